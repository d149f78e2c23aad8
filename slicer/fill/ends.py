"""Ends: strokes of skin end on the plastic of the layer below, those of infill on that of the layers below.

Skins over sparse infill have grown to what holds them (slicer.fill.over_infill), but lines lie beside the rows by which they
grew, turns leave wedges along the border of a skin, and lines of infill end before it. A stroke whose last line width lies on
nothing is extended to plastic nearby if that keeps it inside the outline of its own layer. Otherwise, where the model continues
below, it is cut back to the last place that has plastic below, and left out if there is none; a bridge over open air stays.

The runs along walls that anchor lines of infill begin where no infill lies as soon as the lines move or part. They are cut back,
too, and grow from layer to layer as far as each carries the next.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.bead import Bead
from slicer.geometry.edge_index import EdgeIndex, depths, index_edges, index_segments, nearest
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import length_mm
from slicer.paths import SKINS

STEP = 0.125  # line widths between the places of a stroke under which plastic is looked for
CARRIES = 0.35  # line widths from the middle of a line that it carries the middle of what lies on it
ONWARD = 1.0  # line widths that a stroke may go on to plastic
HOLD = 0.5  # line widths that a stroke which ends on plastic reaches over it or beyond it
CARRYING = 3  # layers below that carry infill: the lines of a pattern lie in the same place in every third layer at least
HELD, EXTEND, CUT = range(3)  # an end on plastic, one that may be extended to it, and one that may also be cut back

Plastic = tuple[EdgeIndex, Floats]  # the middle lines of beads, and for each segment how far from it a bead carries, mm


def plastic_of(beads: Sequence[Bead]) -> Plastic | None:
    """What the beads of a layer carry; None where there are none."""
    lying = [bead for bead in beads if len(bead.points) > 1]
    if not lying:
        return None
    carries_mm = np.repeat([CARRIES * bead.width_mm for bead in lying], [len(bead.points) - 1 for bead in lying])
    return index_segments(np.concatenate([np.hstack([bead.points[:-1], bead.points[1:]]) for bead in lying])), carries_mm


def hold_ends(
    beads: Sequence[Bead], below: Plastic | None, section: Polygons, section_below: Polygons, width_mm: float
) -> list[Bead]:
    """The beads of a layer, whose skin strokes end on the plastic of the layer below where the model is there or near. section,
    section_below: the model's sections in this layer and in the one below."""
    skins = [k for k, bead in enumerate(beads) if bead.kind in SKINS and not bead.closed]
    if not skins or below is None:
        return list(beads)
    lines = [line for k in skins for line in (beads[k].points, np.ascontiguousarray(beads[k].points[::-1]))]
    ends = np.array([_first_held(line, below, width_mm, width_mm) < 0.0 for line in lines]).reshape(-1, 2)
    if not ends.any():
        return list(beads)
    inside_mm = depths(np.concatenate([beads[k].points[[0, -1]] for k in skins]), index_edges(section_below)).reshape(-1, 2)
    loose = np.where(ends & (inside_mm > 0.0), CUT, np.where(ends & (inside_mm > -width_mm), EXTEND, HELD))
    needs, outline = dict(zip(skins, loose.tolist(), strict=True)), index_edges(section)
    out, cut = list[Bead](), False  # cut: the bead that the next one would follow is left out
    for k, bead in enumerate(beads):
        points, (first, last) = bead.points, needs.get(k, (HELD, HELD))
        if first:
            points = _held(points, below, outline, width_mm, first)
        if last and len(points):
            turned = np.ascontiguousarray(points[::-1])
            held = _held(turned, below, outline, width_mm, last)
            points = points if held is turned else held[::-1]
        if points is not bead.points and length_mm(points) < width_mm:
            cut = cut or not bead.follows
            continue
        out.append(bead if points is bead.points and not cut else replace(bead, points=points, follows=bead.follows and not cut))
        cut = False
    return out


def cut_anchors(beads: Sequence[Bead], below: Sequence[Plastic | None]) -> list[Bead]:
    """The beads of a layer, whose lines of infill run along walls only as far as any of the layers below carries them. An end
    that lies on nothing for longer than an anchor is part of the pattern, and stays."""
    layers, out = [plastic for plastic in below if plastic is not None], list(beads)
    for k, bead in enumerate(beads):
        points, width_mm = bead.points, bead.width_mm
        for _ in range(2 if bead.anchor_mm > 0.0 and not bead.closed else 0):
            points = np.ascontiguousarray(points[::-1])
            ways = [_first_held(points, plastic, width_mm, bead.anchor_mm + width_mm) for plastic in layers]
            way = min((way for way in ways if way >= 0.0), default=0.0)
            points = _from(points, way - HOLD * width_mm) if way > width_mm else points
        if points is not bead.points and not np.array_equal(points, bead.points) and length_mm(points) >= width_mm:
            out[k] = replace(bead, points=points)
    return out


@kernel
def _first_held(points: Floats, plastic: Plastic, width_mm: float, most_mm: float) -> float:
    """The way along a stroke to the first place that has plastic under it; -1.0 where most_mm bring none."""
    lines, carries_mm = plastic
    farthest_mm = carries_mm.max()
    since = way = 0.0
    for k in range(len(points) - 1):
        x, y = points[k, 0], points[k, 1]
        dx, dy = points[k + 1, 0] - x, points[k + 1, 1] - y
        length = np.hypot(dx, dy)
        while way <= min(since + length, most_mm):
            share = (way - since) / length if length > 0.0 else 0.0
            px, py = x + share * dx, y + share * dy
            nx, ny, which = nearest(lines, px, py, farthest_mm)
            if which >= 0 and np.hypot(nx - px, ny - py) <= carries_mm[which]:
                return way
            way += STEP * width_mm
        since += length
        if since > most_mm:
            break
    return -1.0


def _held(points: Floats, plastic: Plastic, outline: EdgeIndex, width_mm: float, need: int) -> Floats:
    """A stroke (n, 2) that begins on plastic; no points where it may be cut and has no plastic below. need: EXTEND or CUT."""
    along = points[0] - points[1]
    onward = along * (ONWARD * width_mm / max(float(np.hypot(*along)), 1e-9))
    way = _first_held(np.stack([points[0], points[0] + onward]), plastic, width_mm, ONWARD * width_mm)
    if way >= 0.0:
        end = points[0] + onward * ((way / width_mm + HOLD) / ONWARD)
        if depths(end[None], outline)[0] > 0.5 * width_mm:
            return np.concatenate([end[None], points[1:]])
    if need == EXTEND:
        return points
    way = _first_held(points, plastic, width_mm, np.inf) - HOLD * width_mm
    return _from(points, way) if way >= 0.0 else points[:0]


def _from(points: Floats, way: float) -> Floats:
    """A stroke from a place on the way along it."""
    lengths = np.hypot(*np.diff(points, axis=0).T)
    begins = np.cumsum(lengths) - lengths
    k = int(np.searchsorted(begins, way, side="right")) - 1
    begin = points[k] + (points[k + 1] - points[k]) * ((way - begins[k]) / lengths[k])
    return np.concatenate([begin[None], points[k + 1 :]])
