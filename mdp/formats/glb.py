"""GLB (binary glTF 2.0): the triangles of the scene and the colours of their materials, coordinates taken as mm with z up.

The specification says metres with y up, but programs for 3D printing write their mm and their z unchanged, so nothing is turned
or scaled here; the check of the size detects a model in metres, and a model on its side can be turned when it is read.
"""

import json
import struct
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mdp.formats.surface import Surface, check_meshes, check_placed, check_surface
from mdp.mesh import NO_COLOUR, Floats
from profiles.errors import MeshError

MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942  # "glTF", "JSON" and "BIN" read as little-endian numbers
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
TYPES = {1: "SCALAR", 3: "VEC3"}  # types of accessors, by the number of values in a row
LINES_TO, TRIANGLES = 3, 4  # modes of primitives: up to 3 they are points and lines
UNNAMED = frozenset({"SOLID", "SHELL", "COMPOUND", "COMPSOLID", "FACE"})  # OpenCASCADE's names for unnamed shapes
DEEPEST = 64  # nesting of nodes
# Extensions that a file may require: integer positions, which are read, and those of appearance and other data, which are
# ignored. Any other extension may change the geometry.
READ_REQUIRED = "KHR_mesh_quantization", "KHR_xmp_json_ld", "KHR_animation_pointer"
LOOKS_REQUIRED = "KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "EXT_lights_"


def read(path: Path) -> list[Surface]:
    """One surface for every mesh primitive that the scene places; points and lines are left out with a note.

    Raises MeshError for a damaged file, compressed geometry, outside buffers and strips or fans of triangles.
    """
    return read_scene(path, path.read_bytes())


def read_scene(path: Path, content: bytes) -> list[Surface]:
    """The surfaces of a GLB file's content. path: the name for messages. Raises MeshError as `read` does."""
    document, binary = _chunks(path, content)
    try:
        check_extensions(path, document)
        surfaces, bare = _scene_meshes(path, document, binary)
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError):
        raise MeshError(f"{path} is damaged: its glTF document holds something of a kind that does not belong there") from None
    if not surfaces:
        raise MeshError(f"{path}: its scene places no mesh" + (" but points and lines" if bare else ""))
    if bare:
        of_parts = "one of its parts" if bare == 1 else f"{bare} of its parts"
        surfaces[0] = replace(surfaces[0], notes=(f"left out points and lines in {of_parts}: only solids and faces are printed",))
    return _marks(surfaces)


def _chunks(path: Path, content: bytes) -> tuple[Any, bytes]:
    magic, version, length = struct.unpack("<III", content[:12]) if len(content) >= 20 else (0, 0, 0)
    if magic != MAGIC or version != 2:
        raise MeshError(f"{path} is not a GLB file of version 2")
    if len(content) < length:
        raise MeshError(f"{path} is cut short: it holds {len(content)} of the {length} bytes that its header announces")
    chunks: dict[int, bytes] = {}
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack("<II", content[offset : offset + 8])
        chunks.setdefault(kind, content[offset + 8 : offset + 8 + size])
        offset += 8 + size
    try:
        return json.loads(chunks.get(JSON_CHUNK, b"")), chunks.get(BINARY_CHUNK, b"")
    except RecursionError:
        raise MeshError(f"{path} is damaged: its glTF document is nested too deep") from None
    except json.JSONDecodeError as error:
        raise MeshError(f"{path} is damaged: its glTF document is not valid JSON at character {error.pos + 1}") from None
    except ValueError:  # invalid UTF-8, or a number of thousands of digits
        raise MeshError(f"{path} is damaged: its glTF document holds text or a number that cannot be read") from None


def check_extensions(path: Path, document: Any) -> None:
    """Raises MeshError for a required extension that is not supported."""
    for name in map(str, document.get("extensionsRequired", ())):
        if name not in READ_REQUIRED and not name.startswith(LOOKS_REQUIRED):
            raise MeshError(f"{path}: requires {name[:60]}, a glTF extension that is not read: export it without")


def _entry(path: Path, document: Any, kind: str, number: Any) -> Any:
    """An entry of one of the document's lists, such as "accessors". Raises MeshError if the list has no such entry."""
    entries = document.get(kind, [])
    if not isinstance(entries, list):
        raise MeshError(f"{path} is damaged: {kind} of its glTF document is not a list")
    if not isinstance(number, int) or not 0 <= number < len(entries):
        raise MeshError(f"{path} is damaged: it names {number!r:.40} of its {kind}, there are {len(entries)} (counted from 0)")
    return entries[number]


def parts_without_faces(content: bytes) -> list[str]:
    """The names of the topmost nodes of a GLB file's content that place no face, neither directly nor in nested nodes."""
    document, _ = _chunks(Path(), content)
    nodes, meshes = document.get("nodes", []), document.get("meshes", [])
    names: list[str] = []

    def has_faces(number: int) -> bool:
        node, first = nodes[number], len(names)
        primitives = meshes[node["mesh"]]["primitives"] if "mesh" in node else ()
        inner = [has_faces(child) for child in node.get("children", [])]
        if any(inner) or any(primitive.get("mode", TRIANGLES) > LINES_TO for primitive in primitives):
            return True
        if name := _name(node, ""):
            names[first:] = [name]
        return False

    for number in _roots(Path(), document):
        has_faces(number)
    return names


def _roots(path: Path, document: Any) -> list[int]:
    if document.get("scenes"):
        return list(_entry(path, document, "scenes", document.get("scene", 0)).get("nodes", []))
    children = {child for node in document.get("nodes", []) for child in node.get("children", [])}
    return [number for number in range(len(document.get("nodes", []))) if number not in children]


def _scene_meshes(path: Path, document: Any, binary: bytes) -> tuple[list[Surface], int]:
    """The faces of all nodes of the scene, parents before children, in file order, and the number of primitives that are points
    and lines.
    """
    pending = [(number, np.eye(4), 0, "") for number in reversed(_roots(path, document))]
    surfaces: list[Surface] = []
    placed, faces, bare = 0, 0, 0
    while pending:
        number, parent, depth, name = pending.pop()
        placed += 1
        check_placed(path, placed)
        if depth > DEEPEST:
            raise MeshError(f"{path}: its nodes contain each other")
        node = _entry(path, document, "nodes", number)
        matrix, name = parent @ _matrix(path, node), _name(node, name)
        mesh = _entry(path, document, "meshes", node["mesh"]) if "mesh" in node else {"primitives": ()}
        part = _name(mesh, name)  # each of its colours is a primitive
        for primitive in mesh["primitives"]:
            if primitive.get("mode", TRIANGLES) <= LINES_TO:
                bare += 1
                continue
            surface = replace(_primitive_surface(path, document, binary, primitive, matrix), name=part)
            surfaces.append(surface)
            part = ""
            faces += len(surface.faces)
            check_meshes(path, len(surfaces), faces)
        pending += [(child, matrix, depth + 1, name) for child in reversed(node.get("children", []))]
    return surfaces, bare


def _name(element: Any, above: str) -> str:
    """The name of a node or a mesh, or else the name of the node above."""
    name = str(element.get("name", ""))
    return above if not name or name in UNNAMED or name.startswith("=>[") else name


def _matrix(path: Path, node: Any) -> Floats:
    """(4, 4) acting on column vectors: the node's matrix, or translation @ rotation (quaternion x y z w) @ scale."""
    for key, size in (("matrix", 16), ("rotation", 4), ("scale", 3), ("translation", 3)):
        if key in node and not _is_numbers(node[key], size):
            raise MeshError(f"{path} is damaged: {key} of a node is {str(node[key])[:60]}, it must be {size} finite numbers")
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    rotation = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(rotation) * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix


def _is_numbers(values: Any, size: int) -> bool:
    return isinstance(values, list) and len(values) == size and all(map(_is_number, values))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max


def _primitive_surface(path: Path, document: Any, binary: bytes, primitive: Any, matrix: Floats) -> Surface:
    if primitive.get("mode", TRIANGLES) != TRIANGLES or primitive.get("extensions", {}).keys() & {"KHR_draco_mesh_compression"}:
        raise MeshError(f"{path} holds strips or fans of triangles or compressed geometry; only plain triangles are read")
    vertices = _accessor_rows(path, document, binary, _positions(path, primitive), 3)
    if "indices" in primitive:
        corners = _accessor_rows(path, document, binary, primitive["indices"], 1).astype(np.int64)
    else:
        corners = np.arange(len(vertices))
    if corners.size % 3:
        raise MeshError(f"{path} is damaged: a mesh has {corners.size} corners of triangles, they must be a multiple of 3")
    faces = corners.reshape(-1, 3)
    vertices = check_surface(path, vertices, faces).vertices
    if not np.array_equal(matrix, np.eye(4)):
        vertices = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    colour = _colour(path, document, primitive)
    painted = None if colour == NO_COLOUR else np.full(len(faces), colour, dtype=np.int64)
    return check_surface(path, vertices, faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else faces, painted)


def _positions(path: Path, primitive: Any) -> Any:
    """The accessor number of a primitive's vertices."""
    if "POSITION" not in primitive.get("attributes", {}):
        raise MeshError(f"{path} is damaged: a mesh has no vertices (POSITION)")
    return primitive["attributes"]["POSITION"]


def _colour(path: Path, document: Any, primitive: Any) -> int:
    """The colour of a primitive's material, converted from glTF's linear values (2.0, 3.9.2) to sRGB; NO_COLOUR if it has
    none.
    """
    if "material" not in primitive:
        return NO_COLOUR
    factor = _entry(path, document, "materials", primitive["material"]).get("pbrMetallicRoughness", {}).get("baseColorFactor")
    if factor is None:
        return NO_COLOUR
    linear = np.clip(np.array(factor[:3], dtype=np.float64), 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    red, green, blue = np.rint(255.0 * encoded).astype(int).tolist()
    return int(65536 * red + 256 * green + blue)


def _marks(surfaces: list[Surface]) -> list[Surface]:
    """The surfaces; without colours if all have the same one, which distinguishes nothing."""
    if len({NO_COLOUR if surface.colours is None else int(surface.colours[0]) for surface in surfaces}) > 1:
        return surfaces
    return [replace(surface, colours=None) for surface in surfaces]


def _accessor_rows(path: Path, document: Any, binary: bytes, number: int, width: int) -> Any:
    """(n, width) values of an accessor, strides honoured."""
    accessor = _entry(path, document, "accessors", number)
    if "bufferView" not in accessor and "sparse" not in accessor:
        raise MeshError(f"{path} is damaged: accessor {number} names no bufferView")
    view = _entry(path, document, "bufferViews", accessor["bufferView"]) if "bufferView" in accessor else {}
    if "sparse" in accessor or view.get("extensions") or _entry(path, document, "buffers", view.get("buffer")).get("uri"):
        raise MeshError(
            f"{path} holds sparse or compressed data or data in another file; only plain data inside the file is read"
        )
    component = accessor.get("componentType")
    if component not in COMPONENTS:
        known = ", ".join(map(str, COMPONENTS))
        raise MeshError(f"{path} is damaged: componentType of accessor {number} is {component!r:.40}, it must be one of {known}")
    if accessor.get("type", TYPES[width]) != TYPES[width]:
        raise MeshError(
            f"{path} is damaged: type of accessor {number} is {accessor['type']!r:.40}, it must be {TYPES[width]} here"
        )
    kind = np.dtype(COMPONENTS[component])
    count, stride = int(accessor["count"]), int(view.get("byteStride", 0)) or kind.itemsize * width
    start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
    end = start + stride * (count - 1) + kind.itemsize * width
    if count < 1 or start < 0 or stride < 1 or end > len(binary):
        raise MeshError(f"{path} is damaged: an accessor of {count} rows lies outside the file's {len(binary)} bytes of data")
    rows = np.ndarray((count, width), kind, binary, start, (stride, kind.itemsize))
    if not accessor.get("normalized") or kind.kind == "f":
        return rows
    return np.maximum(rows / np.iinfo(kind).max, -1.0)  # integers that represent -1 to 1 (2.0, 3.11)
