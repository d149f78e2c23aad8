"""3MF: the build items of the package with their transforms, components and unit, in mm (3MF Core Specification 1.3)."""

import lzma
import struct
import zipfile
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from mdp.mesh import Floats
from mdp.surface import Surface, checked, numbers, whole_numbers
from profiles.errors import MeshError

UNIT_MM = {"micron": 0.001, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
PRODUCTION_PATH = "{http://schemas.microsoft.com/3dmanufacturing/production/2015/06}path"
RELATION = "{http://schemas.openxmlformats.org/package/2006/relationships}Relationship"
MODEL_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
DAMAGES: tuple[type[Exception], ...] = (
    KeyError,
    ElementTree.ParseError,
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    EOFError,
)
DAMAGES += (
    ValueError,
    LookupError,
    NotImplementedError,
    RuntimeError,
    struct.error,
)  # unknown compression, a password, a mangled directory
LARGEST_MODEL_BYTES = 2**30  # a zip of a few kB can unpack to more than any memory
DEEPEST = 32  # components within components; a ring of them would never end


@dataclass(frozen=True)
class Package:
    """An open 3MF file and the model parts of it that have been parsed."""

    path: Path
    archive: zipfile.ZipFile
    parts: dict[str, ElementTree.Element] = field(default_factory=dict)

    def model(self, name: str) -> ElementTree.Element:
        """The root element of a model part; raises MeshError when it is missing, too large or malformed."""
        name = name.lstrip("/")
        if name not in self.parts:
            try:
                if self.archive.getinfo(name).file_size > LARGEST_MODEL_BYTES:
                    raise MeshError(f"{self.path}: its part {name} unpacks to more than {LARGEST_MODEL_BYTES} bytes")
                self.parts[name] = ElementTree.fromstring(self.archive.read(name))
            except DAMAGES as error:
                raise MeshError(f"{self.path}: its part {name} is missing or malformed ({error})") from None
        return self.parts[name]


def read(path: Path) -> list[Surface]:
    """One surface for every mesh that the build places, in mm.

    Raises MeshError for a damaged package, an unknown unit, an object that does not exist and indices out of range.
    """
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, struct.error, ValueError, NotImplementedError):
        raise MeshError(f"{path}: is not a 3MF file: not a zip archive, or one that is cut short") from None
    with archive:
        package = Package(path, archive)
        start = _start(package)
        surfaces: list[Surface] = []
        for item in package.model(start).iter(f"{CORE}item"):
            part = item.get(PRODUCTION_PATH, start)
            surfaces += _placed(package, part, item.get("objectid", ""), _transform(path, item), 0)
    if not surfaces:
        raise MeshError(f"{path}: its build places no mesh")
    return surfaces


def _start(package: Package) -> str:
    """Name of the part that the package's relationships call the 3D model."""
    for relation in package.model("_rels/.rels").iter(RELATION):
        if relation.get("Type") == MODEL_TYPE:
            return relation.get("Target", "")
    raise MeshError(f"{package.path}: its relationships name no 3D model")


def _placed(package: Package, part: str, identity: str, transform: Floats, depth: int) -> list[Surface]:
    """The meshes of an object and its components; a point p of the object lies at [p 1] @ transform in the parent."""
    root = package.model(part)
    found = [element for element in root.iter(f"{CORE}object") if element.get("id") == identity]
    if not found or depth > DEEPEST:
        why = "its components contain each other" if found else "it does not exist"
        raise MeshError(f"{package.path}: object {identity!r} cannot be placed: {why}")
    mesh = found[0].find(f"{CORE}mesh")
    if mesh is not None:
        return [_surface(package.path, mesh, transform, _unit_mm(package.path, root))]
    surfaces: list[Surface] = []
    for component in found[0].iter(f"{CORE}component"):
        inner = _transform(package.path, component)
        whole = np.column_stack([inner, [0, 0, 0, 1]]) @ transform
        surfaces += _placed(package, component.get(PRODUCTION_PATH, part), component.get("objectid", ""), whole, depth + 1)
    return surfaces


def _unit_mm(path: Path, root: ElementTree.Element) -> float:
    unit = root.get("unit", "millimeter")
    if unit not in UNIT_MM:
        raise MeshError(f"{path}: its unit {unit!r} is unknown; allowed are {', '.join(UNIT_MM)}")
    return UNIT_MM[unit]


def _surface(path: Path, mesh: ElementTree.Element, transform: Floats, unit_mm: float) -> Surface:
    points = [(v.get("x", ""), v.get("y", ""), v.get("z", "")) for v in mesh.iter(f"{CORE}vertex")]
    corners = [(t.get("v1", ""), t.get("v2", ""), t.get("v3", "")) for t in mesh.iter(f"{CORE}triangle")]
    vertices = numbers(path, points, "a vertex").reshape(-1, 3)
    faces = whole_numbers(path, corners, "a triangle").reshape(-1, 3)
    checked(path, vertices, faces)
    if not np.array_equal(transform, _IDENTITY):
        vertices = vertices @ transform[:3] + transform[3]
    mirrored = np.linalg.det(transform[:3]) < 0
    return checked(path, vertices * unit_mm if unit_mm != 1.0 else vertices, faces[:, ::-1] if mirrored else faces)


_IDENTITY = np.vstack([np.eye(3), np.zeros(3)])


def _transform(path: Path, element: ElementTree.Element) -> Floats:
    """(4, 3): rows of the 3 x 3 part, then the shift, as the specification writes them."""
    text = element.get("transform")
    if text is None:
        return _IDENTITY
    values = numbers(path, [text.split()], "a transform")
    if values.shape != (12,) or not np.isfinite(values).all():
        raise MeshError(f"{path}: a transform has {values.size} numbers instead of 12 finite ones: `{text}`")
    return values.reshape(4, 3)
