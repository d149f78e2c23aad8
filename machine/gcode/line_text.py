"""Line text: splits a line of G-code into the command that is sent and its comment.

All readers of lines use it: the dry run parses the command, the sender sends it, and a file for a server or a card contains it,
so all three have the same text. Firmwares differ in how they read a line, and commands avoid all of these differences:

* Comments in parentheses: CNC firmwares skip them. Marlin (gcode/parser.cpp) and RepRapFirmware (StringParser.cpp, FFF mode)
  execute the words inside; Klipper (klippy/gcode.py) fails on them.
* Small letters and blanks inside words: Marlin ignores small letters unless built with GCODE_CASE_INSENSITIVE.
* `G01` and `G28 XY`: Klipper does not know the first, and homes every axis at the second.
* An axis named twice: Marlin and Klipper take the last value, RepRapFirmware the first, LinuxCNC stops.
* `X1E2`: RepRapFirmware may read an exponent, the others the words X1 and E2.
* Line numbers in the file: Marlin skips one number only, and the sender adds its own.
* A `;` in quotes: text for RepRapFirmware, the beginning of a comment for Marlin and OctoPrint.
* A backspace deletes the character before it in Marlin, the character 127 the whole line in RepRapFirmware.
* A backslash: Marlin (queue.cpp, process_stream_char) drops it, which invalidates the checksum.
"""

import re
import unicodedata
from typing import NamedTuple

from machine.firmware import dialects
from machine.gcode.words import BLOCK, FLAG, FLAGS, MACRO, WORD, quote
from profiles.errors import GcodeError

is_plain_move = re.compile(r"G[01](?: [A-Z]-?[0-9.]+)+").fullmatch  # nearly every line; its command is the line itself

PIECE = re.compile(r'"[^"]*"|\([^()]*\)|;.*|[^"();]+|["()]', re.DOTALL)
FRAME = re.compile(r"[Nn] *[0-9]+ *")
UNNUMBERED = re.compile(r"[Nn] *[GMTgmt] *[0-9]")
CHECKED = re.compile(r"([^;]*)\*([^*;]*)(;.*)?", re.DOTALL)
HEAD = re.compile(r"([GMTgmt]) *0*([0-9]{1,6})(?:\.([0-9]{0,6}))?(?![0-9.])")
# Commands followed by text, parentheses included: messages, expressions of RepRapFirmware, names of files on a card.
MESSAGES = frozenset({"M117", "M118"})
STATEMENTS = frozenset().union(*(dialect.statements for dialect in dialects().values()))
FREE_TEXT = MESSAGES | STATEMENTS | {"M23", "M28", "M30", "M32", "M33", "M928"}
# Commands with displayed text, in which characters that cannot be sent may be replaced.
SHOWN = MESSAGES | {"M0", "M1", "M291", "M486", "RESPOND", "SET_DISPLAY_TEXT"}
SHOWN |= {"EXCLUDE_OBJECT_DEFINE", "EXCLUDE_OBJECT_START", "EXCLUDE_OBJECT_END", "EXCLUDE_OBJECT"}
UNREADABLE = frozenset({"G0", "G1", "G2", "G3", "G92"})  # refused with words other than letters with numbers
UNSENDABLE = str.maketrans({"\\": "/", "*": "x"})  # printable, but a backslash or a star invalidates the checksum
CONTROL = re.compile(r"[\x00-\x1f\x7f]")
SIGNS = " .,:'+-%/"
LETTERS = {
    "ß": "ss", "æ": "ae", "Æ": "AE", "œ": "oe", "Œ": "OE", "ø": "o", "Ø": "O", "ł": "l", "Ł": "L", "đ": "d", "Đ": "D",
    "°": " deg ", "–": "-", "—": "-", "‘": "'", "’": "'", "“": "'", "”": "'", "„": "'", "×": "x", "·": "-", "€": "EUR",
}  # fmt: skip

# Comments that begin layers and parts, without the sign and surrounding blanks; every reader uses these.
LAYER = re.compile(r"LAYER_CHANGE|LAYER:-?[0-9]{1,6}")  # comments of PrusaSlicer and tiltprint, and of Cura
PART = re.compile(r"PART: *([0-9]{1,6})(?: of ([0-9]{1,6}))?.*")


class LineText(NamedTuple):
    """A line of G-code. command: as sent, "" for none; comment: the text after its `;`."""

    command: str
    comment: str


def read_line(line: str) -> LineText:
    """Split a line, with or without its line end, into command and comment.

    Words come out in capitals with one blank before each; texts and macros stay as written. Raises GcodeError, which does not
    name the line, for text that firmwares read differently: unpaired parentheses or quotes, an axis named twice, a wrong
    checksum.
    """
    text = line.strip()
    if text[:1] in ("", ";"):
        return LineText("", text[1:])
    if text[0] in "Nn" and (framed := FRAME.match(text)):
        text = _unframe(text, framed.end())
    elif UNNUMBERED.match(text):
        raise GcodeError(f"{quote(text)} begins with an N without a number, which RepRapFirmware skips: remove it")
    name = command_name(text)
    if '"' in text or "(" in text or ")" in text:
        code, comment = _without_remarks(text, name)
    else:
        code, _, comment = text.partition(";")
    code = code.replace("\t", " ").strip()
    if control := CONTROL.search(code):
        if name not in SHOWN:
            raise GcodeError(f"{quote(code)} cannot be read as G-code: it holds the character {control[0]!r}")
        code = CONTROL.sub("?", code)
    return LineText("" if code == "%" else _canonical(code, name), comment)


def command_name(text: str) -> str:
    """The name of a command: "G1" for "g01 x5", "M117" for "M117 50 %", for a macro its first word in capitals."""
    head = HEAD.match(text)
    if head:
        fraction = (head[3] or "").rstrip("0")
        return f"{head[1].upper()}{head[2]}{'.' if fraction else ''}{fraction}"
    return re.split(r"[\s;(]", text, maxsplit=1)[0].upper()


def macro_name(line: str) -> str:
    """The macro that a line of a program calls, in capitals; "" for none."""
    if line[1:2].isdigit():  # nearly every line
        return ""
    try:
        command = read_line(line).command.upper()
    except GcodeError:
        return ""
    return command.partition(" ")[0] if MACRO.fullmatch(command) else ""


def plain_line(line: str) -> str:
    """A line for a file, in a form that every printer firmware reads alike.

    Unchanged, with indent and comment, if its text already is the command. Raises GcodeError like read_line().
    """
    if is_plain_move(line):
        return line
    line = line.rstrip("\r\n")
    clean = CONTROL.search(line.replace("\t", " ")) is None
    if clean and line[:1] == ";":
        return line
    command, comment = read_line(line)
    comment = CONTROL.sub("?", comment)
    if clean and line.partition(";")[0].strip(" \t") == command:
        return line
    indent = line[: len(line) - len(line.lstrip(" \t"))]  # RepRapFirmware recognises blocks of statements by it
    return indent + (f"{command} ;{comment}".strip() if comment else command)


def to_ascii(command: str) -> str:
    """A command with displayed text in printable ASCII: letters lose their accents, other characters become `?`."""
    if (command.isascii() and command.isprintable()) or command_name(command) not in SHOWN:
        return command
    plain = "".join(c if c.isascii() and c.isprintable() else _likeness(c) for c in command)
    return re.sub(" {2,}", " ", plain).strip()


def _likeness(letter: str) -> str:
    plain = LETTERS.get(letter) or "".join(c for c in unicodedata.normalize("NFKD", letter) if not unicodedata.combining(c))
    return plain if all(c.isascii() and (c.isalnum() or c in SIGNS) for c in plain) else "?"


def _unframe(text: str, begin: int) -> str:
    """A line without number and checksum. Raises GcodeError for a wrong checksum."""
    checked = CHECKED.fullmatch(text)
    if checked is None:
        return text[begin:]
    body, given, comment = checked.groups()
    total = 0
    for byte in body.encode("utf-8", "replace"):
        total ^= byte
    if given.strip() != str(total):
        raise GcodeError(f"{quote(text)} has checksum {given.strip()[:8]!r}, its characters give {total}")
    return body[begin:] + (comment or "")


def _without_remarks(text: str, name: str) -> tuple[str, str]:
    """Code without comments in parentheses, and the comment. Parentheses in quotes, in free text, or directly after a letter in a
    macro (NAME=cube_(1)) are not comments."""
    code, comment = "", ""
    free, macro, shown = name in FREE_TEXT, MACRO.fullmatch(name) is not None, name in SHOWN
    for piece in PIECE.findall(text):
        if piece[0] == ";":
            comment = piece[1:]
            break
        if piece[0] == '"' and len(piece) > 1 and ";" in piece:
            if not shown:
                raise GcodeError(f"{quote(text)} has a ';' between quotes, where some firmwares begin a comment: remove it")
            code += piece.replace(";", ",")
        elif piece[0] == "(" and len(piece) > 1 and not free and (not macro or code[-1:].isspace()):
            code += " "
        elif piece == '"' and name in MESSAGES:
            code += "'"
        elif piece == '"' or (piece in "()" and not (free or macro)):
            sign = "quote" if piece == '"' else "parenthesis"
            raise GcodeError(f"{quote(text)} has a {sign} without its partner, or one inside another: remove it")
        else:
            code += piece
    return code, comment


def _canonical(code: str, name: str) -> str:
    """The canonical form of a command of letters and numbers; of other commands at most the name changes."""
    head = HEAD.match(code)
    if name in FREE_TEXT and head:
        rest = code[head.end() :].strip()
        return f"{name} {rest.translate(UNSENDABLE) if name in MESSAGES else rest}".strip()
    words = code.upper()
    if BLOCK.fullmatch(words):
        return _joined(code, WORD.findall(words))
    if name == "G28" and FLAGS.fullmatch(words):
        return _joined(code, FLAG.findall(words))
    if head and head[1] in "Gg" and name not in UNREADABLE:
        return words
    shown = code.translate(UNSENDABLE) if name in SHOWN else code
    return f"{name}{shown[head.end() :]}" if head and head[1] in "Mm" else shown


def _joined(code: str, words: list[tuple[str, str]]) -> str:
    letters = [letter for letter, _ in words if letter not in "GM"]
    if len(letters) > len(set(letters)):
        twice = next(letter for letter in letters if letters.count(letter) > 1)
        raise GcodeError(f"{quote(code)} has the word {twice} twice: firmwares do not agree which one counts")
    return " ".join(
        f"{command_name(letter + number) if letter in 'GMT' else letter + number.lstrip('+')}" for letter, number in words
    )


def begins_layer(comment: str) -> bool:
    """Whether a comment begins a layer."""
    return LAYER.fullmatch(comment) is not None


def begun_part(comment: str) -> tuple[int, int] | None:
    """Number (from 1) and count (0: not given) of the part that a comment begins; None for any other comment."""
    match = PART.fullmatch(comment)
    return (int(match[1]), int(match[2] or 0)) if match else None
