"""3MF: the build items of the package with their transforms, components and unit, in mm (3MF Core Specification 1.3), the colours
of their triangles (Materials and Properties Extension 1.2), and the roles of volumes in slicer files.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar
from urllib.parse import unquote
from xml.etree import ElementTree
from zipfile import ZipFile

import numpy as np

from mdp.formats.slicer_file import (
    PAINTS,
    PART,
    Build,
    BuildObject,
    Heights,
    Plate,
    Role,
    painted_shares,
    read_bambu,
    read_cura,
    read_heights,
    read_prusaslicer,
)
from mdp.formats.surface import Surface, check_meshes, check_placed, check_surface, parse_floats, parse_integers
from mdp.mesh import NO_COLOUR, Floats, Indices, parse_colour
from profiles.errors import MeshError, first_line
from profiles.files import DAMAGED_ZIP
from profiles.messages import key_name, option, phrase

UNIT_MM = {"micron": 0.001, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}
MATERIAL = "{http://schemas.microsoft.com/3dmanufacturing/material/2015/02}"
COLOUR_GROUP = (f"{MATERIAL}colorgroup", f"{MATERIAL}color")
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
PRODUCTION_PATH = f"{{{PRODUCTION}}}path"
RELATION = "{http://schemas.openxmlformats.org/package/2006/relationships}Relationship"
MODEL_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
EXTENSION = re.compile(r"3dmanufacturing/([a-z]+)/\d{4}")  # an extension's name in its namespace
EXTENSIONS = {"core", "production", "material", "trianglesets"}  # those that do not change the geometry beyond what is read here
PLAIN = "the program that made the file can export plain triangles"
GCODE_ONLY = "nothing but G-code of a sliced plate: save the project in its slicer (File, Save Project) instead"
NOT_PRINTED = ("support", "solidsupport", "other")  # types of objects
PRUSASLICER = ("metadata/slic3r_pe_model.config", "metadata/slic3r_model.config", "metadata/superslicer_model.config")
BAMBU = "metadata/model_settings.config"
HEIGHTS = ("metadata/prusa_slicer_layer_config_ranges.xml", "metadata/layer_config_ranges.xml")
NOT_TAKEN = {  # parts of a package that are ignored, and what they would change
    **dict.fromkeys(
        ("metadata/slic3r_pe_layer_heights_profile.txt", "metadata/layer_heights_profile.txt"),
        f"its variable layer heights are not taken: {key_name('process.adaptive_cusp_mm')}",
    ),
    **dict.fromkeys(
        ("metadata/prusa_slicer_custom_gcode_per_print_z.xml", "metadata/custom_gcode_per_layer.xml"),
        f"its pauses and changes of filament at heights are not taken: {option('pause')}, {option('filament-change')}",
    ),
}
TAKEN_PAINT = "paints for and against support and against seams"
PAINTED = {  # attributes of painted triangles, by what they would change
    "support": ("paint_supports", "slic3rpe:custom_supports"),
    "seams": ("paint_seam", "slic3rpe:custom_seam"),
    "filaments": ("paint_color", "slic3rpe:mmu_segmentation"),
    "fuzzy skin": ("paint_fuzzy_skin", "slic3rpe:fuzzy_skin"),
}
LARGEST_MODEL_BYTES = 2**30  # a zip of a few kB can unpack to more than any memory holds
MOST_ELEMENTS = 12_000_000  # an element takes 80 bytes of memory or more; eight million triangles stay below this
DEEPEST = 32  # nesting of components; a ring of them would never end
_IDENTITY = np.vstack([np.eye(3), np.zeros(3)])
_Read = TypeVar("_Read")


class Model(NamedTuple):
    """A model part of the package: its root element, its objects by ID, the colours of its colour groups or base materials, the
    purposes of its paint, and the surfaces parsed so far.
    """

    root: ElementTree.Element
    objects: dict[str, ElementTree.Element]
    palettes: dict[str, list[int]]
    painted: tuple[str, ...]
    surfaces: dict[str, Surface]


class Placement(NamedTuple):
    """An object placed by a build item or a component; a point p lies at [p 1] @ transform. within: IDs of the enclosing objects,
    outermost first; role: role given by them, None if none is given.
    """

    part: str
    identity: str
    transform: Floats
    within: tuple[str, ...] = ()
    role: Role | None = None


def read_build(path: Path, plate: int | None = None) -> Build:
    """The objects that the build prints on one plate; None: the first plate with objects.

    Raises MeshError for a damaged package, an unknown unit, a missing object or plate, an index out of range, and a required
    extension that is not supported.
    """
    try:
        archive = ZipFile(path)
    except DAMAGED_ZIP:
        raise MeshError(f"{path} is not a 3MF file: not a zip archive, or one that is cut short") from None
    with archive:
        return _Builder(path, archive).build(plate)


class _Builder:
    """Builder: reads the build of an open package."""

    def __init__(self, path: Path, archive: ZipFile) -> None:
        self._path, self._archive = path, archive
        self._models: dict[str, Model] = {}  # parsed so far
        self._start = _start_part(archive)
        heights = _config(archive, HEIGHTS, read_heights)
        bambu = _config(archive, (BAMBU,), read_bambu)
        prusaslicer = None if bambu else _config(archive, PRUSASLICER, read_prusaslicer)
        self._heights = heights or {}
        self._objects, self._parts, self._plates = bambu or (prusaslicer[0] if prusaslicer else {}, {}, [])
        self._triangles = prusaslicer[1] if prusaslicer else {}
        self._notes: list[str] = []
        self._unpainted: Counter[str] = Counter()
        self._in_part = 0  # triangles that count as painted
        self._placed = self._meshes = self._faces = 0
        objects = self._model(self._start).root.findall("{*}resources/{*}object")
        if not self._parts:
            objects = [element for element in objects if element.find("{*}mesh") is not None]
        self._rank = {element.get("id", ""): str(place) for place, element in enumerate(objects, start=1)}

    def build(self, plate: int | None) -> Build:
        """The objects printed on a plate, with notes."""
        notes = self._notes
        items = self._model(self._start).root.findall("{*}build/{*}item")
        counts: Counter[str] = Counter()
        instances = []
        for number in (item.get("objectid", "") for item in items):
            instances.append((number, counts[number]))
            counts[number] += 1
        printed = {instance for instance, item in zip(instances, items, strict=True) if _is_printed(item)}
        plates = [plate for plate in self._plates if plate[2] & printed]
        chosen = self._items(items, instances, self._plate(plates, plate))
        built = [placed for item in chosen if (placed := self._object(item)) is not None]
        if not any(placed.surfaces(PART) for placed in built):
            sliced = any(name.lower().endswith(".gcode") for name in self._archive.namelist())
            why = f" that is printed: it {notes[0]}" if notes else f", it keeps {GCODE_ONLY}" if sliced else ""
            raise MeshError(f"{self._path}: its build places no mesh{why}")
        notes += [
            f"{count} triangle{'s' * (count > 1)} painted for {what} {'are' if count > 1 else 'is'} not taken"
            + (f": only {TAKEN_PAINT} are, on more than half of a triangle" if what in ("support", "seams") else "")
            for what, count in self._unpainted.items()
            if count
        ]
        if self._in_part:
            triangles = f"{self._in_part} triangles are" if self._in_part > 1 else "1 triangle is"
            notes.append(f"{triangles} painted in part, more than half of the area, and taken as a whole")
        strange = sorted(self._heights.keys() - set(self._rank.values()))
        notes += [f"the height ranges of object {number} are left out: there is no such object" for number in strange]
        notes += dict.fromkeys(note for name, note in NOT_TAKEN.items() if _entry(self._archive, name) is not None)
        return Build(built, tuple(dict.fromkeys(notes)), bool(self._objects), {number: name for number, name, _ in plates})

    def _items(
        self, items: list[ElementTree.Element], instances: list[tuple[str, int]], chosen: Plate | None
    ) -> Iterator[ElementTree.Element]:
        """The items printed on a plate; None for a file without plates."""
        for item, instance in zip(items, instances, strict=True):
            if not _is_printed(item):
                self._leave_out(item.get("objectid", ""), "which is switched off in its slicer")
            elif chosen is None or instance in chosen[2]:
                yield item
            elif not any(instance in standing for _, _, standing in self._plates):
                self._leave_out(item.get("objectid", ""), "which stands on none of its plates")

    def _plate(self, plates: list[Plate], wanted: int | None) -> Plate | None:
        """The plate with a number, or else the first one, among plates with printed objects; None for a file without plates."""
        if wanted is None:
            if len(plates) > 1:
                first, name, _ = plates[0]
                others = ", ".join(str(number) for number, _, _ in plates[1:])
                self._notes.append(
                    f"prints plate {first}{f' ({name})' if name else ''}; "
                    f"{phrase('another plate', '--plate prints another')}: {others}"
                )
            return plates[0] if plates else None
        if not plates:
            raise MeshError(
                f"{self._path} has no plates: {option('plate', wanted)} goes with a file of Bambu Studio or OrcaSlicer"
            )
        for plate in plates:
            if plate[0] == wanted:
                return plate
        known = ", ".join(str(number) for number, _, _ in plates)
        why = "is empty" if any(number == wanted for number, _, _ in self._plates) else "does not exist"
        raise MeshError(
            f"{self._path}: {option('plate', wanted)}: that plate {why}; plate{'s' * (len(plates) > 1)} with objects: {known}"
        )

    def _model(self, name: str) -> Model:
        """A model part of the package, parsed once. Raises MeshError."""
        name = name.lstrip("/")
        if name not in self._models:
            self._models[name] = _model(self._archive, name)
        return self._models[name]

    def _object(self, item: ElementTree.Element) -> BuildObject | None:
        """The object that an item places; None if nothing of it is printed."""
        volumes: list[tuple[Surface, Role]] = []
        settings: Mapping[str, str] = {}
        heights: Heights = ()
        pending = [self._placement(item, Placement(self._start, "", _IDENTITY))]
        while pending:
            placement = pending.pop()
            self._placed += 1
            check_placed(self._path, self._placed)
            model = self._model(placement.part)
            element = model.objects.get(placement.identity)
            if element is None or len(placement.within) > DEEPEST:
                why = "it does not exist" if element is None else "its components contain each other"
                raise MeshError(f"{self._path}: object {placement.identity!r} cannot be placed: {why}")
            placement = self._with_role(placement, element)
            if placement.role is None and element.get("type") in NOT_PRINTED:
                self._leave_out(placement.identity, f"an object of type {element.get('type')}, which is not printed")
                continue
            mesh = element.find("{*}mesh")
            if mesh is not None:
                volumes += self._volumes(placement, model, mesh, element.get("pid", ""))
                whole = placement.identity if placement.part == self._start else ""
                for number in (*placement.within[:1], whole):
                    settings = {**settings, **self._objects.get(number, Role()).settings}
                    heights = self._heights.get(self._rank.get(number, ""), heights)
                continue
            components = element.findall("{*}components/{*}component")
            self._check_understood(element, bool(components))
            pending += [self._placement(component, placement) for component in reversed(components)]
        name = self._objects.get(item.get("objectid", ""), Role()).name
        return BuildObject(volumes, settings, heights, name) if volumes else None

    def _with_role(self, placement: Placement, element: ElementTree.Element) -> Placement:
        """The placement with the role that the slicer gives to its object."""
        within, parts = placement.within, self._parts
        role = parts.get(((*within, placement.identity)[0], placement.identity))
        cura = read_cura(element)
        if role is None and (cura.kind != PART or cura.settings):
            outer = Role() if placement.role is None else placement.role
            kind = cura.kind if outer.kind == PART else outer.kind
            role = Role(kind, cura.name or outer.name, {**outer.settings, **cura.settings})
        return placement if role is None else placement._replace(role=role)

    def _volumes(self, placement: Placement, model: Model, mesh: ElementTree.Element, pid: str) -> Iterator[tuple[Surface, Role]]:
        """The volumes of an object's mesh, at a placement."""
        if placement.identity not in model.surfaces:
            model.surfaces[placement.identity] = _mesh_surface(self._path, mesh, pid, model.palettes)
        surface = model.surfaces[placement.identity]
        self._meshes += 1
        self._faces += len(surface.faces)
        check_meshes(self._path, self._meshes, self._faces)
        surface = _transformed(self._path, surface, placement.transform, _unit_mm(self._path, model.root))
        if placement.role is None or placement.role.kind == PART:
            yield from self._painted(surface, mesh, model.painted)
        triangles = self._triangles.get(placement.identity, ()) if placement.part == self._start else ()
        if placement.role is not None or not triangles:
            yield surface, placement.role or Role()
            return
        rest = np.ones(len(surface.faces), dtype=np.bool_)
        for first, last, role in triangles:
            if not 0 <= first <= last < len(surface.faces):
                of = f"object {placement.identity}, which has {len(surface.faces)}"
                raise MeshError(f"{self._path}: volume {role.name!r} has triangles {first} to {last} of {of} (counted from 0)")
            rest[first : last + 1] = False
            yield _piece(surface, slice(first, last + 1)), role
        if rest.any():
            yield _piece(surface, np.flatnonzero(rest)), Role()

    def _painted(self, surface: Surface, mesh: ElementTree.Element, painted: Sequence[str]) -> Iterator[tuple[Surface, Role]]:
        """The painted triangles of a mesh: those with a supported paint on more than half of their area; others are counted."""
        triangles = mesh.findall("{*}triangles/{*}triangle") if painted else []
        for what in painted:
            chosen: dict[str, list[int]] = {}
            for number, triangle in enumerate(triangles):
                if digits := next((text for name in PAINTED[what] if (text := _attribute(triangle, name))), ""):
                    kind = _paint(what, digits)
                    self._unpainted[what] += not kind
                    self._in_part += bool(kind) and len(digits) > 1
                    chosen.setdefault(kind, []).append(number)
            for kind, numbers in chosen.items():
                if kind:
                    yield _piece(surface, np.array(numbers)), Role(kind)

    def _check_understood(self, element: ElementTree.Element, has_components: bool) -> None:
        """Raise MeshError for an object whose shape is given in an unsupported form."""
        names = [child.tag.rpartition("}")[2] for child in element]
        others = [name for name in names if name not in ("components", "metadatagroup", "settings")]
        if others and not has_components:
            raise MeshError(f"{self._path}: object {element.get('id')!r} is a {others[0][:40]}, which is not read: {PLAIN}")

    def _placement(self, element: ElementTree.Element, outer: Placement) -> Placement:
        """The placement of the object that an item or a component of a placed object refers to."""
        transform = np.column_stack([_transform(self._path, element), [0, 0, 0, 1]]) @ outer.transform
        within = (*outer.within, outer.identity) if outer.identity else ()
        return Placement(element.get(PRODUCTION_PATH, outer.part), element.get("objectid", ""), transform, within, outer.role)

    def _leave_out(self, number: str, why: str) -> None:
        element = self._model(self._start).objects.get(number)
        name = self._objects.get(number, Role()).name or ("" if element is None else element.get("name", ""))
        self._notes.append(f"leaves out object {name or number}, {why}")


def _paint(what: str, digits: str) -> str:
    """The kind of paint on more than half of a triangle; empty if there is no supported kind."""
    try:
        shares = painted_shares(digits) if what in ("support", "seams") else {}
    except ValueError:
        return ""
    return next((kind for (subject, paint), kind in PAINTS.items() if subject == what and shares.get(paint, 0.0) > 0.5), "")


def _attribute(element: ElementTree.Element, name: str) -> str:
    """An attribute whose prefix may stand for any namespace."""
    prefix, _, bare = name.rpartition(":")
    if not prefix:
        return element.get(name, "")
    return next((text for key, text in element.attrib.items() if key.rpartition("}")[2] == bare), "")


def _is_printed(item: ElementTree.Element) -> bool:
    return item.get("printable", "1").lower() not in ("0", "false")


def _entry(archive: ZipFile, name: str) -> str | None:
    """The zip entry of a part, whose name is case-insensitive (Open Packaging Conventions, 6.2.2.3); None if there is none."""
    wanted, entries = unquote(name).lstrip("/"), archive.namelist()
    return wanted if wanted in entries else next((name for name in entries if name.lower() == wanted.lower()), None)


def _content(archive: ZipFile, name: str) -> bytes:
    """The bytes of a part; raises MeshError if it is missing or too large."""
    try:
        entry = _entry(archive, name)
        if entry is None:
            raise LookupError("there is no such part")
        if archive.getinfo(entry).file_size > LARGEST_MODEL_BYTES:
            raise MeshError(f"{archive.filename}: its part {name} unpacks to more than {LARGEST_MODEL_BYTES} bytes")
        content = archive.read(entry)
    except DAMAGED_ZIP as error:
        raise _damaged(archive, name, error) from None
    if content.count(b"<") > MOST_ELEMENTS or content.count(b"=") > 4 * MOST_ELEMENTS:
        raise MeshError(f"{archive.filename}: its part {name} has more than {MOST_ELEMENTS} elements or too many attributes")
    return content


def _parse(archive: ZipFile, name: str, content: bytes) -> ElementTree.Element:
    """The root element of a part; raises MeshError if it is malformed."""
    try:
        return _tree(content)
    except (LookupError, ValueError, ElementTree.ParseError) as error:
        raise _damaged(archive, name, error) from None


def _damaged(archive: ZipFile, name: str, error: Exception) -> MeshError:
    return MeshError(f"{archive.filename}: its part {name} is missing or malformed ({first_line(error)})")


def _config(archive: ZipFile, names: tuple[str, ...], read: Callable[[ElementTree.Element], _Read]) -> _Read | None:
    """The content of the first of some parts that the package has, as `read` returns it; None if it has none. Raises
    MeshError.
    """
    name = next((name for name in names if _entry(archive, name) is not None), None)
    if name is None:
        return None
    root = _parse(archive, name, _content(archive, name))
    try:
        return read(root)
    except ValueError as error:
        raise MeshError(f"{archive.filename}: its part {_entry(archive, name)} is malformed: {error}") from None


def _model(archive: ZipFile, name: str) -> Model:
    """A parsed model part. Raises MeshError, also for a required extension that is not supported."""
    content = _content(archive, name)
    root = _parse(archive, name, content)
    if root.tag.rpartition("}")[2] != "model":
        raise MeshError(f"{archive.filename}: its part {name} is not a 3MF model: its first element is {root.tag[:60]!r}")
    for prefix in root.get("requiredextensions", "").split():
        declared = re.search(rb"xmlns:%s\s*=\s*[\"']([^\"']*)" % re.escape(prefix.encode()), content)
        namespace = declared[1].decode(errors="replace") if declared else prefix
        named = EXTENSION.search(namespace)
        if (named[1] if named else prefix) not in EXTENSIONS and prefix not in ("p", "m"):
            needed = named[1] if named else namespace
            raise MeshError(f"{archive.filename} needs the 3MF extension {needed}, which is not read: {PLAIN}")
    objects = {element.get("id", ""): element for element in reversed(root.findall("{*}resources/{*}object"))}
    painted = tuple(
        what for what, names in PAINTED.items() if any(re.search(rb'%s="[^"]' % name.encode(), content) for name in names)
    )
    return Model(root, objects, _palettes(root), painted, {})


def _tree(content: bytes) -> ElementTree.Element:
    """The root element of a document, tolerating undeclared prefixes."""
    try:
        return ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        root = re.match(rb"(?:\s|\xef\xbb\xbf|<!--.*?-->|<\?.*?\?>)*<[A-Za-z_][\w.:-]*", content, re.DOTALL)
        if "unbound prefix" not in str(error) or root is None:
            raise
    used = {*re.findall(rb"[\s</]([A-Za-z_][\w.-]*):[A-Za-z_]", content)} - {b"xml", b"xmlns"}
    missing = sorted(used - {*re.findall(rb"xmlns:([\w.-]+)\s*=", content)})
    meant = {b"p": PRODUCTION.encode(), b"m": MATERIAL.strip("{}").encode()}
    declared = b"".join(b' xmlns:%s="%s"' % (prefix, meant.get(prefix, prefix)) for prefix in missing)
    return ElementTree.fromstring(content[: root.end()] + declared + content[root.end() :])


def _start_part(archive: ZipFile) -> str:
    """Name of the package's 3D model part, by its relationships."""
    name = "_rels/.rels"
    for relation in _parse(archive, name, _content(archive, name)).iter(RELATION):
        if relation.get("Type") == MODEL_TYPE:
            return relation.get("Target", "").lstrip("/")
    raise MeshError(f"{archive.filename}: its relationships name no 3D model")


def _piece(surface: Surface, chosen: slice | Indices) -> Surface:
    """A subset of a surface's faces, with the vertices that they use."""
    vertices, faces = np.unique(surface.faces[chosen], return_inverse=True)
    colours = None if surface.colours is None else surface.colours[chosen]
    return Surface(surface.vertices[vertices], faces.reshape(-1, 3), colours)


def _unit_mm(path: Path, root: ElementTree.Element) -> float:
    unit = root.get("unit", "millimeter")
    if unit not in UNIT_MM:
        raise MeshError(f"{path}: its unit {unit!r} is unknown; allowed are {', '.join(UNIT_MM)}")
    return UNIT_MM[unit]


def _palettes(root: ElementTree.Element) -> dict[str, list[int]]:
    """The colours of every colour group or base material, by ID; NO_COLOUR for an invalid colour."""
    palettes = {}
    for kind, entry, attribute in (("{*}basematerials", "{*}base", "displaycolor"), (*COLOUR_GROUP, "color")):
        for group in root.findall(f"{{*}}resources/{kind}"):
            colours = (parse_colour(element.get(attribute, "")) for element in group.findall(entry))
            palettes[group.get("id", "")] = [NO_COLOUR if colour is None else colour for colour in colours]
    return palettes


def _triangle_colours(triangles: list[ElementTree.Element], pid: str, palettes: dict[str, list[int]]) -> Indices | None:
    """(m,) colours of the triangles that have one of their own, equal at all corners; None if there are none. pid: the object's
    colour group, which triangles inherit; the object's own colour marks nothing.
    """

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
    """The surface of an object's mesh. pid: the object's colour group; palettes: all colour groups."""
    if mesh.find("{*}beamlattice") is not None:
        raise MeshError(f"{path}: its mesh is a lattice of beams, which is not read: {PLAIN}")
    points = [(v.get("x", ""), v.get("y", ""), v.get("z", "")) for v in mesh.findall("{*}vertices/{*}vertex")]
    triangles = mesh.findall("{*}triangles/{*}triangle")
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
    """(4, 3) transform of an element: the rows of its 3 x 3 part, then the shift, as the specification writes them."""
    text = element.get("transform")
    if text is None:
        return _IDENTITY
    values = parse_floats(path, [text.split()], "a transform")
    if values.shape != (12,) or not np.isfinite(values).all():
        raise MeshError(f"{path}: a transform has {values.size} numbers instead of 12 finite ones: `{text}`")
    return values.reshape(4, 3)
