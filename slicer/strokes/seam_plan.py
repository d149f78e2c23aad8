"""Seam plan: seams of the outer walls in all layers of a part that are well hidden and lie in one line.

Every outline offers candidate points: its corners, and points SPACING_MM apart. A point costs its visibility, less the reward of
a corner, higher for an inner than for an outer one, plus a little for its distance from the rear; the shift from the seam of the
outline below costs per millimetre, up to a jump. The outlines form a forest, each on the nearest one of the layer below, so the
optimum is found exactly: from the top down every point sums up the best costs above it, from the bottom up each outline takes its
best point.

Visibility is the share of the light over the surface at a point that its body does not block; other bodies on the plate are
ignored, since they are separated after printing. It is computed by rays for samples, which are coarser than the candidates, and
interpolated among samples with similar normals.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mdp.directions.unit_vectors import spread_like_light
from mdp.kernels.arrays import flags, floats, longs, table
from mdp.kernels.kernel import helper, kernel
from mdp.mesh import Floats, Indices, Mesh, together
from mdp.overhang import Mask
from mdp.sweep.rays import blocked_shares, faces_met, triangle_tree
from mdp.topology.components import vertex_components
from profiles.process import Process
from slicer.geometry.polygons import contours
from slicer.geometry.polyline import near_height, squared_distance_in_space
from slicer.sectioning import Sections

SPACING_MM = 1.0  # distance between candidate points along an outline
FEWEST = 8  # candidates per outline
INNER, OUTER = 0.7, 0.55  # rewards of sharp inner and outer corners; a point in full sight costs 1
TO_REAR = 5e-4  # cost per mm from the rear: between equally visible points, people look at the front
SHIFT, JUMP = 0.14, 2.4  # cost per mm of shift between two layers, and greatest cost of a jump
FORBIDDEN = 1e3  # above all other costs of a part's seams
APART_MM = 3.0  # outlines farther apart than this have independent seams
ALONG_MM, UP_MM = 2.5, 2.0  # spacing of samples along an outline, and upward
FEWEST_SAMPLES = 6  # samples per outline
RAYS = 24
LIFT_MM = 0.1  # distance of a ray's start from the outline
FAR_MM = 1e5
INWARD_MM = 1.0  # distance within which a point finds the face on which it lies
ROUNDED = 4  # decimals, in mm, for equal vertices of two parts
BLUR_MM = 1.0  # samples closer than this have equal weight
ASIDE = 1e-3  # weight of a sample with a different normal
ARM_MM = 1.0  # a corner's angle is measured between points this far before and after it, so that noise does not count
SMOOTH_DEG, SHARP_DEG = 20.0, 90.0  # turns from which a corner begins to hide a seam, and hides it fully
SMOOTH_COSINE = float(np.cos(np.radians(SMOOTH_DEG)))


class SeamLimits(NamedTuple):
    """Limits for seams. edges: (n, 6) segments, such as interface edges, that seams at height z avoid by keep_mm (n,)."""

    edges: Floats
    z: float
    keep_mm: Floats


NO_LIMITS = SeamLimits(np.zeros((0, 6)), 0.0, np.zeros(0))


def rear_of(bounds_mm: Floats) -> Floats:
    """(2,) a point behind the centre of a part, at a distance of the part's depth. bounds_mm: (2, 3)."""
    low, high = bounds_mm
    return np.array([0.5 * (low[0] + high[0]), 2.0 * high[1] - low[1]])


def seam_limits(interfaces: Floats, unwanted: Floats, z_mm: float, process: Process) -> SeamLimits:
    """The (n, 6) interface edges within reach of a layer, and (k, 6) segments where the user wants no seam in it."""
    keep_mm = process.interface_seam_mm
    near = near_height(interfaces, z_mm, keep_mm)
    distances_mm = np.repeat([keep_mm, process.line_width_mm], [len(near), len(unwanted)])
    return SeamLimits(np.concatenate([near, unwanted]), float(z_mm), distances_mm)


def plan_seams(sections: Sections, limits: Sequence[SeamLimits]) -> list[Floats]:
    """(k, 2) planned seams for each layer, one per outline. limits: edges that the seams of each layer avoid."""
    outlines = [contours(area) for area in sections.outlines]
    loops = [(layer, loop) for layer, of_layer in enumerate(outlines) for loop in of_layer]
    if not loops:
        return [np.zeros((0, 2)) for _ in outlines]
    (levels, samples), rear = light_samples(sections, outlines), rear_of(sections.mesh.bounds_mm)
    offered, costs = [], []
    for layer, loop in loops:
        places, strength, clear = _offered(loop, limits[layer])
        worth = np.where(strength > 0.0, INNER, OUTER) * np.abs(strength)
        seen = light_at(layer, places, sections.heights.cut_mm, levels, samples)
        costs.append(seen - worth + TO_REAR * np.hypot(*(places[:, :2] - rear).T) + FORBIDDEN * ~clear)
        offered.append(places[:, :2])
    first, layers = np.cumsum([0, *map(len, offered)]), np.array([layer for layer, _ in loops])
    chosen = choose(np.concatenate(offered), np.concatenate(costs), first, layers)
    return [chosen[layers == layer] for layer in range(len(outlines))]


def light_samples(sections: Sections, outlines: Sequence[Sequence[Floats]]) -> tuple[Indices, list[Floats]]:
    """Some layers of a part, lowest first, and for each (n, 5) samples of its outlines: x, y, outward unit vector, and
    visibility, 0 to 1. outlines: loops (n, 2) of every layer, solid on their left.
    """
    of, cuts_mm = sections.part, sections.heights.cut_mm
    filled = np.flatnonzero([bool(loops) for loops in outlines])
    near = np.searchsorted(cuts_mm[filled], np.arange(cuts_mm[0], cuts_mm[-1], UP_MM)).clip(max=len(filled) - 1)
    levels: Indices = np.unique([*filled[near], filled[-1]])
    samples = [_samples(outlines[level]) for level in levels]
    counts, (places, outward) = [len(level) for level in samples], np.split(np.concatenate(samples), [2], axis=1)
    heights_mm = np.repeat(cuts_mm[levels], counts)[:, None] + of.base.offset_mm
    level, up = np.zeros_like(heights_mm), np.ones_like(heights_mm)
    lifted = np.hstack([places + LIFT_MM * outward, heights_mm]) @ of.rotation
    along = np.hstack([-outward[:, 1:], outward[:, :1], level])
    frames = np.stack([along, np.hstack([level, level, up]), np.hstack([outward, level])], axis=1) @ of.rotation
    mesh = together([part.mesh for part in (*sections.earlier, of, *sections.later)])
    bodies = _bodies(mesh)
    own, blocked = np.full(len(lifted), bodies[sum(len(part.mesh.faces) for part in sections.earlier)]), np.zeros(len(lifted))
    if (bodies != bodies[0]).any():
        met = faces_met(triangle_tree(mesh), np.stack([lifted, -frames[:, 2]], axis=1), INWARD_MM, in_turn=True)
        own = np.where(met >= 0, bodies[met], own)
    for body in np.unique(own):
        tree, rows = triangle_tree(Mesh(mesh.vertices, mesh.faces[bodies == body])), np.flatnonzero(own == body)
        blocked[rows] = blocked_shares(tree, (lifted[rows], frames[rows]), spread_like_light(RAYS), FAR_MM, in_turn=True)
    seen = np.column_stack([places, outward, 1.0 - blocked])
    return levels, np.split(seen, np.cumsum(counts)[:-1])


def _samples(loops: Sequence[Floats]) -> Floats:
    """(n, 4) points spread evenly over loops, with outward unit vectors."""
    samples = []
    for loop in loops:
        sides = np.roll(loop, -1, axis=0) - loop
        lengths = np.hypot(*sides.T)
        ends = np.cumsum(lengths)
        count = max(FEWEST_SAMPLES, int(np.ceil(ends[-1] / ALONG_MM)))
        along = (np.arange(count) + 0.5) * ends[-1] / count
        at = np.searchsorted(ends, along).clip(max=len(loop) - 1)
        way = sides[at] / np.maximum(lengths[at], 1e-12)[:, None]
        places = loop[at] + (along - ends[at] + lengths[at])[:, None] * way
        samples.append(np.column_stack([places, way[:, 1], -way[:, 0]]))
    return np.concatenate(samples)


def _bodies(mesh: Mesh) -> Indices:
    """(m,) number of each face's body. Parts separated by a cut share the vertices of its rim."""
    label = vertex_components(len(mesh.vertices), mesh.faces)
    if (label != label[0]).any():
        _, same = np.unique(np.round(mesh.vertices, ROUNDED), axis=0, return_inverse=True)
        label = vertex_components(len(mesh.vertices), same[mesh.faces])[same]
    return label[mesh.faces[:, 0]]


@kernel
def _offered(loop: Floats, limits: SeamLimits) -> tuple[Floats, Floats, Mask]:
    """(n, 4) candidate points of a loop, the corner of each stretch that has one, with outward unit vectors; (n,) corner
    strengths; and (n,) whether each is clear of the limits.
    """
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
    clear = flags(count)
    for k in range(count):
        clear[k] = is_clear(limits, places[k, 0], places[k, 1])
    return places, strengths, clear


@helper
def corner_strength(loop: Floats, i: int) -> float:
    """Corner strength of a vertex of a loop (n, 2), solid on its left: 0 up to SMOOTH_DEG of turn, growing to 1 at SHARP_DEG for
    an inner corner and -1 for an outer one.
    """
    px, py = _arm(loop, i, -1)
    qx, qy = _arm(loop, i, 1)
    bx, by, cx, cy = loop[i, 0] - px, loop[i, 1] - py, qx - loop[i, 0], qy - loop[i, 1]
    cross, dot = bx * cy - by * cx, bx * cx + by * cy
    if dot > SMOOTH_COSINE * np.hypot(bx, by) * np.hypot(cx, cy):
        return 0.0
    turn = np.degrees(np.arctan2(abs(cross), dot))
    strength = min((turn - SMOOTH_DEG) / (SHARP_DEG - SMOOTH_DEG), 1.0)
    return float(strength if cross < 0.0 else -strength)


@helper
def _arm(loop: Floats, i: int, sense: int) -> tuple[float, float]:
    """The point ARM_MM along the loop from a vertex, forward or backward."""
    n, left, at = len(loop), ARM_MM, i
    for _ in range(n):
        ax, ay = loop[at % n, 0], loop[at % n, 1]
        dx, dy = loop[(at + sense) % n, 0] - ax, loop[(at + sense) % n, 1] - ay
        step = np.hypot(dx, dy)
        if step >= left:
            return ax + left / step * dx, ay + left / step * dy
        left -= step
        at += sense
    return loop[at % n, 0], loop[at % n, 1]


@helper
def is_clear(interfaces: SeamLimits, x: float, y: float) -> bool:
    """Whether a point at their height is clear of all interface edges."""
    for e in range(len(interfaces.edges)):
        begin, end = interfaces.edges[e, :3], interfaces.edges[e, 3:]
        if squared_distance_in_space((x, y, interfaces.z), begin, end) < interfaces.keep_mm[e] * interfaces.keep_mm[e]:
            return False
    return True


def light_at(layer: int, outline_points: Floats, cuts_mm: Floats, levels: Indices, samples: Sequence[Floats]) -> Floats:
    """(n,) visibility of points in a layer, 0 to 1, interpolated between the sampled levels below and above.

    outline_points: (n, 4) x, y and outward unit vector; cuts_mm: heights of all layers; levels, samples: from light_samples.
    """
    upper = min(int(np.searchsorted(levels, layer)), len(levels) - 1)
    lower = upper if levels[upper] <= layer else max(upper - 1, 0)
    low_mm, high_mm = cuts_mm[levels[[lower, upper]]]
    share = 0.0 if high_mm <= low_mm else float(np.clip((cuts_mm[layer] - low_mm) / (high_mm - low_mm), 0.0, 1.0))
    below: Floats = _look_up(outline_points, samples[lower])
    return below if share <= 0.0 else (1.0 - share) * below + share * _look_up(outline_points, samples[upper])


@kernel
def _look_up(outline_points: Floats, samples: Floats) -> Floats:
    """(n,) weighted mean of the visibility of samples; nearby samples with similar normals weigh most."""
    out: Floats = floats(len(outline_points), 0.0)
    for k in range(len(out)):
        x, y, nx, ny = outline_points[k, 0], outline_points[k, 1], outline_points[k, 2], outline_points[k, 3]
        whole, total = 0.0, 0.0
        for s in range(len(samples)):
            dx, dy = samples[s, 0] - x, samples[s, 1] - y
            apart = dx * dx + dy * dy + BLUR_MM * BLUR_MM
            weight = max(nx * samples[s, 2] + ny * samples[s, 3], ASIDE) / (apart * apart)
            whole += weight
            total += weight * samples[s, 4]
        out[k] = total / whole
    return out


@kernel
def choose(xy: Floats, cost: Floats, first: Indices, layer: Indices) -> Floats:
    """(k, 2) point of each outline, chosen for the least total cost.

    xy: (n, 2) points, outline by outline from the lowest layer up; cost: (n,) of each; first: (k + 1,) start of each outline's
    points; layer: (k,) of each outline.
    """
    count = len(layer)
    below, best = longs(count, -1), cost.copy()
    begin = 0
    for k in range(count):
        while layer[begin] < layer[k] - 1:
            begin += 1
        least = APART_MM * (first[k + 1] - first[k])
        for j in range(begin, k):
            if layer[j] != layer[k] - 1:
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
                best[q] += _cheapest(xy, best, first, k, q)[1]
    chosen, taken = table(count, 2), longs(count, 0)
    for k in range(count):
        taken[k] = _cheapest(xy, best, first, k, taken[below[k]] if below[k] >= 0 else -1)[0]
        chosen[k, 0], chosen[k, 1] = xy[taken[k], 0], xy[taken[k], 1]
    return chosen


@helper
def _cheapest(xy: Floats, best: Floats, first: Indices, outline: int, below: int) -> tuple[int, float]:
    """The cheapest point of an outline, including everything above it and the shift from a point below, and its cost; below: -1
    if there is none.
    """
    least, taken = np.inf, first[outline]
    for p in range(first[outline], first[outline + 1]):
        cost = best[p]
        if below >= 0:
            way = np.hypot(xy[p, 0] - xy[below, 0], xy[p, 1] - xy[below, 1])
            cost += min(SHIFT * way, JUMP)
        if cost < least:
            least, taken = cost, p
    return taken, least
