"""Overhanging walls: the stretches with too little of the bead on the layer below, and the rest of the wall."""

from itertools import groupby
from typing import Any

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Mesh
from slicer.bead import Bead
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind
from slicer.slice import slice_part
from slicer.strokes.strokes import Strokes, split_overhangs, strokes_of
from slicer.strokes.travels import NOWHERE
from tests.shapes import standing, tee
from tests.slicer.hand import BARE, as_shapely, cut, of_kind, profile, rows_of, whole

WIDTH = 0.45


def placed(points: Any, of: Kind = Kind.OUTER_WALL) -> Strokes:
    bead = Bead(of, np.array(points, dtype=float), WIDTH, 0)
    return strokes_of([bead], np.array([True]), {0: np.array([[-1.0, -1.0]])}, 0.0)


def kinds(strokes: Strokes) -> list[Kind]:
    return [row.kind for row in rows_of(strokes)]


def square(side: float) -> list[tuple[float, float]]:
    return [(0, 0), (side, 0), (side, side), (0, side), (0, 0)]


def split(wall: Strokes, section: Polygons, bank: Polygons | None, share: float = 0.5) -> Strokes:
    return split_overhangs(wall, section, bank, profile(f"process.overhang_share={share}").process)


def test_the_stretch_beyond_the_bank_overhangs_and_nothing_is_lost() -> None:
    pieces = split(
        placed(square(10)), Polygons.square((12, 12)).translate((-1, -1)), Polygons.square((6, 20)).translate((-1, -5))
    )
    assert [kind for kind, _ in groupby(kinds(pieces))] == [Kind.OUTER_WALL, Kind.OVERHANG, Kind.OUTER_WALL]
    assert pieces.lengths_mm[pieces.is_of(Kind.OVERHANG)].sum() == pytest.approx(5 + 10 + 5, abs=0.3)
    assert pieces.overhang[pieces.lengths_mm.argmax()] == 4  # most of it has no plastic below
    assert pieces.lengths_mm.sum() == pytest.approx(40)
    assert (pieces.last_points[:-1] == pieces.first_points[1:]).all()
    assert pieces.retract.tolist() == [True] + [False] * (len(pieces) - 1)
    assert [len(row.approach) for row in rows_of(pieces)] == [1] + [0] * (len(pieces) - 1)


def test_gap_fill_next_to_a_bridge_overhangs_like_walls() -> None:
    pieces = split(placed([(1, 5), (9, 5)], Kind.GAP), Polygons.square((10, 10)), Polygons.square((3, 10)))
    assert kinds(pieces) == [Kind.GAP, Kind.OVERHANG]


def test_a_bead_shorter_than_two_lines_overhangs_where_all_of_it_hangs() -> None:
    pieces = split(placed([(8, 5), (8.5, 5)]), Polygons.square((20, 10)), Polygons.square((5, 10)))
    assert kinds(pieces) == [Kind.OVERHANG]


def test_walls_over_dense_support_are_as_fast_as_bridges_and_walls_over_air_are_slow() -> None:
    settings = "process.least_layer_time_s=0", "process.bridge_speed_mm_s=28", "process.overhang_0_speed_mm_s=15"
    held, free = (slice_part(whole(tee()), profile(*settings, f"process.support={support}")) for support in ("auto", "none"))
    speeds = [[path.speed_mm_s for path in of_kind(sliced, Kind.OVERHANG)] for sliced in (held, free)]
    assert (min(speeds[0]), max(speeds[0]), min(speeds[1])) == (28, 28, 15)


@pytest.mark.parametrize(
    ("out", "share", "kind"), [(0.1, 0.5, Kind.OVERHANG), (-0.05, 0.5, Kind.OUTER_WALL), (0.1, 0.2, Kind.OUTER_WALL)]
)
def test_the_share_of_the_width_on_the_bank_decides(out: float, share: float, kind: Kind) -> None:
    bank = Polygons.square((20, 10)).translate((0, -out))
    pieces = split(placed([(0, 10), (20, 10)]), Polygons.square((20, 15)), bank, share)
    assert kinds(pieces) == [kind]


@settings(max_examples=40, deadline=None)
@given(st.integers(3, 40), st.floats(3, 9), st.floats(0, 6), st.floats(0, 6))
def test_the_overhanging_length_is_shapelys(corners: int, radius: float, x: float, y: float) -> None:
    around = 2 * np.pi * np.arange(corners) / corners
    loop = radius * np.column_stack([np.cos(around), np.sin(around)])
    bank = Polygons.square((8, 8), True).translate((x, y))
    wall, section = placed(np.vstack([loop, loop[:1]])), Polygons([loop * 1.3])
    pieces = split_overhangs(wall, section, bank, profile().process)
    hangs = shapely.LineString(wall.points[:, :2]).difference(as_shapely(bank).buffer(0.02, join_style="mitre"))
    hanging_mm = pieces.lengths_mm[pieces.is_of(Kind.OVERHANG)].sum()
    assert hanging_mm == pytest.approx(hangs.length, abs=4 * 2 * WIDTH)
    assert pieces.lengths_mm.sum() == pytest.approx(wall.lengths_mm[0])


def funnel(angle: float) -> Mesh:
    return standing(m3.Manifold.cylinder(6, 5, 5 + 6 * np.tan(np.radians(angle)), 96))


@pytest.mark.parametrize(("angle", "hangs"), [(40, False), (46, False), (51, True), (60, True)])
def test_cones_overhang_from_the_angle_at_which_half_a_bead_is_free(angle: float, hangs: bool) -> None:
    beads = of_kind(
        slice_part(whole(funnel(angle)), profile(*BARE, "process.self_supporting_angle_deg=80", "process.least_layer_time_s=0")),
        Kind.OVERHANG,
    )
    assert np.degrees(np.arctan(0.5 * WIDTH / 0.2)) == pytest.approx(48.4, abs=0.1)
    assert bool(beads) is hangs
    assert {p.speed_mm_s for p in beads} <= {25.0, 20.0, 15.0}


def test_a_part_on_plastic_overhangs_where_its_base_reaches_beyond() -> None:
    post = m3.Manifold.cube((10, 10, 10)) + m3.Manifold.cube((20, 10, 4)).translate((0, 0, 10))
    base, plate = cut(standing(post), ((0, 0, 1), 10.0))
    first, second = slice_part(plate, profile(*BARE, "process.walls=1", "process.interface_line_width_mm=0.45"), [base]).layers[
        :2
    ]
    hanging = [p for p in first.paths if p.kind is Kind.OVERHANG]
    assert min(p.points[:, 0].min() for p in hanging) == pytest.approx(0.0, abs=0.1)
    assert sum(p.length_mm for p in hanging) == pytest.approx(2 * (10 - 0.225) + 10 - 0.45, abs=0.3)
    assert Kind.OVERHANG not in {p.kind for p in second.paths}


def test_nothing_overhangs_on_the_build_plate() -> None:
    assert kinds(split(placed(square(10)), Polygons.square((12, 12)), None)) == [Kind.OUTER_WALL]
    assert len(NOWHERE) == 0
