"""Unwanted: where a person wants no support: nothing is held up on marked faces, and none stands on them or in marked boxes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats
from profiles.process import Process
from slicer.geometry.polygons import Polygons, offset, union
from slicer.heights import Heights
from slicer.support.overhang import RIM_MM, Overhang, faces_by_layer
from slicer.support.reachable import EVEN_MM

EDGES = tuple((a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b) in (1, 2, 4))  # of a box, by its corners


def without_unwanted(overhangs: Sequence[Overhang], part: Part, cuts_mm: Floats) -> list[Overhang]:
    """What hangs in each layer without what a person wants held up by nothing. cuts_mm: the middles of the layers."""
    if not part.no_support.anywhere:
        return list(overhangs)
    unwanted = _of_layers(part, cuts_mm)
    return [
        each if place.is_empty() or each.hanging.is_empty() else replace(each, hanging=each.hanging - place)
        for each, place in zip(overhangs, unwanted, strict=True)
    ]


def shut_areas(part: Part, heights: Heights, process: Process) -> list[Polygons]:
    """For each layer where no support may be: in the boxes, and over the faces as far as what would stand on them."""
    unwanted = _of_layers(part, heights.cut_mm)
    ground = np.searchsorted(heights.tip_mm, heights.bottom_mm - process.support_bottom_gap_mm + EVEN_MM, side="right")
    return [union(unwanted[max(near - 1, 0) : k + 1]) for k, near in enumerate(ground.tolist())]


def _of_layers(part: Part, cuts_mm: Floats) -> list[Polygons]:
    """For each layer the sections of the boxes and the shadows of the faces that belong to it."""
    marked, mesh = part.no_support, part.in_part_frame()
    named = {} if marked.faces is None else faces_by_layer(mesh, cuts_mm, marked.faces & (mesh.normals[:, 2] != 0.0))
    boxes = [box.corners @ part.rotation.T - (0.0, 0.0, part.base.offset_mm) for box in marked.boxes]
    layers = []
    for k, height_mm in enumerate(cuts_mm.tolist()):
        pieces = [_section(box, height_mm) for box in boxes]
        if k in named:
            pieces.append(offset(Polygons([_upward(face) for face in named[k]]), RIM_MM))
        layers.append(union(pieces))
    return layers


def _section(box: Floats, height_mm: float) -> Polygons:
    """What a level plane cuts of a box given by its (8, 3) corners."""
    found = []
    for a, b in EDGES:
        low, high = box[a, 2] - height_mm, box[b, 2] - height_mm
        if (low > 0.0) != (high > 0.0):
            found.append(box[a, :2] + low / (low - high) * (box[b, :2] - box[a, :2]))
    return Polygons() if len(found) < 3 else Polygons.hull_points(np.array(found))


def _upward(face: Floats) -> Floats:
    """The shadow (3, 2) of a face, counter-clockwise."""
    (ax, ay), (bx, by) = face[1] - face[0], face[2] - face[0]
    return face if ax * by - ay * bx > 0.0 else face[::-1]
