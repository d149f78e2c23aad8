"""Read: a model file as one closed solid in mm that rests on the build plate, centred about the turn axis."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mdp.foreign.marks import Marks
from mdp.foreign.printed import printed
from mdp.formats.readers import READERS
from mdp.formats.slicer_file import Build
from mdp.formats.surface import Surface
from mdp.mesh import Floats, Mesh
from mdp.model_file import check_file
from mdp.overhang import PLATE_TOLERANCE_MM
from mdp.pose import turned_by
from mdp.repair.colours import carry_colours
from mdp.repair.repair import repair
from mdp.topology.components import vertex_components
from mdp.zone import NO_ZONES, Zones
from profiles.errors import MeshError
from profiles.messages import advice, key_name, option

LEAST_MM, MOST_MM = 1.0, 2000.0  # largest extent of a printable model
OTHER_UNITS = {25.4: "inches", 1000.0: "metres", 10.0: "centimetres", 0.001: "micrometres"}
SMALL_MM = 10.0  # a model of a smaller extent may be in another unit
INCH_MM, METRE_MM = 25.4, 1000.0
TYPICAL_MM = 100.0  # among several fitting units, the one that brings the model nearest to this size is proposed
MANY_FACES = 500_000  # more do not improve a print: with edges of 0.2 mm they cover an area of 90 cm2
PREDICATE = re.compile(r"(is|has|encloses|cannot) ")  # begins errors of repair
MOST_BYTES = 2**30  # greatest size of a file: twenty million facets of a binary STL


class SizeError(MeshError):
    """A size that cannot be printed. question: wording for a front end that can scale the model; units: units that the
    coordinates may have instead of mm, likeliest first, with the scale of each.
    """

    def __init__(self, sentence: str, question: str, units: dict[str, float]) -> None:
        super().__init__(sentence)
        self.question, self.units = question, units


@dataclass(frozen=True, eq=False)
class ReadModel:
    """A model from a file: its solid, a short sentence for every repair and any other note to the user, the marks of a slicer
    file placed on the solid, and the names of its plates by number.
    """

    mesh: Mesh
    notes: tuple[str, ...] = ()
    zones: Zones = NO_ZONES
    plates: Mapping[int, str] = field(default_factory=dict)


def read_mesh(path: Path, scale: float = 1.0, rotate_deg: tuple[float, float, float] = (0, 0, 0)) -> tuple[Mesh, tuple[str, ...]]:
    """The solid of a model file, and a short sentence for every repair that was made.

    Scaled, then rotated about x, then y, then z, then moved so that its box rests on z = 0 and is centred in x and y. Raises
    MeshError for a model that is unreadable, damaged, open, flat, or of an unprintable size.
    """
    model = read_model(path, scale, rotate_deg)
    return model.mesh, model.notes


def read_model(
    path: Path, scale: float = 1.0, rotate_deg: tuple[float, float, float] = (0, 0, 0), plate: int | None = None
) -> ReadModel:
    """A model file as a ReadModel: its solid, notes, and the marks of a slicer file. plate: number of the plate in a slicer file
    with several; None for the first plate with objects. Raises MeshError.
    """
    with np.errstate(all="ignore"):  # an overflow gives a value that is not finite or too large, and the checks below report both
        build = _read_build(path, plate)
    try:
        surfaces, taken = printed(build)
        _check_size(surfaces, scale)
        if scale != 1.0:
            surfaces = [replace(surface, vertices=surface.vertices * scale, gap=surface.gap * scale) for surface in surfaces]
        solid, repairs = repair(surfaces)
        solid = Surface(solid.vertices, solid.faces, carry_colours(surfaces, solid))
        mesh, turn, shift_mm = _place_on_plate(solid, rotate_deg)
        zones, mark_notes = Marks(build, path, mesh, (scale, turn, shift_mm)).zones()
    except SizeError as error:
        raise SizeError(f"{path}: {error}", f"{path}: {error.question}", error.units) from None
    except MeshError as error:
        raise MeshError(_named(path, f"{error}")) from None
    left_out = (note for surface in surfaces for note in surface.notes)
    size = small(mesh, path.suffix.lower(), any(rotate_deg)) if scale == 1.0 else ()
    notes = (*build.notes, *taken, *mark_notes, *size, *left_out, *repairs, *floating_pieces(mesh), *too_fine(mesh))
    return ReadModel(mesh, tuple(dict.fromkeys(notes)), zones, build.plates)


def read_in_place(path: Path) -> Mesh:
    """The solid of a model file in the file's coordinates, mm. Raises MeshError like read_mesh, except for sizes."""
    try:
        solid, _ = repair(printed(_read_build(path))[0])
    except MeshError as error:
        text = f"{error}"
        raise MeshError(text if text.startswith(str(path)) else _named(path, text)) from None
    return Mesh(solid.vertices, solid.faces.astype(np.int32))


def _named(path: Path, text: str) -> str:
    """An error as a sentence about a file; text: a predicate ("is not closed") or a sentence."""
    return f"{path} {text}" if PREDICATE.match(text) else f"{path}: {text}"


def small(mesh: Mesh, suffix: str, turned: bool) -> tuple[str, ...]:
    """A note that proposes a unit and scale, for a small model in a format without units (STL, OBJ, PLY, OFF), or in glTF, whose
    metres with y up many programs ignore. turned: whether the model is rotated while it is read.
    """
    size_mm = float(np.ptp(mesh.bounds_mm, axis=0).max())
    if size_mm >= SMALL_MM or suffix not in (".stl", ".obj", ".ply", ".off", ".glb", ".gltf"):
        return ()
    longest = f"its longest side is {size_mm:.3g} mm: "
    if suffix not in (".glb", ".gltf"):
        return (f"{longest}if its coordinates are inches, {advice('set', f'process.scale={INCH_MM:g}', 'give')}",)
    turn = "" if turned else f" and {option('set', 'process.rotate_deg=[90,0,0]')}"
    if size_mm * METRE_MM <= MOST_MM:
        return (
            f"{longest}if its coordinates are metres with y up, as glTF specifies, "
            f"{advice('set', 'process.scale=1000', 'give')}{turn}",
        )
    return (
        f"{longest}metres with y up, as glTF specifies, would be more than {MOST_MM:g} mm; for a tenth of that "
        f"{advice('set', 'process.scale=100', 'give')}{turn}",
    )


def too_fine(mesh: Mesh) -> tuple[str, ...]:
    """A note that proposes to simplify a mesh with far more faces than a print shows."""
    count = len(mesh.faces)
    if count <= MANY_FACES:
        return ()
    edge_mm = float(np.sqrt(4.0 / np.sqrt(3.0) * mesh.areas_mm2.sum() / count))
    return (
        f"{count} faces, with edges of about {edge_mm:.2g} mm: search and slices take long; {MANY_FACES} are enough for a print: "
        "export it with a larger tolerance, or reduce its faces (Decimate in Blender, Simplify in a slicer)",
    )


def floating_pieces(mesh: Mesh) -> tuple[str, ...]:
    """A note on pieces that do not reach the build plate, if there are any; closed voids do not count."""
    label, corners = vertex_components(len(mesh.vertices), mesh.faces)[mesh.faces[:, 0]], mesh.vertices[mesh.faces]
    volumes = np.bincount(label, np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])))
    lowest = np.full(len(volumes), np.inf)
    np.minimum.at(lowest, label, corners[:, :, 2].min(axis=1))
    heights = lowest[(volumes > 0) & (lowest > PLATE_TOLERANCE_MM)]
    if not len(heights):
        return ()
    pieces = "1 piece floats" if len(heights) == 1 else f"{len(heights)} pieces float at least"
    height = f"{heights.min():.3g} mm above the build plate"
    return (f"{pieces} {height} in its file: only support can hold {'it' if len(heights) == 1 else 'them'}, whatever is cut",)


def _read_build(path: Path, plate: int | None = None) -> Build:
    """A model file as a build; a file without slicer data becomes one object."""
    check_file(path)
    try:
        size = path.stat().st_size
        if size == 0:
            raise MeshError(f"{path} is empty")
        if size > MOST_BYTES:
            raise MeshError(f"{path} has {size} bytes, at most {MOST_BYTES} are read: a model of fewer faces is needed")
        return READERS[path.suffix.lower()](path, plate)
    except OSError as error:
        raise MeshError(f"{path} cannot be read: {error.strerror or error}") from None


def _check_size(surfaces: list[Surface], scale: float) -> None:
    """Raise MeshError for a model that is too small or too large, or SizeError if another unit would fit; the unit that gives the
    commonest size comes first.
    """
    if not scale > 0 or not np.isfinite(scale):
        raise MeshError(f"cannot be scaled by {scale:g}; {key_name('process.scale')} must be above 0")
    corners = np.concatenate([surface.vertices[surface.faces.ravel()] for surface in surfaces])
    with np.errstate(over="ignore"):
        size_mm = scale * float(np.ptp(corners, axis=0).max())
    if size_mm == 0.0 or LEAST_MM <= size_mm <= MOST_MM:
        return
    bound = f"less than {LEAST_MM:g} mm" if size_mm < LEAST_MM else f"more than {MOST_MM:g} mm"
    fitting = [unit for unit in OTHER_UNITS if LEAST_MM <= size_mm * unit <= MOST_MM]
    if not fitting:
        raise MeshError(f"its largest extent is {size_mm:.4g} mm, {bound}: no common unit makes that a size to print")
    fitting.sort(key=lambda unit: abs(np.log(size_mm * unit / TYPICAL_MM)))
    extent, likeliest = f"its largest extent is {size_mm:.4g} mm, {bound}", fitting[0]
    raise SizeError(
        f"{extent}; if its coordinates are {OTHER_UNITS[likeliest]}, "
        f"{advice('set', f'process.scale={scale * likeliest:g}', 'give')}",
        f"{extent}: which unit are its coordinates in?",
        {OTHER_UNITS[unit]: scale * unit for unit in fitting},
    )


def _place_on_plate(solid: Surface, rotate_deg: tuple[float, float, float]) -> tuple[Mesh, Floats, Floats]:
    """The mesh of a solid on the build plate, and the rotation and shift that move it there."""
    vertices, turn = solid.vertices, np.eye(3)
    if any(rotate_deg):
        turn = np.round(turned_by(rotate_deg), 15)  # rounded so that quarter turns are exact
        vertices = vertices @ turn.T
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    colours = None if solid.colours is None else solid.colours.astype(np.int32)
    return Mesh(vertices - middle, solid.faces.astype(np.int32), colours), turn, -middle
