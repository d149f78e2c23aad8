"""Pieces: beads of varying width in pieces of one width each, printed one after the other without a travel."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.bead import EVEN_MM, Course
from slicer.geometry.segments import Segment, nearest_share
from slicer.paths import bead_area_mm2
from slicer.travel.combing import NOWHERE
from slicer.travel.order import Placed

MOST_OVER_MM = 0.022  # by which a piece is wider than its narrowest place: half of it reaches over the section there
SHORTEST_MM = 0.2  # a piece that ends because widths change by EVEN_MM is no shorter,
MOST_SPREAD_MM, LEAST_MM = 0.03, 0.045  # but for one where they change by that much, which is no shorter than this


def in_pieces(placed: Sequence[Placed], height_mm: float) -> list[Placed]:
    """The beads in the same order, those of varying width in pieces whose widths are the means of their stretches."""
    return [piece for bead in placed for piece in _pieces(bead, bead.bead.course, height_mm)]


def split_course(points: Floats, widths: Floats) -> Iterator[tuple[Floats, float]]:
    """Points (k, 2) and width of each piece of a line (n, 2) whose widths (n,) vary."""
    points, widths = _with_small_steps(points, widths)
    steps, means = np.hypot(*np.diff(points, axis=0).T), 0.5 * (widths[1:] + widths[:-1])
    for a, b in pairwise(_cuts(steps.tolist(), means.tolist())):
        mean = float(np.average(means[a:b], weights=np.maximum(steps[a:b], 1e-9)))
        yield points[a : b + 1], min(mean, float(widths[a : b + 1].min()) + MOST_OVER_MM)


def _pieces(placed: Placed, course: Course | None, height_mm: float) -> Iterator[Placed]:
    if course is None:
        yield placed
        return
    bead, first = placed.bead, True
    whole = bead_area_mm2(bead.width_mm, height_mm)
    points = np.ascontiguousarray(placed.points)
    for piece, width in split_course(points, _widths_at(points, course.points, course.widths)):
        flow = 1.0 + (bead.flow - 1.0) * whole / bead_area_mm2(width, height_mm)
        own = replace(bead, points=piece, width_mm=width, flow=flow)
        yield replace(
            placed, bead=own, points=piece, retract=placed.retract and first, approach=placed.approach if first else NOWHERE
        )
        first = False


def _with_small_steps(points: Floats, widths: Floats) -> tuple[Floats, Floats]:
    """The line with points added where its width changes by more than EVEN_MM from one to the next."""
    counts = np.maximum(np.ceil(np.abs(np.diff(widths)) / EVEN_MM), 1).astype(np.int64)
    if counts.max() == 1:
        return points, widths
    first = np.repeat(np.cumsum(counts) - counts, counts)
    share = (np.arange(counts.sum()) - first) / np.repeat(counts, counts)
    at = np.append(np.repeat(np.arange(len(counts)), counts) + share, len(counts))
    known = np.arange(len(points))
    x, y, width = (np.interp(at, known, values) for values in (points[:, 0], points[:, 1], widths))
    return np.column_stack([x, y]), width


def _cuts(steps: list[float], widths: list[float]) -> list[int]:
    """Where pieces begin and end: as long as the widths allow."""
    cuts, length, left = [0], 0.0, sum(steps)
    low = high = widths[0]
    for k, (step, width) in enumerate(zip(steps, widths, strict=True)):
        spread = max(high, width) - min(low, width)
        least_mm = LEAST_MM if spread > MOST_SPREAD_MM else SHORTEST_MM
        if spread > EVEN_MM and length >= least_mm and left >= least_mm:
            cuts.append(k)
            length, low, high = 0.0, width, width
        length, left = length + step, left - step
        low, high = min(low, width), max(high, width)
    return [*cuts, len(steps)]


@kernel
def _widths_at(places: Floats, points: Floats, widths: Floats) -> Floats:
    """(n,) widths at places (n, 2) on a course (k, 2), looked through from the step nearest to the place before on."""
    out: Floats = floats(len(places), 0.0)
    steps, at = len(points) - 1, 0
    for i in range(len(places)):
        least = np.inf
        for tried in range(steps):
            k = (at + tried) % steps
            side = Segment(points[k, 0], points[k, 1], points[k + 1, 0], points[k + 1, 1])
            share = nearest_share(side, places[i, 0], places[i, 1])
            x, y = side.x0 + share * (side.x1 - side.x0), side.y0 + share * (side.y1 - side.y0)
            away = (x - places[i, 0]) ** 2 + (y - places[i, 1]) ** 2
            if away < least:
                least, nearest = away, k
                out[i] = widths[k] + share * (widths[k + 1] - widths[k])
                if away < 1e-16:
                    break
        at = nearest
    return out
