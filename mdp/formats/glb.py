"""GLB (binary glTF 2.0): the triangles of the scene and the colours of their materials, coordinates taken as mm with z up.

The specification says metres with y up, but programs that print write their mm and their z unchanged, so nothing is turned
or scaled here; a model in metres is caught by the check of its size, one that lies on its side can be turned when it is read.
"""

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mdp.formats.surface import Surface, check_meshes, check_placed, check_surface
from mdp.mesh import NO_COLOUR, Floats
from profiles.errors import MeshError

MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942  # "glTF", "JSON" and "BIN" read as little-endian numbers
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
LINES_TO, TRIANGLES = 3, 4  # modes of primitives: up to 3 they are points and lines
UNNAMED = frozenset({"SOLID", "SHELL", "COMPOUND", "COMPSOLID", "FACE"})  # OpenCASCADE's words for shapes without a name
DEEPEST = 64  # nodes within nodes


def read(path: Path) -> list[Surface]:
    """One surface for every mesh primitive that the scene places; points and lines are left out with a note.

    Raises MeshError for a damaged file, compressed geometry, outside buffers and strips or fans of triangles.
    """
    return read_scene(path, path.read_bytes())


def read_scene(path: Path, content: bytes) -> list[Surface]:
    """The same for the content of such a file; path: what messages name."""
    document, binary = _chunks(path, content)
    try:
        surfaces, bare = _scene_meshes(path, document, binary)
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise MeshError(f"{path}: its glTF document is malformed ({type(error).__name__}: {str(error)[:200]})") from None
    if not surfaces:
        raise MeshError(f"{path}: its scene places no mesh" + (" but points and lines" if bare else ""))
    if bare:
        of_parts = "one of its parts" if bare == 1 else f"{bare} of its parts"
        surfaces[0] = replace(surfaces[0], notes=(f"left out points and lines in {of_parts}: only solids and faces are printed",))
    return _marks(surfaces)


def _chunks(path: Path, content: bytes) -> tuple[Any, bytes]:
    magic, version, length = struct.unpack("<III", content[:12]) if len(content) >= 20 else (0, 0, 0)
    if magic != MAGIC or version != 2:
        raise MeshError(f"{path}: is not a GLB file of version 2")
    if len(content) < length:
        raise MeshError(f"{path}: is cut short: it holds {len(content)} of the {length} bytes that its header announces")
    chunks: dict[int, bytes] = {}
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack("<II", content[offset : offset + 8])
        chunks.setdefault(kind, content[offset + 8 : offset + 8 + size])
        offset += 8 + size
    try:
        return json.loads(chunks.get(JSON_CHUNK, b"")), chunks.get(BINARY_CHUNK, b"")
    except RecursionError:
        raise MeshError(f"{path}: its glTF document is malformed (nested too deep)") from None
    except ValueError as error:
        raise MeshError(f"{path}: its glTF document is malformed ({error})") from None


def parts_without_faces(content: bytes) -> list[str]:
    """The names of the nodes of such a file that place no face, nor does any node in them; where one holds another, its name."""
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

    for number in _roots(document):
        has_faces(number)
    return names


def _roots(document: Any) -> list[int]:
    if document.get("scenes"):
        return list(document["scenes"][document.get("scene", 0)].get("nodes", []))
    children = {child for node in document.get("nodes", []) for child in node.get("children", [])}
    return [number for number in range(len(document.get("nodes", []))) if number not in children]


def _scene_meshes(path: Path, document: Any, binary: bytes) -> tuple[list[Surface], int]:
    """The faces of all nodes of the scene, parents before children, in the order of the file, and how many primitives are
    points and lines."""
    pending = [(number, np.eye(4), 0, "") for number in reversed(_roots(document))]
    surfaces: list[Surface] = []
    placed, faces, bare = 0, 0, 0
    while pending:
        number, parent, depth, name = pending.pop()
        placed += 1
        check_placed(path, placed)
        if depth > DEEPEST:
            raise MeshError(f"{path}: its nodes contain each other")
        node = document["nodes"][number]
        matrix, name = parent @ _matrix(node), _name(node, name)
        mesh = document["meshes"][node["mesh"]] if "mesh" in node else {"primitives": ()}
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
    """The name of a node or a mesh, and where it has none that of the node above."""
    name = str(element.get("name", ""))
    return above if not name or name in UNNAMED or name.startswith("=>[") else name


def _matrix(node: Any) -> Floats:
    """(4, 4) acting on column vectors: the node's matrix, or translation @ rotation (quaternion x y z w) @ scale."""
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


def _primitive_surface(path: Path, document: Any, binary: bytes, primitive: Any, matrix: Floats) -> Surface:
    if primitive.get("mode", TRIANGLES) != TRIANGLES or primitive.get("extensions", {}).keys() & {"KHR_draco_mesh_compression"}:
        raise MeshError(f"{path}: holds strips or fans of triangles or compressed geometry; only plain triangles are read")
    vertices = _accessor_rows(path, document, binary, primitive["attributes"]["POSITION"], 3)
    if "indices" in primitive:
        faces = _accessor_rows(path, document, binary, primitive["indices"], 1).astype(np.int64).reshape(-1, 3)
    else:
        faces = np.arange(len(vertices)).reshape(-1, 3)
    vertices = check_surface(path, vertices, faces).vertices
    if not np.array_equal(matrix, np.eye(4)):
        vertices = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    colour = _colour(document, primitive)
    painted = None if colour == NO_COLOUR else np.full(len(faces), colour, dtype=np.int64)
    return check_surface(path, vertices, faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else faces, painted)


def _colour(document: Any, primitive: Any) -> int:
    """The colour of a primitive's material, which glTF counts linearly (2.0, 3.9.2), as sRGB; NO_COLOUR where it says none."""
    if "material" not in primitive:
        return NO_COLOUR
    factor = document["materials"][primitive["material"]].get("pbrMetallicRoughness", {}).get("baseColorFactor")
    if factor is None:
        return NO_COLOUR
    linear = np.clip(np.array(factor[:3], dtype=np.float64), 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    red, green, blue = np.rint(255.0 * encoded).astype(int).tolist()
    return int(65536 * red + 256 * green + blue)


def _marks(surfaces: list[Surface]) -> list[Surface]:
    """The surfaces, without colours where all have the same: it marks nothing."""
    if len({NO_COLOUR if surface.colours is None else int(surface.colours[0]) for surface in surfaces}) > 1:
        return surfaces
    return [replace(surface, colours=None) for surface in surfaces]


def _accessor_rows(path: Path, document: Any, binary: bytes, number: int, width: int) -> Any:
    """(n, width) values of an accessor, strides honoured."""
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    if "sparse" in accessor or view.get("extensions") or document["buffers"][view["buffer"]].get("uri"):
        raise MeshError(
            f"{path}: holds sparse or compressed data or data in another file; only plain data inside the file is read"
        )
    kind = np.dtype(COMPONENTS[accessor["componentType"]])
    count, stride = int(accessor["count"]), int(view.get("byteStride", 0)) or kind.itemsize * width
    start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
    end = start + stride * (count - 1) + kind.itemsize * width
    if count < 1 or start < 0 or stride < 1 or end > len(binary):
        raise MeshError(f"{path}: is damaged: an accessor of {count} rows lies outside the file's {len(binary)} bytes of data")
    return np.ndarray((count, width), kind, binary, start, (stride, kind.itemsize))
