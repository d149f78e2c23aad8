import manifold3d as m3
import numpy as np
import pytest

from machine.dryrun import dry_run
from machine.dryrun.agreement import agreement, shifts
from mdp.cut import mesh_of
from mdp.mesh import Mesh
from mdp.sweep.rays import triangle_tree
from mdp.zone import Modifier, Zone
from profiles.profile import Profile, load
from tests import shapes
from tests.machine.dryrun.bent import bent
from tests.machine.dryrun.planted import Lines, on, part, word
from tests.machine.hand import printed, text

FULL = ["process.infill_density=1"]
BOX = shapes.box(10.0, 10.0, 10.0)


def filled_box(layers: int, aside_mm: float = 0.0) -> list[str]:
    """Layers of parallel beads 0.4 mm apart in a 10 mm box centred on the axis."""
    lines = ["G28", "M83", "M104 S200", "M109 S200", ";TYPE:Solid infill", ";WIDTH:0.4", ";HEIGHT:0.2"]
    for layer in range(layers):
        lines.append(f"G0 Z{0.2 * (layer + 1):.1f} F600")
        for y in np.arange(-4.8, 5.0, 0.4):
            lines += [f"G0 X{aside_mm - 5:g} Y{y:.2f} F6000", f"G1 X{aside_mm + 5:g} E0.33 F600"]
    return lines


def codes(lines: list[str], profile: Profile) -> set[str]:
    return {finding.code for finding in agreement(dry_run(lines, profile), BOX, profile)[1].findings} & {"outside", "unfilled"}


def test_a_filled_box_agrees_with_the_box() -> None:
    found, _ = agreement(dry_run(filled_box(50), load(settings=FULL)), BOX, load(settings=FULL))
    assert (found.filled, found.outside, found.unsupported) == (pytest.approx(1.0, abs=0.002), 0.0, 0.0)
    assert codes(filled_box(50), load(settings=FULL)) == set()


def test_a_box_without_its_upper_half_is_unfilled_unless_the_infill_is_sparse() -> None:
    assert codes(filled_box(25), load(settings=FULL)) == {"unfilled"}
    assert codes(filled_box(25), load(settings=["process.infill_density=0.2"])) == set()


def test_a_box_with_a_region_of_sparse_infill_may_stay_unfilled() -> None:
    profile, lines = load(settings=FULL), filled_box(25)
    sparse, thick = (Modifier(Zone((-9.0, -9.0, 0.0), (9.0, 9.0, 9.0)), own) for own in ({"infill_density": 0.2}, {"walls": 4}))
    found = [agreement(dry_run(lines, profile), BOX, profile, [modifier])[1].findings for modifier in (sparse, thick)]
    assert ["unfilled" in {finding.code for finding in findings} for findings in found] == [False, True]


def test_a_box_printed_two_tenths_aside_is_within_half_a_line_and_one_farther_aside_is_not() -> None:
    assert codes(filled_box(50, 0.2), load(settings=FULL)) == set()
    assert codes(filled_box(50, 1.0), load(settings=FULL)) == {"outside", "unfilled"}


@pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro", "trident_5axis"])
def test_a_table_with_another_centre_puts_tilted_parts_outside_the_model(machine: str) -> None:
    profile, decomposition, _, _ = printed(machine)
    lines = [line for line in text(machine) if not line.startswith("; ")]  # without comments that would reveal it
    x, y, z = profile.machine.tilt.point_mm
    moved = profile.machine.tilt.model_copy(update={"point_mm": (x, y + 2.0, z - 3.0)})
    wrong = profile.model_copy(update={"machine": profile.machine.model_copy(update={"tilt": moved})})
    assert "outside" not in {f.code for f in agreement(dry_run(lines, profile), decomposition.mesh, profile)[1].findings}
    assert "outside" in {f.code for f in agreement(dry_run(lines, wrong), decomposition.mesh, wrong)[1].findings}


def untold(lines: Lines) -> Lines:
    """A program that does not state the contents of its parts, like another slicer's."""
    return [line for line in lines if not line.startswith(";CONTENTS")]


@pytest.mark.parametrize(("index", "letter", "by_mm"), [(1, "X", 0.5), (1, "Y", -0.2), (2, "X", 0.2), (3, "Y", 0.5)])
def test_a_shifted_part_is_reported_and_the_others_are_in_place(index: int, letter: str, by_mm: float) -> None:
    profile, model, lines = bent("generic_ac")
    moved = on(part(index), word(letter, lambda x: x + by_mm))(untold(list(lines)))
    sizes = {part: np.linalg.norm(by) for part, (_, by) in shifts(dry_run(moved, profile), triangle_tree(model)).items()}
    assert sizes == pytest.approx({k: abs(by_mm) if k == index else 0.0 for k in (1, 2, 3)}, abs=0.01)


def test_the_finding_names_the_part_and_the_direction_on_the_table() -> None:
    profile, model, lines = bent("generic_ac")
    moved = on(part(1), word("Y", lambda y: y - 0.2))(untold(list(lines)))
    agreed, run = agreement(dry_run(moved, profile), model, profile)
    (shift,) = (finding for finding in run.findings if finding.code == "shift")
    assert (shift.severity, shift.part) == ("error", 1)
    assert shift.message == "part 1 lies 0.20 mm beside the model, by X+0.00 Y-0.20 Z+0.00, 0.1 mm are allowed"
    assert agreed.shift_mm == pytest.approx(0.2, abs=0.005)


def wedge() -> Mesh:
    """A block of 20 by 20 by 10 mm whose left side leans inward by 45 degrees."""
    corners = [(x + max(z * (x < 0), 0.0), y, z) for x in (-10.0, 10.0) for y in (-10.0, 10.0) for z in (0.0, 10.0)]
    return mesh_of(m3.Manifold.hull_points(np.array(corners)))


def test_walls_with_different_slopes_on_each_side_are_half_their_width_inside_the_model() -> None:
    lines = ["G28", "M83", "M104 S200", "M109 S200", ";TYPE:Outer wall", ";WIDTH:0.4", ";HEIGHT:0.2"]
    for layer in range(50):
        left = 0.2 * (layer + 0.5) - 9.8  # in the middle of the layer
        lines += [f"G0 Z{0.2 * (layer + 1):.1f} F600", f"G0 X{left:.3f} Y-9.8 F6000"]
        lines += [f"G1 X{x:.3f} Y{y} E0.5 F600" for x, y in ((9.8, -9.8), (9.8, 9.8), (left, 9.8), (left, -9.8))]
    ((_, by_mm),) = shifts(dry_run(lines, load()), triangle_tree(wedge())).values()
    assert by_mm == pytest.approx([0.0, 0.0, 0.0], abs=0.01)


@pytest.mark.parametrize("machine", ["generic_ac", "gen5x", "linuxcnc_xyzac"])
def test_an_unchanged_part_is_where_its_model_is(machine: str) -> None:
    profile, model, lines = bent(machine)
    found = shifts(dry_run(lines, profile), triangle_tree(model))
    assert np.array([shift_mm for _, shift_mm in found.values()]) == pytest.approx(np.zeros((3, 3)), abs=0.01)
