"""Rough: a rough length of lines for every layer of a part, from sums over its mesh, and the choice of the layers to slice.

A rough length may be wrong if it is wrong by the same factor in neighbouring layers: the layers that are sliced correct it.
"""

from math import sqrt

import numpy as np

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.kernels.sorting import rank
from mdp.mesh import Floats, Indices, Ints
from slicer.bead import spacing_mm
from slicer.heights import shell_layers
from slicer.modifiers import combined
from slicer.sectioning import Sections

TINY_MM2 = 1e-9


def rough_lengths_mm(sections: Sections) -> Floats:
    """(n, 3) walls, skin and sparse infill of every layer of a part."""
    mesh, process = sections.mesh, sections.process
    (top, bottom), width = shell_layers(process), process.line_width_mm
    area, around, over, under = _measure(mesh.vertices, mesh.faces, sections.heights.cut_mm)
    if not sections.on_platform:
        under[0] = 0.0
    seen, hung, at = np.append(0.0, np.cumsum(over)), np.append(0.0, np.cumsum(under)), np.arange(len(area))
    bare = seen[np.minimum(at + top, len(at))] - seen[at] + hung[at + 1] - hung[np.maximum(at + 1 - bottom, 0)]
    spacing = spacing_mm(width, process.layer_height_mm)
    walls, density = (_by_places(sections, key, float(getattr(process, key))) for key in ("walls", "infill_density"))
    inside = np.maximum(area - walls * spacing * around, 0.0)
    skin = np.where(inside < process.solid_below_mm2, inside, inside * np.minimum(bare / np.maximum(area, TINY_MM2), 1.0))
    return np.column_stack([(area - inside) / spacing, skin / spacing, (inside - skin) * density / spacing])


def _by_places(sections: Sections, key: str, usual: float) -> Floats:
    """(n,) the mean over every layer of a value of the process that some places may have otherwise."""
    values = np.full(len(sections.own), usual)
    for place in combined(sections.places, [key]):
        for layer, (area, section) in enumerate(zip(place.areas, sections.own, strict=True)):
            if not area.is_empty() and not section.is_empty():
                values[layer] += (section ^ area).area() / section.area() * (place.settings[key] - values[layer])
    return values


@kernel
def _measure(vertices: Floats, faces: Ints, cuts: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """(n,) area and outline of the sections, and the surface seen from above and from below that belongs to each layer."""
    n = len(cuts)
    area, around, over, under = floats(n, 0.0), floats(n, 0.0), floats(n, 0.0), floats(n, 0.0)
    ends = floats(4, 0.0)
    for f in range(len(faces)):
        z0, z1, z2 = vertices[faces[f, 0], 2], vertices[faces[f, 1], 2], vertices[faces[f, 2], 2]
        first, last = rank(cuts, min(z0, z1, z2), True), rank(cuts, max(z0, z1, z2), True) - 1
        ax, ay = vertices[faces[f, 1], 0] - vertices[faces[f, 0], 0], vertices[faces[f, 1], 1] - vertices[faces[f, 0], 1]
        bx, by = vertices[faces[f, 2], 0] - vertices[faces[f, 0], 0], vertices[faces[f, 2], 1] - vertices[faces[f, 0], 1]
        shadow = 0.5 * (ax * by - ay * bx)
        low, high = min(first, n - 1), max(min(last, n - 1), min(first, n - 1))
        for layer in range(low, high + 1):
            if shadow > 0.0:
                over[max(first - 1, 0) if last < first else layer] += shadow / (high - low + 1)
            else:
                under[layer] -= shadow / (high - low + 1)
        for layer in range(first, last + 1):
            z = cuts[layer]
            for k in range(3):
                tail, head = faces[f, k], faces[f, (k + 1) % 3]
                tz, hz = vertices[tail, 2], vertices[head, 2]
                if (tz < z) != (hz < z):
                    share = (z - hz) / (tz - hz)
                    at = 0 if hz < z else 2  # the outline comes over the edge that goes down and leaves over the one that goes up
                    ends[at] = vertices[head, 0] + share * (vertices[tail, 0] - vertices[head, 0])
                    ends[at + 1] = vertices[head, 1] + share * (vertices[tail, 1] - vertices[head, 1])
            area[layer] += 0.5 * (ends[0] * ends[3] - ends[1] * ends[2])
            around[layer] += sqrt((ends[2] - ends[0]) ** 2 + (ends[3] - ends[1]) ** 2)
    return area, around, over, under


def choose_layers(weight: Floats, samples: int) -> tuple[Indices, Indices]:
    """Layers that stand for runs of layers, and where each run begins: the first layer for itself, then runs of equal weight.

    The difference of a layer's weight from that of the next one counts, too, so that runs are short where weights vary and begin
    at large jumps. A run's samples are the two neighbours in its middle, whose lines have turned directions.
    """
    count = len(weight)
    done = np.cumsum(weight[1:] + np.abs(np.diff(weight[1:], append=weight[-1:])))
    cuts = np.searchsorted(done, done[-1] * np.arange(1, samples) / samples) + 2 if count > 1 else np.zeros(0, np.int64)
    begins = np.unique(np.concatenate([[0, 1], cuts]))
    begins = begins[begins < count]
    ends, whole = np.append(begins[1:], count), np.concatenate([[0.0], np.cumsum(weight)])
    middle = 0.5 * (whole[begins] + whole[ends])
    upper = np.minimum(np.searchsorted(whole, middle, side="right") - 1, ends - 1)
    return np.union1d(upper, np.maximum(upper - 1, begins)), begins
