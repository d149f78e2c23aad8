"""Strokes: a table that is refined keeps what belongs to each stroke."""

from dataclasses import replace

import numpy as np
import pytest

from slicer.bead import Bead
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind
from slicer.sections import Neighbours
from slicer.strokes.split import split
from slicer.strokes.strokes import strokes_of
from tests.shapes import box
from tests.slicer.hand import rows_of, sections_at


def test_the_pieces_of_several_strokes_keep_their_own_travels() -> None:
    lines = [np.array([[0.0, y], [10.0, y]]) for y in (1.0, 2.0, 3.0)]
    placed = [(Bead(Kind.OUTER_WALL, line, 0.4 + 0.1 * k, 0), line) for k, line in enumerate(lines)]
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


def test_layers_added_on_top_have_the_neighbours_that_lie_above() -> None:
    sections = sections_at(box(10, 10, 1), np.array([0.1, 0.3]))
    beside, above = [Polygons.square((k, k)) for k in (1, 2)], [Polygons.square((k, k)) for k in (3, 4, 5)]
    higher = replace(sections, neighbours=Neighbours(beside, above)).up_to(0.8)
    assert [area.area() for area in higher.neighbours.beside] == pytest.approx([1.0, 4.0, 9.0, 16.0])
    assert [area.area() for area in higher.neighbours.above] == pytest.approx([25.0, 0.0, 0.0])
