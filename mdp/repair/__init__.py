"""Repair: surfaces as files give them into one closed, outward-wound solid, or a sentence why that cannot be."""

from typing import TYPE_CHECKING

import numpy as np

from mdp.mesh import Floats
from mdp.repair.edges import edges_of
from mdp.repair.holes import without_holes
from mdp.repair.overlap import disentangled, overlaps_itself
from mdp.repair.sheets import cancelled, single, without_loose
from mdp.repair.shells import outward, shells_of, solid_of, surface_of, united, volume_of, without_specks
from mdp.repair.weld import compact, uncollapsed, welded, welded_along_openings
from mdp.repair.winding import parted, point, with_single_edges, wound
from mdp.surface import Surface, stacked
from profiles.errors import MeshError

if TYPE_CHECKING:
    import manifold3d as m3

WELD_SHARES = (1e-6, 1e-5, 1e-4)  # of the model's size: the rounding of ASCII files first, gaps of 0.01 mm in 100 mm last
SHRINK = 0.01  # of the model's size: what a repair may take off its box
SAME_VOLUME = 1e-5
SHARED = 0.5  # of the volume: a body that counts half of itself twice is not understood


def repaired(surfaces: list[Surface]) -> tuple[Surface, list[str]]:
    """One closed solid of all surfaces, and a short sentence for every repair; a sound surface comes back as it is.

    Raises MeshError (a predicate without the file's name) when that cannot be, or only by changing the shape.
    """
    before = _bounds(stacked(surfaces))
    size = float((before[1] - before[0]).max())
    if size == 0.0:
        raise MeshError(
            f"encloses no volume: all {sum(len(s.faces) for s in surfaces)} faces lie in one point {point(before[0])}"
        )
    tidy = [_tidied(surface) for surface in surfaces]
    open_ones = [surface for surface in tidy if not _closed(surface)]
    # One body is often spread over several objects of a file, one for each material.
    pieces = [surface for surface in tidy if _closed(surface)] + (
        [welded(stacked(open_ones))] if len(open_ones) > 1 else open_ones
    )
    notes: list[str] = []
    _note(
        notes, sum(len(s.faces) for s in surfaces) - sum(len(s.faces) for s in tidy), "left out {} face{} with coinciding corners"
    )
    closed = [_mended(piece, size, notes) for piece in pieces]
    solid = _solid([parted(piece) for piece in closed if len(piece.faces)], size, notes)
    lost = np.abs(_bounds(solid) - before).max()
    if lost > SHRINK * size:
        raise MeshError(f"cannot be made a valid solid: the closed part of it lacks {lost:.3g} mm of its extent of {size:.4g} mm")
    solid, whole = _understood(solid, notes)
    if whole.volume() <= 0:
        raise MeshError("encloses no volume")
    return (_once_through(solid, whole, notes) if overlaps_itself(whole) else solid), notes


def _understood(solid: Surface, notes: list[str]) -> tuple[Surface, "m3.Manifold"]:
    """The surface and its manifold3d solid, which must enclose the same volume.

    An edge of four faces leaves open which of them go on in which; where manifold3d pairs them otherwise, the edge is made two.
    """
    for change in (lambda surface: surface, with_single_edges):
        tried = change(solid)
        whole = solid_of(tried)
        if abs(whole.volume() - volume_of(tried)) <= SAME_VOLUME * abs(whole.volume()):
            _note(notes, (len(tried.faces) - len(solid.faces)) // 2, "parted {} edge{} that four faces share")
            return tried, whole
    raise MeshError(f"cannot be made a valid solid: its volume is {volume_of(solid):.5g} mm3 or {whole.volume():.5g} mm3")


def _once_through(solid: Surface, whole: "m3.Manifold", notes: list[str]) -> Surface:
    """The solid without what it counts twice; as it is when that cannot be told apart."""
    mended = disentangled(whole)
    left = any(overlaps_itself(piece) for piece in mended.decompose())
    shared_mm3 = whole.volume() - mended.volume()
    if left or not 0 < shared_mm3 < SHARED * whole.volume():
        notes.append("left a body that passes through itself as it is: some of its volume may count twice")
        return solid
    notes.append(f"united a body that passes through itself with itself: {shared_mm3:.3g} mm3 counted twice")
    return surface_of(mended)


def _bounds(surface: Surface) -> Floats:
    used = surface.vertices[surface.faces.ravel()]
    return np.stack([used.min(axis=0), used.max(axis=0)])


def _closed(surface: Surface) -> bool:
    return not len(edges_of(surface.faces).unbalanced)


def _tidied(surface: Surface) -> Surface:
    """The surface as it is when it is closed so, else with its coincident vertices merged, as STL files need it."""
    given = compact(Surface(surface.vertices, uncollapsed(surface.faces)))
    return given if _closed(given) and len(given.faces) else welded(given)


def _mended(surface: Surface, size: float, notes: list[str]) -> Surface:
    """The surface closed and wound consistently; appends to the notes. Raises MeshError when it stays open."""
    faces = len(surface.faces)
    surface = _once(surface)
    _note(notes, faces - len(surface.faces), "left out {} duplicate face{}")
    if _closed(surface):
        return surface
    surface = _joined_openings(surface, size, notes)
    faces = len(surface.faces)
    surface = without_loose(surface)
    _note(notes, faces - len(surface.faces), "left out {} face{} of loose sheets")
    turned = wound(surface)
    _note(notes, int((turned.faces != surface.faces).any(axis=1).sum()), "turned {} face{} over to match their neighbours")
    surface, filled = without_holes(turned)
    notes += filled
    edges = edges_of(surface.faces)
    if len(edges.unbalanced):
        where = surface.vertices[edges.starts[np.flatnonzero(edges.edge == edges.unbalanced[0])[0]]]
        raise MeshError(f"is not closed: {len(edges.unbalanced)} open edges that cannot be mended, one at {point(where)}")
    return surface


def _once(surface: Surface) -> Surface:
    """Every face once, unless that opens a closed surface which opposite pairs alone leave closed."""
    once = single(surface)
    if len(once.faces) == len(surface.faces) or _closed(once) or not _closed(surface):
        return once
    paired_off = cancelled(surface)
    return paired_off if 2 * len(paired_off.faces) > len(surface.faces) else once


def _joined_openings(surface: Surface, size: float, notes: list[str]) -> Surface:
    for share in WELD_SHARES:
        if not (edges_of(surface.faces).counts % 2).any():
            break
        vertices = len(surface.vertices)
        surface = single(welded_along_openings(surface, share * size))
        _note(
            notes,
            vertices - len(surface.vertices),
            f"merged {{}} vert{{}} within {share * size:.2g} mm of another",
            ("ex", "ices"),
        )
    return surface


def _solid(closed: list[Surface], size: float, notes: list[str]) -> Surface:
    """The shells of closed surfaces turned outwards and united; the surfaces as they are when nothing of that is needed."""
    shells = [shell for surface in closed for shell in shells_of(surface)]
    shells, specks = without_specks(shells)
    shells, turned = outward(shells)
    solid, fused = united(shells, WELD_SHARES[0] * size)
    done = [*specks, *turned, *fused]
    notes += done
    return solid if done else stacked(closed)


def _note(notes: list[str], count: int, text: str, endings: tuple[str, str] = ("", "s")) -> None:
    if count:
        notes.append(text.format(count, endings[count != 1]))
