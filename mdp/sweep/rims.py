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
from mdp.sweep.crossing import chord_at, share_above, slopes
from mdp.sweep.facets import Indices
from mdp.sweep.integrals import AHEAD, BLOCK, Block, OffsetGrid, cut_block, find_ramps, share_columns, sort_heights

COT_30 = 3.0**0.5
FEATHER_COSINE = cos(radians(20.0))  # of face and plane: the edge between them is so thin that it is reported
ROUNDING_MM = 1e-9  # a corner that a cut has made lies in its plane


class Rims(NamedTuple):
    """What the rims of cuts and the stairs need of a surface: corners (3, m), unit normals (3, m), areas (m,), how much a mm of
    rim counts on each face (m,), and by how much more on a feather edge; (m,) the area of each face as its steps count when they
    are as high as a layer, and its stairs printed straight up, mm2, both (0,): stairs do not count."""

    corners: Indices
    normals: Floats
    areas_mm2: Floats
    weights: Floats
    feather: float
    stair_areas_mm2: Floats
    stairs_up_mm2: Floats


class ScarsAbove(NamedTuple):
    """Where the scars of cuts at each offset of one direction go, (n,) each, see sweep.Gains."""

    rim: Floats
    stairs_up: Floats
    stairs: Floats


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
def _measure_chords(ahead: float, block: Block, length: Floats) -> None:
    """Weighted chord of each face at the column that lies `ahead` columns after its first."""
    low, middle, high, rise, fall, weight = block.low, block.middle, block.high, block.rise, block.fall, block.weight
    for k in range(len(low)):
        c = max(np.ceil(low[k]), 0.0) + ahead
        inside = weight[k] if c < high[k] else 0.0
        length[k] = inside * chord_at(c, low[k], middle[k], high[k], rise[k], fall[k])


@no_nrt
def _add_rims(block: Block, lengths: Floats, rim: Floats) -> None:
    low, middle, high, rise, fall, weight = block.low, block.middle, block.high, block.rise, block.fall, block.weight
    column, crossed = block.column, block.crossed
    for k in range(len(low)):
        b = np.uint32(column[k])
        rim[b] += lengths[0, k]
        rim[b + 1] += lengths[1, k]
        rim[b + 2] += lengths[2, k]
        for ahead in range(AHEAD, crossed[k]):
            rim[b + ahead] += weight[k] * chord_at(float(b) + ahead, low[k], middle[k], high[k], rise[k], fall[k])


@no_nrt
def _weigh_stairs(cosines: Floats, areas: Floats, out: Floats) -> None:
    for k in range(len(out)):
        out[k] = areas[k] * step_share(cosines[k])


@no_nrt
def _add_stairs(block: Block, shares: Floats, up: Floats, along: Floats, sums: Floats) -> None:
    """Add stairs printed straight up and along the direction: those of faces wholly above, and of the shares of those crossed."""
    low, middle, high, rise, fall = block.low, block.middle, block.high, block.rise, block.fall
    column, crossed = block.column, block.crossed
    for k in range(len(low)):
        b, p, q = np.uint32(column[k]), up[k], along[k]
        sums[b, 0] += p
        sums[b, 1] += q
        sums[b, 2] += p * shares[0, k]
        sums[b, 3] += q * shares[0, k]
        sums[b + 1, 2] += p * shares[1, k]
        sums[b + 1, 3] += q * shares[1, k]
        sums[b + 2, 2] += p * shares[2, k]
        sums[b + 2, 3] += q * shares[2, k]
        for ahead in range(AHEAD, crossed[k]):
            share = share_above(float(b) + ahead, low[k], middle[k], high[k], rise[k], fall[k])
            sums[b + ahead, 2] += p * share
            sums[b + ahead, 3] += q * share


@helper
def integrate_scars(surface: Rims, grid: OffsetGrid, out: ScarsAbove) -> None:
    """Weighted length of the rim that a cut at each offset leaves on the surface, mm, and the stairs above it, mm2."""
    corners, normals, n, counted = surface.corners, surface.normals, grid.columns, len(surface.stair_areas_mm2) > 0
    rims, stairs, cosines = floats(n + AHEAD + 1, 0.0), table(n + AHEAD + 1, 4), floats(BLOCK, 0.0)
    values, shares, places, along = table(6, BLOCK), table(AHEAD, BLOCK), int_table(2, BLOCK), floats(BLOCK, 0.0)
    for begin in range(0, corners.shape[1], BLOCK):
        end = min(begin + BLOCK, corners.shape[1])
        size = end - begin
        block = cut_block(values, places, size)
        sort_heights(corners[0, begin:end], corners[1, begin:end], corners[2, begin:end], grid.heights, block)
        dot(normals[0, begin:end], normals[1, begin:end], normals[2, begin:end], grid.direction, cosines[:size])
        _weigh_rims(cosines[:size], surface.areas_mm2[begin:end], surface.weights[begin:end], surface.feather, block.weight)
        find_ramps(block)
        for ahead in range(AHEAD):
            _measure_chords(float(ahead), block, shares[ahead, :size])
        _add_rims(block, shares, rims)
        if counted:
            _weigh_stairs(cosines[:size], surface.stair_areas_mm2[begin:end], along[:size])
            for ahead in range(AHEAD):
                share_columns(float(ahead), block, shares[ahead, :size])
            _add_stairs(block, shares, surface.stairs_up_mm2[begin:end], along, stairs)
    up_mm2, along_mm2 = 0.0, 0.0
    for column in range(n - 1, -1, -1):
        up_mm2 += stairs[column + 1, 0]
        along_mm2 += stairs[column + 1, 1]
        out.rim[column] = rims[column] / grid.step_mm
        out.stairs_up[column] = stairs[column, 2] + up_mm2
        out.stairs[column] = stairs[column, 3] + along_mm2


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
        low, high = min(p, q, r), max(p, q, r)
        if weights[f] <= 0.0 or low >= -ROUNDING_MM or high <= ROUNDING_MM:
            continue
        middle = max(min(p, q), min(max(p, q), r))
        chord = 2.0 * areas[f] * chord_at(0.0, low, middle, high, *slopes(low, middle, high))
        length += chord * weigh_chord(cosines[f], 0.0)
        weighted += chord * weights[f] * weigh_chord(cosines[f], feather)
        if abs(cosines[f]) > FEATHER_COSINE:
            feathered += chord * weigh_chord(cosines[f], 0.0)
    return Rim(length, weighted, feathered)
