"""Faults planted into a valid program by editing its text, as a user, a script or a damaged disk may change a file."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from math import hypot

Lines = list[str]
Edit = Callable[[Lines], Lines]
STROKE = re.compile(r"G1 (?=.*[XY]).*[EU]\d")
STROKES = "G1 .*[XY].*E[0-9]"
TRAVEL = re.compile(r"G0 (?=.*X)(?!.*[ACUV])")
HEAT_OFF = re.compile(r"M104 [SP]0$")


@dataclass(frozen=True)
class Fault:
    """An edit and the finding that reports it: code, part and (unless 0) layer."""

    name: str
    code: str
    part: int
    layer: int
    edit: Edit
    severity: str = "error"


def part_of(lines: Lines, index: int) -> range:
    """Indices of a part's lines, from its ;PART: comment to the travel before the next turn."""
    first = next(k for k, line in enumerate(lines) if line.startswith(f";PART:{index} "))
    after = next(k for k in range(first + 1, len(lines)) if lines[k].startswith(";TYPE:Custom"))
    return range(first, after)


def layers_of(lines: Lines, index: int) -> list[range]:
    """Indices of the lines of each layer of a part."""
    part = part_of(lines, index)
    firsts = [k for k in part if lines[k] == ";LAYER_CHANGE"]
    return [range(a, b) for a, b in zip(firsts, [*firsts[1:], part.stop], strict=True)]


def on(places: Callable[[Lines], Iterable[int]], change: Callable[[str], str | None]) -> Edit:
    """Change the lines at some indices; None removes a line."""

    def edit(lines: Lines) -> Lines:
        changed = {k: change(lines[k]) for k in places(lines)}
        edited = [changed.get(k, line) for k, line in enumerate(lines)]
        return [line for line in edited if line is not None]

    return edit


def part(index: int) -> Callable[[Lines], Iterable[int]]:
    return lambda lines: part_of(lines, index)


def layers(index: int, first: int, count: int = 1) -> Callable[[Lines], Iterable[int]]:
    """Indices of the lines of some layers of a part, counted from 1."""
    return lambda lines: [k for layer in layers_of(lines, index)[first - 1 : first - 1 + count] for k in layer]


def nth(pattern: str, which: int = 0, within: int = 0) -> Callable[[Lines], Iterable[int]]:
    """The index of the n-th matching line; within: a part, 0: the whole file."""

    def places(lines: Lines) -> Iterable[int]:
        among = part_of(lines, within) if within else range(len(lines))
        return [[k for k in among if re.match(pattern, lines[k])][which]]

    return places


def word(letter: str, change: Callable[[float], float], only: str = "G[01] ") -> Callable[[str], str]:
    """Scale the number of one word of moves."""

    def changed(line: str) -> str:
        if not re.match(only, line):
            return line
        return re.sub(rf" {letter}(-?[0-9.]+)", lambda told: f" {letter}{change(float(told[1])):.5f}", line)

    return changed


def drop(pattern: str) -> Callable[[str], str | None]:
    return lambda line: None if re.match(pattern, line) else line


def insert(places: Callable[[Lines], Iterable[int]], *added: str) -> Edit:
    """Insert lines before an index."""

    def edit(lines: Lines) -> Lines:
        at = next(iter(places(lines)))
        return [*lines[:at], *added, *lines[at:]]

    return edit


def before_turn(lines: Lines, index: int) -> int:
    """The index of the line that lifts the tip after a part's last bead, before the table turns to the next part."""
    stop = part_of(lines, index).stop
    part_of(lines, index + 1)
    return max(k for k in range(stop) if lines[k] == ";WIPE_END") + 1


def everywhere(lines: Lines) -> Iterable[int]:
    return range(len(lines))


def amid(index: int, layer: int) -> Callable[[Lines], Iterable[int]]:
    """An index between two strokes, after the first lines of a layer."""

    def places(lines: Lines) -> Iterable[int]:
        begun = layers_of(lines, index)[layer - 1][8:]
        return [next(k for k in begun if STROKE.match(lines[k - 1]) and STROKE.match(lines[k]))]

    return places


def end_of(index: int, layer: int) -> Callable[[Lines], Iterable[int]]:
    return lambda lines: [layers_of(lines, index)[layer - 1].stop]


def not_pulled(lines: Lines) -> Lines:
    """The last wipe of part 2 without its filament."""
    at = before_turn(lines, 2)
    begin = max((k for k in range(at) if lines[k] == ";WIPE_START"), default=at - 8)
    return on(lambda _: range(begin, at), word("E", lambda _: 0.0, "G1 .*E-"))(lines)


def purged_at_middle(lines: Lines) -> Lines:
    return on(lambda _: range(part_of(lines, 1).start), word("Y", lambda _: 0.0))(lines)


def turn_to(index: int) -> Callable[[Lines], Iterable[int]]:
    """The index of the line that turns the table to a part's pose."""

    def places(lines: Lines) -> Iterable[int]:
        begin = part_of(lines, index).start
        pose = lines[begin + 1].removeprefix(";POSE:")
        return [max(k for k in range(begin) if pose in lines[k])]

    return places


def turned_on(line: str) -> str:
    return re.sub(r"([CV])(-?[0-9.]+)", lambda told: f"{told[1]}{float(told[2]) + 10:.4f}", line)


def tilted_back(line: str) -> str:
    return re.sub(r" ([AU])(-?[0-9.]+)", lambda told: f" {told[1]}{-float(told[2]):.4f}", line)


def into_the_air(lines: Lines) -> Lines:
    """A bead of 45 mm beside part 1, above its layer 20."""
    reach = float(re.findall(r"X\S+ (\S+)", lines[part_of(lines, 1).start + 2])[0])
    way = (f"G0 X{reach + 10:.3f} Y0", f"G1 X{reach + 55:.3f} Y0 E1.5 F600", "G0 X0 Y0")
    return insert(end_of(1, 20), *way)(lines)


def along_a_bead(lines: Lines) -> Lines:
    """A travel 0.15 mm low along the longest stroke of layer 20 of part 1, when that is printed."""
    layer = layers_of(lines, 1)[19]
    height = float(next(lines[k] for k in layer if lines[k].startswith(";Z:")).removeprefix(";Z:"))
    corners = [re.match(r"G[01] X(\S+) Y(\S+)", lines[k]) for k in layer]
    ends = [
        (float(corner[1]), float(corner[2]), STROKE.match(lines[k])) for k, corner in zip(layer, corners, strict=True) if corner
    ]
    begin, end = max((p for p in pairwise(ends) if p[1][2]), key=lambda p: hypot(p[1][0] - p[0][0], p[1][1] - p[0][1]))
    low = (f"G0 X{begin[0]} Y{begin[1]}", f"G0 Z{height - 0.15:.3f}", f"G0 X{end[0]} Y{end[1]}", f"G0 Z{height:.3f}")
    return insert(end_of(1, 20), *low)(lines)


def still(line: str) -> str | None:
    """The fan off at the beginning of a layer, and never on again."""
    return "M107" if line.startswith(";HEIGHT") else drop("M106")(line)


def fan_off(line: str) -> str:
    return "M107" if line.startswith("M106") else line


def extruding_travels(push: Callable[[float], float]) -> Edit:
    """Forty travels within parts that push filament; push: of the length, mm."""

    def edit(lines: Lines) -> Lines:
        edited, left, at = list(lines), 40, (0.0, 0.0)
        inside = {k for layer in layers_of(lines, 1) for k in layer}
        for k, line in enumerate(lines):
            words = dict(re.findall(r"([XY])(-?[0-9.]+)", line)) if line.startswith("G") else {}
            to = (float(words.get("X", at[0])), float(words.get("Y", at[1])))
            length = abs(to[0] - at[0]) + abs(to[1] - at[1])
            at = to
            if left and k in inside and TRAVEL.match(line) and length > 2.0:
                left -= 1
                edited[k] = f"{line.replace('G0', 'G1')} E{push(length):.5f}"
        return edited

    return edit


def moved_part(lines: Lines, index: int, behind: int) -> Lines:
    """A part with its turn, moved after another part."""
    blocks = {k: turn_and_part(lines, k) for k in (index, behind)}
    text = [line for k, line in enumerate(lines) if k not in blocks[index]]
    at = len([k for k in range(blocks[behind].stop) if k not in blocks[index]])
    return [*text[:at], *(lines[k] for k in blocks[index]), *text[at:]]


def turn_and_part(lines: Lines, index: int) -> range:
    """Indices from the turn before a part to the turn after it."""
    body = part_of(lines, index)
    return range(body.start - 2, body.stop)


def without_part(index: int) -> Edit:
    def edit(lines: Lines) -> Lines:
        gone = turn_and_part(lines, index)
        return [*lines[: gone.start], *lines[gone.stop :]]

    return edit


def repeated(places: Callable[[Lines], Iterable[int]]) -> Edit:
    """Lines that occur twice."""

    def edit(lines: Lines) -> Lines:
        block = list(places(lines))
        return [*lines[: block[-1] + 1], *(lines[k] for k in block), *lines[block[-1] + 1 :]]

    return edit


def swapped_layers(index: int, first: int) -> Edit:
    def edit(lines: Lines) -> Lines:
        a, b = layers_of(lines, index)[first - 1 : first + 1]
        return [*lines[: a.start], *lines[b.start : b.stop], *lines[a.start : a.stop], *lines[b.stop :]]

    return edit


def crossed_low(lines: Lines) -> Lines:
    """After a turn, first down and then across."""
    begin = part_of(lines, 3).start
    ways = [k for k in range(begin, begin + 8) if lines[k].startswith("G0")]
    edited = list(lines)
    edited[ways[0]], edited[ways[1]] = lines[ways[1]], lines[ways[0]]
    return edited


IN_1_20, IN_2_1 = amid(1, 20), amid(2, 1)

FAULTS = (
    Fault("a part shifted by 0.5 mm", "contents", 2, 1, on(part(2), word("X", lambda x: x + 0.5))),
    Fault("a part shifted by 0.2 mm", "contents", 2, 1, on(part(2), word("X", lambda x: x + 0.2))),
    Fault("the first part shifted by 0.2 mm", "contents", 1, 1, on(part(1), word("Y", lambda y: y - 0.2))),
    Fault("a part raised 0.3 mm off its interface", "contents", 2, 1, on(part(2), word("Z", lambda z: z + 0.3))),
    Fault("a part pressed 0.1 mm into its interface", "contents", 3, 1, on(part(3), word("Z", lambda z: z - 0.1))),
    Fault("the first part 0.15 mm above the plate", "contents", 1, 1, on(part(1), word("Z", lambda z: z + 0.15))),
    Fault("a part scaled by 1.02", "contents", 2, 0, on(part(2), word("X", lambda x: 1.02 * x))),
    Fault("a mirrored part", "contents", 2, 0, on(part(2), word("Y", lambda y: -y))),
    Fault("a layer missing", "gap", 1, 20, on(layers(1, 20), lambda _: None)),
    Fault("four layers missing", "gap", 2, 12, on(layers(2, 12, 4), lambda _: None)),
    Fault("a layer whose moves are gone", "gap", 1, 31, on(layers(1, 30), drop("G1 .*E"))),
    Fault("a layer whose beads are not extruded", "gap", 2, 11, on(layers(2, 10), word("E", lambda e: 0.0, "G1 .*E[0-9]"))),
    Fault("a layer 0.1 mm too high", "gap", 1, 25, on(layers(1, 25), word("Z", lambda z: z + 0.1))),
    Fault("a layer 0.1 mm too low", "gap", 1, 26, on(layers(1, 25), word("Z", lambda z: z - 0.1))),
    Fault("a lift that is not lowered again", "gap", 1, 15, insert(amid(1, 15), "G91", "G0 Z0.4", "G90", "M83")),
    Fault("a layer printed twice", "filled", 1, 11, repeated(layers(1, 10))),
    Fault("two layers in the wrong order", "order", 1, 11, swapped_layers(1, 10)),
    Fault("a part at 60 % flow", "extrusion", 2, 2, on(part(2), word("E", lambda e: 0.6 * e, STROKES))),
    Fault("a first layer at 60 % flow", "room", 2, 1, on(layers(2, 1), word("E", lambda e: 0.6 * e, STROKES)), "warning"),
    Fault("a first layer twice as full", "room", 3, 1, on(layers(3, 1), word("E", lambda e: 2.0 * e, STROKES)), "warning"),
    Fault("a part at 150 % flow", "extrusion", 3, 1, on(part(3), word("E", lambda e: 1.5 * e, STROKES))),
    Fault("a layer at 80 % flow", "extrusion", 1, 18, on(layers(1, 18), word("E", lambda e: 0.8 * e, STROKES))),
    Fault("M221 S60 for a part", "extrusion", 2, 2, insert(nth(";PART:2"), "M221 S60")),
    Fault("40 travels that ooze", "extrusion", 1, 0, extruding_travels(lambda mm: 0.05)),
    Fault("40 travels that extrude", "extruding-travel", 1, 0, extruding_travels(lambda mm: 0.035 * mm)),
    Fault("no lift before a turn", "low-travel", 1, 48, on(lambda t: [before_turn(t, 1)], lambda _: None)),
    Fault("across after the turn at the height of the first bead", "low-travel", 3, 0, crossed_low),
    Fault("no fans", "fan", 1, 6, on(everywhere, drop("M106"))),
    Fault("no fan for a part", "fan", 2, 6, on(part(2), fan_off)),
    Fault("the fan off amid a part", "fan", 1, 20, on(layers(1, 20, 6), still)),
    Fault("45 mm laid in the air", "air", 1, 20, into_the_air),
    Fault("a nozzle of 170 deg C", "temperature", 2, 1, insert(IN_2_1, "M104 S170")),
    Fault("a nozzle of 255 deg C", "temperature", 2, 1, insert(IN_2_1, "M104 S255")),
    Fault("the nozzle off amid the print", "cold-extrusion", 1, 20, insert(IN_1_20, "M104 S0")),
    Fault("no waiting for heat", "cold-extrusion", 1, 1, on(everywhere, drop("M109"))),
    Fault("the heater left on", "heater-on", 3, 0, on(everywhere, lambda line: None if HEAT_OFF.match(line) else line)),
    Fault("the bed off amid the print", "bed-off", 1, 20, insert(IN_1_20, "M140 S0"), "warning"),
    Fault("parts in the wrong order", "order", 2, 1, lambda t: moved_part(t, 2, 3)),
    Fault("a part missing", "missing", 2, 0, without_part(2)),
    Fault("a part printed twice", "filled", 2, 1, repeated(part(2))),
    Fault("cut off amid the last part", "contents", 3, 10, lambda t: t[: layers_of(t, 3)[10].start]),
    Fault("cut off before the last part", "missing", 3, 0, lambda t: t[: part_of(t, 3).start]),
    Fault("a prime missing", "retraction", 1, 0, on(nth("G1 E0", 0, 1), lambda _: None)),
    Fault("no pulling back before a turn", "retraction", 2, 34, not_pulled),
    Fault("a blob of 5 mm of filament", "retraction", 1, 20, insert(IN_1_20, "G1 E5 F300")),
    Fault("30 mm pulled back", "retraction", 1, 20, insert(IN_1_20, "G1 E-30 F300", "G1 E30 F300")),
    Fault("another turn", "pose", 2, 1, on(turn_to(2), turned_on)),
    Fault("a tilt to the other side", "pose", 2, 1, on(turn_to(2), tilted_back)),
    Fault("filament while the table turns", "turning-stroke", 1, 48, on(turn_to(2), lambda line: line + " E1")),
    Fault("speeds ten times as high", "flow", 2, 2, on(part(2), word("F", lambda f: 10 * f, STROKES)), "warning"),
    Fault("M220 S1000", "axis-speed", 1, 0, insert(IN_1_20, "M220 S1000"), "warning"),
    Fault("relative moves from a layer on", "axis-limit", 1, 0, insert(IN_1_20, "G91")),
    Fault("inches from a layer on", "gap", 1, 20, insert(IN_1_20, "G20")),
    Fault("filament told absolutely", "contents", 1, 0, on(everywhere, lambda line: "M82" if line == "M83" else line)),
    Fault("a plunge below the plate", "collision", 1, 20, insert(IN_1_20, "G0 Z-1", "G0 Z4")),
    Fault("a travel 0.15 mm too low", "contact", 1, 0, along_a_bead),
    Fault("a plunge into an earlier part", "contact", 3, 5, insert(amid(3, 5), "G91", "G0 Z-3", "G0 Z3", "G90", "M83")),
    Fault("homing amid the print", "homing-over-print", 1, 20, insert(IN_1_20, "G28"), "warning"),
    Fault("no homing", "not-homed", 0, 0, on(everywhere, drop("G28|G92 [A-Z]0 "))),
    Fault("a place beyond the axis", "axis-limit", 1, 20, insert(IN_1_20, "G0 X900")),
    Fault("a purge line through the part", "purge", 0, 0, purged_at_middle),
    Fault("the first part beside the plate", "off-plate", 1, 0, on(part(1), word("X", lambda x: x + 95.0))),
)

REFUSED = {
    "a speed of 0": (insert(IN_1_20, "G1 X1 Y1 E0.1 F0"), "a feed must be above 0"),
    "a number that is none": (insert(IN_1_20, "G1 Xnan Y1 E0.1"), "Xnan"),
    "a word without its number": (insert(IN_1_20, "G1 X Y1 E0.1"), "without a number"),
    "an arc without its centre": (insert(IN_1_20, "G2 X1 Y1 E0.1"), "is not an arc"),
    "half a line": (insert(IN_1_20, "G1 X12.3 Y-"), "cannot be read"),
}
