"""Parse: converts G-code text of any dialect to moves with absolute axis positions, one array row per move."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from machine.gcode.commands import PATHS
from machine.gcode.line_text import FREE_TEXT, begins_layer, begun_part, command_name, read_line, to_ascii
from machine.gcode.lines import Lines
from machine.gcode.modes import MODES
from machine.gcode.reader.codes import BARE_WORDS, VALUED, do_command, do_macro, flush
from machine.gcode.reader.parsed import MoveKind, ParsedProgram, Remarks, pieces
from machine.gcode.reader.plain_moves import read_plain_moves
from machine.gcode.reader.state import Reader, reader_of
from machine.gcode.settings import PART_TOTALS, read_totals
from machine.gcode.words import BLOCK, FLAG, FLAGS, MACRO, Word, quote, read_words
from machine.kinematics.table import axis_positions
from mdp.mesh import Floats, Indices
from profiles.errors import GcodeError
from profiles.machine import Machine
from slicer.estimate.timing import axis_speeds, lengths
from slicer.paths import Unsupported

LONGEST_LINE = 2000
CONDITIONS = ("IF", "ELIF", "ELSE", "WHILE")
SECOND = re.compile(r"[GM] *[0-9]+")  # a second command in a line
STRING = re.compile(r'"[^"]*"')
PLACED = (*PATHS, "G4", "G10", "G28", "G92")
STOPS = ("M0", "M1", "M2", "M30")
STILL = 1e-9
SWAY_MM = 0.05  # greatest deviation of the head in a followed turn, from straight steps and rounded positions


def parse_gcode(lines: Iterable[str], machine: Machine) -> ParsedProgram:
    """Read G-code lines (with or without line ends) as the machine's firmware would.

    Raises GcodeError, naming the line, for text that is not G-code and for unsupported motion codes; unknown M codes and macros
    are counted in `ignored`: code -> (first line, count).
    """
    lines = Lines.of(lines)
    reader, at = reader_of(machine, len(lines)), 0
    while at < len(lines):
        after = read_plain_moves(reader, lines, at)
        if after == at:
            reader.number = after = at + 1
            line = lines[at]
            if len(line) > LONGEST_LINE and len(line.partition(";")[0]) > LONGEST_LINE:
                raise GcodeError(
                    f"line {after} is {len(line)} characters long: a G-code line has at most {LONGEST_LINE} before its comment"
                )
            try:
                _line(reader, line)
            except GcodeError as error:
                raise GcodeError(f"line {after}: {error}") from None
        at = after
    if reader.turning:
        flush(reader)
    return _program_of(reader)


def _line(reader: Reader, line: str) -> None:
    """Read any line: its comment, then its command, as it is sent. Raises GcodeError, which does not name the line."""
    if reader.ended:
        _remark(reader, line.partition(";")[2])
        return
    text, comment = read_line(line)
    if comment:
        _remark(reader, comment)
    if not text:
        return
    if reader.dialect.statements:
        _check_condition(reader, line, text)
    code = text.upper()
    if BLOCK.fullmatch(code):
        _block(reader, read_words(code), text)
    else:
        _irregular(reader, code, text)


def _remark(reader: Reader, text: str) -> None:
    """Apply a comment, without its sign: PrusaSlicer's words, Cura's LAYER, and PART, CONTENTS and UNSUPPORTED of tiltprint."""
    text = text.strip()
    if begins_layer(text):
        reader.layer += 1
        reader.layers += 1
        return
    if part := begun_part(text):
        reader.part, reader.layer = part[0], 0
        reader.parts.append(reader.part)
        reader.announced = max(reader.announced, part[1])
        return
    key, colon, value = text.partition(":")
    if not colon:
        return
    if key == "TYPE":
        reader.type = reader.types.setdefault(value, len(reader.types))
    elif key == "WIDTH":
        reader.width = _positive(value)
    elif key == "HEIGHT":
        reader.height = _positive(value)
    elif key == PART_TOTALS:
        if totals := read_totals(value, reader.number, reader.part):
            reader.part_totals.append(totals)
    elif key == "UNSUPPORTED":
        area, _, rest = value.partition("@")
        layer, _, reason = rest.partition(" ")
        worst = int(layer) if re.fullmatch("[0-9]{1,6}", layer) else 0
        reader.unsupported.append((reader.number, reader.part, Unsupported(_positive(area), worst, reason)))


def _positive(text: str) -> float:
    """The number in a comment; 0 for any other text, for a comment must not stop a print."""
    return float(text) if re.fullmatch(r" *[0-9]{1,9}(?:\.[0-9]{1,12})? *", text) else 0.0


def _check_condition(reader: Reader, line: str, command: str) -> None:
    """Refuse a move or a mode below `if`, `else` or `while`: only the firmware knows whether and how often it runs."""
    spread, name = line.expandtabs(4), command_name(command)
    indent = len(spread) - len(spread.lstrip())
    if reader.condition is not None and indent <= reader.condition:
        reader.condition = None
    if reader.condition is not None and name in (*PATHS, *MODES, "G10", "G11", "G92"):
        raise GcodeError(f"{quote(command)} depends on a condition: write moves and modes outside of it")
    if name in CONDITIONS and reader.condition is None:
        reader.condition = indent


def _block(reader: Reader, words: Sequence[Word], text: str) -> None:
    """Execute letters and numbers: one command, or for CNC firmwares several that share their words, the one that moves last.

    A serial firmware needs one command per line, at the front: Marlin and Klipper take a second one for a parameter,
    RepRapFirmware executes it.
    """
    named = [_name(*word) for word in words if word[0] in "GMT"]
    others = {letter: value for letter, value in words if letter not in "GMT"}
    goes_on = reader.motion != "" and not reader.dialect.serial and not reader.letters.keys().isdisjoint(others)
    if not named and goes_on:
        do_command(reader, reader.motion, others)
        return
    if not named and not reader.dialect.serial and words[0][0] == "F" and words[0][1] > 0:
        reader.modes.move(reader.at, words[:1])
        return
    if words[0][0] not in "GMT":
        raise GcodeError(f"{quote(text)} begins with no command: G, M or T is expected")
    if reader.dialect.serial and (second := next((_name(*word) for word in words[1:] if word[0] in "GM"), None)):
        raise GcodeError(f"{quote(text)} holds two commands, {named[0]} and {second}: write one a line")
    if len(named) == 1 or reader.dialect.serial:
        do_command(reader, named[0], dict(words[1:]))
        return
    placed = [name for name in named if name in PLACED]
    if len(placed) > 1:
        raise GcodeError(f"{quote(text)} holds two motions, {placed[0]} and {placed[1]}")
    for name in [name for name in named if name not in (*placed, *STOPS)]:
        do_command(reader, name, {} if name[0] == "G" else others)
    if placed or goes_on:
        do_command(reader, placed[0] if placed else reader.motion, others)
    for name in [name for name in named if name in STOPS]:
        do_command(reader, name, {})


def _irregular(reader: Reader, code: str, text: str) -> None:
    """Execute commands with other words than letter and number: axis names alone, texts, macros."""
    dialect = reader.dialect
    if to_ascii(text) != text:
        reader.replaced.append((reader.number, text))
    head = re.match(r"([GM]) *([0-9]{1,6}(?:\.[0-9]{1,6})?)(?![0-9])", code)
    if head and (head[1] == "M" or FLAGS.fullmatch(code)):
        name, rest = _name(head[1], float(head[2])), code[head.end() :]
        if head[1] == "G" and name not in BARE_WORDS:
            raise GcodeError(f"{quote(text)} has a word without a number")
        if name in VALUED:
            raise GcodeError(f"{quote(text)}: behind {name} only letters with a number are allowed")
        if dialect.serial and name not in FREE_TEXT:
            _check_alone(name, rest, text)
        words = FLAG.findall(rest) if FLAGS.fullmatch(code) else []
        do_command(reader, name, {letter: float(value or 0.0) for letter, value in words})
    elif MACRO.fullmatch(code) and text.isprintable():
        name, _, rest = code.partition(" ")
        if dialect.serial and not dialect.macros and name not in dialect.statements:
            _check_alone(name, rest, text)
        if not dialect.macros or not do_macro(reader, code):
            reader.own(name)
    elif re.match(r"O *[0-9<]|#|IF *\[|WHILE *\[", code):
        raise GcodeError(f"{quote(text)}: parameters and O words are not supported, only plain G-code is")
    else:
        raise GcodeError(f"{quote(text)} cannot be read as G-code")


def _check_alone(name: str, rest: str, text: str) -> None:
    """Refuse a second command after the words and texts of a first one, which RepRapFirmware would execute."""
    if second := SECOND.search(STRING.sub("", rest)):
        raise GcodeError(f"{quote(text)} holds two commands, {name} and {second[0]}: write one a line")


def _name(letter: str, value: float) -> str:
    return f"{letter}{value:g}"


def _program_of(reader: Reader) -> ParsedProgram:
    """The program in a reader."""
    columns, count = reader.columns, reader.rows
    begins, remark = columns.starts if len(columns.starts) else columns.places, columns.remark_rows[: reader.remarks].T
    program = ParsedProgram(
        line=columns.line[:count], start=begins[:count], end=columns.places[1 : count + 1], e_mm=columns.e_mm[:count],
        feed=columns.feed[:count], kind=np.empty(count, np.int8), remark=columns.remark[:count],
        remarks=Remarks(*remark[:3].astype(np.int32), *remark[3:]), types=tuple(reader.types), events=tuple(reader.events),
        ignored=reader.ignored, replaced=tuple(reader.replaced), layers=reader.layers, parts=tuple(dict.fromkeys(reader.parts)),
        unsupported=tuple(reader.unsupported), announced=reader.announced, part_totals=tuple(reader.part_totals),
    )  # fmt: skip
    followed = np.searchsorted(reader.switches, np.arange(count), side="right") % 2 == 1 if reader.switches else np.zeros(0, bool)
    program = _in_axis_positions(program, np.flatnonzero(followed), reader)
    for some in pieces(len(program.line)):
        change, pushed = np.abs(program.end[some] - program.start[some]) > STILL, program.e_mm[some]
        moved, turned = change[:, :3].any(axis=1), change[:, 3:].any(axis=1)
        does = [turned, moved & (pushed > STILL), ~moved & (np.abs(pushed) > STILL)]
        program.kind[some] = np.select(does, [MoveKind.ROTATE, MoveKind.EXTRUDE, MoveKind.RETRACT], MoveKind.TRAVEL)
    return program


def _in_axis_positions(program: ParsedProgram, followed: Indices, reader: Reader) -> ParsedProgram:
    """The program with its (m,) followed rows converted to axis positions, with feeds by the measure of NIST."""
    asked = (program.feed < 0.0) | np.isinf(program.feed)
    asked[followed] = True
    if reader.dialect.largest_delta:
        asked |= (program.start[:, 3:] != program.end[:, 3:]).any(axis=1)
    odd = np.flatnonzero(asked)
    length, keep = _feed_length(program.changes(odd), reader.dialect.largest_delta), None
    if len(followed):
        program = replace(program, start=program.start.copy(), end=program.end.copy())
        for side in (program.start, program.end):
            side[followed, :3] = axis_positions(reader.machine, side[followed])
        keep = _turn_starts(program, followed)
    program.feed[odd] = _feeds(program.feed[odd], length, program.changes(odd), axis_speeds(reader.machine))
    return program if keep is None else _merge_turns(keep, program)


def _feed_length(change: Floats, largest: bool = False) -> Floats:
    """(n,) lengths to which F refers along (n, 6) changes, by the rule of NIST RS274.

    largest: for pure turns only the axis that moves farthest (Klipper).
    """
    length, measure = lengths(change)
    return np.where(measure == 1, np.abs(change[:, 3:5]).max(axis=1, initial=0.0), length) if largest else length


def _feeds(given: Floats, asked: Floats, change: Floats, speeds: Floats) -> Floats:
    """Units per minute by NIST's measure, from feeds by another measure, inverse time, or the axes' top speeds."""
    length = _feed_length(change)
    with np.errstate(divide="ignore", invalid="ignore"):
        fastest = 60.0 * length / (np.abs(change) / speeds).max(axis=1)
        minutes = np.where(given < 0, -1.0 / given, asked / given)
        along = np.where(minutes > 0, length / minutes, fastest)
    along = np.where(np.isinf(given), fastest, along)
    along = np.where(np.isfinite(along) & (along > 0), along, 1.0)
    differs = (given < 0) | np.isinf(given) | (np.abs(asked - length) > STILL)
    return np.where(differs, along, given)


def _turn_starts(program: ParsedProgram, followed: Indices) -> NDArray[np.bool_]:
    """(n,) False for a row that continues the turn of the previous row, in the same direction with the head at rest."""
    start, end = program.start, program.end
    turn = end[:, 3:] - start[:, 3:]
    size = np.hypot(turn[:, 0], turn[:, 1])
    sway = np.abs(end[followed, :3] - start[followed, :3]).max(axis=1, initial=0.0)
    pure = np.zeros(len(size), dtype=np.bool_)
    pure[followed] = (size[followed] > STILL) & (program.e_mm[followed] == 0.0) & (sway < SWAY_MM)
    heading = turn / np.maximum(size, STILL)[:, None]
    goes_on = np.zeros(len(size), dtype=np.bool_)
    goes_on[1:] = pure[1:] & pure[:-1] & (np.abs(heading[1:] - heading[:-1]).max(axis=1, initial=0.0) < 0.01)
    goes_on[1:] &= np.abs(start[1:] - end[:-1]).max(axis=1, initial=0.0) < SWAY_MM
    goes_on[[event.row for event in program.events if event.row < len(size)]] = False
    end[pure, :3] = start[pure, :3]
    for row in np.flatnonzero(goes_on):
        start[row, :3] = end[row, :3] = start[row - 1, :3]
    return ~goes_on


def _merge_turns(keep: NDArray[np.bool_], program: ParsedProgram) -> ParsedProgram:
    """The program with each turn in one row, at the mean speed of the turn."""
    first = np.flatnonzero(keep)
    last = np.append(first[1:], len(keep)) - 1
    minutes = np.add.reduceat(_feed_length(program.changes()) / program.feed, first)
    merged_row = np.append(np.cumsum(keep) - 1, len(first))
    names = ("line", "start", "e_mm", "feed", "kind", "remark")
    merged = replace(
        program,
        **{name: getattr(program, name)[first] for name in names},
        end=program.end[last],
        events=tuple(replace(event, row=int(merged_row[event.row])) for event in program.events),
    )
    joined = first < last
    merged.feed[joined] = _feed_length(merged.changes())[joined] / minutes[joined]
    return merged
