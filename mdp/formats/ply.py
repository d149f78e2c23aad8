"""PLY, ASCII and binary: the elements `vertex` and `face`, their colours red, green and blue; other properties are ignored."""

from pathlib import Path
from typing import Any

import numpy as np

from mdp.formats.polygons import polygon_surface
from mdp.formats.surface import Surface
from mdp.mesh import NO_COLOUR, Indices
from profiles.errors import MeshError

TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8"}
TYPES |= {
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "float64": "f8",
}
RGB = ("red", "green", "blue")
OF_255 = {"f4": 255.0, "f8": 255.0, "u2": 255.0 / 65535.0}  # bytes need no conversion
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


Column = tuple[str, str, str]  # its name and type, and the type of a list's length: "" for a plain value
Element = tuple[str, int, list[Column]]  # a table of the file: its name, its rows, its columns


def read(path: Path) -> list[Surface]:
    """The polygons of a PLY file as triangles.

    Raises MeshError for a malformed header and for tables that are incomplete.
    """
    content = path.read_bytes()
    order, elements, body = _header(path, content)
    columns: dict[str, dict[str, Any]] = {}
    words = content[body:].split() if order == "" else []
    position = body if order else 0
    for name, count, properties in elements:
        try:
            if order:
                columns[name], position = _binary_rows(content, position, count, properties, order)
            else:
                columns[name], position = _ascii_rows(words, position, count, properties)
        except (ValueError, IndexError, OverflowError):
            raise MeshError(f"{path} is cut short or malformed in its {count} rows of `{name}`") from None
    every = [(table, column) for table, _, properties in elements for column in properties]
    kinds = {(table, name): kind for table, (name, kind, length) in every if not length}
    listed = {(table, name) for table, (name, _, length) in every if length}
    corners = next((name for name in ("vertex_indices", "vertex_index") if ("face", name) in listed), None)
    if corners is None or not {("vertex", axis) for axis in "xyz"} <= kinds.keys():
        raise MeshError(f"{path} needs the elements `vertex` with x, y, z and `face` with a list vertex_indices")
    vertex, polygons = columns["vertex"], columns["face"][corners]
    vertices = np.stack([np.asarray(vertex[axis], dtype=np.float64) for axis in "xyz"], axis=1)
    painted = _colours(columns["face"], kinds, "face")
    if painted is None:
        painted = _corner_colours(_colours(vertex, kinds, "vertex"), polygons)
    return [polygon_surface(path, vertices, polygons, painted)]


def _colours(columns: dict[str, Any], kinds: dict[tuple[str, str], str], table: str) -> Indices | None:
    """(n,) colours of a table's rows; None if it lacks one of the columns red, green and blue."""
    if not {(table, name) for name in RGB} <= kinds.keys():
        return None
    colours = np.zeros(len(columns[RGB[0]]), dtype=np.int64)
    painted = np.ones(len(colours), dtype=np.bool_)
    for name in RGB:
        values = np.asarray(columns[name], dtype=np.float64) * OF_255.get(kinds[table, name], 1.0)
        painted &= (values >= 0.0) & (values <= 255.0)
        colours = 256 * colours + np.where(painted, np.rint(values), 0).astype(np.int64)
    return np.where(painted, colours, NO_COLOUR)


def _corner_colours(colours: Indices | None, polygons: list[list[int]] | Indices) -> Indices | None:
    """(m,) colours of the polygons whose corners share one colour; indices out of range are reported elsewhere."""
    if colours is None:
        return None

    def colour_of(corners: list[int]) -> int:
        at_corners = {int(colours[corner]) for corner in corners if 0 <= corner < len(colours)}
        return at_corners.pop() if len(at_corners) == 1 else NO_COLOUR

    if not isinstance(polygons, np.ndarray):
        return np.array([colour_of(corners) for corners in polygons], dtype=np.int64)
    if not len(colours):
        return None
    a, b, c = colours[np.clip(polygons, 0, len(colours) - 1)].T
    return np.where((a == b) & (b == c), a, NO_COLOUR)


def _header(path: Path, content: bytes) -> tuple[str, list[Element], int]:
    end = content.find(b"end_header")
    body = content.find(b"\n", end) + 1
    lines = [line.decode("latin-1").split() for line in content[: max(end, 0)].splitlines()]
    if end < 0 or not body or lines[0] != ["ply"]:
        raise MeshError(f"{path} is not a PLY file: no header from `ply` to `end_header`")
    order, elements = None, list[Element]()
    try:
        for words in lines[1:]:
            if words[:1] == ["format"]:
                order = ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append((words[1], int(words[2]), []))
            elif words[:1] == ["property"]:
                listed = words[1] == "list"
                column = (words[4], TYPES[words[3]], TYPES[words[2]]) if listed else (words[2], TYPES[words[1]], "")
                elements[-1][2].append(column)
    except (KeyError, IndexError, ValueError):
        raise MeshError(f"{path}: the header line `{' '.join(words)}` is not understood") from None
    if order is None:
        raise MeshError(f"{path}: its header names no format; allowed are {', '.join(ORDERS)}")
    for name, count, properties in elements:
        # A row with empty lists is the least: an absurd count is refused before anything is allocated.
        least_bytes = sum(np.dtype(length or kind).itemsize for _, kind, length in properties)
        if count < 0 or count * (least_bytes if order else 2 * len(properties) - 1) > len(content) - body + 1:
            raise MeshError(f"{path}: announces {count} rows of `{name}`, more than the file can hold")
    return order, elements, body


def _binary_rows(content: bytes, offset: int, count: int, properties: list[Column], order: str) -> tuple[dict[str, Any], int]:
    """The columns of a binary table: read at once if every list is as long as the first row's, else row by row."""
    lengths = _first_lengths(content, offset, properties, order) if count else {}
    fields: list[Any] = []
    for name, kind, length in properties:
        if length:
            fields.append((f"{name} length", order + length))
        fields.append((name, order + kind, *([(lengths.get(name, 0),)] if length else [])))
    record = np.dtype(fields)
    if len(content) - offset >= record.itemsize * count:
        rows = np.frombuffer(content, record, count, offset)
        if all((rows[f"{name} length"] == length).all() for name, length in lengths.items()):
            return {name: _values(rows[name], length) for name, _, length in properties}, offset + record.itemsize * count
    if not lengths:
        raise ValueError("cut short")
    columns: dict[str, list[Any]] = {name: [] for name, _, _ in properties}
    for _ in range(count):
        for name, kind, length in properties:
            held, offset = _count(content, offset, length, order)
            values = np.frombuffer(content, order + kind, held, offset).tolist()
            offset += np.dtype(kind).itemsize * held
            columns[name].append(values if length else values[0])
    return columns, offset


def _count(content: bytes, offset: int, length: str, order: str) -> tuple[int, int]:
    """The number of values that a column has in a row, and their offset. length: the type of a list's length, "" for a plain
    value.
    """
    if not length:
        return 1, offset
    return int(np.frombuffer(content, order + length, 1, offset)[0]), offset + np.dtype(length).itemsize


def _values(values: Any, length: str) -> Any:
    return values.tolist() if length and values.shape[1] != 3 else values.astype(np.int64) if length else values


def _first_lengths(content: bytes, offset: int, properties: list[Column], order: str) -> dict[str, int]:
    lengths = {}
    for name, kind, length in properties:
        held, offset = _count(content, offset, length, order)
        if length:
            lengths[name] = held
        offset += np.dtype(kind).itemsize * held
    return lengths


def _ascii_rows(words: list[bytes], index: int, count: int, properties: list[Column]) -> tuple[dict[str, Any], int]:
    width = len(properties)
    if not any(length for _, _, length in properties):
        table = np.array(words[index : index + width * count]).astype(np.float64).reshape(count, width)
        return {name: table[:, k] for k, (name, _, _) in enumerate(properties)}, index + width * count
    columns: dict[str, list[Any]] = {name: [] for name, _, _ in properties}
    for _ in range(count):
        for name, kind, length in properties:
            held = int(words[index]) if length else 1
            index += 1 if length else 0
            if index + held > len(words) or held < 0:
                raise ValueError("cut short")
            number = float if kind in ("f4", "f8") else int
            values = [number(word) for word in words[index : index + held]]
            columns[name].append(values if length else values[0])
            index += held
    return columns, index
