"""Beneath: which faces have, along a direction, nothing of the solid beneath them, only air (a numba kernel).

Support leans, so a few directions spread evenly stand for those between them. For each a grid of cells across it keeps the lowest
surface that looks up; a face is over air where none in its cell lies lower than itself.
"""

from math import pi, sqrt

import numpy as np

from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import kernel, part
from mdp.mesh import Floats
from mdp.support_need.linked_faces import LinkedFaces
from mdp.support_need.patches import Classes, frame_across

COUNT = 37  # directions over the half sphere, some 24 degrees apart
CELLS = 96  # of a grid along its longer side
LEAST_COSINE = 0.05  # of a surface that looks up and the direction


def coarse_directions() -> Floats:
    """(COUNT, 3) unit directions over the upper half sphere (a Fibonacci lattice)."""
    index = np.arange(COUNT) + 0.5
    z, angle = 1.0 - index / COUNT, index * pi * (3.0 - sqrt(5.0))
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)


@kernel
def find_over_air(begin_row: int, end_row: int, surface: LinkedFaces, directions: Floats, out: Classes) -> None:
    """For each of (k, 3) directions which faces (k, m) are over air for the most part, 0 or 1."""
    vertices, faces, normals = surface.vertices, surface.faces, surface.normals
    seen = table(vertices.shape[1], 3)
    for row in range(begin_row, end_row):
        d = directions[row]
        cell = _see(vertices, d, seen)
        lowest = floats((CELLS + 2) * (CELLS + 2), np.inf)
        for f in range(len(faces)):
            if normals[0, f] * d[0] + normals[1, f] * d[1] + normals[2, f] * d[2] > LEAST_COSINE:
                _lay(seen, faces[f, 0], faces[f, 1], faces[f, 2], lowest)
        for f in range(len(faces)):
            airy = 0
            for k in range(4):
                x, y, z = 0.0, 0.0, 0.0
                for corner in range(3):
                    share = (1.0 if k == 3 else (2.0 if k == corner else 0.5)) / 3.0
                    v = faces[f, corner]
                    x, y, z = x + share * seen[v, 0], y + share * seen[v, 1], z + share * seen[v, 2]
                airy += int(lowest[int(y) * (CELLS + 2) + int(x)] > z - 1e-3 * cell)
            out[row, f] = int(airy > 2)


@part
def _see(vertices: Floats, d: Floats, seen: Floats) -> float:
    """Fill the places of the vertices in cells across the direction and their heights in mm; the size of a cell, mm."""
    frame = frame_across(d)
    low, high = floats(2, np.inf), floats(2, -np.inf)
    for v in range(len(seen)):
        x, y, z = vertices[0, v], vertices[1, v], vertices[2, v]
        seen[v, 2] = x * d[0] + y * d[1] + z * d[2]
        for axis in range(2):
            seen[v, axis] = x * frame[axis, 0] + y * frame[axis, 1] + z * frame[axis, 2]
            low[axis], high[axis] = min(low[axis], seen[v, axis]), max(high[axis], seen[v, axis])
    cell: float = max(high[0] - low[0], high[1] - low[1]) / CELLS
    for v in range(len(seen)):
        for axis in range(2):
            seen[v, axis] = (seen[v, axis] - low[axis]) / cell + 1.0 - 1e-9
    return cell


@part
def _lay(seen: Floats, a: int, b: int, c: int, lowest: Floats) -> None:
    """Lay a triangle, wider by half a cell, into the grid of lowest surfaces."""
    ax, ay, bx, by, cx, cy = seen[a, 0], seen[a, 1], seen[b, 0], seen[b, 1], seen[c, 0], seen[c, 1]
    twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    least, most = min(seen[a, 2], seen[b, 2], seen[c, 2]), max(seen[a, 2], seen[b, 2], seen[c, 2])
    if twice <= 0.0:
        return
    slack_a = 0.5 * (abs(cx - bx) + abs(cy - by))
    slack_b = 0.5 * (abs(ax - cx) + abs(ay - cy))
    slack_c = 0.5 * (abs(bx - ax) + abs(by - ay))
    for j in range(int(min(ay, by, cy)), int(max(ay, by, cy)) + 1):
        for i in range(int(min(ax, bx, cx)), int(max(ax, bx, cx)) + 1):
            x, y = i + 0.5, j + 0.5
            p = (cx - bx) * (y - by) - (cy - by) * (x - bx)
            q = (ax - cx) * (y - cy) - (ay - cy) * (x - cx)
            r = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
            if p >= -slack_a and q >= -slack_b and r >= -slack_c:
                height = (p * seen[a, 2] + q * seen[b, 2] + r * seen[c, 2]) / twice
                k = j * (CELLS + 2) + i
                lowest[k] = min(lowest[k], max(least, min(most, height)))
