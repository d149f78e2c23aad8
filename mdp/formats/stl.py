"""STL, binary and ASCII, distinguished by the size rule of the binary format, not by the word `solid`."""

import re
from pathlib import Path

import numpy as np

from mdp.formats.surface import Surface, check_surface, parse_floats
from profiles.errors import MeshError, counted

HEADER, FACET = 84, 50  # bytes: 80 of text and the count; normal, three corners and an attribute
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
UNCOUNTED = (0, 0xFFFFFFFF)  # counts in files whose writer did not know the number of facets beforehand
CORNER = rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)\s+"
SOUND_FACET = re.compile(  # some programs write words after `endloop`
    rb"facet\s+normal\s+\S+\s+\S+\s+\S+\s+outer\s+loop\s+" + CORNER * 3 + rb"endloop\b[^\r\n]*?\s+endfacet", re.IGNORECASE
)
FACET_START = re.compile(rb"\bfacet\s+normal\b", re.IGNORECASE)
VERTEX = re.compile(rb"\bvertex\s+[-+.0-9ni]", re.IGNORECASE)  # the word alone may occur in the name of a solid


def read(path: Path) -> list[Surface]:
    """The facets of an STL file, three vertices each; several ASCII solids in a file become one surface.

    Raises MeshError for a file of neither kind, for one that is cut short, and for an ASCII facet without exactly three vertices.
    """
    with path.open("rb") as file:
        text = file.read(HEADER)
        count = int.from_bytes(text[80:84], "little") if len(text) == HEADER else -1
        ascii_likely = text.lstrip()[:5].lower() in (b"", b"solid")
        size = path.stat().st_size
        text += file.read(FACET)
        announced = "that its header announces"
        if count in UNCOUNTED and any(text[HEADER:]):  # a file of zeros is not a model, however long
            count, announced = -(-(size - HEADER) // FACET), "that it begins"
        text += file.read() if ascii_likely else file.read(min(FACET * max(count - 1, 0) + 1, size))
    if count >= 0 and len(text) == HEADER + FACET * count:
        return [_binary(path, text, count)]
    if text.lstrip()[:5].lower() == b"solid" and FACET_START.search(text):
        return [_ascii(path, text)]
    if len(text) < HEADER or b"\0" not in text:
        raise MeshError(f"{path} is not an STL file: neither binary nor ASCII with `solid` and `facet` in it")
    if len(text) < HEADER + FACET * count:
        held = (len(text) - HEADER) // FACET
        raise MeshError(f"{path} is cut short: it holds {held} of the {count} facets {announced}")
    return [_binary(path, text, count)]  # some programs write colours or padding after the facets


def _binary(path: Path, text: bytes, count: int) -> Surface:
    records = np.frombuffer(text, dtype=RECORD, count=count, offset=HEADER)
    return check_surface(path, records["corners"].reshape(-1, 3), np.arange(3 * count))


def _ascii(path: Path, text: bytes) -> Surface:
    facets = SOUND_FACET.findall(text)
    if 3 * len(facets) != text.lower().count(b"vertex") or len(facets) != len(FACET_START.findall(text)):
        bad = _first_bad_facet(text)  # none if these words occur only in the name of a solid
        if bad:
            raise MeshError(f"{path}: {bad}")
    return check_surface(path, parse_floats(path, facets, "a vertex"), np.arange(3 * len(facets)))


def _first_bad_facet(text: bytes) -> str:
    """The error of the first bad facet; empty if there is none."""
    starts = [match.start() for match in FACET_START.finditer(text)]
    for number, (start, end) in enumerate(zip(starts, [*starts[1:], len(text)], strict=True), 1):
        if SOUND_FACET.match(text, start, end) and len(VERTEX.findall(text, start, end)) == 3:
            continue
        where = f"facet {number} of {len(starts)} (line {text.count(10, 0, start) + 1})"
        vertices = len(VERTEX.findall(text, start, end))
        if b"endfacet" not in text[start:end].lower():
            return f"is cut short or damaged in {where}"
        return f"{where} has {counted(vertices, 'vertex', 'vertices')} instead of 3" if vertices != 3 else f"{where} is malformed"
    return ""
