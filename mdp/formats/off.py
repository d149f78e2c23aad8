"""OFF: counts, then one vertex and one polygon a line."""

from itertools import islice
from pathlib import Path

from mdp.formats.polygons import polygon_surface
from mdp.formats.surface import Surface, parse_floats, parse_integers, text_lines
from mdp.mesh import Indices
from profiles.errors import MeshError, counted

KINDS = ("OFF", "COFF", "NOFF", "CNOFF", "STOFF")  # the letters name columns behind the position, which are left alone


def read(path: Path) -> list[Surface]:
    """The polygons of an OFF file as triangles; colours and normals are left alone.

    Raises MeshError for another kind of file, counts that the file does not hold and malformed lines.
    """
    stripped = ((number, line.split("#", 1)[0].split()) for number, line in enumerate(text_lines(path), 1))
    lines = [(number, words) for number, words in stripped if words]
    if not lines or lines[0][1][0] not in KINDS:
        raise MeshError(f"{path}: is not an OFF file: its first word is none of {', '.join(KINDS)}")
    counts_line, first = (lines[0][1][1:], 1) if len(lines[0][1]) > 1 else (lines[1][1] if len(lines) > 1 else [], 2)
    counts = parse_integers(path, [counts_line[:2]], "the line of counts").tolist()
    if len(counts) < 2 or min(counts) < 0:
        raise MeshError(f"{path}: its line of counts must name the vertices and the faces, got `{' '.join(counts_line)}`")
    held = len(lines) - first
    if sum(counts) > held:
        announced = f"{counted(counts[0], 'vertex', 'vertices')} and {counted(counts[1], 'face')}"
        raise MeshError(f"{path}: announces {announced} but holds only {counted(held, 'line')} of them")
    vertex_rows, face_rows = lines[first : first + counts[0]], lines[first + counts[0] : first + sum(counts)]
    short = next((number for number, words in vertex_rows if len(words) < 3), None)
    if short is not None:
        raise MeshError(f"{path}: the vertex in line {short} has fewer than three coordinates")
    vertices = parse_floats(path, [words[:3] for _, words in vertex_rows], "a vertex").reshape(-1, 3)
    return [polygon_surface(path, vertices, _polygons(path, face_rows))]


def _polygons(path: Path, rows: list[tuple[int, list[str]]]) -> list[list[int]] | Indices:
    if all(words[0] == "3" and len(words) >= 4 for _, words in rows):
        return parse_integers(path, [words[1:4] for _, words in rows], "a face").reshape(-1, 3)
    polygons = []
    for number, words in rows:
        corners = int(words[0]) if words[0].isdecimal() and len(words[0]) < 10 else -1
        if corners < 3 or len(words) <= corners:
            raise MeshError(f"{path}: the face in line {number} is malformed: `{' '.join(islice(words, 8))}`")
        polygons.append(parse_integers(path, [words[1 : corners + 1]], f"the face in line {number}").tolist())
    return polygons
