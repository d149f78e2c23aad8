"""Ends: strokes of skin end on the plastic of the layer below.

Skins over sparse infill have grown to what holds them (slicer.fill.over_infill), but lines lie beside the rows by which they
grew, turns leave wedges along the border of a skin, and lines of infill end before it. Where nothing lies under the last width
of a stroke it goes on to plastic that is near, or else ends where there is some; one that meets none is left out.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.bead import Bead
from slicer.geometry.edge_index import EdgeIndex, index_edges, index_segments, lie_within, nearest
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import length_mm
from slicer.paths import SKINS

STEP = 0.125  # line widths between the places of a stroke under which plastic is looked for
CARRIES = 0.35  # line widths from the middle of a line that it carries the middle of what lies on it
ONWARD = 1.0  # line widths that a stroke may go on to plastic
HOLD = 0.5  # line widths that a stroke which ends on plastic reaches over it or beyond it


def hold_ends(beads: Sequence[Bead], below: Sequence[Bead], section_below: Polygons, width_mm: float) -> list[Bead]:
    """The beads of a layer; those of skin end on the plastic of the layer below wherever the model is there.

    below, section_below: the beads of the layer below, and the model's section there.
    """
    skins = [k for k, bead in enumerate(beads) if bead.kind in SKINS and not bead.closed]
    if not skins or not below:
        return list(beads)
    points = [bead.points for bead in below if len(bead.points) > 1]
    if not points:
        return list(beads)
    plastic = index_segments(np.concatenate([np.hstack([line[:-1], line[1:]]) for line in points]))
    lines = [line for k in skins for line in (beads[k].points, np.ascontiguousarray(beads[k].points[::-1]))]
    ends = np.array([_first_held(line, plastic, width_mm, width_mm) < 0.0 for line in lines]).reshape(-1, 2)
    if not ends.any():
        return list(beads)
    inside = index_edges(section_below)
    ends &= lie_within(inside, np.concatenate([beads[k].points[[0, -1]] for k in skins])).reshape(-1, 2)
    return _held_beads(beads, dict(zip(skins, ends.tolist(), strict=True)), plastic, width_mm)


def _held_beads(beads: Sequence[Bead], loose: dict[int, list[bool]], plastic: EdgeIndex, width_mm: float) -> list[Bead]:
    """The beads with their loose ends held; loose: by the number of a bead, whether its beginning and its end are."""
    out, cut = list[Bead](), False  # cut: the bead that the next one would follow is left out
    for k, bead in enumerate(beads):
        points = bead.points
        first, last = loose.get(k, (False, False))
        if first:
            points = _held(points, plastic, width_mm)
        if last and len(points):
            points = _held(np.ascontiguousarray(points[::-1]), plastic, width_mm)[::-1]
        if points is not bead.points and length_mm(points) < width_mm:
            cut = cut or not bead.follows
            continue
        out.append(bead if points is bead.points and not cut else replace(bead, points=points, follows=bead.follows and not cut))
        cut = False
    return out


@kernel
def _first_held(points: Floats, plastic: EdgeIndex, width_mm: float, most_mm: float) -> float:
    """The way along a stroke to the first place that has plastic under it; -1.0 where most_mm bring none."""
    since = way = 0.0
    for k in range(len(points) - 1):
        x, y = points[k, 0], points[k, 1]
        dx, dy = points[k + 1, 0] - x, points[k + 1, 1] - y
        length = np.hypot(dx, dy)
        while way <= min(since + length, most_mm):
            share = (way - since) / length if length > 0.0 else 0.0
            if nearest(plastic, x + share * dx, y + share * dy, CARRIES * width_mm)[2] >= 0:
                return way
            way += STEP * width_mm
        since += length
        if since > most_mm:
            break
    return -1.0


def _held(points: Floats, plastic: EdgeIndex, width_mm: float) -> Floats:
    """A stroke (n, 2) whose beginning is loose, begun on plastic; empty where there is none."""
    along = points[0] - points[1]
    onward = along * (ONWARD * width_mm / max(float(np.hypot(*along)), 1e-9))
    way = _first_held(np.stack([points[0], points[0] + onward]), plastic, width_mm, ONWARD * width_mm)
    if way >= 0.0:
        end = points[0] + onward * ((way / width_mm + HOLD) / ONWARD)
        return np.concatenate([end[None], points[1:]])
    way = _first_held(points, plastic, width_mm, np.inf) - HOLD * width_mm
    if way < 0.0:
        return points[:0]
    lengths = np.hypot(*np.diff(points, axis=0).T)
    begins = np.cumsum(lengths) - lengths
    k = int(np.searchsorted(begins, way, side="right")) - 1
    begin = points[k] + (points[k + 1] - points[k]) * ((way - begins[k]) / lengths[k])
    return np.concatenate([begin[None], points[k + 1 :]])
