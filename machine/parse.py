"""Parse: G-code text back into moves with absolute positions, one array row per move."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from math import hypot, inf

import numpy as np

from machine.arcs import centre_of, chord_count, chords, sweep_rad
from machine.parsed import Event, MoveKind, ParsedProgram
from machine.words import BLOCK, FLAG, FLAGS, MACRO, PAREN, WORD, shown, unframed
from profiles.errors import GcodeError
from profiles.machine import Machine

LONGEST_LINE = 2000
INCH_MM = 25.4
DEFAULT_FEED = 1500.0
CHORD_MM = 0.005  # arcs are read as chords that stay so near
ROUND_MM = 0.1  # by how much an arc's radius may differ at its ends
E_AXIS = 5


@dataclass
class Reader:
    """The firmware's state while reading: position, modes, and what the comments said."""

    letters: dict[str, int]
    home: list[float]
    at: list[float]
    e_shift: float = 0.0
    relative: bool = False
    relative_e: bool = False
    scale: float = 1.0
    feed: float = DEFAULT_FEED
    printing: float = inf
    travelling: float = inf
    motion: bool = False
    part: int = 0
    layer: int = 0
    layers: int = 0
    type: int = 0
    width: float = 0.0
    height: float = 0.0
    number: int = 0
    types: dict[str, int] = field(default_factory=lambda: {"": 0})
    parts: list[int] = field(default_factory=list)
    rows: list[tuple[float, ...]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    ignored: dict[str, tuple[int, int]] = field(default_factory=dict)
    unsupported: list[tuple[int, int, float, int]] = field(default_factory=list)


def parse_gcode(lines: Iterable[str], machine: Machine) -> ParsedProgram:
    """Read G-code lines (with or without line ends).

    Raises GcodeError, with the line, for what is not G-code and for motion codes that are not supported; M codes and
    macros that are not known are counted in `ignored`: code -> (first line, how often).
    """
    letters = {"X": 0, "Y": 1, "Z": 2, machine.tilt.letter: 3, machine.turn.letter: 4, "E": E_AXIS}
    linear = [min(max(0.0, axis.limits_mm[0]), axis.limits_mm[1]) for axis in (machine.x, machine.y, machine.z)]
    home = [*linear, machine.tilt.zero_deg, machine.turn.zero_deg, 0.0]
    reader = Reader(letters, home, home.copy())
    for number, line in enumerate(lines, start=1):
        reader.number = number
        code, _, remark = line.partition(";")
        if len(code) > LONGEST_LINE:
            raise GcodeError(f"line {number} is {len(line)} characters long: a G-code line has at most {LONGEST_LINE}")
        if remark:
            _remark(reader, remark)
        code = code.strip()
        if code:
            _command(reader, code)
    return _arrays(reader)


def _command(reader: Reader, text: str) -> None:
    """One line without its ; comment."""
    code = text.upper()
    if "(" in code:
        code = PAREN.sub(" ", code).strip()
    if code.startswith("N"):
        code = unframed(reader.number, code)
    if not code or code == "%":
        return
    if BLOCK.fullmatch(code):
        words = [(letter, float(value)) for letter, value in WORD.findall(code)]
        letter, value = words[0]
        if letter == "G" and value in (0.0, 1.0):
            _straight(reader, words[1:])
            return
        if letter in "GMT":
            _dispatch(reader, _name(letter, value), words[1:])
        elif reader.motion and letter in reader.letters:
            _straight(reader, words)
        elif letter == "F":
            reader.feed = value * reader.scale
        else:
            raise GcodeError(f"line {reader.number}: {shown(text)} begins with no command: G, M or T is expected")
        return
    _irregular(reader, code, text)


def _irregular(reader: Reader, code: str, text: str) -> None:
    """Lines whose words are not all letter and number: axis names alone, texts, macros."""
    head = re.match(r"([GM]) *([0-9]+(?:\.[0-9]+)?)", code)
    if head and (head[1] == "M" or FLAGS.fullmatch(code)):
        name = _name(head[1], float(head[2]))
        words = (
            [(letter, float(value or 0.0)) for letter, value in FLAG.findall(code[head.end() :])] if FLAGS.fullmatch(code) else []
        )
        if name in ("G0", "G1", "G92"):
            raise GcodeError(f"line {reader.number}: {shown(text)} has a word without a number")
        _dispatch(reader, name, words)
    elif MACRO.fullmatch(code) and text.isprintable():
        _ignore(reader, code.split()[0])
    else:
        raise GcodeError(f"line {reader.number}: {shown(text)} cannot be read as G-code")


def _straight(reader: Reader, words: list[tuple[str, float]]) -> None:
    """G0 and G1: a row, unless only F is given."""
    reader.motion = True
    at, letters, before = reader.at, reader.letters, tuple(reader.at)
    moved = False
    for letter, value in words:
        axis = letters.get(letter)
        if axis is None:
            if letter != "F":
                raise GcodeError(
                    f"line {reader.number}: word {letter}{value:g} of a move is not known: this machine has {' '.join(letters)} F"
                )
            if value <= 0:
                raise GcodeError(f"line {reader.number}: F is {value:g}: a feed must be above 0")
            reader.feed = value * reader.scale
            continue
        moved = True
        value *= 1.0 if axis in (3, 4) else reader.scale
        if axis == E_AXIS:
            at[axis] = at[axis] + value if reader.relative_e else value + reader.e_shift
        else:
            at[axis] = at[axis] + value if reader.relative else value
    if moved:
        _row(reader, before)


def _row(reader: Reader, before: tuple[float, ...]) -> None:
    """A move from a place to where the reader is now."""
    at = reader.at
    acceleration = reader.printing if at[E_AXIS] != before[E_AXIS] else reader.travelling
    told = (reader.part, reader.layer, reader.type, reader.width, reader.height)
    reader.rows.append((reader.number, *before, *at, reader.feed, *told, acceleration))


def _arc(reader: Reader, name: str, words: list[tuple[str, float]]) -> None:
    """G2 and G3 in the X Y plane, by I J or R: rows of chords, the other axes going along evenly."""
    clockwise, before = name == "G2", tuple(reader.at)
    shape = {letter: value * reader.scale for letter, value in words if letter in "IJR" and letter not in reader.letters}
    known = len(reader.rows)
    _straight(reader, [(letter, value) for letter, value in words if letter not in shape])
    after = tuple(reader.at)
    del reader.rows[known:]
    start, end = (before[0], before[1]), (after[0], after[1])
    if "R" in shape:
        centre = centre_of(start, end, shape["R"], clockwise)
    else:
        centre = (start[0] + shape.get("I", 0.0), start[1] + shape.get("J", 0.0)) if shape else None
    radii = [0.0, 0.0] if centre is None else [hypot(p[0] - centre[0], p[1] - centre[1]) for p in (start, end)]
    if centre is None or min(radii) == 0.0 or abs(radii[0] - radii[1]) > ROUND_MM:
        raise GcodeError(
            f"line {reader.number}: {name} is no arc: I and J, or R, must give a centre as far from its beginning as from its end"
        )
    sweep = sweep_rad(start, end, centre, clockwise)
    points = chords(start, end, centre, sweep, chord_count(max(radii), sweep, CHORD_MM))
    for k, point in enumerate(points, start=1):
        row_before, share = tuple(reader.at) if k > 1 else before, k / len(points)
        others = [a + share * (b - a) for a, b in zip(before[2:], after[2:], strict=True)]
        reader.at[:] = after if k == len(points) else [*point, *others]
        _row(reader, row_before)


def _dispatch(reader: Reader, name: str, words: list[tuple[str, float]]) -> None:
    action = CODES.get(name)
    if action is not None:
        action(reader, name, words)
    elif name[0] in "GT":
        raise GcodeError(f"line {reader.number}: {name} is not supported: G0 to G4, G20, G21, G28, G90, G91, G92 and T0 are")
    else:
        _ignore(reader, name)


def _ignore(reader: Reader, name: str) -> None:
    first, count = reader.ignored.get(name, (reader.number, 0))
    reader.ignored[name] = (first, count + 1)


def _mode(reader: Reader, name: str, words: list[tuple[str, float]]) -> None:
    """G20 G21 G90 G91 M82 M83; G90 and G91 set E too, as in Marlin."""
    if name in ("G20", "G21"):
        reader.scale = INCH_MM if name == "G20" else 1.0
    elif name in ("G90", "G91"):
        reader.relative = reader.relative_e = name == "G91"
    else:
        reader.relative_e = name == "M83"


def _home(reader: Reader, name: str, words: list[tuple[str, float]]) -> None:
    """G28: the named axes, or all, stand at 0 (or the nearest place inside their limits)."""
    named = [letter for letter, _ in words if letter in reader.letters and letter != "E"] or [
        k for k in reader.letters if k != "E"
    ]
    _note(reader, name, [(letter, 0.0) for letter in named])
    for letter in named:
        reader.at[reader.letters[letter]] = reader.home[reader.letters[letter]]


def _set(reader: Reader, name: str, words: list[tuple[str, float]]) -> None:
    """G92: the named axes stand at the given values from now on; E keeps its sum and changes its zero."""
    _note(reader, name, words)
    for letter, value in words or [(letter, 0.0) for letter in reader.letters]:
        axis = reader.letters.get(letter)
        if axis == E_AXIS:
            reader.e_shift = reader.at[E_AXIS] - value * reader.scale
        elif axis is not None:
            reader.at[axis] = value * (1.0 if axis in (3, 4) else reader.scale)


def _note(reader: Reader, name: str, words: list[tuple[str, float]]) -> None:
    values = dict(words)
    value = values.get("S", values.get("R", 0.0))
    if name == "G4":
        value = values.get("S", values.get("P", 0.0) / 1000.0)
    reader.events.append(Event(reader.number, name, value, "".join(letter for letter, _ in words), len(reader.rows)))


def _accelerate(reader: Reader, name: str, words: list[tuple[str, float]]) -> None:
    """M204: P while filament moves, T while it stands still, S both; what is not above 0 tells nothing."""
    for letter, value in words:
        if value > 0 and letter in "PS":
            reader.printing = value * reader.scale
        if value > 0 and letter in "TS":
            reader.travelling = value * reader.scale


def _nothing(reader: Reader, name: str, words: list[tuple[str, float]]) -> None:
    """Codes without a bearing on motion or heat."""


Action = Callable[[Reader, str, list[tuple[str, float]]], None]
ACTIONS: tuple[tuple[Action, str], ...] = (
    (_mode, "G20 G21 G90 G91 M82 M83"),
    (_note, "G4 M0 M1 M18 M84 M104 M106 M107 M109 M140 M190 M400"),
    (_nothing, "G17 G94 M486 M73 M105 M110 M115 M117 M118 M155 M201 M203 M205 M220 M221 T0"),
    (_accelerate, "M204"),
    (_home, "G28"),
    (_set, "G92"),
    (_arc, "G2 G3"),
)
CODES: dict[str, Action] = {code: action for action, codes in ACTIONS for code in codes.split()}


def _remark(reader: Reader, remark: str) -> None:
    """The comments that viewers know: what a move is for."""
    text = remark.strip()
    if text == "LAYER_CHANGE":
        reader.layer += 1
        reader.layers += 1
        return
    key, colon, value = text.partition(":")
    if not colon:
        return
    if key == "TYPE":
        reader.type = reader.types.setdefault(value, len(reader.types))
    elif key in ("WIDTH", "HEIGHT"):
        setattr(reader, key.lower(), _positive(value))
    elif key == "PART":
        _part(reader, value)
    elif key == "UNSUPPORTED":
        area, _, layer = value.partition("@")
        worst = int(layer) if re.fullmatch("[0-9]{1,6}", layer) else 0
        reader.unsupported.append((reader.number, reader.part, _positive(area), worst))


def _part(reader: Reader, value: str) -> None:
    number = value.split()[0] if value.split() else ""
    if re.fullmatch("[0-9]{1,6}", number):
        reader.part, reader.layer = int(number), 0
        reader.parts.append(reader.part)


def _positive(text: str) -> float:
    """The number of a comment; 0 when it is none, for a comment must not stop a print."""
    return float(text) if re.fullmatch(r" *[0-9]+(?:\.[0-9]+)? *", text) else 0.0


def _name(letter: str, value: float) -> str:
    return f"{letter}{value:g}"


def _arrays(reader: Reader) -> ParsedProgram:
    table = np.array(reader.rows, dtype=np.float64).reshape(-1, 20)
    start, end = table[:, 1:6], table[:, 7:12]
    e_mm = table[:, 12] - table[:, 6]
    turned = (np.abs(end[:, 3:] - start[:, 3:]) > 1e-9).any(axis=1)
    travelled = (np.abs(end[:, :3] - start[:, :3]) > 1e-9).any(axis=1)
    kind = np.select(
        [turned, travelled & (e_mm > 1e-9), ~travelled & (np.abs(e_mm) > 1e-9)],
        [MoveKind.ROTATE, MoveKind.EXTRUDE, MoveKind.RETRACT],
        MoveKind.TRAVEL,
    ).astype(np.int8)
    whole = table[:, [0, 14, 15, 16]].astype(np.int64)
    return ParsedProgram(
        line=whole[:, 0], start=start, end=end, e_mm=e_mm, filament_mm=np.cumsum(e_mm), feed=table[:, 13], kind=kind,
        part=whole[:, 1], layer=whole[:, 2], type=whole[:, 3], types=tuple(reader.types),
        width_mm=table[:, 17], height_mm=table[:, 18], acceleration=table[:, 19],
        events=tuple(reader.events), ignored=reader.ignored,
        layers=reader.layers, parts=tuple(dict.fromkeys(reader.parts)), unsupported=tuple(reader.unsupported),
    )  # fmt: skip
