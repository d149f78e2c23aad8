"""PLY, ASCII and binary: the elements `vertex` and `face`, their colours red, green and blue, whatever other properties they
carry."""

from dataclasses import dataclass
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
OF_255 = {"f4": 255.0, "f8": 255.0, "u2": 255.0 / 65535.0}  # bytes count as they are
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class Property:
    """One column; `length` is the type of a list's count and empty for a plain value."""

    name: str
    kind: str
    length: str = ""


@dataclass(frozen=True)
class Element:
    """A table of the file."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def least_bytes(self) -> int:
        """Size of one row with empty lists, so that an absurd count is refused before anything is allocated."""
        return sum(np.dtype(column.length or column.kind).itemsize for column in self.properties)


def read(path: Path) -> list[Surface]:
    """The polygons of a PLY file as triangles.

    Raises MeshError for a header that is malformed and for tables that the file does not hold.
    """
    content = path.read_bytes()
    order, elements, body = _header(path, content)
    columns: dict[str, dict[str, Any]] = {}
    words = content[body:].split() if order == "" else []
    position = body if order else 0
    for element in elements:
        try:
            if order:
                columns[element.name], position = _binary_rows(content, position, element, order)
            else:
                columns[element.name], position = _ascii_rows(words, position, element)
        except (ValueError, IndexError, OverflowError):
            raise MeshError(f"{path}: is cut short or malformed in its {element.count} rows of `{element.name}`") from None
    plain = {(table.name, column.name) for table in elements for column in table.properties if not column.length}
    listed = {(table.name, column.name) for table in elements for column in table.properties if column.length}
    corners = next((name for name in ("vertex_indices", "vertex_index") if ("face", name) in listed), None)
    if corners is None or not {("vertex", axis) for axis in "xyz"} <= plain:
        raise MeshError(f"{path}: needs the elements `vertex` with x, y, z and `face` with a list vertex_indices")
    vertex, polygons = columns["vertex"], columns["face"][corners]
    vertices = np.stack([np.asarray(vertex[axis], dtype=np.float64) for axis in "xyz"], axis=1)
    kinds = {(table.name, column.name): column.kind for table in elements for column in table.properties if not column.length}
    painted = _colours(columns["face"], kinds, "face")
    if painted is None:
        painted = _corner_colours(_colours(vertex, kinds, "vertex"), polygons)
    return [polygon_surface(path, vertices, polygons, painted)]


def _colours(columns: dict[str, Any], kinds: dict[tuple[str, str], str], table: str) -> Indices | None:
    """(n,) colours of the rows of a table; None where it has no columns red, green and blue."""
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
    """(m,) colours of the polygons whose corners all have one; indices out of range are reported elsewhere."""
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
        raise MeshError(f"{path}: is not a PLY file: no header from `ply` to `end_header`")
    order, elements = None, list[Element]()
    try:
        for words in lines[1:]:
            if words[:1] == ["format"]:
                order = ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(Element(words[1], int(words[2]), ()))
            elif words[:1] == ["property"]:
                last = elements.pop()
                listed = words[1] == "list"
                column = Property(words[4], TYPES[words[3]], TYPES[words[2]]) if listed else Property(words[2], TYPES[words[1]])
                elements.append(Element(last.name, last.count, (*last.properties, column)))
    except (KeyError, IndexError, ValueError):
        raise MeshError(f"{path}: the header line `{' '.join(words)}` is not understood") from None
    if order is None:
        raise MeshError(f"{path}: its header names no format; allowed are {', '.join(ORDERS)}")
    for element in elements:
        least = element.least_bytes if order else 2 * len(element.properties) - 1
        if element.count < 0 or element.count * least > len(content) - body + 1:
            raise MeshError(f"{path}: announces {element.count} rows of `{element.name}`, more than the file can hold")
    return order, elements, body


def _binary_rows(content: bytes, offset: int, element: Element, order: str) -> tuple[dict[str, Any], int]:
    """Rows read in one piece when all lists are as long as the first row's, else one by one."""
    lengths = _first_lengths(content, offset, element, order) if element.count else {}
    fields: list[Any] = []
    for column in element.properties:
        if column.length:
            fields.append((f"{column.name} length", order + column.length))
        fields.append((column.name, order + column.kind, *([(lengths.get(column.name, 0),)] if column.length else [])))
    record = np.dtype(fields)
    if len(content) - offset >= record.itemsize * element.count:
        rows = np.frombuffer(content, record, element.count, offset)
        if all((rows[f"{name} length"] == length).all() for name, length in lengths.items()):
            return _columns(rows, element), offset + record.itemsize * element.count
    if not lengths:
        raise ValueError("cut short")
    columns: dict[str, list[Any]] = {column.name: [] for column in element.properties}
    for _ in range(element.count):
        for column in element.properties:
            count = 1
            if column.length:
                count = int(np.frombuffer(content, order + column.length, 1, offset)[0])
                offset += np.dtype(column.length).itemsize
            values = np.frombuffer(content, order + column.kind, count, offset).tolist()
            offset += np.dtype(column.kind).itemsize * count
            columns[column.name].append(values if column.length else values[0])
    return columns, offset


def _columns(rows: Any, element: Element) -> dict[str, Any]:
    def column_of(column: Property) -> Any:
        values = rows[column.name]
        return values.tolist() if column.length and values.shape[1] != 3 else values.astype(np.int64) if column.length else values

    return {column.name: column_of(column) for column in element.properties}


def _first_lengths(content: bytes, offset: int, element: Element, order: str) -> dict[str, int]:
    lengths = {}
    for column in element.properties:
        count = 1
        if column.length:
            count = int(np.frombuffer(content, order + column.length, 1, offset)[0])
            offset += np.dtype(column.length).itemsize
            lengths[column.name] = count
        offset += np.dtype(column.kind).itemsize * count
    return lengths


def _ascii_rows(words: list[bytes], index: int, element: Element) -> tuple[dict[str, Any], int]:
    width = len(element.properties)
    if not any(column.length for column in element.properties):
        table = np.array(words[index : index + width * element.count]).astype(np.float64).reshape(element.count, width)
        return {column.name: table[:, k] for k, column in enumerate(element.properties)}, index + width * element.count
    columns: dict[str, list[Any]] = {column.name: [] for column in element.properties}
    for _ in range(element.count):
        for column in element.properties:
            count = int(words[index]) if column.length else 1
            index += 1 if column.length else 0
            if index + count > len(words) or count < 0:
                raise ValueError("cut short")
            number = float if column.kind in ("f4", "f8") else int
            values = [number(word) for word in words[index : index + count]]
            columns[column.name].append(values if column.length else values[0])
            index += count
    return columns, index
