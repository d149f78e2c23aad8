"""3MF: the build items of the package with their transforms, components and unit, in mm (3MF Core Specification 1.3), and the
colours of their triangles (Materials and Properties Extension 1.2)."""

import lzma
import struct
import zipfile
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from mdp.formats.surface import Surface, check_meshes, check_placed, check_surface, parse_floats, parse_integers
from mdp.mesh import NO_COLOUR, Floats, Indices, parse_colour
from profiles.errors import MeshError

UNIT_MM = {"micron": 0.001, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
MATERIAL = "{http://schemas.microsoft.com/3dmanufacturing/material/2015/02}"
COLOUR_GROUP = (f"{MATERIAL}colorgroup", f"{MATERIAL}color")
PRODUCTION_PATH = "{http://schemas.microsoft.com/3dmanufacturing/production/2015/06}path"
RELATION = "{http://schemas.openxmlformats.org/package/2006/relationships}Relationship"
MODEL_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
DAMAGES: tuple[type[Exception], ...] = (
    LookupError,
    ElementTree.ParseError,
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    EOFError,
    ValueError,
    NotImplementedError,  # unknown compression
    RuntimeError,  # a password
    struct.error,  # a mangled directory
)
LARGEST_MODEL_BYTES = 2**30  # a zip of a few kB can unpack to more than any memory
MOST_MARKS = 12_000_000  # each element takes 80 bytes of memory and more; eight million triangles are below
DEEPEST = 32  # components within components; a ring of them would never end
_IDENTITY = np.vstack([np.eye(3), np.zeros(3)])


@dataclass(frozen=True)
class Model:
    """A model part of the package: its root element, its objects by their numbers, the colours of its groups of colours or of
    materials, and the surfaces made of them so far."""

    root: ElementTree.Element
    objects: dict[str, ElementTree.Element]
    palettes: dict[str, list[int]]
    surfaces: dict[str, Surface] = field(default_factory=dict)


@dataclass(frozen=True)
class Package:
    """An open 3MF file and the model parts of it that have been parsed."""

    path: Path
    archive: zipfile.ZipFile
    models: dict[str, Model] = field(default_factory=dict)

    def parse(self, name: str) -> ElementTree.Element:
        """The root element of a part; raises MeshError when it is missing, too large or malformed."""
        try:
            if self.archive.getinfo(name).file_size > LARGEST_MODEL_BYTES:
                raise MeshError(f"{self.path}: its part {name} unpacks to more than {LARGEST_MODEL_BYTES} bytes")
            content = self.archive.read(name)
            if content.count(b"<") > MOST_MARKS or content.count(b"=") > 4 * MOST_MARKS:
                raise MeshError(f"{self.path}: its part {name} has more than {MOST_MARKS} elements or too many attributes")
            return ElementTree.fromstring(content)
        except DAMAGES as error:
            raise MeshError(f"{self.path}: its part {name} is missing or malformed ({error})") from None

    def model(self, name: str) -> Model:
        """A model part, parsed once; raises MeshError."""
        name = name.lstrip("/")
        if name not in self.models:
            root = self.parse(name)
            objects = {element.get("id", ""): element for element in reversed(root.findall(f"{CORE}resources/{CORE}object"))}
            self.models[name] = Model(root, objects, _palettes(root))
        return self.models[name]


@dataclass(frozen=True)
class Placement:
    """An object of a model part that a build item or a component places; a point p lies at [p 1] @ transform."""

    part: str
    identity: str
    transform: Floats
    depth: int


def read(path: Path) -> list[Surface]:
    """One surface for every mesh that the build places, in mm.

    Raises MeshError for a damaged package, an unknown unit, an object that does not exist and indices out of range.
    """
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, struct.error, ValueError, NotImplementedError):
        raise MeshError(f"{path}: is not a 3MF file: not a zip archive, or one that is cut short") from None
    with archive:
        surfaces = _built_meshes(Package(path, archive))
    if not surfaces:
        raise MeshError(f"{path}: its build places no mesh")
    return surfaces


def _built_meshes(package: Package) -> list[Surface]:
    """The meshes of all build items and their components, in the order of the file."""
    start = _start_part(package)
    items = package.model(start).root.findall(f"{CORE}build/{CORE}item")
    pending = [_placement(package, item, start, _IDENTITY, 0) for item in reversed(items)]
    surfaces: list[Surface] = []
    placed, faces = 0, 0
    while pending:
        placement = pending.pop()
        placed += 1
        check_placed(package.path, placed)
        model = package.model(placement.part)
        element = model.objects.get(placement.identity)
        if element is None or placement.depth > DEEPEST:
            why = "it does not exist" if element is None else "its components contain each other"
            raise MeshError(f"{package.path}: object {placement.identity!r} cannot be placed: {why}")
        mesh = element.find(f"{CORE}mesh")
        if mesh is not None:
            if placement.identity not in model.surfaces:
                model.surfaces[placement.identity] = _mesh_surface(package.path, mesh, element.get("pid", ""), model.palettes)
            surface = model.surfaces[placement.identity]
            surfaces.append(_transformed(package.path, surface, placement.transform, _unit_mm(package.path, model.root)))
            faces += len(surface.faces)
            check_meshes(package.path, len(surfaces), faces)
            continue
        components = element.findall(f"{CORE}components/{CORE}component")
        pending += [
            _placement(package, component, placement.part, placement.transform, placement.depth + 1)
            for component in reversed(components)
        ]
    return surfaces


def _start_part(package: Package) -> str:
    """Name of the part that the package's relationships call the 3D model."""
    for relation in package.parse("_rels/.rels").iter(RELATION):
        if relation.get("Type") == MODEL_TYPE:
            return relation.get("Target", "")
    raise MeshError(f"{package.path}: its relationships name no 3D model")


def _placement(package: Package, element: ElementTree.Element, part: str, outer: Floats, depth: int) -> Placement:
    """What an item or a component of a part places, within an outer transform."""
    transform = np.column_stack([_transform(package.path, element), [0, 0, 0, 1]]) @ outer
    return Placement(element.get(PRODUCTION_PATH, part), element.get("objectid", ""), transform, depth)


def _unit_mm(path: Path, root: ElementTree.Element) -> float:
    unit = root.get("unit", "millimeter")
    if unit not in UNIT_MM:
        raise MeshError(f"{path}: its unit {unit!r} is unknown; allowed are {', '.join(UNIT_MM)}")
    return UNIT_MM[unit]


def _palettes(root: ElementTree.Element) -> dict[str, list[int]]:
    """The colours of every group of colours or of materials, by its number; NO_COLOUR for one that is not understood."""
    palettes = {}
    for kind, entry, attribute in ((f"{CORE}basematerials", f"{CORE}base", "displaycolor"), (*COLOUR_GROUP, "color")):
        for group in root.findall(f"{CORE}resources/{kind}"):
            colours = (parse_colour(element.get(attribute, "")) for element in group.findall(entry))
            palettes[group.get("id", "")] = [NO_COLOUR if colour is None else colour for colour in colours]
    return palettes


def _triangle_colours(triangles: list[ElementTree.Element], pid: str, palettes: dict[str, list[int]]) -> Indices | None:
    """(m,) colours of the triangles that name one for themselves, the same at all corners; None where none does. pid: the
    object's group, which a triangle may leave out; the object's own colour marks nothing."""

    def colour_of(triangle: ElementTree.Element) -> int:
        first = triangle.get("p1", "")
        palette = palettes.get(triangle.get("pid", pid), [])
        alike = {triangle.get(corner, first) for corner in ("p2", "p3")} == {first}
        return palette[int(first)] if alike and first.isdecimal() and int(first) < len(palette) else NO_COLOUR

    colours = (
        np.array([colour_of(triangle) for triangle in triangles], dtype=np.int64) if palettes else np.zeros(0, dtype=np.int64)
    )
    return colours if (colours != NO_COLOUR).any() else None


def _mesh_surface(path: Path, mesh: ElementTree.Element, pid: str, palettes: dict[str, list[int]]) -> Surface:
    """The surface of an object's mesh. pid: the object's group of colours, palettes: all groups."""
    points = [(v.get("x", ""), v.get("y", ""), v.get("z", "")) for v in mesh.iter(f"{CORE}vertex")]
    triangles = list(mesh.iter(f"{CORE}triangle"))
    corners = [(t.get("v1", ""), t.get("v2", ""), t.get("v3", "")) for t in triangles]
    vertices, faces = parse_floats(path, points, "a vertex"), parse_integers(path, corners, "a triangle")
    return check_surface(path, vertices, faces, _triangle_colours(triangles, pid, palettes))


def _transformed(path: Path, surface: Surface, transform: Floats, unit_mm: float) -> Surface:
    vertices = surface.vertices
    if not np.array_equal(transform, _IDENTITY):
        vertices = vertices @ transform[:3] + transform[3]
    mirrored = np.linalg.det(transform[:3]) < 0
    faces = surface.faces[:, ::-1] if mirrored else surface.faces
    return check_surface(path, vertices * unit_mm if unit_mm != 1.0 else vertices, faces, surface.colours)


def _transform(path: Path, element: ElementTree.Element) -> Floats:
    """(4, 3): rows of the 3 x 3 part, then the shift, as the specification writes them."""
    text = element.get("transform")
    if text is None:
        return _IDENTITY
    values = parse_floats(path, [text.split()], "a transform")
    if values.shape != (12,) or not np.isfinite(values).all():
        raise MeshError(f"{path}: a transform has {values.size} numbers instead of 12 finite ones: `{text}`")
    return values.reshape(4, 3)
