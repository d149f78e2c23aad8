"""Rough: what every layer of a part takes, roughly, from the sums over its mesh, and the layers that are looked at more closely.

A rough figure need not be right, only as much too high or low in a layer as in those next to it: what is really sliced of a few
layers corrects it.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.kernels.sorting import rank
from mdp.mesh import Floats, Indices, Ints, Mesh
from profiles.process import Process
from slicer.bead import spacing_mm
from slicer.fill.region import shell_layers
from slicer.heights import Heights
from slicer.paths import bead_area_mm2

LAYER_S = 0.3  # for the ways between strokes of even the smallest layer


@dataclass(frozen=True, eq=False)
class Rough:
    """(n,) seconds and mm3 of every layer of a part."""

    time_s: Floats
    mm3: Floats

    def __add__(self, other: "Rough") -> "Rough":
        return Rough(self.time_s + other.time_s, self.mm3 + other.mm3)


def rough_layers(mesh: Mesh, heights: Heights, process: Process, on_platform: bool) -> Rough:
    """What the layers of a mesh take without support."""
    (top, bottom), width, high = shell_layers(process), process.line_width_mm, heights.height_mm
    area, around, over, under = _measure(mesh.vertices, mesh.faces, heights.cut_mm)
    if not on_platform:
        under[0] = 0.0
    sums = np.concatenate([[0.0], np.cumsum(over)]), np.concatenate([[0.0], np.cumsum(under)])
    at = np.arange(len(area))
    bare = sums[0][np.minimum(at + top, len(at))] - sums[0][at] + sums[1][at + 1] - sums[1][np.maximum(at + 1 - bottom, 0)]
    spacing = spacing_mm(width, high)
    inside = np.maximum(area - process.walls * spacing * around, 0.0)
    skin = np.where(inside < process.solid_below_mm2, inside, inside * np.minimum(bare / np.maximum(area, 1e-9), 1.0))
    walls_mm = around * np.minimum(process.walls, 0.5 * area / np.maximum(spacing * around, 1e-9))
    skin_mm, sparse_mm = skin / spacing, (inside - skin) * process.infill_density / spacing
    wall_s = walls_mm / max(process.walls, 1) * (1.0 / process.outer_wall_speed_mm_s + (process.walls - 1) / process.inner_wall_speed_mm_s)
    laying_s = LAYER_S + wall_s + skin_mm / process.skin_speed_mm_s + sparse_mm / process.infill_speed_mm_s
    total_mm = walls_mm + skin_mm + sparse_mm
    least_s = np.minimum(process.least_layer_time_s, total_mm / process.least_speed_mm_s)
    return Rough(np.maximum(laying_s, least_s), 1e-6 + total_mm * bead_area_mm2(width, high))


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


def choose_layers(weight: Floats, first: int, samples: int) -> tuple[Indices, Indices]:
    """Layers that stand for runs of layers, and where each run begins: the first ones each for itself, the others for as much of
    the weight as each other."""
    count = len(weight)
    first = min(first, count)
    done = np.cumsum(weight[first:])
    cuts = np.searchsorted(done, done[-1] * np.arange(1, samples) / samples) + 1 if len(done) else np.zeros(0, np.int64)
    begins = np.unique(np.concatenate([np.arange(first), first + np.concatenate([[0], cuts])]))
    begins = begins[begins < count]
    whole = np.concatenate([[0.0], np.cumsum(weight)])
    middle = 0.5 * (whole[begins] + whole[np.append(begins[1:], count)])
    return np.minimum(np.searchsorted(whole, middle, side="right") - 1, np.append(begins[1:], count) - 1), begins
