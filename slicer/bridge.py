"""Bridges: hanging places whose lines can span from bank to bank, and the direction in which they sag least."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mdp.kernel import kernel, longs
from mdp.mesh import Floats
from slicer.bead import Bead
from slicer.paths import Kind
from slicer.polygons import Polygons, edges, grown, opened
from slicer.region import Region
from slicer.scanline import clipped
from slicer.scanline import inside as lies_inside
from slicer.skin import skin

TURNS = 18  # directions tried over half a turn, besides those of the place's own sides
SIDES = 8  # so many of its longest sides are tried, along and across
LEAST = 4.0  # in line widths squared: a smaller place is no bridge but an edge
ANCHOR = 2.0  # line widths that the lines of a bridge reach over its banks
LOOSE = 2.63  # a line held at one end sags like one this much longer held at both: (384 / 8)^(1/4), beam theory
ADRIFT = 10.0  # and one held nowhere like this
TOLERATED = 0.02  # share of a bridge's length that may have a loose end: corners of the place
GAIN = 0.01  # a direction is better only by this share, more than where the lines happen to lie; else the place's own sides win


@dataclass(frozen=True, eq=False)
class Bridge:
    """place: what hangs; angle_deg: direction of its lines, 0 to 180.

    longest_mm: the longest span; loose: share of the lines' length that is not held at both ends.
    """

    place: Polygons
    angle_deg: float
    longest_mm: float
    loose: float

    def carries(self, longest_mm: float) -> bool:
        """Whether it needs no support: every line from bank to bank, none longer than that."""
        return self.loose <= TOLERATED and self.longest_mm <= longest_mm


def bridge(hanging: Polygons, banks: Floats, width_mm: float) -> Bridge | None:
    """Lines over one connected hanging place in the direction that sags least; None where there is nothing to hold on to.

    banks: (n, 4) edges of the layer below, grown by a quarter of a line. The sum of squared spans is least, a line held at
    one end counting as 2.63 times its length: where all lines reach over, that is the direction of the shortest spans.
    """
    if hanging.area() < LEAST * width_mm**2 or not len(banks):
        return None
    sides = edges(hanging)
    around = sides.reshape(-1, 2)
    best, least = None, np.inf
    for angle in _angles(sides):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        turned = np.ascontiguousarray((around @ turn).reshape(-1, 4))
        rows = clipped(turned, np.arange(turned[:, 1].min() + 0.5 * width_mm, turned[:, 1].max(), width_mm))
        if not len(rows):
            continue
        spans, held = rows[:, 1] - rows[:, 0], _held(banks, rows, np.ascontiguousarray(turn))
        sag = float(((np.array([ADRIFT, LOOSE, 1.0])[held] * spans) ** 2).sum() / spans.sum())
        if held.any() and sag < least * (1.0 - GAIN):
            least, loose = sag, float(spans[held < 2].sum() / spans.sum())
            best = (float(np.degrees(angle)), float(spans.max()), loose)
    return None if best is None else Bridge(hanging, *best)


def _angles(sides: Floats) -> list[float]:
    """Directions worth trying, radians in 0 .. pi, those of the place's sides first."""
    steps = sides[:, 2:] - sides[:, :2]
    longest = np.argsort(-np.hypot(*steps.T), kind="stable")[:SIDES]
    along = np.arctan2(steps[longest, 1], steps[longest, 0])
    own = np.round(np.concatenate([along, along + 0.5 * np.pi]) % np.pi, 4)
    return [*np.unique(own).tolist(), *(np.pi * np.arange(TURNS) / TURNS).tolist()]


@kernel
def _held(banks: Floats, rows: Floats, turn: Floats) -> NDArray[np.int64]:
    """(m,) how many ends of each line lie on a bank."""
    held: NDArray[np.int64] = longs(len(rows), 0)
    for r in range(len(rows)):
        for end in range(2):
            x, y = rows[r, end], rows[r, 2]
            held[r] += lies_inside(banks, turn[0, 0] * x + turn[0, 1] * y, turn[1, 0] * x + turn[1, 1] * y)
    return held


def bridged(span: Bridge, inside: Polygons, width_mm: float) -> Polygons:
    """Where the lines of a bridge run: over what hangs of a layer's inside, and onto the banks as far as the inside reaches."""
    open_place = opened(span.place ^ inside, 0.5 * width_mm)
    return open_place if open_place.is_empty() else grown(open_place, ANCHOR * width_mm) ^ inside


def beside(region: Region, area: Polygons, width_mm: float) -> Region:
    """The region without the place of a bridge."""

    def rest(polygons: Polygons) -> Polygons:
        left = polygons - area
        return left if left.is_empty() or left.area() == polygons.area() else opened(left, 0.25 * width_mm)

    return replace(region, top=rest(region.top), solid=rest(region.solid), sparse=rest(region.sparse))


def bridge_beads(area: Polygons, angle_deg: float, flow: float, width_mm: float, height_mm: float, overlap: float) -> list[Bead]:
    """The lines of a bridge with its own flow."""
    return [replace(bead, flow=bead.flow * flow) for bead in skin(area, Kind.BRIDGE, angle_deg, width_mm, height_mm, overlap)]
