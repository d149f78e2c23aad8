"""Hidden regions: how inconspicuous a seam is on each face of a model.

A seam in a crease or a neck looks like a part of the shape, and one in an occluded region is out of sight. Concavity comes from
the curvature tensor of Cohen-Steiner and Morvan (2003): over a neighbourhood every edge adds its dihedral angle times its length
along the edge, so single noisy edges cancel out. Occlusion comes from rays over the hemisphere, spread so that each stands for
the same share of the light.
"""

from typing import NamedTuple

import numpy as np

from mdp.cut import simplify
from mdp.directions.unit_vectors import spread_like_light
from mdp.kernels.arrays import floats, ints
from mdp.kernels.kernel import kernel, no_nrt
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats, Ints, Mesh
from mdp.sweep.rays import blocked_shares, faces_met, frames_about, triangle_tree
from mdp.topology.edges import opposites

NEIGHBOURHOOD = 0.03  # radius of a face's neighbourhood, as a share of the model's diagonal
FULL_BEND = 0.6  # inward bend over such a radius, in radians, that counts as fully hidden
RAYS = 12
REACH = 0.3  # length of a ray that meets nothing, as a share of the model's diagonal
OPEN = 0.1  # share of the rays that may be blocked at a face that still counts as open
MOST_NEIGHBOURS = 512  # faces of a neighbourhood; a finer mesh gets a smaller radius
LIFT = 1e-6  # distance of a ray's start above its face, as a share of the model's diagonal
FINE = 20_000  # faces; a finer mesh is measured on a simplified copy
COARSER = 1e-3  # deviation of that copy from the surface, as a share of the model's diagonal
WORTH = 0.7  # share of the faces; a copy with more saves too little
ALIKE = 0.5  # least cosine between the normals of a face and its counterpart on the copy


class Surroundings(NamedTuple):
    """Neighbourhood data of a surface: for each face its occlusion (m,), its centre (m, 3), its area (m,), and the faces across
    its edges (m, 3); for every edge its length times its dihedral angle, positive where concave, and its direction (m, 3, 3).
    """

    radius_mm: float
    occluded: Floats
    middles: Floats
    areas_mm2: Floats
    across: Ints
    bends: Floats
    directions: Floats


def hidden_shares(mesh: Mesh) -> Floats:
    """(m,) how hidden each face of a closed mesh in spatial order is: 0 in plain sight, 1 deep in a crease or fully occluded."""
    diagonal_mm = float(np.linalg.norm(mesh.bounds_mm[1] - mesh.bounds_mm[0]))
    copy = simplify(mesh, COARSER * diagonal_mm) if len(mesh.faces) > FINE else mesh
    if len(copy.faces) < WORTH * len(mesh.faces):
        return _looked_up(mesh, copy, COARSER * diagonal_mm)
    return _shares(mesh, diagonal_mm)


def _looked_up(mesh: Mesh, copy: Mesh, off_mm: float) -> Floats:
    """(m,) hidden shares of a mesh's faces, taken from the faces of a copy within off_mm above or below; 0 where there is
    none.
    """
    on_copy, middles, reach_mm = hidden_shares(copy), mesh.vertices[mesh.faces].mean(axis=1), 2.0 * off_mm
    rays = np.stack([middles - reach_mm * mesh.normals, mesh.normals], axis=1)
    found = faces_met(triangle_tree(copy), rays, 2.0 * reach_mm, ALIKE)
    return np.where(found >= 0, on_copy[found], 0.0)


def _shares(mesh: Mesh, diagonal_mm: float) -> Floats:
    """(m,) hidden shares of a mesh's faces, measured face by face."""
    places = mesh.vertices[mesh.faces].mean(axis=1) + LIFT * diagonal_mm * mesh.normals
    views = places, frames_about(mesh.normals)
    occluded = blocked_shares(triangle_tree(mesh), views, spread_like_light(RAYS), REACH * diagonal_mm)
    hidden = np.zeros(len(mesh.faces))
    in_threads(_hide, len(mesh.faces), _surroundings(mesh, NEIGHBOURHOOD * diagonal_mm, occluded), hidden)
    return hidden


def _surroundings(mesh: Mesh, radius_mm: float, occluded: Floats) -> Surroundings:
    corners = mesh.vertices[mesh.faces]
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.linalg.norm(edges, axis=2)
    directions = edges / np.where(lengths > 0.0, lengths, 1.0)[..., None]
    across, normals = opposites(mesh.faces).reshape(-1, 3) // 3, mesh.normals
    beyond = normals[across]
    sine = np.einsum("mki,mki->mk", np.cross(normals[:, None], beyond), directions)
    angles = np.arctan2(-sine, np.einsum("mi,mki->mk", normals, beyond))
    return Surroundings(radius_mm, occluded, corners.mean(axis=1), mesh.areas_mm2, across, angles * lengths, directions)


@kernel
def _hide(begin: int, end: int, surface: Surroundings, out: Floats) -> None:
    """Compute how hidden every face is from its neighbourhood."""
    radius = surface.radius_mm
    seen, near, tensor = ints(len(surface.areas_mm2), -1), ints(MOST_NEIGHBOURS, 0), floats(6, 0.0)
    for f in range(begin, end):
        count = _gather(surface, f, seen, near)
        area, dark = 0.0, 0.0
        for k in range(6):
            tensor[k] = 0.0
        for at in range(count):
            g = near[at]
            area += surface.areas_mm2[g]
            dark += surface.areas_mm2[g] * surface.occluded[g]
            for e in range(3):
                bend = 0.5 * surface.bends[g, e]  # both faces of an edge contribute
                p, q, r = surface.directions[g, e, 0], surface.directions[g, e, 1], surface.directions[g, e, 2]
                tensor[0] += bend * p * p
                tensor[1] += bend * q * q
                tensor[2] += bend * r * r
                tensor[3] += bend * p * q
                tensor[4] += bend * q * r
                tensor[5] += bend * r * p
        if area > 0.0:
            concave = min(1.0, max(0.0, _most_bend(tensor) / area) * radius / FULL_BEND)
            shade = min(1.0, max(0.0, dark / area - OPEN) / (1.0 - OPEN))
            out[f] = 1.0 - (1.0 - concave) * (1.0 - shade)


@no_nrt
def _gather(surface: Surroundings, face: int, seen: Ints, near: Ints) -> int:
    """Write the faces around a face into `near`, nearest rings first, while their centres lie within the radius; returns their
    number.
    """
    middles, radius = surface.middles, surface.radius_mm
    near[0], count, at = face, 1, 0
    seen[face] = face
    while at < count:
        for e in range(3):
            g = surface.across[near[at], e]
            if seen[g] == face or count == MOST_NEIGHBOURS:
                continue
            seen[g] = face
            x, y, z = middles[g, 0] - middles[face, 0], middles[g, 1] - middles[face, 1], middles[g, 2] - middles[face, 2]
            if x * x + y * y + z * z <= radius * radius:
                near[count] = g
                count += 1
        at += 1
    return count


@no_nrt
def _most_bend(tensor: Floats) -> float:
    """The largest eigenvalue of a symmetric tensor xx, yy, zz, xy, yz, zx (Smith 1961)."""
    xx, yy, zz, xy, yz, zx = tensor[0], tensor[1], tensor[2], tensor[3], tensor[4], tensor[5]
    mean = (xx + yy + zz) / 3.0
    off = xy * xy + yz * yz + zx * zx
    size = np.sqrt(((xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2.0 * off) / 6.0)
    if size <= 0.0:
        return float(mean)
    a, b, c = (xx - mean) / size, (yy - mean) / size, (zz - mean) / size
    d, e, f = xy / size, yz / size, zx / size
    half = 0.5 * (a * (b * c - e * e) - d * (d * c - e * f) + f * (d * e - b * f))
    return float(mean + 2.0 * size * np.cos(np.arccos(min(1.0, max(-1.0, half))) / 3.0))
