"""Seams: their position by each rule, their alignment, and that none lies on the edge of an interface."""

from collections.abc import Sequence
from typing import Any

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead
from slicer.geometry.polyline import length_mm
from slicer.paths import Kind, Layer, SlicedPart
from slicer.slice import slice_part
from slicer.strokes.seam import Surroundings, place_seams
from slicer.strokes.seam_plan import rear_of, seam_limits
from tests.shapes import box, branch, standing
from tests.slicer.hand import BARE, cut, profile, shared, whole

NONE = np.zeros((0, 2))
SQUARE = np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]])
ELL = np.array([[0.0, 0], [20, 0], [20, 10], [10, 10], [10, 20], [0, 20]])


def process(seam: str, **more: float) -> Process:
    return profile(f"process.seam={seam}", "process.seam_gap=0", *(f"process.{k}={v}" for k, v in more.items())).process


def around(
    before: Any = NONE, tip: Sequence[float] = (0.0, 0.0), interfaces: Any = None, layer: int = 0, planned: Any = NONE
) -> Surroundings:
    edges = np.zeros((0, 6)) if interfaces is None else np.array(interfaces, dtype=float)
    limits = seam_limits(edges, np.zeros((0, 6)), 0.1, process("rear"))
    below, wanted = np.array(before, dtype=float), np.array(planned, dtype=float)
    return Surroundings(np.array([5.0, 30.0]), below, np.array(tip), limits, layer, wanted)


def seam_of(loop: Floats, rule: str, **surroundings: Any) -> tuple[float, float]:
    beads, seams = place_seams([Bead(Kind.OUTER_WALL, loop, 0.45, 0)], process(rule), around(**surroundings))
    assert (beads[0].points[0] == seams[0]).all()
    return tuple(seams[0])


def outer_seams(sliced: SlicedPart, first: int = 2) -> Floats:
    """Start of the longest outer wall of each layer."""
    walls = [[p.points for p in layer.paths if p.kind in (Kind.OUTER_WALL, Kind.OVERHANG)] for layer in sliced.layers[first:]]
    return np.array([max(joined(of_layer), key=length_mm)[0] for of_layer in walls if of_layer])


def joined(pieces: list[Floats]) -> list[Floats]:
    """Whole walls, joined from consecutive pieces of different overhang."""
    out = pieces[:1]
    for piece in pieces[1:]:
        if (piece[0] == out[-1][-1]).all():
            out[-1] = np.concatenate([out[-1], piece[1:]])
        else:
            out.append(piece)
    return out


@pytest.mark.parametrize("rule", ["aligned", "corner"])
def test_the_inner_corner_of_an_ell_hides_the_seam(rule: str) -> None:
    assert seam_of(ELL, rule) == (10, 10)


def test_a_box_without_inner_corners_gets_an_outer_one_at_the_rear() -> None:
    assert seam_of(SQUARE, "corner") == (0, 10)


def test_the_rear_is_the_middle_of_the_back() -> None:
    assert seam_of(SQUARE, "rear") == (5, 10)


@pytest.mark.parametrize(("tip", "expected"), [((3, -4), (3, 0)), ((14, 13), (10, 10)), ((-1, 4), (0, 4))])
def test_nearest_is_the_point_of_the_wall_nearest_to_the_tip(tip: tuple[float, float], expected: tuple[float, float]) -> None:
    assert seam_of(SQUARE, "nearest", tip=tip) == pytest.approx(expected)


def test_an_aligned_seam_continues_the_seam_below_unless_a_corner_is_close() -> None:
    assert seam_of(SQUARE, "aligned", before=[(4, -0.1)]) == pytest.approx((4, 0))
    assert seam_of(SQUARE, "aligned", before=[(9.4, -0.1)]) == (10, 0)
    assert seam_of(SQUARE, "corner", before=[(6, -0.1)]) == (10, 0)


def test_a_planned_corner_is_taken_whole_and_a_planned_place_on_a_side_draws_the_line_by_a_share() -> None:
    """The outline's corner lies half a width outside the wall's corner on both sides."""
    assert seam_of(SQUARE, "aligned", before=[(8.5, 0)], planned=[(10.225, -0.225)]) == (10, 0)
    assert seam_of(SQUARE, "aligned", before=[(3, 0)], planned=[(4, -0.225)]) == pytest.approx((3.3, 0))


def test_random_seams_are_spread_over_the_whole_wall_and_repeat() -> None:
    spots = np.array([seam_of(SQUARE, "random", layer=k) for k in range(100)])
    sides = [np.isclose(spots[:, axis], value).sum() for axis in (0, 1) for value in (0, 10)]
    assert min(sides) >= 20
    assert seam_of(SQUARE, "random", layer=7) == tuple(spots[7])


@settings(max_examples=60, deadline=None)
@given(st.integers(3, 60), st.floats(2, 20), st.floats(-30, 30), st.floats(-30, 30))
def test_nearest_is_as_near_as_shapely_finds(corners: int, radius: float, x: float, y: float) -> None:
    turn = 2 * np.pi * np.arange(corners) / corners
    loop = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    ring = shapely.LinearRing(loop)
    seam = shapely.Point(seam_of(loop, "nearest", tip=(x, y)))
    assert seam.distance(ring) < 1e-9
    assert seam.distance(shapely.Point(x, y)) == pytest.approx(ring.distance(shapely.Point(x, y)), abs=1e-6)


@pytest.mark.parametrize("rule", ["aligned", "rear", "corner"])
@pytest.mark.parametrize("top", [9.0, 5.0])
def test_on_round_walls_the_seam_stays_in_line(rule: str, top: float) -> None:
    mesh = standing(m3.Manifold.cylinder(8, 9, top, 90).rotate((0, 0, 1.3)))
    angles = np.degrees(np.unwrap(np.arctan2(*outer_seams(slice_part(whole(mesh), profile(*BARE, f"process.seam={rule}"))).T)))
    assert np.abs(np.diff(angles)).max() < 2
    assert np.ptp(angles) < 4


@pytest.mark.parametrize("rule", ["aligned", "corner"])
def test_on_a_twisting_box_the_seam_stays_on_its_corner(rule: str) -> None:
    mesh = standing(m3.Manifold.extrude(m3.CrossSection.square((16, 16), True), 12, 60, 60))
    seams = outer_seams(slice_part(whole(mesh), profile(*BARE, f"process.seam={rule}")))
    assert np.hypot(*seams.T) == pytest.approx((8 - 0.225) * np.sqrt(2), abs=0.05)
    assert np.hypot(*np.diff(seams, axis=0).T).max() < 0.5


def test_on_a_real_model_few_layers_break_the_line() -> None:
    sliced = slice_part(whole(shared("org_kitten", 30.0)), profile(*BARE))
    jumps = np.hypot(*np.diff(outer_seams(sliced), axis=0).T)
    assert (jumps > 3).mean() < 0.05
    assert np.median(jumps) < 0.25


def test_inner_walls_begin_next_to_the_start_of_their_outer_wall() -> None:
    layer = slice_part(whole(branch()), profile(*BARE, "process.layer_height_mm=0.4")).layers[10]
    outer = next(p for p in layer.paths if p.kind is Kind.OUTER_WALL)
    for wall in (p for p in layer.paths if p.kind is Kind.INNER_WALL):
        assert np.hypot(*(wall.points[0] - outer.points[0])) < 2.1 * 0.45


@given(st.floats(0, 1), st.sampled_from(["aligned", "rear", "corner", "nearest", "random"]))
def test_a_wall_stops_short_of_its_beginning_by_the_gap(gap: float, rule: str) -> None:
    settings_ = profile(f"process.seam={rule}", f"process.seam_gap={gap}").process
    (bead,), _ = place_seams([Bead(Kind.OUTER_WALL, SQUARE, 0.45, 0)], settings_, around())
    assert bead.length_mm == pytest.approx(40 - gap * 0.45)


def distance_mm(seam: Floats, z: float, segments: Floats) -> float:
    """Distance from a point of the layer to the nearest of some segments in space, by brute force."""
    share = np.linspace(0, 1, 400)[:, None, None]
    points = segments[:, :3] + share * (segments[:, 3:] - segments[:, :3])
    return np.sqrt(((points - [*seam, z]) ** 2).sum(axis=2)).min()


def test_no_seam_is_on_the_edge_where_a_later_part_begins() -> None:
    mesh = standing(m3.Manifold.cylinder(20, 5, 5, 96))
    base, top = cut(mesh, ((0, np.sin(0.7), np.cos(0.7)), 7.0))
    edge = rim(5.0, 0.7, 7.0)
    for rule in ("aligned", "rear", "corner", "nearest", "random"):
        sliced = slice_part(base, profile(*BARE, f"process.seam={rule}", "process.interface_seam_mm=1.5"), later=[top])
        starts = [(points[0], lay.z_mm - 0.5 * lay.height_mm) for lay in sliced.layers for points in outer(lay)]
        assert min(distance_mm(at, z, edge) for at, z in starts[:-4]) > 1.49


def outer(layer: Layer) -> list[Floats]:
    """Closed outer walls, including their stretches of other widths."""
    walls = joined([p.points for p in layer.paths if p.kind is Kind.OUTER_WALL])
    return [points for points in walls if (np.abs(points[0] - points[-1]) < 0.2).all()]


def rim(radius: float, tilt: float, offset: float) -> Floats:
    """The ellipse in which a plane tilted about x cuts a cylinder about z, as segments."""
    turn = np.linspace(0, 2 * np.pi, 181)
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    points = np.column_stack([x, y, (offset - y * np.sin(tilt)) / np.cos(tilt)])
    return np.hstack([points[:-1], points[1:]])


def test_first_layers_on_a_section_of_the_same_shape_begin_inside() -> None:
    mesh = standing(m3.Manifold.cylinder(40, 8, 8, 96))
    base, top = cut(mesh, ((0, 0, 1), 20.0))
    layers = slice_part(top, profile(*BARE, "process.interface_seam_mm=0.5"), [base]).layers
    starts = np.array([np.hypot(*next(p for p in lay.paths if p.kind is Kind.OUTER_WALL).points[0]) for lay in layers])
    assert starts[:3] == pytest.approx([8 - 0.3 - 0.6, *[8 - 0.225 - 0.45] * 2], abs=0.05)
    assert starts[3:] == pytest.approx(8 - 0.225, abs=0.05)


@pytest.mark.parametrize(
    "loop", [[(0, 0), (0.4, 1.6), (-0.4, 1.6)], [(0, 0), (0.3, 0), (0.3, 4), (0, 4)], [(0, 0), (0.01, -0.1), (0.3, 2)]]
)
def test_walls_of_a_tip_near_an_interface_begin_inside_it(loop: list[tuple[float, float]]) -> None:
    everywhere = [[-1, y, 0.1, 1, y, 0.1] for y in np.arange(-1, 5, 0.1)]
    (bead,), _ = place_seams([Bead(Kind.OUTER_WALL, np.array(loop), 0.45, 0)], process("rear"), around(interfaces=everywhere))
    assert shapely.Polygon(loop).buffer(1e-6).covers(shapely.LineString(bead.points))


def test_first_layers_wider_than_the_part_below_begin_next_to_it() -> None:
    post = m3.Manifold.cube((10, 10, 10)) + m3.Manifold.cube((20, 10, 4)).translate((0, 0, 10))
    base, plate = cut(standing(post), ((0, 0, 1), 10.0))
    first = slice_part(plate, profile(*BARE, "process.seam=rear"), [base]).layers[0]
    seam = next(p for p in first.paths if p.kind in (Kind.OVERHANG, Kind.OUTER_WALL)).points[0]
    assert seam[0] > 1.0


def test_a_rear_seam_is_behind_the_middle_of_its_part() -> None:
    assert rear_of(box(10, 20, 5).bounds_mm) == pytest.approx([0, 30])


def test_a_wall_begins_inside_where_there_is_room_and_not_in_a_sharp_corner() -> None:
    wedge = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 3.0]])
    rim = np.hstack([np.insert(wedge, 2, 0.1, axis=1), np.insert(np.roll(wedge, -1, axis=0), 2, 0.1, axis=1)])
    beads, _ = place_seams(
        [Bead(Kind.OUTER_WALL, wedge, 0.45, 0)], process("corner"), around(before=[(0.0, 0.0)], interfaces=rim)
    )
    begin, end = (shapely.Point(beads[0].points[k]) for k in (0, -1))
    wall = shapely.LinearRing(wedge)
    assert wall.distance(begin) > 0.7 * 0.45
    assert wall.distance(end) > 0.35 * 0.45
    assert shapely.Polygon(wedge).contains(begin)
