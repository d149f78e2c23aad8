"""Lines of G-code: what is sent equals what was dry-run, however a firmware parses the text.

The parsers of the firmwares are transcribed here from their sources, independently of the program: Marlin's gcode/queue.cpp and
parser.cpp, klippy/gcode.py, RepRapFirmware's GCodeBuffer/StringParser.cpp, and OctoPrint's strip_comment.
"""

import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from machine.firmware import dialect_of, dialects
from machine.gcode.blocks import fill_block
from machine.gcode.line_text import plain_line, read_line, to_ascii
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import ParsedProgram
from machine.link.protocol.framing import command_of, frame
from machine.printing.servers.server import GcodeUpload
from profiles.errors import GcodeError, LocalProtocolError
from profiles.machine import Machine
from profiles.profile import load

Read = tuple[str, dict[str, float]] | None  # a command's name and its numeric words; None: nothing that could move
NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")


def marlin_float(text: str) -> float | None:
    number = NUMBER.match(text)
    return float(number[0]) if number else None


def marlin(line: str) -> Read:
    """GCodeParser::parse with FASTER_GCODE_PARSER: upper case only, signs between words are skipped, the last word counts."""
    text = re.sub(r"^N[-+0-9.]+ *", "", line.lstrip(" ")).partition("*")[0]
    head = re.match(r"([GMT]) *([0-9]+)(?:\.([0-9]+))? *", text)
    if head is None or f"{head[1]}{int(head[2])}" in ("M23", "M28", "M30", "M117", "M118", "M928"):
        return None
    words: dict[str, float] = {}
    at = head.end()
    while at < len(text):
        letter, at = text[at], at + 1
        if "A" <= letter <= "Z":
            at += len(text[at:]) - len(text[at:].lstrip(" "))
            value = marlin_float(text[at:])
            words.pop(letter, None)
            if value is not None or head[2] == "28":
                words[letter] = value or 0.0
        if not "A" <= text[at : at + 1] <= "Z":
            at += len(text[at:]) - len(text[at:].lstrip("0123456789.+-"))
            at += len(text[at:]) - len(text[at:].lstrip(" "))
    return f"{head[1]}{int(head[2])}" + (f".{int(head[3])}" if head[3] and int(head[3]) else ""), words


def marlin_receives(data: bytes) -> Read:
    """GCodeQueue: a `;` ends the line, a backslash escapes the next character, number and checksum must be right."""
    kept, escaped = "", False
    for c in data.decode("ascii").rstrip("\n"):
        if escaped:
            escaped = False
        elif c == "\\":
            escaped = True
            continue
        elif c == ";":
            break
        kept += c
    body, _, given = kept.rpartition("*")
    total = 0
    for byte in body.encode():
        total ^= byte
    assert body.startswith("N")
    assert int(given) == total, f"Marlin asks for {data!r} again and again"
    return marlin(kept)


def octoprint(line: str) -> Read:
    """The bytes that OctoPrint sends to a Marlin for a line of a file: cut at a `;` that no backslash escapes."""
    kept = re.sub(r"\\(.)", r"\1", re.split(r"(?<!\\);", line, maxsplit=1)[0].strip())
    while "\x08" in kept:  # each deletes a character, as process_stream_char does
        kept = re.sub("[^\x08]?\x08", "", kept, count=1)
    return marlin(kept)


def klipper(line: str) -> Read:
    """GCodeDispatch._process_commands; a word that is not a number is an error that ends the print: nothing moves."""
    parts = re.split(r"([A-Z_]+|[A-Z*])", line.strip().partition(";")[0].upper())
    name = "".join(parts[3:5] if "".join(parts[:2]) == "N" else parts[:3]).strip()
    words = {parts[k]: parts[k + 1].strip() for k in range(1, len(parts), 2)}
    if not re.fullmatch(r"[GM][0-9.]+", name):
        return None
    numbers: dict[str, float] = {}
    for letter, value in words.items():
        try:
            numbers[letter] = float(value)
        except ValueError:
            if name != "G28" and name[0] == "G":
                return None
    named = {letter: 0.0 for letter in words if letter in ("X", "Y", "Z")} if name == "G28" else {}
    return name, named | numbers


def reprapfirmware(line: str) -> list[Read]:
    """StringParser: it does not treat parentheses as comments, a G or M outside quotes begins a command, the first of two
    words counts."""
    kept, quoted = "", False
    for c in line.strip():
        quoted ^= c == '"'
        if c == "\x7f":
            return []
        if c == ";" and not quoted:
            kept += "\n"
        kept += c
    kept = kept.partition("\n")[0]
    kept = re.sub(r"^[Nn][0-9]* *", "", kept)
    done: list[Read] = []
    while kept:
        head = re.match(r"([GMT])(?:(-?[0-9]+)(?:\.([0-9]))?)?", kept.upper())
        if head is None or f"{head[1]}{head[2]}" in ("M23", "M28", "M30", "M117", "M118"):
            return done
        rest = re.sub(r'"[^"]*"?', lambda text: "_" * len(text[0]), kept.upper()[head.end() :])
        end = next((k for k, c in enumerate(rest) if c in "GM"), len(rest))
        words: dict[str, float] = {}
        for word in re.finditer(r"([A-Z])([-+]?[0-9.]*(?:E[-+]?[0-9]+)?)", rest[:end]):
            value = NUMBER.match(word[2])
            if word[1] not in words:
                powered = re.fullmatch(NUMBER.pattern + "(?:E[-+]?[0-9]+)?", word[2])
                words[word[1]] = float(powered[0]) if powered else float(value[0]) if value else 0.0
        done.append((f"{head[1]}{int(head[2] or -1)}" + (f".{head[3]}" if head[3] else ""), words))
        kept = kept[head.end() + end :]
    return done


class Playing:
    """Position of a machine after its moves: X Y Z tilt turn and the filament."""

    def __init__(self, machine: Machine) -> None:
        self.letters = "".join(("XYZ", machine.tilt.letter, machine.turn.letter, "E"))
        self.at, self.zero = [0.0] * 6, 0.0
        self.relative = self.filament_relative = False
        self.unit, self.filament_mode = 1.0, {"marlin": "set", "klipper": "carried", "reprapfirmware": "apart"}[machine.dialect]
        self.moves: list[tuple[int, list[float]]] = []

    def do(self, number: int, read: Read) -> None:
        if read is None:
            return
        name, words = read
        if name in ("G0", "G1", "G2", "G3") and any(letter in words for letter in self.letters + "IJR"):
            self.move(number, words)
        elif name in ("G90", "G91"):
            self.relative = name == "G91"
            if self.filament_mode == "set":
                self.filament_relative = self.relative
        elif name in ("M82", "M83"):
            self.filament_relative = name == "M83"
        elif name in ("G20", "G21"):
            self.unit = 25.4 if name == "G20" else 1.0
        elif name == "G28":
            named = [letter for letter in self.letters[:5] if letter in words] or list(self.letters[:5])
            for letter in named:
                self.at[self.letters.index(letter)] = 0.0
        elif name == "G92":
            named = [letter for letter in self.letters if letter in words]
            if not named and self.filament_mode == "carried":
                named, words = list(self.letters), dict.fromkeys(self.letters, 0.0)
            for letter in named:
                self.call(self.letters.index(letter), words[letter])

    def call(self, axis: int, value: float) -> None:
        value *= 1.0 if axis in (3, 4) else self.unit
        if axis == 5:
            self.zero = value - self.at[5]
        else:
            self.at[axis] = value

    def move(self, number: int, words: dict[str, float]) -> None:
        for axis, letter in enumerate(self.letters):
            if letter in words:
                value = words[letter] * (1.0 if axis in (3, 4) else self.unit)
                steps = (
                    self.relative if axis < 5 else self.filament_relative or (self.relative and self.filament_mode == "carried")
                )
                self.at[axis] = self.at[axis] + value if steps else value - (self.zero if axis == 5 else 0.0)
        self.moves.append((number, list(self.at)))


MACHINES = {
    "marlin": load().machine,
    "klipper": load(settings=["machine.dialect=klipper"]).machine,
    "reprapfirmware": load(settings=["machine.dialect=reprapfirmware"]).machine,
}


def dry_run_moves(program: ParsedProgram) -> list[tuple[int, list[float]]]:
    """The line and the end of every move; for an arc, the end of its last chord."""
    last = np.flatnonzero(np.append(program.line[1:] != program.line[:-1], True)) if len(program.line) else []
    ends = np.column_stack([program.end, program.filament_mm])
    return [(int(program.line[k]), ends[k].tolist()) for k in last]


def assert_same_moves(done: list[tuple[int, list[float]]], program: ParsedProgram) -> None:
    expected = dry_run_moves(program)
    assert [line for line, _ in done] == [line for line, _ in expected]
    np.testing.assert_allclose([at for _, at in done], [at for _, at in expected], atol=1e-6)


def sent(lines: list[str]) -> list[tuple[int, bytes]]:
    """Data sent down a serial line: the line's number in the program, and the bytes."""
    commands = [(number, command_of(line, number)) for number, line in enumerate(lines, 1)]
    return [(number, frame(number, command)) for number, command in commands if command]


SCRAPS = (
    "G1", "G0", "G1 ", "g1", "G 1", "G01", "G1.0", "G2 I5", "G90", "G91", "G92 ", "G28 ", "G20", "G21", "M82", "M83", "M117 ",
    "M118 ", "M106 S255", "M104 S2", "M84 ", "T0", "X10", "X 10", "Y-5.5", "x1e2", "Z+2", "E1", "F300", "A30", "C 4", "X", "XY",
    "X1.5.2", "Y.5", "(then Y50 Z2)", "(", ")", "((a) X3)", ";", ";LAYER_CHANGE", ";PAUSE:x", '"', '"a (b)"', '"a;b"', "N3 ", "N",
    "*98", "\\", "\\;", "\t", " ", "  ", "%", "/", "{", "#", "=", ",", ".", "-", "+", "ä", "\xff", "\u2028",
    "\x08\x08\x08\x08\x08", "\x7f", "\uff1b", "half", "PAUSE ", "START X5 Y6", "MSG=", "'",
)  # fmt: skip
USUAL = (
    "G1 X10 Y-5.5 E1 F300", "G1 X 10 Y5", "G0 Z2 A30", "G2 I5 E.5", "G92 X3 E0", "G28 X Y", "G91", "G90", "M83", "M104 S2",
    "M117 a b", "G20",
)  # fmt: skip
PROBE = "G1 X7 Z1 E1 F600"  # its end shows which modes are in effect


def put_between(words: list[str], scrap: str, place: int) -> str:
    """A usual line with a scrap inserted between two of its words."""
    return " ".join([*words[: place % (len(words) + 1)], scrap, *words[place % (len(words) + 1) :]])


HEAPS = st.lists(st.sampled_from(SCRAPS), max_size=6).flatmap(lambda some: st.sampled_from(["".join(some), " ".join(some)]))
SPOILT = st.builds(put_between, st.sampled_from(USUAL).map(str.split), st.sampled_from(SCRAPS), st.integers(0, 5))
TEXTS = st.lists(st.one_of(HEAPS, SPOILT, SPOILT), min_size=1, max_size=3).map(
    lambda lines: [line for wild in lines for line in (wild, PROBE)]
)
REMARK = "G1 X10 F3000 (then Y50 Z2 by hand)"
WAYS: dict[str, tuple[str, Callable[[str], list[Read]]]] = {
    "OctoPrint": ("marlin", lambda line: [octoprint(line)]),
    "Moonraker": ("klipper", lambda line: [klipper(line)]),
    "Duet": ("reprapfirmware", reprapfirmware),
}


@given(TEXTS)
@example([REMARK])
@example(["G91", "G1 X5 X10"])
@example(["N1 G1 X5"])
@example(["G1 X5", "X7"])
@example(["G1 X50 ;PAUSE:wait"])
@example(["g01 x5y6 e1"])
@example(["M117 50 % (half) X9", "M117 a\\b", 'M118 "a;b"'])
@example(["G91 G1 X5"])
@example(["M84\\"])
def test_marlin_moves_by_what_is_sent_as_the_dry_run_does(lines: list[str]) -> None:
    try:
        program, stream = parse_gcode(lines, MACHINES["marlin"]), sent(lines)
    except (GcodeError, LocalProtocolError):
        return
    playing = Playing(MACHINES["marlin"])
    for number, data in stream:
        playing.do(number, marlin_receives(data))
    assert_same_moves(playing.moves, program)


@pytest.mark.parametrize("way", WAYS)
@given(TEXTS)
@example([REMARK])
@example(["G91", "G1 X5 X10"])
@example(["G1 X5\\; Y10"])
@example(["G1 X10 (smile ;) Y5"])
@example(["G1 X1e2"])
@example(["M117 \x08\x08\x08\x08\x08G1 X50"])
@example(["G1 X5 ;a\x7f"])
@example(["G28 XY", "G1 X5"])
@example(["M83 ä", PROBE, PROBE])
@example(["NG01 X5"])
@example(["\xa0G91", PROBE, PROBE])
@example(["MOVE G1 X5"])
@example(["M84 X G1 Y50"])
def test_a_server_s_firmware_moves_by_the_uploaded_file_as_the_dry_run_does(way: str, lines: list[str]) -> None:
    dialect, read = WAYS[way]
    try:
        program, upload = parse_gcode(lines, MACHINES[dialect]), GcodeUpload("a.gcode", lines)
    except GcodeError:
        return
    playing = Playing(MACHINES[dialect])
    for number, line in enumerate(upload.content.decode().split("\n"), 1):
        for command in read(line):
            playing.do(number, command)
    assert_same_moves(playing.moves, program)


@given(TEXTS)
def test_a_command_is_read_as_itself_and_a_plain_line_too(lines: list[str]) -> None:
    for line in lines:
        try:
            command = read_line(line).command
        except GcodeError:
            continue
        assert read_line(command) == (command, "")
        assert read_line(plain_line(line)).command == command


@pytest.mark.parametrize(("line", "command", "comment"), [
    (REMARK, "G1 X10 F3000", ""),
    ("G1 X10 (a;b) Y5 ; (done", "G1 X10 Y5", " (done"),
    ("g01x1 y-.5(left)z+2", "G1 X1 Y-.5 Z2", ""),
    ("N3 G28 X Y*", "G28 X Y*", None),
    ("N3 G1 X1*98 ; home", "G1 X1", " home"),
    ("G28 XY", "G28 X Y", ""),
    ("M 104S200(hot)", "M104 S200", ""),
    ("m117 50 % (half) ;x", "M117 50 % (half)", "x"),
    ('M118 S"a (b;c)" ;d', 'M118 S"a (b,c)"', "d"),
    ('M291 P"Change (now)" S3 (ask)', 'M291 P"Change (now)" S3', ""),
    ("M117 a\\b * c", "M117 a/b x c", ""),
    ('M117 5" nozzle', "M117 5' nozzle", ""),
    ('RESPOND MSG="50 % (half)" (told)', 'RESPOND MSG="50 % (half)"', ""),
    ("EXCLUDE_OBJECT_START NAME=cube_(1)", "EXCLUDE_OBJECT_START NAME=cube_(1)", ""),
    ("if (a > b) && c", "if (a > b) && c", ""),
    ("M23 box (2).gco", "M23 box (2).gco", ""),
    ("%", "", ""),
    ("(only words)", "", ""),
])  # fmt: skip
def test_a_line_is_split_into_command_and_comment(line: str, command: str, comment: str | None) -> None:
    if comment is None:
        with pytest.raises(GcodeError, match="has checksum ''"):
            read_line(line)
        return
    assert read_line(line) == (command, comment)


@pytest.mark.parametrize(("line", "sentence"), [
    ("G1 X5 (then Y50", "line 1: 'G1 X5 (then Y50' has a parenthesis without its partner, or one inside another: remove it"),
    ("G1 X5 (a (b) Y2)", "line 1: 'G1 X5 (a (b) Y2)' has a parenthesis without its partner, or one inside another: remove it"),
    ("G1 X5 X6", "line 1: 'G1 X5 X6' has the word X twice: firmwares do not agree which one counts"),
    ("G90 G1 X5", "line 1: 'G90 G1 X5' holds two commands, G90 and G1: write one a line"),
    ("M106 S255 G1 X5", "line 1: 'M106 S255 G1 X5' holds two commands, M106 and G1: write one a line"),
    ("M84 X G1 Y5", "line 1: 'M84 X G1 Y5' holds two commands, M84 and G1: write one a line"),
    ("X5", "line 1: 'X5' begins with no command: G, M or T is expected"),
    ("M104 S200.5.2", "line 1: 'M104 S200.5.2': behind M104 only letters with a number are allowed"),
    ('M98 P"a;b.g"', "line 1: 'M98 P\"a;b.g\"' has a ';' between quotes, where some firmwares begin a comment: remove it"),
])  # fmt: skip
def test_a_line_that_firmwares_read_differently_is_refused_with_its_line_number(line: str, sentence: str) -> None:
    with pytest.raises(GcodeError) as error:
        parse_gcode([line], MACHINES["marlin"])
    assert str(error.value) == sentence


def test_an_uploaded_line_is_unchanged_if_every_firmware_reads_it_the_same() -> None:
    lines = ["G1 X1.5 E0.1", "  M104 S200 ; hot", "; (a remark)", "M117 Düse (heiß)", "", 'echo "a"']
    assert GcodeUpload("a.gcode", lines).content.decode().splitlines() == lines


@pytest.mark.parametrize(("text", "plain"), [
    ("M117 Düse heizt auf 60°C", "M117 Duse heizt auf 60 deg C"),
    ("RESPOND MSG=\"größer – 字\"", 'RESPOND MSG="grosser - ?"'),
    ("M117 \uff1b\uff0a\uff3c\x08", "M117 ????"),
    ('M98 P"ü.g"', 'M98 P"ü.g"'),
])  # fmt: skip
def test_letters_of_a_shown_text_lose_their_accents(text: str, plain: str) -> None:
    assert to_ascii(text) == plain


MOVE = "MANUAL_STEPPER STEPPER=stepper_a"


@pytest.mark.parametrize("rest", ["# MOVE=5", "MOVE = 5", "MOVE=(5)", "'MOVE=5'", "MOVE=5 SYNC"])
def test_a_macro_that_klipper_reads_differently_is_refused(rest: str) -> None:
    with pytest.raises(GcodeError, match=r"line 1: .MANUAL_STEPPER .*: behind MANUAL_STEPPER only KEY=VALUE is allowed"):
        parse_gcode([f"{MOVE} {rest}"], MACHINES["klipper"])


def test_a_move_below_a_condition_is_refused_and_homing_is_not() -> None:
    assert len(parse_gcode(["if !move.axes[0].homed", "  G28", "G1 X5"], MACHINES["reprapfirmware"]).line) == 1
    with pytest.raises(GcodeError, match="line 3: 'G1 X5' depends on a condition: write moves and modes outside of it"):
        parse_gcode(["while iterations < 5", "  M400", "  G1 X5"], MACHINES["reprapfirmware"])


def test_a_start_block_is_written_without_remarks_and_with_its_indents() -> None:
    block = "G28 (home, then G1 Y50)\n(only words)\nif true\n  M400 ; (wait)\n"
    assert fill_block(block, "start", {}, dialect_of(MACHINES["reprapfirmware"])) == ["G28", "if true", "  M400 ; (wait)"]
    assert fill_block("(MSG, hello)\nG28 (home)", "start", {}, dialects()["linuxcnc"]) == ["(MSG, hello)", "G28 (home)"]


def test_only_a_line_s_end_ends_a_comment_of_a_start_block() -> None:
    block = "G28 ; fa\u00e7ade\u2028G1 Z-5 \x85G1 Z-6\nM400"
    assert fill_block(block, "start", {}, dialect_of(MACHINES["reprapfirmware"])) == [block.split("\n")[0], "M400"]
