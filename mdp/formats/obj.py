"""OBJ: `v` and `f` lines; texture, normals, groups and materials are left alone."""

from pathlib import Path

from mdp.formats.polygons import polygon_surface
from mdp.formats.surface import Surface, parse_floats, text_lines
from profiles.errors import MeshError, counted

MOST_INDEX = 2**62  # no file has that many vertices, and more would not fit into an array


def read(path: Path) -> list[Surface]:
    """The polygons of an OBJ file as triangles; all objects and groups come as one surface, since they share their vertices.

    Raises MeshError for a vertex without three coordinates and a face without three corners or with a bad index.
    """
    positions: list[list[str]] = []
    polygons: list[list[int]] = []
    for number, line in enumerate(text_lines(path, continued="\\"), 1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        if words[0] == "v":
            if len(words) < 4:
                raise MeshError(f"{path}: the vertex in line {number} has fewer than three coordinates")
            positions.append(words[1:4])
        elif words[0] == "f":
            polygons.append(_corners(path, number, words[1:], len(positions)))
    vertices = parse_floats(path, positions, "a vertex").reshape(-1, 3)
    return [polygon_surface(path, vertices, polygons)]


def _corners(path: Path, number: int, words: list[str], vertices: int) -> list[int]:
    if len(words) < 3:
        raise MeshError(f"{path}: the face in line {number} has {counted(len(words), 'corner')}, at least 3 are needed")
    try:
        named = [int(word.split("/", 1)[0]) for word in words]
    except ValueError:
        raise MeshError(f"{path}: the face in line {number} is malformed: `{' '.join(words[:8])}`") from None
    if 0 in named or min(named) < -vertices or max(named) > MOST_INDEX:
        raise MeshError(f"{path}: the face in line {number} names a vertex that does not exist: `{' '.join(words[:8])}`")
    return [index - 1 if index > 0 else vertices + index for index in named]
