"""Rims: the length of the seam that a cut at each offset leaves, feather edges weighted (numba kernels of the sweep). The stairs
above it are summed up in the same pass, for both look at every face of the surface.

A face that a plane crosses gives its chord. The chord grows linearly with the offset up to the face's middle corner and falls
linearly beyond; its integral over the extent across the planes is the area times the sine of the angle between face and plane.
"""

from math import cos, radians
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import dot, floats, int_table, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Ints
from mdp.stairs import step_share
from mdp.sweep.crossing import chord_at, ramp_of
from mdp.sweep.facets import Scars
from mdp.sweep.integrals import AHEAD, BLOCK, Block, OffsetGrid, add_areas, find_shares, lay_block, ramp_at

COT_30 = 3.0**0.5
FEATHER_COSINE = cos(radians(20.0))  # of face and plane: the edge between them is so thin that it is reported
ROUNDING_MM = 1e-9  # a corner that a cut has made lies in its plane


@no_nrt
def weigh_chord(cosine: float, feather: float) -> float:
    """How much a chord counts where a face's normal has that cosine with the plane's, times the sine of the angle between.

    A feather edge, where face and plane meet at less than 30 degrees, counts 1 + feather (cot angle - cot 30) times.
    """
    facing = abs(cosine)
    sine: float = np.sqrt(max(1.0 - facing * facing, 0.0))
    return sine + feather * max(facing - COT_30 * sine, 0.0)


@no_nrt
def _weigh_rims(cosines: Floats, areas: Floats, weights: Floats, feather: float, out: Floats) -> None:
    """Twice the area times the sine of the angle between face and plane: the longest chord times the extent across the planes;
    weighted."""
    for k in range(len(out)):
        out[k] = 2.0 * areas[k] * weights[k] * weigh_chord(cosines[k], feather)


@no_nrt
def _find_chords(block: Block, chords: Floats) -> None:
    """(AHEAD, k) chord of each face at the first columns that it crosses, 0 at those that it does not reach."""
    for ahead in range(AHEAD):
        for k in range(len(block.low)):
            c = max(np.ceil(block.low[k]), 0.0) + ahead
            chords[ahead, k] = chord_at(c, ramp_at(block, k)) if c < block.high[k] else 0.0


@no_nrt
def _add_rims(block: Block, chords: Floats, rim: Floats) -> None:
    weight = block.weight
    for k in range(len(weight)):
        b = np.uint32(block.column[k])
        rim[b] += weight[k] * chords[0, k]
        rim[b + 1] += weight[k] * chords[1, k]
        rim[b + 2] += weight[k] * chords[2, k]
        for ahead in range(AHEAD, block.crossed[k]):
            rim[b + ahead] += weight[k] * chord_at(float(b) + ahead, ramp_at(block, k))


@no_nrt
def _weigh_stairs(cosines: Floats, areas: Floats, weights: Floats, out: Floats) -> None:
    for k in range(len(out)):
        out[k] = areas[k] * weights[k] * step_share(cosines[k])


@helper
def integrate_scars(scars: Scars, grid: OffsetGrid, out: tuple[Floats, Floats, Floats]) -> None:
    """Weighted length of the rim that a cut at each offset leaves on the surface, mm, and the stairs above it printed straight up
    and along the direction, mm2."""
    faces, (rim, stairs_up, stairs_along), n = scars.faces, out, grid.columns
    corners, normals, areas, stair_weights = faces.corners, faces.normals, faces.areas_mm2, faces.stair_weights
    rims, stairs, cosines = floats(n + AHEAD + 1, 0.0), table(n + AHEAD + 1, 4), floats(BLOCK, 0.0)
    values, shares, places, kinds = table(6, BLOCK), table(AHEAD, BLOCK), int_table(2, BLOCK), int_table(2, BLOCK)
    for k in range(BLOCK):
        kinds[1, k] = 1
    for begin in range(0, corners.shape[1], BLOCK):
        end = min(begin + BLOCK, corners.shape[1])
        a, b, c, along = corners[0, begin:end], corners[1, begin:end], corners[2, begin:end], cosines[: end - begin]
        block = lay_block(values, places, (a, b, c), grid.heights)
        dot(normals[0, begin:end], normals[1, begin:end], normals[2, begin:end], grid.direction, along)
        _weigh_rims(along, areas[begin:end], faces.seam_weights[begin:end], scars.feather, block.weight)
        _find_chords(block, shares)
        _add_rims(block, shares, rims)
        if len(stair_weights) > 0:
            find_shares(block, shares)
            _weigh_stairs(normals[2, begin:end], areas[begin:end], stair_weights[begin:end], block.weight)
            add_areas(kinds[0], block, shares, stairs)
            _weigh_stairs(along, areas[begin:end], stair_weights[begin:end], block.weight)
            add_areas(kinds[1], block, shares, stairs)
    up_mm2, along_mm2 = 0.0, 0.0
    for column in range(n - 1, -1, -1):
        up_mm2 += stairs[column + 1, 0]
        along_mm2 += stairs[column + 1, 2]
        rim[column] = rims[column] / grid.step_mm
        stairs_up[column] = stairs[column, 1] + up_mm2
        stairs_along[column] = stairs[column, 3] + along_mm2


class Rim(NamedTuple):
    """The rim of one plane on faces that count: its length, that with their weights, and that of feather edges of less than 20
    degrees, mm."""

    length_mm: float
    weighted_mm: float
    feathered_mm: float

    @property
    def feather_share(self) -> float:
        """Share of the rim that is a feather edge; 0 where nothing of it is seen."""
        return self.feathered_mm / self.length_mm if self.length_mm > 0.0 else 0.0


NO_RIM = Rim(0.0, 0.0, 0.0)  # of what stands on the platform


@kernel
def measure_rim(faces: Ints, heights: Floats, cosines: Floats, areas: Floats, weights: Floats, feather: float) -> Rim:
    """The rim at height 0 of a mesh: vertices of its (m, 3) faces at (n,) heights; cosines (m,) of face and plane."""
    length, weighted, feathered = 0.0, 0.0, 0.0
    for f in range(len(faces)):
        p, q, r = heights[faces[f, 0]], heights[faces[f, 1]], heights[faces[f, 2]]
        if weights[f] <= 0.0 or min(p, q, r) >= -ROUNDING_MM or max(p, q, r) <= ROUNDING_MM:
            continue
        chord = 2.0 * areas[f] * chord_at(0.0, ramp_of(p, q, r))
        length += chord * weigh_chord(cosines[f], 0.0)
        weighted += chord * weights[f] * weigh_chord(cosines[f], feather)
        if abs(cosines[f]) > FEATHER_COSINE:
            feathered += chord * weigh_chord(cosines[f], 0.0)
    return Rim(length, weighted, feathered)
