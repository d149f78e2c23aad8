"""Read: a model file into one closed solid in mm that rests on the platform, centred about the turn axis."""

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
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.pose import turned_by
from mdp.repair.colours import carry_colours
from mdp.repair.repair import repair
from mdp.topology.components import vertex_components
from mdp.zone import NO_ZONES, Zones
from profiles.errors import MeshError
from profiles.messages import advice, key_name, option

LEAST_MM, MOST_MM = 1.0, 2000.0  # largest extent of anything that such a printer makes
OTHER_UNITS = {25.4: "inches", 1000.0: "metres", 10.0: "centimetres", 0.001: "micrometres"}
SMALL_MM = 10.0  # largest extent of a model that may well be of another unit
INCH_MM, METRE_MM = 25.4, 1000.0
TYPICAL_MM = 100.0  # of several units that would fit the one is proposed by which a model is nearest to this
MANY_FACES = 500_000  # more make no better print: at 0.2 mm an edge they are an area of 90 cm2
MOST_BYTES = 2**30  # of a file: twenty million facets of a binary STL


class SizeError(MeshError):
    """A size that no printer makes. question: that as somebody asks it who can scale the model; units: those that its coordinates
    may be in instead of mm, the likeliest first, each with what it is scaled by then."""

    def __init__(self, sentence: str, question: str, units: dict[str, float]) -> None:
        super().__init__(sentence)
        self.question, self.units = question, units


@dataclass(frozen=True, eq=False)
class ReadModel:
    """A model as its file has it: its solid, a short sentence for every repair and for what else a person must know, the marks
    that a slicer file brings along, where they lie on the solid, and the names of its plates by their numbers."""

    mesh: Mesh
    notes: tuple[str, ...] = ()
    zones: Zones = NO_ZONES
    plates: Mapping[int, str] = field(default_factory=dict)


def read_mesh(path: Path, scale: float = 1.0, rotate_deg: tuple[float, float, float] = (0, 0, 0)) -> tuple[Mesh, tuple[str, ...]]:
    """The solid of a model file, and a short sentence for every repair that was made.

    Scaled, then rotated about x, then y, then z, then moved so that its box rests on z = 0 and is centred in x and y.
    Raises MeshError with one sentence: unreadable, damaged, open, flat, or of a size that no printer makes.
    """
    model = read_model(path, scale, rotate_deg)
    return model.mesh, model.notes


def read_model(
    path: Path, scale: float = 1.0, rotate_deg: tuple[float, float, float] = (0, 0, 0), plate: int | None = None
) -> ReadModel:
    """The same with the marks that the file brings along.

    plate: of a slicer file with several; None: the first that holds something. Raises MeshError.
    """
    with np.errstate(all="ignore"):  # what overflows is no finite number, or too large: both are said in a sentence below
        build = _read_build(path, plate)
    try:
        surfaces, taken = printed(build)
        _check_size(surfaces, scale)
        if scale != 1.0:
            surfaces = [replace(surface, vertices=surface.vertices * scale, gap=surface.gap * scale) for surface in surfaces]
        solid, repairs = repair(surfaces)
        solid = Surface(solid.vertices, solid.faces, carry_colours(surfaces, solid))
        mesh, turn, shift_mm = _place_on_platform(solid, rotate_deg)
        zones, mark_notes = Marks(build, path, mesh, (scale, turn, shift_mm)).zones()
    except SizeError as error:
        raise SizeError(f"{path}: {error}", f"{path}: {error.question}", error.units) from None
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    left_out = (note for surface in surfaces for note in surface.notes)
    size = small(mesh, path.suffix.lower(), any(rotate_deg)) if scale == 1.0 else ()
    notes = (*build.notes, *taken, *mark_notes, *size, *left_out, *repairs, *floating_pieces(mesh), *too_fine(mesh))
    return ReadModel(mesh, tuple(dict.fromkeys(notes)), zones, build.plates)


def read_in_place(path: Path) -> Mesh:
    """The solid of a model file where the file has it, in mm. Raises MeshError as read_mesh, but for sizes."""
    try:
        solid, _ = repair(printed(_read_build(path))[0])
    except MeshError as error:
        text = f"{error}"
        raise MeshError(text if text.startswith(str(path)) else f"{path}: {text}") from None
    return Mesh(solid.vertices, solid.faces.astype(np.int32))


def small(mesh: Mesh, suffix: str, turned: bool) -> tuple[str, ...]:
    """What its unit may be and how to scale it, for a small model in a format that has none (STL, OBJ, PLY, OFF), or whose metres
    with y up many programs leave out of account (glTF). turned: whether it is rotated as it is read."""
    size_mm = float(np.ptp(mesh.bounds_mm, axis=0).max())
    if size_mm >= SMALL_MM or suffix not in (".stl", ".obj", ".ply", ".off", ".glb", ".gltf"):
        return ()
    longest = f"its longest side is {size_mm:.3g} mm: "
    if suffix not in (".glb", ".gltf"):
        return (f"{longest}if its coordinates are inches, {advice('set', f'process.scale={INCH_MM:g}', 'give')}",)
    turn = "" if turned else f" and {option('set', 'process.rotate_deg=[90,0,0]')}"
    if size_mm * METRE_MM <= MOST_MM:
        return (
            f"{longest}if its coordinates are metres with y up, as glTF has them, "
            f"{advice('set', 'process.scale=1000', 'give')}{turn}",
        )
    return (
        f"{longest}metres with y up, as glTF has them, would be more than {MOST_MM:g} mm; for a tenth of that "
        f"{advice('set', 'process.scale=100', 'give')}{turn}",
    )


def too_fine(mesh: Mesh) -> tuple[str, ...]:
    """What to reduce, for a mesh of far more faces than a print shows."""
    count = len(mesh.faces)
    if count <= MANY_FACES:
        return ()
    edge_mm = float(np.sqrt(4.0 / np.sqrt(3.0) * mesh.areas_mm2.sum() / count))
    return (
        f"{count} faces, with edges of about {edge_mm:.2g} mm: search and slices take long; {MANY_FACES} are enough for a print: "
        "export it with a larger tolerance, or reduce its faces (Decimate in Blender, Simplify in a slicer)",
    )


def floating_pieces(mesh: Mesh) -> tuple[str, ...]:
    """A sentence about the pieces that do not reach the platform, if there are any; closed voids are no pieces."""
    label, corners = vertex_components(len(mesh.vertices), mesh.faces)[mesh.faces[:, 0]], mesh.vertices[mesh.faces]
    volumes = np.bincount(label, np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])))
    lowest = np.full(len(volumes), np.inf)
    np.minimum.at(lowest, label, corners[:, :, 2].min(axis=1))
    heights = lowest[(volumes > 0) & (lowest > PLATFORM_TOLERANCE_MM)]
    if not len(heights):
        return ()
    pieces = "1 piece floats" if len(heights) == 1 else f"{len(heights)} pieces float at least"
    height = f"{heights.min():.3g} mm above the platform"
    return (f"{pieces} {height}, as its file has it, on nothing: only support can hold such, whatever is cut",)


def _read_build(path: Path, plate: int | None = None) -> Build:
    """What a model file prints; one that no slicer has saved is one object."""
    check_file(path)
    try:
        size = path.stat().st_size
        if size == 0:
            raise MeshError(f"{path}: is empty")
        if size > MOST_BYTES:
            raise MeshError(f"{path}: has {size} bytes, at most {MOST_BYTES} are read: a model of fewer faces is needed")
        return READERS[path.suffix.lower()](path, plate)
    except OSError as error:
        raise MeshError(f"{path}: cannot be read: {error.strerror or error}") from None


def _check_size(surfaces: list[Surface], scale: float) -> None:
    """Refuses what is too small or too large, naming the scale of the unit that would bring it nearest to a common size."""
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


def _place_on_platform(solid: Surface, rotate_deg: tuple[float, float, float]) -> tuple[Mesh, Floats, Floats]:
    """The mesh of a solid on the platform, and the rotation and the shift that bring it there."""
    vertices, turn = solid.vertices, np.eye(3)
    if any(rotate_deg):
        turn = np.round(turned_by(rotate_deg), 15)  # rounded so that quarter turns are exact
        vertices = vertices @ turn.T
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    colours = None if solid.colours is None else solid.colours.astype(np.int32)
    return Mesh(vertices - middle, solid.faces.astype(np.int32), colours), turn, -middle
