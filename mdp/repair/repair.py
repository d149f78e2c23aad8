"""Repair: surfaces read from files become one closed, outward-wound solid, or an error that says why they cannot."""

from typing import TYPE_CHECKING

import numpy as np

from mdp.formats.surface import Surface, concatenate
from mdp.mesh import Floats, Indices
from mdp.repair.holes import fill_holes
from mdp.repair.sheets import cancel_opposite_faces, drop_duplicate_faces, drop_loose_sheets
from mdp.repair.shells import (
    FLAT_SHEETS,
    check_count,
    drop_specks,
    orient_outward,
    shells_of,
    solid_of,
    surface_of,
    unite,
    volume_of,
)
from mdp.repair.weld import (
    drop_collapsed_faces,
    drop_unused_vertices,
    merge_rim_vertices,
    merge_vertices,
    split_rim_edges,
)
from mdp.repair.winding import format_point, orient_faces, split_shared_edges, split_touching_fans
from mdp.topology.edges import edges_of
from profiles.errors import MeshError, counted

if TYPE_CHECKING:
    import manifold3d as m3

WELD_SHARES = (1e-6, 1e-5, 1e-4)  # shares of the model's size: first the rounding of ASCII files, last gaps of 0.01 mm in 100 mm
SHRINK = 0.01  # share of the model's size: how much a repair may reduce its box
SAME_VOLUME = 1e-5  # share by which two readings of one surface may differ: float32 files move corners by 6e-8 of the size
MOST_CHANGED = 0.01  # share of the volume: how much the reading of edges with many faces may change it
MOST_READINGS = 5  # each pairs the edges again; the last reading of an unstable surface is used
SECTIONS = 23  # an overlap missed by all of them is lower than a 24th of the height
EXCESS = 1e-3  # share of the area of all sections; smaller folds stay, since their repair would re-triangulate the model
DEEPEST, TOGETHER = 5, 8  # depth of halvings, and number of pieces united at once
UNION_FACES, UNION_GROWTH = 1000, 2  # faces that a union may have, and limit per face of its pieces
SHARED = 0.5  # share of the volume: a body that counts half of itself twice cannot be resolved


def repair(surfaces: list[Surface]) -> tuple[Surface, list[str]]:
    """Repair surfaces and unite them to one closed solid; the second value has a short sentence for every repair.

    A surface without defects is returned unchanged. Raises MeshError if no repair yields a closed solid of the same shape; its
    message is a predicate, such as "encloses no volume", to which the caller adds the file's name.
    """
    before = _bounds(concatenate(surfaces))
    size = float((before[1] - before[0]).max())
    if size == 0.0:
        raise MeshError(
            f"encloses no volume: all {sum(len(s.faces) for s in surfaces)} faces lie in one point {format_point(before[0])}"
        )
    tidy = [_tidy(surface) for surface in surfaces]
    open_ones = [surface for surface in tidy if not _is_closed(surface)]
    # One body is often spread over several objects of a file, one for each material.
    pieces = [surface for surface in tidy if _is_closed(surface)] + (
        [merge_vertices(concatenate(open_ones))] if len(open_ones) > 1 else open_ones
    )
    notes: list[str] = []
    _note(
        notes, sum(len(s.faces) for s in surfaces) - sum(len(s.faces) for s in tidy), "left out {} face{} with coinciding corners"
    )
    gap = max(surface.gap for surface in surfaces)
    names = {surface.name for surface, merged in zip(surfaces, tidy, strict=True) if not _is_closed(merged)} - {""}
    try:
        closed = [_close_surface(piece, size, gap, notes) for piece in pieces]
    except MeshError as error:
        raise MeshError(f"its part {names.pop()!r} {error}" if len(names) == 1 and len(surfaces) > 1 else f"{error}") from None
    solid = _unite_shells([split_touching_fans(piece) for piece in closed if len(piece.faces)], size, notes)
    lost = np.abs(_bounds(solid) - before).max()
    if lost > SHRINK * size:
        raise MeshError(f"cannot be made a valid solid: the closed part of it lacks {lost:.3g} mm of its extent of {size:.4g} mm")
    solid, whole = _read_as_solid(solid, notes)
    if whole.volume() <= 0:
        raise MeshError(f"encloses no volume: {FLAT_SHEETS}")
    return (_count_once(solid, whole, notes) if _overlaps_itself(whole) else solid), notes


def _read_as_solid(solid: Surface, notes: list[str]) -> tuple[Surface, "m3.Manifold"]:
    """The surface and its manifold3d solid, which must enclose equal volumes.

    An edge shared by four faces leaves their pairing open; where manifold3d pairs them differently, the edge is duplicated. If a
    difference remains, manifold3d's reading is used, unless it is a different shape.
    """
    for change in (lambda surface: surface, split_shared_edges):
        tried = change(solid)
        whole = solid_of(tried)
        if abs(whole.volume() - volume_of(tried)) <= SAME_VOLUME * abs(whole.volume()):
            _note(notes, (len(tried.faces) - len(solid.faces)) // 2, "split {} edge{} that four faces share")
            return tried, whole
    return _keep_what_was_read(solid, whole, notes)


def _rounded(value: float) -> str:
    """A value with three significant digits, without an exponent."""
    return f"{float(f'{value:.3g}'):.12g}"


def _keep_what_was_read(solid: Surface, whole: "m3.Manifold", notes: list[str]) -> tuple[Surface, "m3.Manifold"]:
    """Take manifold3d's reading of the surface, repeated until it is stable. Raises MeshError for a different shape."""
    for _ in range(MOST_READINGS):
        if whole.is_empty():
            break
        before_mm3, whole = whole.volume(), solid_of(surface_of(whole))
        if abs(whole.volume() - before_mm3) <= SAME_VOLUME * abs(before_mm3):
            break
    cleaned, enclosed_mm3, taken_mm3 = surface_of(whole), volume_of(solid), whole.volume()
    box = _bounds(solid)
    same = abs(taken_mm3 - enclosed_mm3) <= MOST_CHANGED * taken_mm3 and len(cleaned.faces) > 0
    if not same or np.abs(_bounds(cleaned) - box).max() > SHRINK * (box[1] - box[0]).max():
        raise MeshError(
            f"cannot be made a valid solid: its faces enclose {_rounded(enclosed_mm3)} mm³, but the closest valid solid has "
            f"{_rounded(taken_mm3)} mm³; make it manifold in another program first (Blender: 3D-Print Toolbox, Make Manifold)"
        )
    percent = float(f"{100 * (taken_mm3 / enclosed_mm3 - 1):.3g}") + 0.0
    notes.append(f"left out folds where more than two faces share an edge: the volume changes by {percent:+g} %")
    return cleaned, whole


def _count_once(solid: Surface, whole: "m3.Manifold", notes: list[str]) -> Surface:
    """The solid with overlapping volume counted once; unchanged if the overlap cannot be resolved."""
    resolved = resolve_overlap(whole)
    left = resolved is None or any(_overlaps_itself(piece) for piece in resolved.decompose())
    shared_mm3 = 0.0 if resolved is None else whole.volume() - resolved.volume()
    if resolved is None or left or not 0 < shared_mm3 < SHARED * whole.volume():
        notes.append("left a self-intersecting body as it is: some of its volume may count twice")
        return solid
    notes.append(f"resolved a self-intersecting body: {shared_mm3:.3g} mm³ counted twice")
    return surface_of(resolved)


def _bounds(surface: Surface) -> Floats:
    used = surface.vertices[surface.faces.ravel()]
    return np.stack([used.min(axis=0), used.max(axis=0)])


def _is_closed(surface: Surface) -> bool:
    return not len(edges_of(surface.faces).unbalanced)


def _tidy(surface: Surface) -> Surface:
    """The surface as it is if it is closed, else with coincident vertices merged, as STL files need."""
    given = drop_unused_vertices(Surface(surface.vertices, drop_collapsed_faces(surface.faces)))
    return given if _is_closed(given) and len(given.faces) else merge_vertices(given)


def _close_surface(surface: Surface, size: float, gap: float, notes: list[str]) -> Surface:
    """The surface closed and wound consistently; appends to the notes. Raises MeshError if it stays open."""
    faces = len(surface.faces)
    surface = _drop_repeats(surface)
    _note(notes, faces - len(surface.faces), "left out {} duplicate face{}")
    if _is_closed(surface):
        return surface
    surface = _close_seams(surface if gap == 0.0 else _sew(surface, gap), size, notes)
    faces = len(surface.faces)
    surface = drop_loose_sheets(surface)
    _note(notes, faces - len(surface.faces), "left out {} face{} of loose sheets")
    turned = orient_faces(surface)
    _note(notes, int((turned.faces != surface.faces).any(axis=1).sum()), "turned {} face{} over to match their neighbours")
    surface, filled = fill_holes(turned)
    notes += filled
    edges = edges_of(surface.faces)
    if len(edges.unbalanced):
        where = surface.vertices[edges.starts[np.flatnonzero(edges.edge == edges.unbalanced[0])[0]]]
        raise MeshError(
            f"is not closed: {counted(len(edges.unbalanced), 'open edge')} that cannot be repaired, one at {format_point(where)}"
        )
    return surface


def _drop_repeats(surface: Surface) -> Surface:
    """Remove duplicate faces, except where that would open a surface closed by opposite pairs; then only such pairs are
    removed.
    """
    once = drop_duplicate_faces(surface)
    if len(once.faces) == len(surface.faces) or _is_closed(once) or not _is_closed(surface):
        return once
    paired_off = cancel_opposite_faces(surface)
    return paired_off if 2 * len(paired_off.faces) > len(surface.faces) else once


def _sew(surface: Surface, gap: float) -> Surface:
    """Join faces whose common edges lie within a distance of each other."""
    joined = split_rim_edges(merge_rim_vertices(surface, gap), gap)
    return drop_duplicate_faces(Surface(joined.vertices, drop_collapsed_faces(joined.faces)))


def _close_seams(surface: Surface, size: float, notes: list[str]) -> Surface:
    for share in WELD_SHARES:
        if not (edges_of(surface.faces).counts % 2).any():
            break
        vertices = len(surface.vertices)
        surface = drop_duplicate_faces(merge_rim_vertices(surface, share * size))
        _note(
            notes,
            vertices - len(surface.vertices),
            f"merged {{}} vert{{}} within {share * size:.2g} mm of another",
            ("ex", "ices"),
        )
    return surface


def _unite_shells(closed: list[Surface], size: float, notes: list[str]) -> Surface:
    """The shells of closed surfaces turned outwards and united; the surfaces unchanged if nothing has to be repaired."""
    shells = [shell for surface in closed for shell in shells_of(surface)]
    shells, specks = drop_specks(shells)
    check_count(shells)
    shells, turned = orient_outward(shells)
    solid, fused = unite(shells, WELD_SHARES[0] * size)
    repairs = [*specks, *turned, *fused]
    notes += repairs
    return solid if repairs else concatenate(closed)


def _note(notes: list[str], count: int, text: str, endings: tuple[str, str] = ("", "s")) -> None:
    if count:
        notes.append(text.format(count, endings[count != 1]))


def _overlaps_itself(solid: "m3.Manifold") -> bool:
    """Whether the solid overlaps itself: its horizontal sections have less area than their outlines wind around."""
    mesh = solid.to_mesh64()
    vertices, faces = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64)
    _, _, low, _, _, high = solid.bounding_box()
    # Odd fractions of the height, since models are made in steps that round fractions would hit.
    heights = (low + (np.arange(1, SECTIONS + 1) - 0.0137) * (high - low) / (SECTIONS + 1)).tolist()
    wound = sum(_section_area(vertices, faces, height) for height in heights)
    return bool(wound - sum(solid.slice(height).area() for height in heights) > EXCESS * wound)


def _section_area(vertices: Floats, faces: Indices, height: float) -> float:
    """Area of a section at a height, each region counted as often as the outline winds around it: Green's theorem over the cut
    faces.
    """
    above = vertices[:, 2] > height
    sides = above[faces]
    cut = faces[sides.any(axis=1) & ~sides.all(axis=1)]
    origin = vertices.mean(axis=0)[:2]
    ends: list[Floats] = []
    for rising in (False, True):
        point = np.zeros((len(cut), 2))
        for k in range(3):
            p, q = cut[:, k], cut[:, (k + 1) % 3]
            here = (above[q] if rising else above[p]) & ~(above[p] if rising else above[q])
            run = ((height - vertices[p, 2]) / np.where(here, vertices[q, 2] - vertices[p, 2], 1.0))[:, None]
            point = np.where(here[:, None], vertices[p, :2] + run * (vertices[q, :2] - vertices[p, :2]) - origin, point)
        ends.append(point)
    start, end = ends
    return abs(0.5 * float((start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]).sum()))


def resolve_overlap(solid: "m3.Manifold") -> "m3.Manifold | None":
    """The solid with every point counted once; None if it is so tangled that its union would have many times its faces.

    It is halved across its longest side until no piece overlaps itself: halves of a body that overlaps itself are separate bodies
    where the overlapping regions are far apart along the surface, and their union counts nothing twice.
    """
    return _united(solid, 0)


def _united(solid: "m3.Manifold", depth: int) -> "m3.Manifold | None":
    import manifold3d as m3

    whole: list[m3.Manifold] = []
    for piece in solid.decompose():
        if depth == DEEPEST or not _overlaps_itself(piece):
            whole.append(piece)
            continue
        box = np.array(piece.bounding_box()).reshape(2, 3)
        normal = np.eye(3)[np.argmax(box[1] - box[0])]
        for half in piece.split_by_plane(tuple(normal), float(normal @ box.mean(axis=0))):
            resolved = _united(half, depth + 1)
            if resolved is None:
                return None
            whole.append(resolved)
    most = UNION_FACES + UNION_GROWTH * sum(piece.num_tri() for piece in whole)
    while len(whole) > 1:  # few at a time, so a union that intersects everywhere is detected before it fills the memory
        whole = [m3.Manifold.batch_boolean(whole[k : k + TOGETHER], m3.OpType.Add) for k in range(0, len(whole), TOGETHER)]
        if sum(piece.num_tri() for piece in whole) > most:
            return None
    return whole[0] if whole else m3.Manifold()
