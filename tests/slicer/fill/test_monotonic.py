"""Monotonic skins: every line is printed on the same side of its neighbour, and none is lost."""

from math import cos, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.mesh import Floats
from profiles.settings.layers import SkinPattern
from slicer.bead import Bead
from slicer.fill.skin import SolidLines, skin_beads
from slicer.geometry.polygons import Polygons, clean
from slicer.paths import Kind
from slicer.strokes.order import order_beads
from tests.slicer.hand import profile, rows_of

WIDTH, HEIGHT = 0.45, 0.2
SPACING = 0.45 - 0.2 * (1 - np.pi / 4)


def disc(x: float, y: float, radius: float, sides: int = 24) -> Floats:
    turns = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    return np.column_stack([x + radius * np.cos(turns), y + radius * np.sin(turns)])


def plate(holes: list[tuple[float, float, float]]) -> Polygons:
    area = clean([disc(0, 0, 12, 60)])
    for x, y, radius in holes:
        area -= clean([disc(x, y, radius)])
    return area


def lines_of(beads: list[Bead], angle_deg: float) -> Floats:
    """(n, 3) height, left and right end of every straight line along the angle, in printing order."""
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    rows = []
    for bead in beads:
        points = bead.points @ np.array([[c, -s], [s, c]])
        flat = (np.abs(np.diff(points[:, 1])) < 1e-6) & (np.abs(np.diff(points[:, 0])) > 0.05)
        rows += [(points[k, 1], *sorted((points[k, 0], points[k + 1, 0]))) for k in np.flatnonzero(flat)]
    return np.array(rows).reshape(-1, 3)


def out_of_order(lines: Floats) -> int:
    """Number of neighbouring lines, less than 1.5 spacings apart and overlapping, whose upper line is printed first."""
    height, left, right = lines.T
    up = height[None, :] - height[:, None]
    beside = np.minimum(right[:, None], right[None, :]) - np.maximum(left[:, None], left[None, :]) > 0.05
    neighbours = (up > 0.3 * SPACING) & (up < 1.5 * SPACING) & beside
    return int((neighbours & (np.arange(len(lines))[:, None] > np.arange(len(lines))[None, :])).sum())


HOLES = st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(0.6, 4.0)), max_size=5)


@given(HOLES, st.sampled_from([0.0, 45.0, 135.0, 77.0]))
def test_no_line_is_printed_after_its_upper_neighbour(holes: list[tuple[float, float, float]], angle_deg: float) -> None:
    beads = [
        b
        for b in skin_beads(plate(holes), Kind.TOP_SKIN, SolidLines(angle_deg, WIDTH, HEIGHT, pattern="monotonic"))
        if b.kind is Kind.TOP_SKIN
    ]
    for island in range(sum(not bead.follows for bead in beads)):
        firsts = [k for k, bead in enumerate(beads) if not bead.follows] + [len(beads)]
        assert out_of_order(lines_of(beads[firsts[island] : firsts[island + 1]], angle_deg)) == 0


PATTERNS: tuple[SkinPattern, SkinPattern] = ("monotonic", "rectilinear")


@given(HOLES)
def test_order_loses_no_line(holes: list[tuple[float, float, float]]) -> None:
    rows = [
        lines_of(
            [
                b
                for b in skin_beads(plate(holes), Kind.TOP_SKIN, SolidLines(45.0, WIDTH, HEIGHT, pattern=mode))
                if b.kind is Kind.TOP_SKIN
            ],
            45.0,
        )
        for mode in PATTERNS
    ]
    assert float((rows[0][:, 2] - rows[0][:, 1]).sum()) == pytest.approx(float((rows[1][:, 2] - rows[1][:, 1]).sum()), rel=0.01)


def test_without_monotonic_order_lines_meet_from_both_sides_of_a_hole() -> None:
    beads = skin_beads(plate([(0, 0, 4)]), Kind.TOP_SKIN, SolidLines(45.0, WIDTH, HEIGHT))
    assert out_of_order(lines_of(beads, 45.0)) > 0


def test_the_order_of_a_layer_keeps_it() -> None:
    area = plate([(3, 2, 3), (-5, -3, 2)])
    beads = skin_beads(area, Kind.TOP_SKIN, SolidLines(45.0, WIDTH, HEIGHT, pattern="monotonic"))
    placed = order_beads(beads, area, profile().process, np.array([20.0, 20.0]))
    printed = [Bead(row.kind, row.points, WIDTH, 2) for row in rows_of(placed) if row.kind is Kind.TOP_SKIN]
    assert out_of_order(lines_of(printed, 45.0)) == 0
