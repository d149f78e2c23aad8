"""Neck: the plane of locally minimal rim length near a given plane.

Towards the end of a model rims shrink to nothing as well, but that is not a neck. At a neck the rim grows on both sides of the
plane, and for every tilt.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from math import atan2, ceil, cos, pi, radians, sin

import numpy as np

from mdp.directions.unit_vectors import frame_across
from mdp.mesh import Floats, Ints, Mesh
from mdp.plane import Plane
from mdp.sweep.crossing import sum_chords
from mdp.sweep.sweep import Remainder, gains

REACH_SHARE, REACH_DEG = 0.15, 25.0  # search range for necks: share of the diagonal of the mesh, and tilt
RISE = 0.02  # share by which a rim must grow on either side
OFFSETS, RINGS = 48, 3  # planes along each direction and rings of directions around the first, in the initial scan
MOST_TRIED, APART = 3, 0.3  # necks of the initial scan that are refined, and their least distance as a share of the reach
LEAST_MM, LEAST_DEG = 0.005, 0.02  # resolution; finer differences do not matter
MOST_STEPS, LEAST_GAIN = 60, 1e-6  # steps of the refinement, and least relative reduction of the rim for a step
NOTHING_RISKY = -2.0  # below the cosine of any face
NEAR_MM = 1e-6  # corners nearer to a plane count as above it; otherwise rims along edges would be lost


@dataclass(frozen=True, eq=False)
class _Surface:
    """Vertices, and the faces near a plane on which a rim counts, with their normals and areas."""

    vertices: Floats
    faces: Ints
    normals: Floats
    areas_mm2: Floats

    def rim_mm(self, plane: Plane) -> float:
        """Visible length of a plane's rim, mm."""
        faces = self.faces, self.normals, self.areas_mm2, self.areas_mm2  # any positive weights: only the length is used
        return float(sum_chords(faces, self._heights_mm(plane), plane.normal, 0.0).length_mm)

    def _heights_mm(self, plane: Plane) -> Floats:
        heights: Floats = plane.heights_mm(self.vertices)
        heights[np.abs(heights) < NEAR_MM] = NEAR_MM
        return heights

    def centre_mm(self, plane: Plane) -> Floats:
        """(3,) centre of a plane's rim, mm."""
        a, b, c = (self._heights_mm(plane) > 0.0)[self.faces.T]
        near = self.vertices[self.faces[(a != b) | (b != c)]].reshape(-1, 3)
        middle = 0.5 * (near.min(axis=0) + near.max(axis=0))
        centre: Floats = middle - plane.heights_mm(middle[None])[0] * plane.normal
        return centre


def find_neck(mesh: Mesh, seen: Floats, plane: Plane, reach_mm: float) -> Plane | None:
    """The plane of the shortest rim among the necks near a plane; None if there is none, or if the plane misses the mesh.

    seen: (m,) positive for faces on which a rim counts. The centre of the neck's rim is at most reach_mm from the plane and its
    normal at most REACH_DEG from the plane's.
    """
    heights = plane.heights_mm(mesh.vertices)
    if heights.max() <= 0.0 or heights.min() >= 0.0:
        return None
    surface = _surface_near(mesh, seen, heights, reach_mm)
    if surface.rim_mm(plane) <= 0.0:
        return None
    centre = surface.centre_mm(plane)
    shorter = sorted(_coarse_scan(mesh, seen, plane.normal, centre, reach_mm), key=lambda pair: pair[0])
    begins = _distinct(surface, [begin for _, begin in shorter], APART * reach_mm)
    necks = [_refine(surface, begin, 2.0 * reach_mm / OFFSETS) for begin in begins]
    allowed = [neck for neck in necks if _is_neck(surface, neck, plane, reach_mm)]
    return min(allowed, key=surface.rim_mm, default=None)


def _surface_near(mesh: Mesh, seen: Floats, heights: Floats, reach_mm: float) -> _Surface:
    """The part of a mesh that any plane of the search can meet, without faces far above and below."""
    wide_mm = float(np.linalg.norm(mesh.bounds_mm[1] - mesh.bounds_mm[0]))
    far_mm = 2.0 * reach_mm + wide_mm * sin(radians(REACH_DEG))
    around = heights[mesh.faces]
    kept = (around.min(axis=1) <= far_mm) & (around.max(axis=1) >= -far_mm) & (seen > 0.0)
    faces = mesh.faces[kept]
    faces.setflags(write=False)  # read-only like the mesh's own, so the kernel for rims is compiled once for both
    return _Surface(mesh.vertices, faces, mesh.normals[kept], mesh.areas_mm2[kept])


def _coarse_scan(mesh: Mesh, seen: Floats, normal: Floats, centre: Floats, reach_mm: float) -> Iterator[tuple[float, Plane]]:
    """Planes with a locally minimal rim along their normal, and its length, from a sweep along each direction."""
    step_mm, directions = 2.0 * reach_mm / OFFSETS, np.vstack([normal, *map(partial(_ring, normal), range(1, RINGS + 1))])
    remainder = Remainder(mesh, np.zeros(len(mesh.faces), dtype=np.bool_), np.where(seen > 0.0, 1.0, 0.0))
    swept = gains(remainder, directions, step_mm, NOTHING_RISKY)
    all_offsets_mm = swept.offsets_mm(step_mm)
    for row, direction in enumerate(directions):
        offsets_mm, rims = (values[row, : swept.columns[row]] for values in (all_offsets_mm, swept.rim_mm))
        near = np.abs(offsets_mm - direction @ centre) <= reach_mm
        before, here, after = rims[:-2], rims[1:-1], rims[2:]
        low = near[1:-1] & (here > 0.0) & (here <= np.minimum(before, after)) & (here < np.maximum(before, after))
        for k in np.flatnonzero(low) + 1:
            yield float(rims[k]), Plane(direction, float(offsets_mm[k]))


def _distinct(surface: _Surface, planes: list[Plane], apart_mm: float) -> list[Plane]:
    """The first planes whose rims have centres at least that far apart, since neighbouring directions find the same neck."""
    taken: list[tuple[Floats, Plane]] = []
    for plane in planes:
        centre = surface.centre_mm(plane)
        if all(float(np.linalg.norm(centre - middle)) > apart_mm for middle, _ in taken):
            taken.append((centre, plane))
        if len(taken) == MOST_TRIED:
            break
    return [plane for _, plane in taken]


def _ring(normal: Floats, number: int) -> Floats:
    """(k, 3) directions in a ring around a normal; the last ring is at the edge of the range."""
    return _leaning(normal, radians(REACH_DEG * number / RINGS), pi * np.arange(6 * number) / (3 * number))


def _leaning(normal: Floats, tilt_rad: float, turns_rad: Floats) -> Floats:
    """(k, 3) directions that lean from a normal by an angle, each to one of (k,) sides, radians."""
    aside, across = frame_across(normal)
    sides = np.cos(turns_rad)[:, None] * aside + np.sin(turns_rad)[:, None] * across
    leaning: Floats = cos(tilt_rad) * normal + sin(tilt_rad) * sides
    return leaning


def _refine(surface: _Surface, plane: Plane, step_mm: float) -> Plane:
    """Pattern search for a shorter rim: shift the plane, or tilt it about the centre of its rim, with shrinking steps.

    A plane that keeps moving is on its way to an end of the model: it is returned as it is, and is not a neck.
    """
    least, step_deg = surface.rim_mm(plane), REACH_DEG / RINGS
    for _ in range(MOST_STEPS):
        planes = _around(surface, plane, step_mm, step_deg)
        tried = [(rim, near) for near in planes if (rim := surface.rim_mm(near)) > 0.0]
        rim, best = min(tried, key=lambda pair: pair[0], default=(least, plane))
        if rim < (1.0 - LEAST_GAIN) * least:
            least, plane = rim, best
        elif step_mm <= LEAST_MM and step_deg <= LEAST_DEG:
            break
        else:
            step_mm, step_deg = 0.5 * step_mm, 0.5 * step_deg
    return plane


def _around(surface: _Surface, plane: Plane, step_mm: float, step_deg: float) -> Iterator[Plane]:
    """The planes one step away."""
    yield Plane(plane.normal, plane.offset_mm + step_mm)
    yield Plane(plane.normal, plane.offset_mm - step_mm)
    normals = _leaning(plane.normal, radians(step_deg), pi * (np.arange(8) - 2) / 4)
    for normal, offset_mm in zip(normals, normals @ surface.centre_mm(plane), strict=True):
        yield Plane(normal, float(offset_mm))


def _is_neck(surface: _Surface, neck: Plane, plane: Plane, reach_mm: float) -> bool:
    """Whether a plane lies within reach and its rim grows on both sides before it shrinks again."""
    tilt_deg = np.degrees(atan2(float(np.linalg.norm(np.cross(neck.normal, plane.normal))), float(neck.normal @ plane.normal)))
    away_mm = abs(float(plane.heights_mm(surface.centre_mm(neck)[None])[0]))
    if tilt_deg > REACH_DEG - LEAST_DEG or away_mm > reach_mm:
        return False
    least, step_mm = surface.rim_mm(neck), 2.0 * reach_mm / OFFSETS
    return all(_rim_grows(surface, neck, side * step_mm, least) for side in (-1.0, 1.0))


def _rim_grows(surface: _Surface, neck: Plane, step_mm: float, least: float) -> bool:
    """Whether the rim grows by RISE within the reach on one side before it becomes shorter than the neck's."""
    for k in range(1, ceil(OFFSETS / 2) + 1):
        rim = surface.rim_mm(Plane(neck.normal, neck.offset_mm + k * step_mm))
        if rim < least * (1.0 - 1e-9):
            return False
        if rim >= (1.0 + RISE) * least:
            return True
    return False
