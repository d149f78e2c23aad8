"""Hopeless faces: those that no cut can save, because every direction along which they would carry themselves needs a plane that
lies too low.

A face is saved by a direction d along which it does not overhang, where a plane across d may lie below the face's middle. What a
search has lost for ever is at least their area: a lower bound that it knows before it cuts anything.
"""

from typing import NamedTuple

from mdp.kernels.kernel import kernel
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats
from mdp.overhang import Mask
from mdp.sweep.facets import FaceTable, Facets


class Savers(NamedTuple):
    """(k, 3) directions, (k,) offsets below which no plane across them may lie, and the cosine of normal and direction below
    which a face is risky."""

    directions: Floats
    least_offset_mm: Floats
    risky_below: float


def hopeless_faces(facets: Facets, savers: Savers) -> Mask:
    """(m,) the risky faces that no direction saves; an infinite least offset: the direction is out of reach."""
    lost: Mask = facets.faces.risky.copy()
    in_threads(_find_hopeless, len(lost), facets.faces, savers, lost)
    return lost


@kernel
def _find_hopeless(begin: int, end: int, faces: FaceTable, savers: Savers, lost: Mask) -> None:
    points, corners, normals = faces.points, faces.corners, faces.normals
    directions, count = savers.directions, len(savers.directions)
    last = 0  # neighbours are mostly saved by the same direction
    for f in range(begin, end):
        if not lost[f]:
            continue
        a, b, c = corners[0, f], corners[1, f], corners[2, f]
        x = (points[0, a] + points[0, b] + points[0, c]) / 3.0
        y = (points[1, a] + points[1, b] + points[1, c]) / 3.0
        z = (points[2, a] + points[2, b] + points[2, c]) / 3.0
        for number in range(count):
            row = (last + number) % count
            p, q, r = directions[row, 0], directions[row, 1], directions[row, 2]
            carried = normals[0, f] * p + normals[1, f] * q + normals[2, f] * r >= savers.risky_below
            if carried and x * p + y * q + z * r > savers.least_offset_mm[row]:
                lost[f] = False
                last = row
                break
