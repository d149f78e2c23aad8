"""Shells: the closed pieces of a surface, turned outwards or kept as voids, and united where they overlap."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mdp.formats.surface import Surface, concatenate
from mdp.mesh import Floats, Indices, crosses_of
from mdp.repair.weld import drop_unused_vertices, merge_vertices
from mdp.repair.winding import pair_half_edges
from mdp.topology.components import connected_components
from mdp.topology.edges import edges_of
from profiles.errors import MeshError

if TYPE_CHECKING:
    import manifold3d as m3

NEGLIGIBLE = 1e-7  # share of the volume of all shells: 0.1 mm across beside a 20 mm cube
FLAT_SHEETS = "its faces lie in one plane or on each other; give it a thickness (Blender: Solidify)"
FLAT = 1e-9  # share of the cube of a shell's diagonal
MOST_BODIES = 2000  # each costs time in every step: 20 s of export for this number of cubes of 1 mm
GRID = 0.1  # share of the reach: grid for corners of bodies that are united, finer than the rounding of files
SAMPLES = 24  # vertices of a shell that must lie inside another for it to count as contained


@dataclass(frozen=True, eq=False)
class Shell:
    """One closed, consistently wound piece; faces index the vertices of the whole surface."""

    vertices: Floats
    faces: Indices
    volume: float
    low: Floats
    high: Floats

    def flip(self) -> "Shell":
        """The shell turned inside out."""
        return Shell(self.vertices, self.faces[:, ::-1], -self.volume, self.low, self.high)

    def contains(self, inner: "Shell") -> bool:
        """Whether another shell lies inside this one, judged by its box and a sample of its vertices."""
        if (inner.low < self.low).any() or (inner.high > self.high).any():
            return False
        corners = np.unique(inner.faces)
        sample = inner.vertices[corners[np.linspace(0, len(corners) - 1, SAMPLES).astype(np.int64)]]
        return all(abs(winding_number(p, self.vertices, self.faces)) > 0.5 for p in sample)


def winding_number(position: Floats, vertices: Floats, faces: Indices) -> float:
    """Winding number of the closed faces around a point.

    Sum of solid angles over 4 pi: A. van Oosterom, J. Strackee, The solid angle of a plane triangle (1983).
    """
    a, b, c = (vertices[faces[:, k]] - position for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    dots = la * lb * lc + np.einsum("ij,ij->i", a, b) * lc + np.einsum("ij,ij->i", b, c) * la + np.einsum("ij,ij->i", c, a) * lb
    return float(np.arctan2(np.einsum("ij,ij->i", a, np.cross(b, c)), dots).sum() / (2 * np.pi))


def shells_of(surface: Surface) -> list[Shell]:
    """The shells of a closed surface in the order of their first faces."""
    pairs = pair_half_edges(surface, edges_of(surface.faces)) // 3
    label = connected_components(len(surface.faces), pairs[:, 0], pairs[:, 1])
    middle = surface.vertices.mean(axis=0)
    signed = (
        np.einsum("ij,ij->i", surface.vertices[surface.faces[:, 0]] - middle, crosses_of(surface.vertices, surface.faces)) / 6.0
    )
    order = np.argsort(label, kind="stable")
    shells = []
    for numbers in np.split(order, np.flatnonzero(np.diff(label[order])) + 1):
        corners = surface.vertices[surface.faces[numbers].ravel()]
        low, high = corners.min(axis=0), corners.max(axis=0)
        shells.append(Shell(surface.vertices, surface.faces[numbers], float(signed[numbers].sum()), low, high))
    return shells


def volume_of(surface: Surface) -> float:
    """Signed volume of a closed surface by the divergence theorem."""
    middle = surface.vertices.mean(axis=0)
    return float(
        np.einsum("ij,ij->", surface.vertices[surface.faces[:, 0]] - middle, crosses_of(surface.vertices, surface.faces)) / 6
    )


def drop_specks(shells: list[Shell]) -> tuple[list[Shell], list[str]]:
    """The shells that enclose a printable volume, and a note on the others."""
    total = sum(abs(shell.volume) for shell in shells)
    sizeable = [
        shell
        for shell in shells
        if abs(shell.volume) > max(NEGLIGIBLE * total, FLAT * float(np.linalg.norm(shell.high - shell.low)) ** 3)
    ]
    if not sizeable:
        raise MeshError(f"encloses no volume: {FLAT_SHEETS}")
    gone = len(shells) - len(sizeable)
    return sizeable, [f"left out {gone} shell{'s' * (gone > 1)} with next to no volume"] if gone else []


def check_count(shells: list[Shell]) -> None:
    """Raise MeshError for too many bodies; voids do not count."""
    bodies = sum(shell.volume > 0 for shell in shells) or len(shells)
    if bodies > MOST_BODIES:
        raise MeshError(
            f"has {bodies} separate bodies, {MOST_BODIES} are allowed: unite those that belong together (Blender: Boolean, "
            "Union), or save them in several files"
        )


def orient_outward(shells: list[Shell]) -> tuple[list[Shell], list[str]]:
    """Wind every shell so that it bounds solid: outwards, or inwards if it is a void in another shell.

    An outermost shell that is inside out is turned with everything inside it, since the relative windings in a file are more
    often right than wrong. A shell wound inwards outside any solid is turned as well.
    """
    if all(shell.volume > 0 for shell in shells):
        return shells, []
    inside = _containers(shells)
    turn = [shell.volume < 0 and not inside[i] for i, shell in enumerate(shells)]
    turn = [turn[i] ^ bool(sum(turn[j] for j in inside[i] if not inside[j]) % 2) for i in range(len(shells))]
    result = [shell.flip() if turn[i] else shell for i, shell in enumerate(shells)]
    depth = [sum(1 if result[j].volume > 0 else -1 for j in inside[i]) for i in range(len(shells))]
    stray = [result[i].volume < 0 and depth[i] <= 0 for i in range(len(shells))]
    result = [shell.flip() if stray[i] else shell for i, shell in enumerate(result)]
    count = sum(a ^ b for a, b in zip(turn, stray, strict=True))
    return result, [f"turned {count} of {len(shells)} shells the right side out"] if count else []


def _containers(shells: list[Shell]) -> list[list[int]]:
    """For each shell, the larger shells that contain it."""
    low, high = np.array([shell.low for shell in shells]), np.array([shell.high for shell in shells])
    size = np.array([abs(shell.volume) for shell in shells])
    containers = []
    for shell in shells:
        around = (low <= shell.low).all(axis=1) & (high >= shell.high).all(axis=1) & (size > abs(shell.volume))
        containers.append([j for j in np.flatnonzero(around).tolist() if shells[j].contains(shell)])
    return containers


def unite(shells: list[Shell], reach: float) -> tuple[Surface, list[str]]:
    """One surface from all shells, overlapping and touching bodies united; separate shells keep their triangles."""
    solid = [i for i, shell in enumerate(shells) if shell.volume > 0]
    voids: dict[int, list[Shell]] = {i: [] for i in solid}
    for hollow in (shell for shell in shells if shell.volume < 0):
        around = [i for i in solid if shells[i].contains(hollow)]
        voids[min(around, key=lambda i: shells[i].volume)].append(hollow)
    bodies = [[shells[i], *voids[i]] for i in solid]
    pieces: list[Surface] = []
    fused = 0
    for group in _groups([body[0] for body in bodies], reach):
        plain = [_body_surface(bodies[i]) for i in group]
        union = _union(plain, reach) if len(group) > 1 else None
        pieces += plain if union is None else [union]
        fused += len(group) if union is not None else 0
    surface = concatenate(pieces)
    return surface, [f"united {fused} bodies that overlap or touch"] if fused else []


def _groups(outers: list[Shell], reach: float) -> list[list[int]]:
    """Groups of bodies whose boxes are within reach of each other, transitively."""
    low, high = np.array([s.low for s in outers]), np.array([s.high for s in outers])
    near = [
        np.flatnonzero((low <= high[i] + reach).all(axis=1) & (high >= low[i] - reach).all(axis=1)) for i in range(len(outers))
    ]
    a = np.repeat(np.arange(len(outers)), [len(others) for others in near])
    b = np.concatenate(near)
    label = connected_components(len(outers), a, b)
    return [np.flatnonzero(label == first).tolist() for first in np.unique(label)]


def _union(bodies: list[Surface], reach: float) -> Surface | None:
    """The union of closed surfaces; None if they neither overlap nor touch.

    Their corners are snapped to a grid finer than the reach: walls that are meant to touch then do. Otherwise the rounding of a
    file leaves slivers between them so thin that the union cannot be read again.
    """
    import manifold3d as m3

    grid = 2.0 ** np.floor(np.log2(GRID * reach))
    solids = [solid_of(_on_grid(body, grid)) for body in bodies]
    union = m3.Manifold.batch_boolean(solids, m3.OpType.Add)
    before = sum(solid.volume() for solid in solids)
    if union.num_tri() == sum(s.num_tri() for s in solids) and abs(union.volume() - before) <= 1e-9 * before:
        return None
    if union.volume() > (1 + 1e-6) * before or union.volume() < max(solid.volume() for solid in solids) * (1 - 1e-6):
        raise MeshError("has bodies that overlap in a way that cannot be united")
    return surface_of(union)


def subtract(surface: Surface, others: list[Surface]) -> Surface:
    """Difference of closed surfaces; without faces if nothing is left."""
    import manifold3d as m3

    return surface_of(m3.Manifold.batch_boolean([solid_of(surface), *map(solid_of, others)], m3.OpType.Subtract))


def above(surface: Surface, z_mm: float) -> Surface:
    """The part of a closed surface above a height; without faces if there is none."""
    return surface_of(solid_of(surface).trim_by_plane((0.0, 0.0, 1.0), z_mm))


def _on_grid(body: Surface, grid: float) -> Surface:
    """A closed surface with its corners on a grid; unchanged if that would open it or turn it inside out."""
    snapped = merge_vertices(Surface(np.round(body.vertices / grid) * grid, body.faces))
    closed = len(snapped.faces) and not len(edges_of(snapped.faces).unbalanced)
    return snapped if closed and (edges_of(snapped.faces).counts == 2).all() else body


def surface_of(solid: "m3.Manifold") -> Surface:
    """The triangles of a manifold3d solid."""
    mesh = solid.to_mesh64()
    return Surface(np.asarray(mesh.vert_properties)[:, :3].copy(), np.asarray(mesh.tri_verts).astype(np.int64))


def solid_of(surface: Surface) -> "m3.Manifold":
    """The manifold3d solid of a closed surface; raises MeshError if manifold3d rejects it."""
    import manifold3d as m3

    mesh = m3.Mesh64(np.ascontiguousarray(surface.vertices), np.ascontiguousarray(surface.faces).astype(np.uint64))
    solid = m3.Manifold(mesh)
    if solid.status() != m3.Error.NoError:
        raise MeshError(f"cannot be made a valid solid ({solid.status().name})")
    return solid


def _body_surface(body: list[Shell]) -> Surface:
    return drop_unused_vertices(concatenate([Surface(shell.vertices, shell.faces) for shell in body]))
