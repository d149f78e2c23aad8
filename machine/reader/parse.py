"""Parse: G-code text of any dialect back into moves with absolute axis positions, one array row per move."""

import re
from collections.abc import Iterable

from machine.gcode.commands import PATHS
from machine.gcode.lines import Lines
from machine.gcode.words import BLOCK, FLAG, FLAGS, MACRO, PAREN, quote, read_words, unframe
from machine.reader.codes import dispatch
from machine.reader.macros import macro
from machine.reader.motion import flush
from machine.reader.parsed import ParsedProgram
from machine.reader.plain_moves import Text, letters_of, read_plain_moves
from machine.reader.remarks import remark
from machine.reader.state import Reader, Words, reader_of
from machine.reader.table import Table
from profiles.errors import GcodeError
from profiles.machine import Machine

LONGEST_LINE = 2000
PLACED = (*PATHS, "G4", "G10", "G28", "G92")


def parse_gcode(lines: Iterable[str], machine: Machine) -> ParsedProgram:
    """Read G-code lines (with or without line ends) as the machine's firmware would.

    Raises GcodeError, with the line, for what is not G-code and for motion codes that are not supported; M codes and
    macros that are not known are counted in `ignored`: code -> (first line, how often).
    """
    reader, lines = reader_of(machine), Lines.of(lines)
    table, text, letters, at = Table(reader, len(lines)), Text(lines.content, lines.start), letters_of(reader), 0
    while at < len(lines):
        line = lines[at]
        after = read_plain_moves(reader, text, letters, at) if line[:2] in ("G1", "G0") else at
        if after == at:
            reader.number = after = at + 1
            _line(reader, line)
        at = after
        table.take_some()
    if reader.turning:
        flush(reader)
    return table.program()


def _line(reader: Reader, line: str) -> None:
    """Any line: its comment, then its command."""
    code, _, said = line.partition(";")
    if "(" in code and len(line) <= LONGEST_LINE and code.count("(") > code.count(")"):
        code, _, said = PAREN.sub(" ", line).partition(";")  # the ; stands inside a comment in parentheses
    if len(code) > LONGEST_LINE:
        raise GcodeError(
            f"line {reader.number} is {len(line)} characters long: a G-code line has at most {LONGEST_LINE} before its comment"
        )
    if said:
        remark(reader, said)
    code = code.strip()
    if code and not reader.ended:
        _command(reader, code)


def _command(reader: Reader, text: str) -> None:
    """One line without its ; comment."""
    code = text.upper()
    if "(" in code:
        code = PAREN.sub(" ", code).strip()
    if code.startswith("N"):
        code = unframe(reader.number, code)
    if not code or code == "%":
        return
    if BLOCK.fullmatch(code):
        _block(reader, read_words(code), text)
    else:
        _irregular(reader, code, text)


def _block(reader: Reader, words: Words, text: str) -> None:
    """Letters and numbers: one command, or as CNC firmwares have it several, their words shared, the one that moves last."""
    named = [_name(letter, value) for letter, value in words if letter in "GMT"]
    others = [word for word in words if word[0] not in "GMT"]
    if not named:
        if reader.motion and any(letter in reader.letters for letter, _ in words):
            dispatch(reader, reader.motion, words)
        elif words[0][0] == "F" and words[0][1] > 0:
            reader.modes.move(reader.at, words[:1])
        else:
            raise GcodeError(f"line {reader.number}: {quote(text)} begins with no command: G, M or T is expected")
        return
    if words[0][0] not in "GMT":
        raise GcodeError(f"line {reader.number}: {quote(text)} begins with no command: G, M or T is expected")
    if (words[0][0] == "M" and reader.dialect.serial) or len(named) == 1:
        dispatch(reader, named[0], words[1:])
        return
    placed = [name for name in named if name in PLACED]
    if len(placed) > 1:
        raise GcodeError(f"line {reader.number}: {quote(text)} holds two motions, {placed[0]} and {placed[1]}")
    for name in [name for name in named if name not in (*placed, "M0", "M1", "M2", "M30")]:
        dispatch(reader, name, [] if name[0] == "G" else others)
    if placed:
        dispatch(reader, placed[0], others)
    elif reader.motion and any(letter in reader.letters for letter, _ in others):
        dispatch(reader, reader.motion, others)
    for name in [name for name in named if name in ("M0", "M1", "M2", "M30")]:
        dispatch(reader, name, [])


def _irregular(reader: Reader, code: str, text: str) -> None:
    """Lines whose words are not all letter and number: axis names alone, texts, macros."""
    head = re.match(r"([GM]) *([0-9]{1,6}(?:\.[0-9]{1,6})?)(?![0-9])", code)
    if head and (head[1] == "M" or FLAGS.fullmatch(code)):
        name = _name(head[1], float(head[2]))
        words = (
            [(letter, float(value or 0.0)) for letter, value in FLAG.findall(code[head.end() :])] if FLAGS.fullmatch(code) else []
        )
        if name in (*PATHS, "G92"):
            raise GcodeError(f"line {reader.number}: {quote(text)} has a word without a number")
        dispatch(reader, name, words)
    elif MACRO.fullmatch(code) and text.isprintable():
        if not macro(reader, code):
            reader.own(code.split()[0])
    elif re.match(r"O *[0-9<]|#|IF *\[|WHILE *\[", code):
        raise GcodeError(f"line {reader.number}: {quote(text)}: parameters and O words are not supported, only plain G-code is")
    else:
        raise GcodeError(f"line {reader.number}: {quote(text)} cannot be read as G-code")


def _name(letter: str, value: float) -> str:
    return f"{letter}{value:g}"
