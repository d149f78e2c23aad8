"""Crossing: what a plane leaves of a triangle above it, from the heights of the triangle's corners over the plane.

The share of the area above a plane at height c is quadratic in c on either side of the middle corner; its chord in the plane is
linear. A `Ramp` has the heights and the factors of a triangle on either side, which a sweep works out once for a direction.
"""

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Ints

THIRD = 1.0 / 3.0
Ramp = tuple[float, float, float, float, float]  # heights of the corners, lowest first, and the two factors


@no_nrt
def slopes(low: float, middle: float, high: float) -> tuple[float, float]:
    """The factors of a triangle's share below its middle corner and above it; 0 where that side of the triangle is flat."""
    extent = high - low
    lower, upper = (middle - low) * extent, (high - middle) * extent
    return 1.0 / lower if lower > 0.0 else 0.0, 1.0 / upper if upper > 0.0 else 0.0


@no_nrt
def ramp_of(p: float, q: float, r: float) -> Ramp:
    """The ramp of a triangle with corners at three heights."""
    low, middle, high = min(p, q, r), max(min(p, q), min(max(p, q), r)), max(p, q, r)
    rise, fall = slopes(low, middle, high)
    return low, middle, high, rise, fall


@no_nrt
def share_above(c: float, ramp: Ramp) -> float:
    """Share of a face above an offset that it crosses."""
    low, middle, high, rise, fall = ramp
    return 1.0 - (c - low) * (c - low) * rise if c < middle else (high - c) * (high - c) * fall


@no_nrt
def moment_above(c: float, ramp: Ramp) -> float:
    """First moment about an offset of the share of a face above it."""
    low, middle, high, rise, fall = ramp
    mean, up, down = (low + middle + high) * THIRD, c - low, high - c
    return mean - c + up * up * rise * up * THIRD if c < middle else down * down * fall * down * THIRD


@no_nrt
def chord_at(c: float, ramp: Ramp) -> float:
    """Length of a face's chord at an offset that it crosses, of its longest chord times its extent."""
    low, middle, high, rise, fall = ramp
    return (c - low) * rise if c < middle else (high - c) * fall


@kernel
def areas_above(faces: Ints, heights: Floats, areas_mm2: Floats) -> Floats:
    """(m,) the area above height 0 of each of a mesh's (m, 3) faces, whose vertices have (n,) heights."""
    above = floats(len(faces), 0.0)
    for f in range(len(faces)):
        ramp = ramp_of(heights[faces[f, 0]], heights[faces[f, 1]], heights[faces[f, 2]])
        if ramp[0] >= 0.0 and ramp[2] > 0.0:
            above[f] = areas_mm2[f]
        elif ramp[2] > 0.0:
            above[f] = areas_mm2[f] * share_above(0.0, ramp)
    return above
