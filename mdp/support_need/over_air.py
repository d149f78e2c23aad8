"""Overhangs over air: which faces have nothing of the solid beneath them along a direction (a numba kernel).

Support can be slanted, so a few evenly spread directions represent those between them. For each direction, a grid of cells across
it stores the lowest upward-facing surface; a point is over air if no surface in its cell lies below it. Flat regions are decided
as a whole, by samples on a raster, so that the result does not depend on their triangulation.
"""

import numpy as np

from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Ints
from mdp.support_need.patches import Classes
from mdp.topology.edges import LinkedFaces

CELLS = 96  # number of grid cells along its longer side
LEAST_COSINE = 0.05  # between an upward-facing surface and the direction
RASTER = 0.5  # cells between two samples of a flat region
ASIDE = 0.29  # offset of the samples within the raster's step, so that none lies on the edge of a cell
FEW_SAMPLES = 8.0  # fewest samples on a flat region; smaller regions are measured by area
MOST = 0.55  # share of a flat region over air above which the whole region counts; exactly half, up to rounding, is common
TINY = 1e-9  # twice the area of a face seen edge-on, in cells


# Rows of the figures of all flat regions (6, m): lowest and highest point, number of samples and of samples over air; for regions
# with few samples, the area, and the area over air by points of the faces.
LOW, HIGH, SAMPLED, UNOCCLUDED, AREA, UNOCCLUDED_AREA = range(6)


@kernel
def find_over_air(
    begin_row: int, end_row: int, flat: tuple[LinkedFaces, Ints], framed: tuple[Floats, Floats], out: Classes
) -> None:
    """For each direction, with the frame across it, set (k, m) to 1 for downward-facing faces over air, else 0. flat: a surface
    and its flat_places (m,); each region is decided as a whole.
    """
    (surface, places), (directions, frames) = flat, framed
    vertices, faces, normals = surface.vertices, surface.faces, surface.normals
    seen, count = table(vertices.shape[1], 3), len(faces)
    facing = floats(count, 0.0)
    for row in range(begin_row, end_row):
        d = directions[row]
        cell = _see(vertices, d, frames[row], seen)
        counts = table(6, count)
        _find_extents(seen, faces, places, counts)
        lowest = floats((CELLS + 2) * (CELLS + 2), np.inf)
        for f in range(count):
            facing[f] = normals[0, f] * d[0] + normals[1, f] * d[1] + normals[2, f] * d[2]
            if facing[f] > LEAST_COSINE:
                _lay(seen, faces[f], counts[LOW, places[f]], counts[HIGH, places[f]], lowest)
        for f in range(count):
            if facing[f] < 0.0:
                sampled, unoccluded = _sample(seen, faces[f], lowest, 1e-3 * cell)
                counts[SAMPLED, places[f]] += sampled
                counts[UNOCCLUDED, places[f]] += unoccluded
        for f in range(count):
            if facing[f] < 0.0 and counts[SAMPLED, places[f]] < FEW_SAMPLES:
                counts[AREA, places[f]] += surface.areas_mm2[f]
                counts[UNOCCLUDED_AREA, places[f]] += surface.areas_mm2[f] * _share_over_air(seen, faces[f], lowest, 1e-3 * cell)
        for f in range(count):
            p = places[f]
            part, of = (UNOCCLUDED_AREA, AREA) if counts[SAMPLED, p] < FEW_SAMPLES else (UNOCCLUDED, SAMPLED)
            out[row, f] = int(counts[part, p] > MOST * counts[of, p])


@no_nrt
def _find_extents(seen: Floats, faces: Ints, places: Ints, counts: Floats) -> None:
    """Fill the lowest and highest points of the flat regions."""
    for p in range(counts.shape[1]):
        counts[LOW, p], counts[HIGH, p] = np.inf, -np.inf
    for f in range(len(faces)):
        p = places[f]
        for corner in range(3):
            z = seen[faces[f, corner], 2]
            counts[LOW, p], counts[HIGH, p] = min(counts[LOW, p], z), max(counts[HIGH, p], z)


@no_nrt
def _is_unoccluded(lowest: Floats, x: float, y: float, z: float) -> bool:
    """Whether no upward-facing surface in the cell of a point lies below it."""
    return bool(lowest[int(y) * (CELLS + 2) + int(x)] > z)


@no_nrt
def _sample(seen: Floats, face: Ints, lowest: Floats, slack_mm: float) -> tuple[int, int]:
    """The number of raster samples on a face, and of those over air."""
    a, b, c, sampled, unoccluded = face[0], face[1], face[2], 0, 0
    ux, uy, uz = seen[b, 0] - seen[a, 0], seen[b, 1] - seen[a, 1], seen[b, 2] - seen[a, 2]
    vx, vy, vz = seen[c, 0] - seen[a, 0], seen[c, 1] - seen[a, 1], seen[c, 2] - seen[a, 2]
    twice = ux * vy - uy * vx
    if abs(twice) < TINY:
        return 0, 0
    slope_x, slope_y = (uz * vy - vz * uy) / twice, (vz * ux - uz * vx) / twice
    low, high = min(seen[a, 1], seen[b, 1], seen[c, 1]), max(seen[a, 1], seen[b, 1], seen[c, 1])
    for j in range(int(low / RASTER), int(high / RASTER) + 1):
        y, begin, end = (j + ASIDE) * RASTER, np.inf, -np.inf
        for k in range(3):
            p, q = face[k], face[(k + 1) % 3]
            if (seen[p, 1] < y) != (seen[q, 1] < y):
                x = seen[p, 0] + (y - seen[p, 1]) / (seen[q, 1] - seen[p, 1]) * (seen[q, 0] - seen[p, 0])
                begin, end = min(begin, x), max(end, x)
        if begin < end:
            for i in range(int(np.ceil(begin / RASTER - ASIDE)), int(np.ceil(end / RASTER - ASIDE))):
                x = (i + ASIDE) * RASTER
                z = seen[a, 2] + slope_x * (x - seen[a, 0]) + slope_y * (y - seen[a, 1])
                sampled += 1
                unoccluded += int(_is_unoccluded(lowest, x, y, z - slack_mm))
    return sampled, unoccluded


@no_nrt
def _share_over_air(seen: Floats, face: Ints, lowest: Floats, slack_mm: float) -> float:
    """Share of a small face over air, from its centre and points near its corners."""
    unoccluded = 0
    for k in range(4):
        x, y, z = 0.0, 0.0, 0.0
        for corner in range(3):
            share = (1.0 if k == 3 else (2.0 if k == corner else 0.5)) / 3.0
            v = face[corner]
            x, y, z = x + share * seen[v, 0], y + share * seen[v, 1], z + share * seen[v, 2]
        unoccluded += int(_is_unoccluded(lowest, x, y, z - slack_mm))
    return 0.25 * unoccluded


@helper
def _see(vertices: Floats, d: Floats, frame: Floats, seen: Floats) -> float:
    """Fill the positions of the vertices in cells across the direction and their heights, mm; returns the size of a cell, mm."""
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


@no_nrt
def _lay(seen: Floats, face: Ints, least: float, most: float, lowest: Floats) -> None:
    """Lower the grid of lowest surfaces by a face: in each cell that it touches, by the height of its plane at the cell's centre,
    within the extent of its flat region.
    """
    a, b, c = face[0], face[1], face[2]
    ax, ay, bx, by, cx, cy = seen[a, 0], seen[a, 1], seen[b, 0], seen[b, 1], seen[c, 0], seen[c, 1]
    twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if twice < TINY:
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
