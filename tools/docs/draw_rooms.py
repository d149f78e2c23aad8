"""Draw the rooms of the packages, each on the lowest floor from which its imports only lead down.

    python tools/docs/draw_rooms.py     writes docs/rooms.svg; tests/test_layers.py compares it with the imports

A room is a folder. A file beside rooms is a room of its own: values shared by the rooms are below them, stages that join them
above.
"""

import ast
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from graphlib import TopologicalSorter
from html import escape
from textwrap import wrap

from tools.docs.harness import DOCS, ROOT

PICTURE = DOCS / "rooms.svg"
LAYERS = ("profiles", "mdp", "slicer", "machine")
TINTS = {"profiles": "#f3e2c7", "mdp": "#d5e8d4", "slicer": "#dae8fc", "machine": "#f5d7d3"}
SHARED = " (shared)"  # suffix of a folder's name: its files that its rooms import
WIDTH, HEIGHT, GAP, CHARACTERS = 330, 52, 8, 58


def modules() -> dict[str, str]:
    """Dotted name -> source of every module of the packages."""
    files = (file for layer in LAYERS for file in (ROOT / layer).rglob("*.py"))
    return {".".join(file.relative_to(ROOT).with_suffix("").parts): file.read_text(encoding="utf-8") for file in files}


def imports(source: str) -> Iterator[str]:
    """Every module that a source imports, inside functions too; `from a import b` gives a and a.b."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)


def import_graph(sources: Mapping[str, str]) -> dict[str, set[str]]:
    """Module -> its imports from the packages; a package is represented by its `__init__`."""
    graph = {}
    for module, source in sources.items():
        named = {name if name in sources else f"{name}.__init__" for name in imports(source)}
        graph[module] = {name for name in named if name in sources and name != module}
    return graph


def rooms_of(modules: Iterable[str]) -> dict[str, str]:
    """Module -> its room: its folder, or itself if the folder has rooms."""
    folders = {module.rpartition(".")[0] for module in modules}
    parted = {folder for folder in folders if any(path.startswith(f"{folder}.") for path in folders)}
    rooms = {}
    for module in modules:
        folder, _, file = module.rpartition(".")
        rooms[module] = module if folder in parted and file != "__init__" else folder
    return rooms


def room_graph(graph: Mapping[str, set[str]], rooms: Mapping[str, str]) -> dict[str, set[str]]:
    """Room -> the other rooms that its modules import."""
    out: dict[str, set[str]] = {room: set() for room in rooms.values()}
    for module, imported in graph.items():
        out[rooms[module]] |= {rooms[name] for name in imported} - {rooms[module]}
    return out


def floors(graph: Mapping[str, set[str]]) -> dict[str, int]:
    """Room -> its floor from 0; every room is above all its imports. Raises graphlib.CycleError for a cycle."""
    level: dict[str, int] = {}
    for room in TopologicalSorter(graph).static_order():
        level[room] = max((level[below] + 1 for below in graph[room]), default=0)
    return level


def columns() -> dict[str, list[tuple[str, str]]]:
    """Package -> its boxes from the lowest up: name and text.

    Rooms have the first sentence of their `__init__`. The files beside rooms are two boxes: those that rooms import and that
    import no room themselves, and the others.
    """
    sources = modules()
    rooms, graph = rooms_of(sources), import_graph(sources)
    by_room = room_graph(graph, rooms)
    filled = {room for module, room in rooms.items() if not module.endswith("__init__")}
    level = floors({room: below & filled for room, below in by_room.items() if room in filled})
    drawn: dict[str, dict[str, tuple[int, str]]] = defaultdict(dict)
    for room in sorted(level, key=lambda room: (level[room], room)):
        package = drawn[room.partition(".")[0]]
        if room not in sources:
            text = ast.get_docstring(ast.parse(sources[f"{room}.__init__"])) or ""
            package[room] = level[room], text.partition("\n")[0].partition(": ")[2] or text.partition("\n")[0]
            continue
        folder, _, file = room.rpartition(".")
        own = {name for name in level if name.startswith(f"{folder}.") and name not in sources}
        shared = any(room in by_room[name] for name in own) and not by_room[room] & own
        name = folder + (SHARED if shared else "")
        floor, files = package.get(name, (level[room], ""))
        package[name] = (floor if shared else level[room]), f"{files}, {file}" if files else file
    return {
        name: [(box, text) for box, (_, text) in sorted(drawn[name].items(), key=lambda item: (item[1][0], item[0]))]
        for name in LAYERS
    }


def draw() -> str:
    """The rooms as SVG: a column per package, its lowest room at the bottom."""
    stacks = columns()
    width, height = len(stacks) * (WIDTH + GAP) + GAP, max(map(len, stacks.values())) * (HEIGHT + GAP) + GAP
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif">',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    for k, stack in enumerate(stacks.values()):
        for floor, (room, text) in enumerate(stack):
            out += _box(GAP + k * (WIDTH + GAP), height - (floor + 1) * (HEIGHT + GAP), room, text)
    return "\n".join([*out, "</svg>", ""])


def _box(x: float, y: float, room: str, text: str) -> list[str]:
    tint, lines = TINTS[room.partition(".")[0].removesuffix(SHARED)], wrap(text, CHARACTERS)
    lines = lines if len(lines) <= 2 else [lines[0], f"{lines[1]} ..."]
    return [
        f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="5" fill="{tint}" stroke="#777777"/>',
        f'<text x="{x + 8:g}" y="{y + 16:g}" font-size="13" font-weight="bold">{escape(room.replace(".", "/"))}</text>',
        *(f'<text x="{x + 8:g}" y="{y + 29 + 12 * k:g}" font-size="10">{escape(line)}</text>' for k, line in enumerate(lines)),
    ]


def main() -> None:
    """Write the picture."""
    PICTURE.write_text(draw(), encoding="utf-8")


if __name__ == "__main__":
    main()
