"""Hand-written IGES files: fixed lines of 80 columns by IGES 5.3, in a given unit."""

from collections.abc import Sequence
from math import cos, sin

Entity = tuple[int, int, Sequence[float]]  # type, form, parameters
UNITS = {"IN": 1, "MM": 2}
PARAMETERS, LINE = 64, 72  # columns of text


def iges_file(entities: Sequence[Entity], unit: str = "MM") -> str:
    """A file of entities, which refer to each other by `pointer`."""
    words = [_text(word) for word in ("part", "part.igs", "tests", "tests")]
    settings = [",".join([*words, "32,38,6,308,15", _text("part"), f"1.0,{UNITS[unit]}", _text(unit)])]
    settings += ["1,0.01", _text("20260101.000000"), "1E-6,1000.0", _text("nobody"), _text("nowhere"), "11,0"]
    sections: dict[str, list[str]] = {"S": ["written by a test"], "G": [], "D": [], "P": []}
    settings_text = f"{_text(',')},{_text(';')},{','.join(settings)},{_text('20260101.000000')};"
    sections["G"] = [settings_text[k : k + LINE] for k in range(0, len(settings_text), LINE)]
    for number, (kind, form, parameters) in enumerate(entities):
        lines = _wrapped([str(kind), *map(repr, parameters)])
        first = [kind, len(sections["P"]) + 1, 0, 0, 0, 0, 0, 0, "00000000"]
        second = [kind, 0, 0, len(lines), form, "", "", "", 0]
        sections["D"] += ["".join(f"{word:>8}" for word in row) for row in (first, second)]
        sections["P"] += [f"{line:<{PARAMETERS}}{pointer(number):>8}" for line in lines]
    rows = [f"{line:<{LINE}}{letter}{k:>7}" for letter, lines in sections.items() for k, line in enumerate(lines, 1)]
    counts = "".join(f"{letter}{len(lines):>7}" for letter, lines in sections.items())
    return "\n".join([*rows, f"{counts:<{LINE}}T{1:>7}", ""])


def pointer(number: int) -> int:
    """The reference to an entity, counted from 0: the number of the first of its two lines."""
    return 2 * number + 1


def iges_cylinder(radius: float, height: float, unit: str = "MM", points: int = 0) -> str:
    """A group of three faces that share no edge (a cylinder's side, and two planes trimmed by circles that begin elsewhere)
    and extra points."""
    x, y = radius * cos(1.3), radius * sin(1.3)
    entities: list[Entity] = [(100, 0, [0.0, 0.0, 0.0, radius, 0.0, radius, 0.0]), (122, 0, [pointer(0), radius, 0.0, height])]
    for z in (0.0, height):
        first = len(entities)
        plane, circle, boundary = (pointer(first + k) for k in range(3))
        entities += [
            (108, 0, [0.0, 0.0, 1.0, z, 0, 0.0, 0.0, z, 0.0]),
            (100, 0, [z, 0.0, 0.0, x, y, x, y]),
            (142, 0, [0, plane, 0, circle, 2]),
            (144, 0, [plane, 1, 0, boundary]),
        ]
    entities.append((402, 7, [3, pointer(1), pointer(5), pointer(9)]))
    entities += [(116, 0, [0.0, 0.0, float(k), 0]) for k in range(points)]
    return iges_file(entities, unit)


def _text(word: str) -> str:
    return f"{len(word)}H{word}"


def _wrapped(words: list[str]) -> list[str]:
    """Parameters with their separators, wrapped to the longest line allowed."""
    lines = [""]
    for word in [*(f"{word}," for word in words[:-1]), f"{words[-1]};"]:
        if len(lines[-1]) + len(word) > PARAMETERS:
            lines.append("")
        lines[-1] += word
    return lines
