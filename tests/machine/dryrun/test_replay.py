"""The height field against brute force over points; beads printed in air, beside each other and on each other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from shapely import LineString, MultiLineString, MultiPolygon, box
from shapely.affinity import translate

from machine.dryrun import DryRun, dry_run
from machine.dryrun.agreement import fill, filled_share
from machine.dryrun.height_field import CELL_MM, Field, depth_of, empty_field, highest_first, lay_bead
from mdp.head import head_of
from profiles.profile import load
from tests import shapes

MACHINE = load().machine
HALF_MM = 0.225
PLACE = st.tuples(st.floats(-20, 20), st.floats(-20, 20))


@njit
def _lay(a, b, half, field):  # type: ignore[no-untyped-def]
    lay_bead(a, b, half, 0, field)


@njit
def _depth(a, b, slack, field, head):  # type: ignore[no-untyped-def]
    return depth_of(a, b, slack, field, head)


Place = tuple[float, float]
Line = tuple[Place, Place]


def _field(lines: list[Line], z: float) -> Field:
    field = empty_field(np.array([-25.0, -25.0]), np.array([25.0, 25.0]))
    for a, b in lines:
        _lay(np.array([*a, z]), np.array([*b, z]), HALF_MM, field)
    return field


def _exact_depth(lines: list[Line], above_tip: float, start: Place, end: Place, grown: float) -> float:
    """Depth of the head in lines, by shapely: silhouette and boxes grown on all sides, the lines above_tip above its tip."""
    move, plastic = LineString([start, end]), MultiLineString(lines)
    radii, heights = np.array(MACHINE.head.silhouette_mm).T
    radius = max(move.distance(plastic) - grown, 0.0)
    deepest = above_tip - float(np.interp(radius, radii, heights)) if radius <= radii[-1] else 0.0
    for body in MACHINE.head.boxes:
        corners = box(*body.min_mm[:2], *body.max_mm[:2]).buffer(grown, join_style="mitre")
        swept = MultiPolygon([translate(corners, *start), translate(corners, *end)]).convex_hull
        if swept.intersects(plastic):
            deepest = max(deepest, above_tip - body.min_mm[2])
    return max(deepest, 0.0)


@settings(deadline=None, max_examples=60)  # the first call compiles
@given(st.lists(st.tuples(PLACE, PLACE), min_size=1, max_size=3), PLACE, PLACE, st.floats(0, 60))
def test_the_depth_of_a_level_move_is_the_exact_one_within_half_a_bead_and_a_cell(lines, start, end, down: float) -> None:
    depth = _depth(np.array([*start, 80.0 - down]), np.array([*end, 80.0 - down]), 0.0, _field(lines, 80.0), head_of(MACHINE))
    assert _exact_depth(lines, down, start, end, -CELL_MM) - 1e-6 <= depth
    assert depth <= _exact_depth(lines, down, start, end, HALF_MM + CELL_MM) + 1e-6


@settings(deadline=None, max_examples=30)
@given(st.lists(st.tuples(PLACE, PLACE), min_size=1, max_size=3), PLACE, PLACE, st.floats(0, 60), st.floats(60, 90))
def test_sorting_blocks_by_height_gives_the_same_depth_after_later_deposits(lines, start, end, down: float, z: float) -> None:
    depths, a, b = [], np.array([*start, 80.0 - down]), np.array([*end, 80.0 - down])
    for order in (lambda field: field, highest_first):
        field = order(_field(lines[1:], 80.0))
        _lay(np.array([*lines[0][0], z]), np.array([*lines[0][1], z]), HALF_MM, field)
        depths.append(_depth(a, b, 0.0, field, head_of(MACHINE)))
    assert depths[0] == depths[1]


@settings(deadline=None, max_examples=30)
@given(PLACE, PLACE, st.floats(60, 90), st.floats(60, 90))
def test_a_slanting_move_s_depth_is_between_those_of_its_highest_and_lowest_end(start, end, z0: float, z1: float) -> None:
    lines = [((-15.0, 0.0), (15.0, 0.0))]
    depth = _depth(np.array([*start, z0]), np.array([*end, z1]), 0.0, _field(lines, 80.0), head_of(MACHINE))
    assert _exact_depth(lines, 80.0 - max(z0, z1), start, end, -CELL_MM) - 1e-6 <= depth
    assert depth <= _exact_depth(lines, 80.0 - min(z0, z1), start, end, HALF_MM + CELL_MM) + 1e-6


def test_a_tip_that_dips_a_millimetre_into_a_line_is_a_millimetre_deep() -> None:
    field = _field([((-15.0, 0.0), (15.0, 0.0))], 80.0)
    assert _depth(np.array([0.0, -5.0, 79.0]), np.array([0.0, 5.0, 79.0]), 0.0, field, head_of(MACHINE)) == pytest.approx(1.0)


BEGIN = "G28\nM109 S210\nM83\n;PART:1 of 1\n;LAYER_CHANGE\n;TYPE:Perimeter\n;WIDTH:0.45\n;HEIGHT:0.2\nG0 Z{z} F600\nG0 X-20 Y0\n"


def _run(moves: str, z: float = 0.2) -> DryRun:
    return dry_run((BEGIN.format(z=z) + moves + "\nM104 S0").splitlines(), load())


def _sums(run: DryRun) -> list[float]:
    assert run.contacts is not None
    return [float(values.sum()) for values in (run.contacts.air_mm, run.contacts.overlapping_mm, run.contacts.beside_mm)]


def test_a_bead_on_the_plate_is_carried() -> None:
    assert _sums(_run("G1 X20 E1.5 F600")) == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("z", [0.4, 1.0, 30.0])
def test_a_bead_above_nothing_hangs_in_air_along_all_its_length(z: float) -> None:
    run = _run("G1 X20 E1.5 F600", z)
    assert _sums(run) == pytest.approx([40.0, 0.0, 0.0])
    assert [f.code for f in run.findings if f.severity == "error"] == ["air"]


def test_unsupported_part_and_support_lengths_are_reported_separately() -> None:
    first, high = ";LAYER_CHANGE\nG1 X20 E1.5 F600\n", ";LAYER_CHANGE\nG0 Z5\nG0 Y20\nG1 X-20 E1.5\n"
    run = _run(f"{first}{high}G0 Y30\n;TYPE:Support material\nG1 X0 E0.75")
    (message,) = (finding.message for finding in run.findings if finding.code == "air")
    assert message.endswith("40.0 mm of the part, 20.0 mm of its support")


def test_a_bead_next_to_one_in_air_is_supported_by_it_but_a_farther_one_is_not() -> None:
    assert _sums(_run("G1 X20 E1.5 F600\nG0 Y0.4\nG1 X-20 E1.5", 5.0)) == pytest.approx([40.0, 0.0, 40.0])
    assert _sums(_run("G1 X20 E1.5 F600\nG0 Y0.9\nG1 X-20 E1.5", 5.0)) == pytest.approx([80.0, 0.0, 0.0])


@pytest.mark.parametrize(("shift", "air"), [(0.0, 0.0), (0.3, 0.0), (0.6, 40.0)])
def test_a_bead_on_another_is_supported_until_it_is_next_to_it(shift: float, air: float) -> None:
    assert _sums(_run(f"G1 X20 E1.5 F600\nG0 Z0.4\nG0 Y{shift}\nG1 X-20 E1.5"))[0] == pytest.approx(air)


@pytest.mark.parametrize(("slot_mm", "hangs"), [(0.9, False), (3.0, True)])
def test_a_wall_spans_a_slot_that_is_no_wider_than_itself(slot_mm: float, hangs: bool) -> None:
    banks = f"G1 X0 E0.75 F600\nG0 X{slot_mm}\nG1 X20 E0.75\n"
    run = _run(f";TYPE:External perimeter\n;WIDTH:0.6\n;HEIGHT:0.2\n{banks}G0 Z0.4\nG1 X-20 E1.5")
    assert (_sums(run)[0] > 0.0) == hangs


def test_a_bridge_that_the_slicer_names_is_no_finding_but_counts_as_air() -> None:
    run = _run(";TYPE:Bridge infill\nG1 X20 E1.5 F600", 5.0)
    assert _sums(run)[0] == pytest.approx(40.0)


def test_a_line_printed_twice_fills_what_is_full() -> None:
    run = _run("G1 X20 E1.5 F600\nG0 Z1\nG0 X-20\nG0 Z0.2\nG1 X20 E1.5")
    assert _sums(run)[1] == pytest.approx(40.0)
    assert [f.code for f in run.findings if f.severity == "error"] == ["filled"]


def test_a_box_of_parallel_beads_fills_its_model_and_half_of_it_half() -> None:
    lines = []
    for k in range(50):
        rows = [f"G0 Z{0.2 * (k + 1):.1f} F600"]
        for y in np.arange(-4.8, 5.0, 0.4):
            rows.append(f"G0 X-5 Y{y:.2f}\nG1 X5 E0.4")
        lines += rows
    whole, half = _run("\n".join(lines)), _run("\n".join(lines[: len(lines) // 2]))
    model = shapes.box(10.0, 10.0, 10.0)
    assert filled_share(whole, model, 20_000) == pytest.approx(1.0, abs=0.002)
    assert filled_share(half, model, 20_000) == pytest.approx(0.5, abs=0.02)


@settings(deadline=None)
@given(st.tuples(st.floats(-3, 13), st.floats(-2, 2), st.floats(-2, 2)))
def test_a_place_is_in_a_bar_by_the_plain_inequalities(place: tuple[float, float, float]) -> None:
    x, y, z = place
    wanted = abs(y) <= 0.52 and -1.02 <= z <= 0.02 and -0.5 <= x <= 10.5 and (abs(y) <= 0.5)
    filled = np.zeros((1, 1, 1), np.bool_)
    fill(filled, np.array(place), 1.0, np.array([[[0.0, 0, 0], [10.0, 0, 0]]]), np.array([[0.0, 0, 1]]), np.array([[1.0, 1.0]]))
    edge = min(abs(abs(y) - 0.5), abs(abs(y) - 0.52), abs(z - 0.02), abs(z + 1.02), abs(x + 0.5), abs(x - 10.5)) < 0.03
    assert edge or bool(filled[0, 0, 0]) == wanted
