"""Strokes: the beads of a layer in printing order as one table, before their speed is known; splitting one is a refinement."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from slicer.bead import Bead
from slicer.geometry.polyline import PATH_RESOLUTION_MM, lengths_mm, mark_corners
from slicer.geometry.segments import Segment, nearest_share
from slicer.paths import NUMBER, Kind, is_of

RINGS = (Kind.OUTER_WALL, Kind.INNER_WALL)


@dataclass(frozen=True, eq=False)
class Strokes:
    """One row per stroke, in printing order.

    points: (n, 3) mm, x, y and the width of the bead there; starts: (k + 1,) where the points of each stroke begin.
    approach: (m, 2) points that the travels to strokes pass; approach_starts: (k + 1,). Columns, (k,) each: kind: index in KINDS;
    width_mm: mean; flow, overhang, over_infill: as in Bead; small: a closed wall no longer than process.small_wall_mm, also the
    pieces of one whose width varies; varies: the width changes along the stroke; retract: the travel to it pulls filament back.
    """

    points: Floats
    starts: Indices
    kind: NDArray[np.int8]
    width_mm: Floats
    flow: Floats
    overhang: NDArray[np.int8]
    over_infill: Mask
    small: Mask
    varies: Mask
    retract: Mask
    approach: Floats
    approach_starts: Indices

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def lengths_mm(self) -> Floats:
        """(k,) length of each stroke."""
        return lengths_mm(self.points, self.starts)

    @property
    def first_points(self) -> Floats:
        """(k, 2) where each stroke begins."""
        return self.points[self.starts[:-1], :2]

    @property
    def last_points(self) -> Floats:
        """(k, 2) where each stroke ends."""
        return self.points[self.starts[1:] - 1, :2]

    def is_of(self, *kinds: Kind) -> Mask:
        """(k,) which strokes are of some kinds."""
        return is_of(self.kind, kinds)

    def refined(self, points: Floats, starts: Indices, source: Indices) -> "Strokes":
        """The strokes with other points; source: (j,) the stroke that each of the new ones is a piece of, in the same order.

        The pieces of a stroke follow each other without a travel: only the first one keeps retraction and approach.
        """
        first = np.diff(source, prepend=-1) > 0
        return Strokes(
            points=points,
            starts=starts,
            kind=self.kind[source],
            width_mm=self.width_mm[source],
            flow=self.flow[source],
            overhang=self.overhang[source],
            over_infill=self.over_infill[source],
            small=self.small[source],
            varies=self.varies[source],
            retract=self.retract[source] & first,
            approach=self.approach,
            approach_starts=np.append(self.approach_starts[source + ~first], len(self.approach)),
        )

    def simplified(self) -> "Strokes":
        """The strokes without points that lie within PATH_RESOLUTION_MM of the line between those that stay."""
        corners = mark_corners(self.points, self.starts, PATH_RESOLUTION_MM)
        return replace(self, points=self.points[corners], starts=np.append(0, np.cumsum(corners))[self.starts])


def strokes_of(
    placed: Sequence[tuple[Bead, Floats]], retract: Mask, approaches: Mapping[int, Floats], small_wall_mm: float
) -> Strokes:
    """The table of beads in order, each with its points (n, 2) as printed; approaches: by number of the stroke."""
    beads = [bead for bead, _ in placed]
    counts = [len(points) for _, points in placed]
    starts = np.cumsum([0, *counts])
    kind = np.array([NUMBER[bead.kind] for bead in beads], dtype=np.int8)
    width_mm = np.array([bead.width_mm for bead in beads])
    points = np.empty((int(starts[-1]), 3))
    points[:, :2] = np.concatenate([np.zeros((0, 2)), *(points for _, points in placed)])
    points[:, 2] = np.repeat(width_mm, counts)
    for k, bead in enumerate(beads):
        if bead.course is not None:
            way = points[starts[k] : starts[k + 1]]
            way[:, 2] = _widths_at(way, bead.course)
    ends = points[starts[1:] - 1, :2] - points[starts[:-1], :2]
    closed = np.hypot(ends[:, 0], ends[:, 1]) <= width_mm  # a seam gap leaves a wall a little open
    small = is_of(kind, RINGS) & closed & (lengths_mm(points, starts) <= small_wall_mm)
    passed = [approaches.get(k, points[:0, :2]) for k in range(len(beads))]
    return Strokes(
        points=points,
        starts=starts,
        kind=kind,
        width_mm=width_mm,
        flow=np.array([bead.flow for bead in beads]),
        overhang=np.array([bead.overhang for bead in beads], dtype=np.int8),
        over_infill=np.array([bead.over_infill for bead in beads], dtype=np.bool_),
        small=small,
        varies=np.array([bead.course is not None for bead in beads], dtype=np.bool_),
        retract=retract,
        approach=np.concatenate([np.zeros((0, 2)), *passed]),
        approach_starts=np.cumsum([0, *(len(way) for way in passed)]),
    )


@kernel
def _widths_at(places: Floats, course: Floats) -> Floats:
    """(n,) widths at places (n, 2 or 3) on a course (k, 3); the search for a place begins at the step nearest to the last one."""
    out: Floats = floats(len(places), 0.0)
    steps, at = len(course) - 1, 0
    for i in range(len(places)):
        least = np.inf
        for tried in range(steps):
            k = (at + tried) % steps
            side = Segment(course[k, 0], course[k, 1], course[k + 1, 0], course[k + 1, 1])
            share = nearest_share(side, places[i, 0], places[i, 1])
            x, y = side.x0 + share * (side.x1 - side.x0), side.y0 + share * (side.y1 - side.y0)
            away = (x - places[i, 0]) ** 2 + (y - places[i, 1]) ** 2
            if away < least:
                least, nearest = away, k
                out[i] = course[k, 2] + share * (course[k + 1, 2] - course[k, 2])
                if away < 1e-16:
                    break
        at = nearest
    return out
