"""Zones: what a person marked on a part, in its layers: where none of its walls begins, and where no support is."""

import numpy as np

from mdp.cut import convex_hull
from mdp.decomposition import Part
from mdp.mesh import Floats, Indices, Mesh
from mdp.overhang import Mask
from mdp.topology.cross_section import cross_sections
from mdp.zone import Zone, touched
from slicer.geometry.polygons import Polygons, offset, union
from slicer.overhangs import RIM_MM, faces_by_layer


def no_support_areas(part: Part, mesh: Mesh, cuts_mm: Floats) -> list[Polygons]:
    """For each layer the sections of the boxes and the shadows of the faces, as they belong to it, that get no support; [] for a
    part that may have some everywhere.

    mesh: the part's, in its frame; cuts_mm: the middles of the layers.
    """
    marked = part.no_support
    if not marked.anywhere:
        return []
    named = {} if marked.faces is None else faces_by_layer(mesh, cuts_mm, marked.faces & (mesh.normals[:, 2] != 0.0))
    boxes = [convex_hull(box.corners @ part.rotation.T - (0.0, 0.0, part.base.offset_mm)) for box in marked.boxes]
    sections = [cross_sections(box, cuts_mm) for box in boxes]
    layers = []
    for k in range(len(cuts_mm)):
        pieces = [Polygons(loops[k]) for loops in sections]
        if k in named:
            pieces.append(offset(Polygons([_upward(face) for face in named[k]]), RIM_MM))
        layers.append(union(pieces))
    return layers


def _upward(face: Floats) -> Floats:
    """The shadow (3, 2) of a face, counter-clockwise."""
    (ax, ay), (bx, by) = face[1] - face[0], face[2] - face[0]
    return face if ax * by - ay * bx > 0.0 else face[::-1]


def no_seam_segments(part: Part, mesh: Mesh, cuts_mm: Floats) -> list[Floats]:
    """(k, 6) for each layer segments of the part's frame at its middle, one of cuts_mm: what that cuts of the faces that the
    part's zones name, and of all faces within their boxes. mesh: the part's, in its frame."""
    marked = part.no_seam
    chords = [_chords(mesh, np.zeros(len(mesh.faces), dtype=np.bool_) if marked.faces is None else marked.faces, cuts_mm)]
    for box in marked.boxes:
        segments, layer = _chords(mesh, touched(part.mesh, [box]), cuts_mm)
        low, high = _within((segments + np.array([0.0, 0.0, part.base.offset_mm])) @ part.rotation, box)
        inside = low < high
        start, along = segments[inside, 0], segments[inside, 1] - segments[inside, 0]
        ends = start[:, None] + np.stack([low[inside], high[inside]], axis=1)[..., None] * along[:, None]
        chords.append((ends, layer[inside]))
    segments, layer = (np.concatenate(columns) for columns in zip(*chords, strict=True))
    order = np.argsort(layer, kind="stable")
    first = np.searchsorted(layer[order], np.arange(1, len(cuts_mm)))
    return np.split(segments[order].reshape(-1, 6), first)


def _chords(mesh: Mesh, chosen: Mask, cuts_mm: Floats) -> tuple[Floats, Indices]:
    """(k, 2, 3) what level planes cut of the chosen faces, and (k,) which plane each is of."""
    corners = mesh.vertices[mesh.faces[chosen]]
    heights = corners[:, :, 2]
    first, last = np.searchsorted(cuts_mm, heights.min(axis=1)), np.searchsorted(cuts_mm, heights.max(axis=1))
    counts = last - first
    face = np.repeat(np.arange(len(corners)), counts)
    layer = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(first, counts)
    around = corners[face]
    above = around[:, :, 2] - cuts_mm[layer][:, None]
    after, beyond = np.roll(around, -1, axis=1), np.roll(above, -1, axis=1)
    crossed = (above > 0.0) != (beyond > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        places = around + (above / (above - beyond))[..., None] * (after - around)
    return places[crossed].reshape(-1, 2, 3), layer[crossed.any(axis=1)]


def _within(segments: Floats, box: Zone) -> tuple[Floats, Floats]:
    """Shares along (k, 2, 3) segments between which each lies in a box; the first is the greater where none of it does."""
    segments = box.along(segments)
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        first, last = (np.array(box.min_mm) - start) / along, (np.array(box.max_mm) - start) / along
    outside = (along == 0.0) & ((start < box.min_mm) | (start > box.max_mm))
    enters = np.where(along == 0.0, -np.inf, np.minimum(first, last))
    leaves = np.where(along == 0.0, np.inf, np.maximum(first, last))
    low, high = enters.max(axis=1).clip(0.0, 1.0), leaves.min(axis=1).clip(0.0, 1.0)
    return low, np.where(outside.any(axis=1), low, high)
