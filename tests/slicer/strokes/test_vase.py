"""Vase: a bottom, then one rising wall without a seam; unsuitable parts are refused with the reason."""

from itertools import pairwise

import manifold3d as m3
import numpy as np
import pytest

from machine.dryrun.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.planning.plan import plan
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Mesh
from profiles.errors import SliceError
from slicer.paths import Kind, bead_area_mm2
from slicer.slice import slice_part, slice_parts
from tests.shapes import box, standing, tee
from tests.slicer.hand import BARE, cut, profile, whole

VASE = (*BARE, "process.spiral_vase=true", "process.bottom_thickness_mm=0")


def cup() -> Mesh:
    """A cone that widens from 10 to 13 mm radius over 6 mm."""
    return standing(m3.Manifold.cylinder(6, 10, 13, 96))


@pytest.mark.parametrize("sides", [4, 96])
def test_a_cone_ends_where_no_wall_fits_into_its_tip(sides: int) -> None:
    cone = standing(m3.Manifold.cylinder(30, 12, 0, sides))
    sliced = slice_part(whole(cone), profile(*VASE))
    top_mm = 30.0 * (1.0 - 0.5 * 0.45 / (12.0 * np.cos(np.pi / sides)))  # where the inscribed circle is as wide as a wall
    assert sliced.too_thin_mm == pytest.approx(top_mm, abs=0.25)
    assert sliced.layers[-1].z_mm == pytest.approx(sliced.too_thin_mm, abs=0.01)


@pytest.mark.parametrize("sides", [4, 96])
def test_the_tip_does_not_plough_through_a_cone_when_its_print_ends(sides: int) -> None:
    part, settings = whole(standing(m3.Manifold.cylinder(30, 12, 0, sides))), profile(*VASE)
    decomposition = Decomposition("cone", part.mesh, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    program = plan(decomposition, slice_parts([part], settings), settings)
    findings = dry_run(tuple(write_gcode(program, settings)), settings).findings
    assert [finding for finding in findings if finding.severity == "error"] == []


@pytest.mark.parametrize("mesh", [box(40, 1.5, 8), box(1, 1, 8), standing(m3.Manifold.cylinder(8, 0.9, 0.9, 48))])
def test_a_thin_body_without_a_tip_is_climbed_to_its_top(mesh: Mesh) -> None:
    sliced = slice_part(whole(mesh), profile(*VASE))
    assert sliced.too_thin == 0
    assert sliced.layers[-1].z_mm == pytest.approx(8.0)


def test_a_needle_in_which_no_wall_fits_is_refused() -> None:
    needle = m3.Manifold.cylinder(2, 8, 8, 48) + m3.Manifold.cylinder(12, 0.18, 0.18, 24)
    with pytest.raises(SliceError, match="a place too narrow for a wall"):
        slice_part(whole(standing(needle)), profile(*VASE))


def test_the_wall_climbs_evenly_from_the_bottom_to_the_top() -> None:
    sliced = slice_part(whole(cup()), profile(*VASE))
    assert [Kind.SKIN in {path.kind for path in layer.paths} for layer in sliced.layers[:5]] == [True] * 4 + [False]
    climbing = [path for layer in sliced.layers[5:-1] for path in layer.paths]
    assert len(climbing) == len(sliced.layers) - 6
    heights = np.concatenate([layer.points_mm[:, 2] for layer in sliced.layers[4:]])
    assert (np.diff(heights) >= -1e-9).all()
    assert (heights[0], heights[-1]) == pytest.approx((0.8, 6.0))
    ends = [path for layer in sliced.layers[4:] for path in layer.paths]
    assert max(np.hypot(*(b.points[0] - a.points[-1])) for a, b in pairwise(ends)) < 1e-9
    assert [path.retract for path in ends] == [True] + [False] * (len(ends) - 1)


def test_the_wall_holds_as_much_plastic_as_it_is_long_with_half_of_it_in_the_first_and_the_last_turn() -> None:
    sliced = slice_part(whole(standing(m3.Manifold.cylinder(6, 10, 10, 96))), profile(*VASE))
    turn_mm3 = 2 * np.pi * (10 - 0.225) * bead_area_mm2(0.45, 0.2)
    turns = sum(layer.volumes_mm3.sum() for layer in sliced.layers[4:]) / turn_mm3
    assert turns == pytest.approx(0.5 + 25 + 0.5, rel=0.01)


def test_the_printed_vase_climbs_in_every_line_and_the_dry_run_has_nothing_against_it() -> None:
    asked = profile(*VASE)
    part = whole(cup())
    decomposition = Decomposition("cup", part.mesh, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    lines = tuple(write_gcode(plan(decomposition, slice_parts((part,), asked), asked), asked))
    assert [finding.message for finding in dry_run(lines, asked).findings if finding.code != "uncalibrated"] == []
    climbing = lines[lines.index(";Z:3") : lines.index(";Z:3.2")]
    heights = [float(line.split("Z")[1].split()[0]) for line in climbing if line.startswith("G1 X") and " Z" in line]
    assert len(heights) > 90
    assert heights == sorted(heights)
    assert (heights[0], heights[-1]) == pytest.approx((2.8, 3.0), abs=0.01)


def test_a_step_that_is_less_than_a_walls_width_is_climbed() -> None:
    assert slice_part(whole(stepped(10, 9.7)), profile(*VASE)).layers[-1].z_mm == pytest.approx(8.0)


def two_towers() -> Mesh:
    towers = m3.Manifold.cube((5, 5, 8), True).translate((-6, 0, 4)) + m3.Manifold.cube((5, 5, 8), True).translate((6, 0, 4))
    return standing(towers + m3.Manifold.cube((20, 8, 2), True))


def tube() -> Mesh:
    return standing(m3.Manifold.cylinder(6, 10, 10, 48) - m3.Manifold.cylinder(6, 6, 6, 48).translate((0, 0, 2)))


def stepped(low_mm: float, high_mm: float) -> Mesh:
    """A round tower 4 mm high with another one on it, by their radii."""
    return standing(m3.Manifold.cylinder(4, low_mm, low_mm, 48) + m3.Manifold.cylinder(8, high_mm, high_mm, 48))


@pytest.mark.parametrize(
    ("parts", "settings", "reason"),
    [
        (cut(box(), ((0.0, 0.0, 1.0), 8.0)), (), "climbs round a model in one part, this one is in 2: --parts 1"),
        ([whole(tee())], ("process.support=auto",), "prints no support, and at"),
        ([whole(two_towers())], (), "one outline without holes in every layer: the layer at 2.20 mm has 2 outlines"),
        ([whole(tube())], (), "the layer at 2.20 mm has 2 outlines"),
        ([whole(stepped(10, 6))], (), "at 4.20 mm the model steps in or out by more than a wall's width, 0.45 mm: 36 mm of wall"),
    ],
)
def test_a_model_unsuitable_for_vase_mode_is_refused_with_the_reason(
    parts: list[Part], settings: tuple[str, ...], reason: str
) -> None:
    with pytest.raises(SliceError) as refused:
        slice_parts(parts, profile(*VASE, *settings))
    assert reason in str(refused.value)
