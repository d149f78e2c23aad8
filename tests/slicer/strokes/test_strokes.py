"""Strokes: a refined table keeps the values of each stroke."""

import numpy as np
import pytest

from profiles.profile import load
from slicer.bead import Bead
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind, bead_area_mm2
from slicer.strokes.speed import timed
from slicer.strokes.strokes import in_pieces, split, strokes_of
from tests.slicer.hand import rows_of


def test_the_pieces_of_several_strokes_keep_their_own_travels() -> None:
    lines = [np.array([[0.0, y], [10.0, y]]) for y in (1.0, 2.0, 3.0)]
    placed = [Bead(Kind.OUTER_WALL, line, 0.4 + 0.1 * k, 0) for k, line in enumerate(lines)]
    approaches = {0: np.array([[-1.0, 1.0]]), 2: np.array([[-1.0, 3.0], [-2.0, 3.0]])}
    strokes = strokes_of(placed, np.array([True, False, True]), approaches, 0.0)
    middle = Polygons.square((4.0, 10.0)).translate((3.0, 0.0))
    pieces, within = split(strokes, middle, np.array([True, False, True]), 0.5)
    rows = rows_of(pieces)
    assert [row.width_mm for row in rows] == pytest.approx([0.4, 0.4, 0.4, 0.5, 0.6, 0.6, 0.6])
    assert within.tolist() == [False, True, False, False, False, True, False]
    assert [row.retract for row in rows] == [True, False, False, False, True, False, False]
    assert [len(row.approach) for row in rows] == [1, 0, 0, 0, 2, 0, 0]
    assert rows[4].approach.tolist() == [[-1.0, 3.0], [-2.0, 3.0]]


def test_pieces_of_a_rich_stroke_hold_what_is_more_of_the_whole() -> None:
    line, widths = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([0.3, 0.6])
    bead = Bead(Kind.OUTER_WALL, line, 0.45, 0, flow=1.2, course=np.column_stack([line, widths]))
    strokes = strokes_of([bead], np.array([True]), {}, 0.0)
    pieces = in_pieces(strokes, 0.2)
    areas_mm2 = bead_area_mm2(pieces.width_mm, 0.2)
    more_mm3 = float(((pieces.flow - 1.0) * areas_mm2 * pieces.lengths_mm).sum())
    assert len(pieces) > 5
    assert more_mm3 == pytest.approx(0.2 * bead_area_mm2(0.45, 0.2) * 10.0)


def test_a_piece_of_a_small_wall_is_no_small_wall() -> None:
    ring = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0], [0.0, 0.0]])
    strokes = strokes_of([Bead(Kind.OUTER_WALL, ring, 0.45, 0)], np.array([True]), {}, 20.0)
    pieces, _ = split(strokes, Polygons.square((10.0, 1.5)).translate((-1.0, -0.5)), np.array([True]), 0.5)
    assert strokes.small.tolist() == [True]
    assert len(pieces) == 3
    assert not pieces.small.any()


def test_no_piece_of_a_wall_is_short_because_its_width_changes_a_little() -> None:
    course = np.array([[0.0, 0.0, 0.55], [5.0, 0.0, 0.55], [5.4, 0.0, 0.64], [9.0, 0.0, 0.64]])
    pieces = in_pieces(strokes_of([Bead(Kind.INNER_WALL, course[:, :2], 0.6, 0, course=course)], np.array([True]), {}, 0.0), 0.2)
    assert len(pieces) > 2
    assert pieces.lengths_mm.min() > 0.2 - 1e-9
    plastic_mm2 = 5.0 * 0.55 + 0.4 * 0.595 + 3.6 * 0.64
    assert float((pieces.width_mm * pieces.lengths_mm).sum()) == pytest.approx(plastic_mm2, rel=0.002)


@pytest.mark.parametrize(("kind", "least_mm"), [(Kind.SKIN, 0.2), (Kind.INNER_WALL, 0.149)])
def test_a_skin_line_that_reaches_into_a_corner_has_no_short_steps_and_keeps_its_plastic(kind: Kind, least_mm: float) -> None:
    line = np.array([[-8.0, -6.0], [-0.55, 0.0], [0.0, 0.0], [0.0, -0.149], [-0.173, -0.173], [-7.0, -7.0]])
    strokes = strokes_of([Bead(kind, line, 0.42, 0)], np.array([True]), {}, 0.0)
    printed, _ = timed(strokes, load(), 0.2, None, 1.0)
    assert np.hypot(*np.diff(printed.points[:, :2], axis=0).T).min() == pytest.approx(least_mm, abs=0.015)
    assert [printed.points[0, :2].tolist(), printed.points[-1, :2].tolist()] == [line[0].tolist(), line[-1].tolist()]
    assert float(printed.flow[0] * printed.lengths_mm[0]) == pytest.approx(float(np.hypot(*np.diff(line, axis=0).T).sum()))


def test_a_shortened_line_is_no_faster_than_the_hot_end_can_melt() -> None:
    line = np.array([[-8.0, -6.0], [-0.55, 0.0], [0.0, 0.0], [0.0, -0.149], [-0.173, -0.173], [-7.0, -7.0]])
    strokes = strokes_of([Bead(Kind.SKIN, line, 0.42, 0)], np.array([True]), {}, 0.0)
    profile = load(settings=["process.skin_speed_mm_s=500", "process.least_layer_time_s=0"])
    printed, speeds = timed(strokes, profile, 0.2, None, 1.0)
    assert printed.flow[0] > 1.0  # shorter with the same volume of plastic
    melted_mm3_s = speeds[0] * 0.2 * (0.42 - 0.2 * (1.0 - np.pi / 4.0)) * printed.flow[0]
    assert melted_mm3_s == pytest.approx(profile.material.volumetric_limit_mm3_s)
