"""Crossing: what a plane leaves of a triangle above it, from the heights of the triangle's corners over the plane.

The share of the area above a plane at height c is quadratic in c on either side of the middle corner; its chord in the plane is
linear. `rise` and `fall` are the two factors (see slopes), which a sweep works out once for all planes of a direction.
"""

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Ints

THIRD = 1.0 / 3.0


@no_nrt
def slopes(low: float, middle: float, high: float) -> tuple[float, float]:
    """The factors of a triangle's share below its middle corner and above it; 0 where that side of the triangle is flat."""
    extent = high - low
    lower, upper = (middle - low) * extent, (high - middle) * extent
    return 1.0 / lower if lower > 0.0 else 0.0, 1.0 / upper if upper > 0.0 else 0.0


@no_nrt
def share_above(c: float, low: float, middle: float, high: float, rise: float, fall: float) -> float:
    """Share of a face above an offset that it crosses."""
    return 1.0 - (c - low) * (c - low) * rise if c < middle else (high - c) * (high - c) * fall


@no_nrt
def moment_above(c: float, low: float, middle: float, high: float, rise: float, fall: float) -> float:
    """First moment about an offset of the share of a face above it."""
    mean, up, down = (low + middle + high) * THIRD, c - low, high - c
    return mean - c + up * up * rise * up * THIRD if c < middle else down * down * fall * down * THIRD


@no_nrt
def chord_at(c: float, low: float, middle: float, high: float, rise: float, fall: float) -> float:
    """Length of a face's chord at an offset that it crosses, of its longest chord times its extent."""
    return (c - low) * rise if c < middle else (high - c) * fall


@kernel
def areas_above(faces: Ints, heights: Floats, areas_mm2: Floats) -> Floats:
    """(m,) the area above height 0 of each of a mesh's (m, 3) faces, whose vertices have (n,) heights."""
    above = floats(len(faces), 0.0)
    for f in range(len(faces)):
        p, q, r = heights[faces[f, 0]], heights[faces[f, 1]], heights[faces[f, 2]]
        low, high = min(p, q, r), max(p, q, r)
        middle = max(min(p, q), min(max(p, q), r))
        if low >= 0.0 and high > 0.0:
            above[f] = areas_mm2[f]
        elif high > 0.0:
            above[f] = areas_mm2[f] * share_above(0.0, low, middle, high, *slopes(low, middle, high))
    return above
