"""Seam plan: where the outer walls of all layers of a part are to begin, so that they are seen little and lie in one line.

Every outline offers places: its corners, and others SPACING_MM apart. A place costs what is seen of it, less what a corner is
worth, an inner one more than an outer one, and a little for its way to the rear; the way from a seam to that of the outline below
costs by the millimetre, up to a jump. The outlines are a forest, each on the nearest one of the layer below, so the cheapest
choice of all is found exactly: from the top down every place sums up the best that can stand on it, from the bottom up each
outline takes its best one.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import longs, table
from mdp.kernels.kernel import helper, kernel
from mdp.mesh import Floats
from slicer.geometry.polygons import contours
from slicer.sections import Sections
from slicer.strokes.seam import SeamLimits, corner_strength, keeps_clear, rear_of
from slicer.strokes.visibility import Outside, Visibility

SPACING_MM = 1.0  # of the places of an outline
FEWEST = 8  # places of an outline
INNER, OUTER = 0.7, 0.1  # what sharp inner and outer corners are worth; a place in full sight costs 1
TO_REAR = 5e-4  # what a mm to the rear costs: among places that are seen alike, people look at the front
SHIFT, JUMP = 0.14, 2.4  # what a mm of way between two layers costs, and a jump at most
FORBIDDEN = 1e3  # more than all that a part's seams can cost otherwise
APART_MM = 3.0  # outlines that are farther from each other have seams of their own


class Places(NamedTuple):
    """xy: (n, 2) outline after outline from the lowest layer up; cost: (n,); first: (k + 1,) where each outline's begin; layer:
    (k,)."""

    xy: Floats
    cost: Floats
    first: NDArray[np.int64]
    layer: NDArray[np.int64]


def plan_seams(sections: Sections, limits: Sequence[SeamLimits]) -> list[Floats]:
    """(k, 2) places for each layer, one an outline, where its outer walls are to begin.

    limits: what the seams of each layer keep clear of.
    """
    outlines = [contours(area) for area in sections.outlines]
    loops = [(layer, loop) for layer, of_layer in enumerate(outlines) for loop in of_layer]
    if not loops:
        return [np.zeros((0, 2)) for _ in outlines]
    visibility, rear = Visibility(sections, outlines), rear_of(sections.mesh.bounds_mm)
    offered, costs = [], []
    for layer, loop in loops:
        places, strength = _offered(loop)
        clear = keeps_clear(places[:, :2], limits[layer])
        worth = np.where(strength > 0.0, INNER, OUTER) * np.abs(strength)
        seen = visibility.at(layer, Outside(places[:, :2], places[:, 2:]))
        costs.append(seen - worth + TO_REAR * np.hypot(*(places[:, :2] - rear).T) + FORBIDDEN * ~clear)
        offered.append(places[:, :2])
    first, layers = np.cumsum([0, *map(len, offered)]), np.array([layer for layer, _ in loops])
    chosen = choose(Places(np.concatenate(offered), np.concatenate(costs), first, layers))
    return [chosen[layers == layer] for layer in range(len(outlines))]


@kernel
def _offered(loop: Floats) -> tuple[Floats, Floats]:
    """(n, 4) places spread over a loop, the corner of each stretch of it that has one, with the unit vectors out of the solid
    there, and (n,) how much of a corner each is."""
    n, total = len(loop), 0.0
    for i in range(n):
        total += np.hypot(loop[i, 0] - loop[i - 1, 0], loop[i, 1] - loop[i - 1, 1])
    count = max(FEWEST, int(np.ceil(total / SPACING_MM)))
    places, strengths = table(count, 4), np.zeros(count)
    along, k = 0.0, 0
    for i in range(n):
        after = (i + 1) % n
        dx, dy = loop[after, 0] - loop[i, 0], loop[after, 1] - loop[i, 1]
        step = np.hypot(dx, dy)
        if step <= 0.0:
            continue
        strength, stretch = corner_strength(loop, i), min(int(along / total * count), count - 1)
        while k < count and (k + 0.5) * total / count <= along + step:
            share = ((k + 0.5) * total / count - along) / step
            if strengths[k] == 0.0:
                places[k, 0], places[k, 1] = loop[i, 0] + share * dx, loop[i, 1] + share * dy
                places[k, 2], places[k, 3] = dy / step, -dx / step
            k += 1
        if abs(strength) > abs(strengths[stretch]):
            strengths[stretch] = strength
            ex, ey = loop[i, 0] - loop[i - 1, 0], loop[i, 1] - loop[i - 1, 1]
            before = max(np.hypot(ex, ey), 1e-12)
            x, y = dy / step + ey / before, -dx / step - ex / before
            length = max(np.hypot(x, y), 1e-12)
            places[stretch, 0], places[stretch, 1] = loop[i, 0], loop[i, 1]
            places[stretch, 2], places[stretch, 3] = x / length, y / length
        along += step
    return places, strengths


@helper
def _cheapest(places: Places, best: Floats, outline: int, below: int) -> tuple[int, float]:
    """The place of an outline that costs least with all on it and the way to it from a place below, and that cost; below -1:
    there is none."""
    least, taken = np.inf, places.first[outline]
    for p in range(places.first[outline], places.first[outline + 1]):
        cost = best[p]
        if below >= 0:
            way = np.hypot(places.xy[p, 0] - places.xy[below, 0], places.xy[p, 1] - places.xy[below, 1])
            cost += min(SHIFT * way, JUMP)
        if cost < least:
            least, taken = cost, p
    return taken, least


@kernel
def choose(places: Places) -> Floats:
    """(k, 2) the place of each outline, of all choices the one that costs least together."""
    xy, first, count = places.xy, places.first, len(places.layer)
    below, best = longs(count, -1), places.cost.copy()
    begin = 0
    for k in range(count):
        while places.layer[begin] < places.layer[k] - 1:
            begin += 1
        least = APART_MM * (first[k + 1] - first[k])
        for j in range(begin, k):
            if places.layer[j] != places.layer[k] - 1:
                break
            far = 0.0
            for p in range(first[k], first[k + 1]):
                near = np.inf
                for q in range(first[j], first[j + 1]):
                    near = min(near, (xy[p, 0] - xy[q, 0]) ** 2 + (xy[p, 1] - xy[q, 1]) ** 2)
                far += np.sqrt(near)
                if far >= least:
                    break
            if far < least:
                least, below[k] = far, j
    for k in range(count - 1, -1, -1):
        if below[k] >= 0:
            for q in range(first[below[k]], first[below[k] + 1]):
                best[q] += _cheapest(places, best, k, q)[1]
    chosen, taken = table(count, 2), longs(count, 0)
    for k in range(count):
        taken[k] = _cheapest(places, best, k, taken[below[k]] if below[k] >= 0 else -1)[0]
        chosen[k, 0], chosen[k, 1] = xy[taken[k], 0], xy[taken[k], 1]
    return chosen
