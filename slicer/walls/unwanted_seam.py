"""Unwanted seam: where on the walls of each layer a person wants none to begin, as segments for the placement of seams."""

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Indices, Mesh
from mdp.overhang import Mask
from mdp.zone import Zone, touched


def unwanted_segments(part: Part, cuts_mm: Floats) -> list[Floats]:
    """(k, 6) for each layer segments of the part's frame at its middle, one of cuts_mm: what that cuts of the faces that the
    part's zones name, and of all faces within their boxes."""
    mesh, marked = part.in_part_frame(), part.no_seam
    nobody = np.zeros(len(mesh.faces), dtype=np.bool_)
    found = [_chords(mesh, nobody if marked.faces is None else marked.faces, cuts_mm)]
    for box in marked.boxes:
        segments, layer = _chords(mesh, touched(part.mesh, [box]), cuts_mm)
        low, high = _within((segments + np.array([0.0, 0.0, part.base.offset_mm])) @ part.rotation, box)
        inside = low < high
        start, along = segments[inside, 0], segments[inside, 1] - segments[inside, 0]
        ends = start[:, None] + np.stack([low[inside], high[inside]], axis=1)[..., None] * along[:, None]
        found.append((ends, layer[inside]))
    segments, layer = (np.concatenate(each) for each in zip(*found, strict=True))
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
        one, other = (np.array(box.min_mm) - start) / along, (np.array(box.max_mm) - start) / along
    outside = (along == 0.0) & ((start < box.min_mm) | (start > box.max_mm))
    enters = np.where(along == 0.0, -np.inf, np.minimum(one, other))
    leaves = np.where(along == 0.0, np.inf, np.maximum(one, other))
    low, high = enters.max(axis=1).clip(0.0, 1.0), leaves.min(axis=1).clip(0.0, 1.0)
    return low, np.where(outside.any(axis=1), low, high)
