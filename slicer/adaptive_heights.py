"""Adaptive heights: how shallow the surface is at every height, and layers that follow it.

A layer of height h leaves steps of depth h |n_z| on a surface with normal n, measured across the surface (Dolenc and Makela
1994, cusp height). Level surfaces have no steps but a height of their own, where a layer should end.
"""

from dataclasses import dataclass

import numpy as np

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Ints, Mesh
from profiles.process import Process

BIN_SHARE = 0.125  # of the least layer height: slopes are known in bins of this height, each by its worst face
LEVEL = 0.9998  # cosine of one degree: flatter faces count as level
LEAST_LEVEL_MM2 = 1.0  # a smaller level face is no surface that a layer should end at
MOST_BINS = 2_000_000  # 16 MB; a part 300 mm high has 24,000 at a least layer height of 0.1 mm


@dataclass(frozen=True, eq=False)
class Slopes:
    """most_mm: (n,) highest layer that may touch each bin of bin_mm from the base plane up; levels_mm: rising heights."""

    most_mm: Floats
    bin_mm: float
    levels_mm: Floats


def _measure_slopes(mesh: Mesh, process: Process) -> Slopes:
    """What the surface of a mesh in its part frame allows: steps of at most adaptive_cusp_mm, between least and most height."""
    top = float(mesh.bounds_mm[1, 2])
    bin_mm = max(BIN_SHARE * process.least_layer_height_mm, top / MOST_BINS)
    leaning = np.abs(mesh.normals[:, 2])
    level = leaning > LEVEL
    steepest = _worst(mesh.vertices[:, 2], mesh.faces[~level], leaning[~level], bin_mm, int(top / bin_mm) + 1)
    allowed = process.adaptive_cusp_mm / np.maximum(steepest, 1e-9)
    heights_mm = np.round(mesh.vertices[mesh.faces[level, 0], 2], 6)
    levels, which = np.unique(heights_mm, return_inverse=True)
    areas = np.bincount(which, mesh.areas_mm2[level], len(levels))
    return Slopes(
        np.clip(allowed, process.least_layer_height_mm, process.most_layer_height_mm), bin_mm, levels[areas >= LEAST_LEVEL_MM2]
    )


@kernel
def _worst(z: Floats, faces: Ints, leaning: Floats, bin_mm: float, bins: int) -> Floats:
    """(bins,) greatest |n_z| of the faces that reach into each bin."""
    worst: Floats = floats(bins, 0.0)
    for f in range(len(faces)):
        a, b, c = z[faces[f, 0]], z[faces[f, 1]], z[faces[f, 2]]
        first = max(int(np.floor(min(a, b, c) / bin_mm)), 0)
        last = min(int(np.floor(max(a, b, c) / bin_mm)), bins - 1)
        for k in range(first, last + 1):
            worst[k] = max(worst[k], leaning[f])
    return worst


def adaptive_heights(mesh: Mesh, process: Process, from_mm: float, top_mm: float) -> list[float]:
    """Heights of layers from one height up towards another, each as high as the surface beside it allows; mesh: part frame.

    Layers end at level surfaces and at the top, none is lower than least_layer_height_mm or higher than most_layer_height_mm:
    where what is left under a level is less than two of the least, one layer takes all of it, or the level is passed over where
    that one would be too high. What is left so under the top is not taken.
    """
    slopes, least_mm = _measure_slopes(mesh, process), process.least_layer_height_mm
    stops = [level for level in slopes.levels_mm.tolist() if from_mm < level < top_mm - least_mm] + [top_mm]
    thick: list[float] = []
    z = from_mm
    for stop in stops:
        if stop - z < least_mm and stop < top_mm:
            continue
        while stop - z > 1e-9:
            height, left = _highest(slopes, z), stop - z
            if process.most_layer_height_mm + 1e-9 < left < 2.0 * least_mm:
                break
            if left <= height + 1e-9 or left < 2.0 * least_mm:
                height = left
            elif left < height + least_mm:
                height = 0.5 * left
            thick.append(height)
            z += height
    return thick


def _highest(slopes: Slopes, z_mm: float) -> float:
    """The highest layer from a height up that every bin it touches allows."""
    k = min(int(z_mm / slopes.bin_mm), len(slopes.most_mm) - 1)
    height = float(slopes.most_mm[k])
    while k + 1 < len(slopes.most_mm) and (k + 1) * slopes.bin_mm < z_mm + height:
        k += 1
        height = min(height, max(float(slopes.most_mm[k]), k * slopes.bin_mm - z_mm))
    return height
