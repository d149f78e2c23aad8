"""Painted: how much of a triangle is painted with what, where slicers save that a brush covers it in part.

Hexadecimal digits, read from the last, walk a tree of triangles. A digit's lower two bits tell how many sides are halved. Where
none is, its upper two bits are the paint, and 3 there adds 3 to the next digit. Children follow, the last one first (PrusaSlicer,
src/libslic3r/TriangleSelector.cpp, Model.cpp: FacetsAnnotation).
"""

from collections.abc import Mapping
from functools import lru_cache

FOR, AGAINST = 1, 2  # paints; 0: none
CHILDREN = ((), (0.5, 0.5), (0.25, 0.25, 0.5), (0.25, 0.25, 0.25, 0.25))  # shares of the area, by how many sides are halved
LONG = 3  # as a paint: the next digit tells which


@lru_cache(maxsize=4096)  # most triangles are painted whole
def painted_shares(digits: str) -> Mapping[int, float]:
    """The share of a triangle's area by its paint. Raises ValueError for digits that are no such tree."""
    shares, pending, codes = dict[int, float](), [1.0], [int(digit, 16) for digit in digits]
    while pending:
        share, code = pending.pop(), _next(codes)
        sides, paint = code & 3, code >> 2
        if sides:
            pending += [share * part for part in CHILDREN[sides]]
        else:
            paint = LONG + _next(codes) if paint == LONG else paint
            shares[paint] = shares.get(paint, 0.0) + share
    if codes:
        raise ValueError(f"{len(codes)} of the digits belong to nothing")
    return shares


def _next(codes: list[int]) -> int:
    """The last of the digits that are left."""
    if not codes:
        raise ValueError("digits are missing")
    return codes.pop()
