"""Areas to fill, and the plastic that fills them."""

from collections.abc import Sequence

from hypothesis import strategies as st

from slicer.bead import Bead
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import length_mm
from slicer.paths import bead_area_mm2

WIDTH, HEIGHT, OVERLAP = 0.45, 0.2, 0.2
STARS = st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=4, max_size=9)


def square() -> Polygons:
    return Polygons.square((40, 40))


def ring() -> Polygons:
    return Polygons.circle(15, 64) - Polygons.circle(6, 48)


def strip() -> Polygons:
    return Polygons.square((3, 30)).rotate(20)


def plastic_mm2(beads: Sequence[Bead]) -> float:
    return sum(length_mm(b.points) * bead_area_mm2(b.width_mm, HEIGHT) * b.flow for b in beads) / HEIGHT
