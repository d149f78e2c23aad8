"""Rims: the length of the seam that a cut at each offset leaves, feather edges weighted (numba kernels of the sweep).

A face that a plane crosses gives its chord. The chord grows linearly with the offset up to the face's middle corner and falls
linearly beyond; its integral over the extent across the planes is the area times the sine of the angle between face and plane.
"""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, int_table, table
from mdp.kernels.kernel import inlined, part, vector_part
from mdp.mesh import Floats
from mdp.sweep.facets import Indices
from mdp.sweep.integrals import AHEAD, BLOCK, Block, OffsetGrid, cut_block, dot, find_ramps, sort_heights

COT_30 = 3.0**0.5


class Rims(NamedTuple):
    """What the rims of cuts need of a surface: corners (3, m), unit normals (3, m), areas (m,), how much a mm of rim counts on
    each face (m,), and by how much more on a feather edge."""

    corners: Indices
    normals: Floats
    areas_mm2: Floats
    weights: Floats
    feather: float


@vector_part
def _weigh_rims(cosines: Floats, areas: Floats, weights: Floats, feather: float, out: Floats) -> None:
    """Twice the area times the sine of the angle between face and plane: the longest chord times the extent across the planes.

    A feather edge, where face and plane meet at less than 30 degrees, counts 1 + feather (cot angle - cot 30) times.
    """
    for k in range(len(out)):
        cosine = abs(cosines[k])
        sine = np.sqrt(max(1.0 - cosine * cosine, 0.0))
        out[k] = 2.0 * areas[k] * weights[k] * (sine + feather * max(cosine - COT_30 * sine, 0.0))


@inlined
def _chord(c: float, low: float, middle: float, high: float, rise: float, fall: float) -> float:
    """Length of a face's chord at an offset that it crosses, of its longest chord times its extent."""
    return (c - low) * rise if c < middle else (high - c) * fall


@vector_part
def _measure_chords(ahead: float, block: Block, length: Floats) -> None:
    """Weighted chord of each face at the column that lies `ahead` columns after its first."""
    low, middle, high, rise, fall, weight = block.low, block.middle, block.high, block.rise, block.fall, block.weight
    for k in range(len(low)):
        c = max(np.ceil(low[k]), 0.0) + ahead
        inside = weight[k] if c < high[k] else 0.0
        length[k] = inside * _chord(c, low[k], middle[k], high[k], rise[k], fall[k])


@vector_part
def _add_rims(block: Block, lengths: Floats, rim: Floats) -> None:
    low, middle, high, rise, fall, weight = block.low, block.middle, block.high, block.rise, block.fall, block.weight
    column, crossed = block.column, block.crossed
    for k in range(len(low)):
        b = np.uint32(column[k])
        rim[b] += lengths[0, k]
        rim[b + 1] += lengths[1, k]
        rim[b + 2] += lengths[2, k]
        for ahead in range(AHEAD, crossed[k]):
            rim[b + ahead] += weight[k] * _chord(float(b) + ahead, low[k], middle[k], high[k], rise[k], fall[k])


@part
def integrate_rim(surface: Rims, grid: OffsetGrid, rim: Floats) -> None:
    """Weighted length of the rim that a cut at each offset leaves on the surface, mm."""
    corners, normals, n = surface.corners, surface.normals, grid.columns
    sums, cosines = floats(n + AHEAD + 1, 0.0), floats(BLOCK, 0.0)
    values, lengths, places = table(6, BLOCK), table(AHEAD, BLOCK), int_table(2, BLOCK)
    for begin in range(0, corners.shape[1], BLOCK):
        end = min(begin + BLOCK, corners.shape[1])
        size = end - begin
        block = cut_block(values, places, size)
        sort_heights(corners[0, begin:end], corners[1, begin:end], corners[2, begin:end], grid.heights, block)
        dot(normals[0, begin:end], normals[1, begin:end], normals[2, begin:end], grid.direction, cosines[:size])
        _weigh_rims(cosines[:size], surface.areas_mm2[begin:end], surface.weights[begin:end], surface.feather, block.weight)
        find_ramps(block)
        for ahead in range(AHEAD):
            _measure_chords(float(ahead), block, lengths[ahead, :size])
        _add_rims(block, lengths, sums)
    for column in range(n):
        rim[column] = sums[column] / grid.step_mm
