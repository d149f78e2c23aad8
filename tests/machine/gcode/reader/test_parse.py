import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from profiles.errors import GcodeError
from profiles.profile import load

MACHINE = load().machine
COORDINATE = st.floats(-150, 150).map(lambda v: round(v, 3))


def _read(text: str) -> ParsedProgram:
    return parse_gcode(text.splitlines(), MACHINE)


def _ends(text: str) -> list[list[float]]:
    parsed = _read(text)
    return np.column_stack([parsed.end, parsed.filament_mm]).round(6).tolist()


def test_inches_become_millimetres_but_angles_stay_degrees() -> None:
    parsed = _read("G20\nG1 X1 A30 E0.1 F60")
    assert parsed.end[0].tolist() == [25.4, 0, 0, 30, 0]
    assert (parsed.e_mm[0], parsed.feed[0]) == (pytest.approx(2.54), 1524)


def test_g92_moves_nothing_and_renames_the_place() -> None:
    parsed = _read("G0 X10\nG92 X0 A5\nG0 X1")
    assert parsed.start[1].tolist() == [0, 0, 0, 5, 0]
    assert parsed.end[1].tolist() == [1, 0, 0, 5, 0]


def test_homing_puts_only_the_named_axes_at_home() -> None:
    parsed = _read("G0 X10 Y10 Z10\nG28 X Y\nG0 X1")
    assert parsed.start[1].tolist() == [0, 0, 10, 0, 0]
    assert [(event.code, event.letters, event.row) for event in parsed.events] == [("G28", "XY", 1)]


def test_move_kinds_are_distinguished() -> None:
    kinds = _read("M83\nG0 X1\nG1 X2 E1\nG1 E-1\nG1 E1\nG0 A30 C10\nG0 F200").kind
    assert kinds.tolist() == [MoveKind.TRAVEL, MoveKind.EXTRUDE, MoveKind.RETRACT, MoveKind.RETRACT, MoveKind.ROTATE]


def test_words_need_no_blanks_and_may_be_small() -> None:
    assert _ends("g1x1y-.5f300(to the left)z+2 ; done") == [[1, -0.5, 2, 0, 0, 0]]


def test_a_bare_coordinate_repeats_the_last_motion_where_the_firmware_does() -> None:
    parsed = parse_gcode(["G1 X1 F60", "X2", " Y1"], load(machine="linuxcnc_xyzac").machine)
    assert parsed.end[:, 0].tolist() == [1, 2, 2]


def test_line_numbers_and_checksums_are_checked_and_dropped() -> None:
    assert _ends("N3 G1 X1*98") == [[1, 0, 0, 0, 0, 0]]
    with pytest.raises(GcodeError, match=r"line 1: .* has checksum '99', its characters give 98"):
        _read("N3 G1 X1*99")


def test_temperatures_fans_and_waits_are_events_with_their_place() -> None:
    events = _read("M104 S210\nG0 X1\nM109 R200\nM106 S128\nG4 P1500\nG4 S2\nM84").events
    assert [(event.code, event.value, event.row) for event in events] == [
        ("M104", 210, 0), ("M109", 200, 1), ("M106", 128, 1), ("G4", 1.5, 1), ("G4", 2, 1), ("M84", 0, 1),
    ]  # fmt: skip


def test_unknown_m_codes_and_macros_are_counted_not_refused() -> None:
    assert _read("M907 K0.04\nM907 K0.05\nSTART_PRINT BED=60\nM117 50% done: (almost)").ignored == {
        "M907": (1, 2),
        "START_PRINT": (3, 1),
    }


def test_parts_layers_and_types_come_from_the_comments() -> None:
    text = ";PART:2 of 3\n;LAYER_CHANGE\n;TYPE:Perimeter\n;WIDTH:0.45\n;HEIGHT:0.2\nG0 X1\n;PART:3 of 3\nG0 X2"
    parsed = _read(text)
    assert (parsed.part.tolist(), parsed.layer.tolist(), parsed.parts) == ([2, 3], [1, 0], (2, 3))
    assert (parsed.types[parsed.type[0]], parsed.width_mm[0], parsed.height_mm[0]) == ("Perimeter", 0.45, 0.2)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("G1 Xnan Y1", "line 2: 'G1 Xnan Y1' has a word without a number"),
        ("G1 Xinf", "line 2: 'G1 Xinf' has a word without a number"),
        ("G1 X" + "9" * 400, "line 2: .* cannot be read"),
        ("G1 X1_0", "line 2: .* cannot be read"),
        ("G1 X", "line 2: 'G1 X' has a word without a number"),
        ("G1 X1.2.3", "line 2: .* cannot be read"),
        ("\x00\x7fELF\x02", "line 2: .* cannot be read"),
        ("PK\x03\x04\x14", "line 2: .* cannot be read"),
        ("hello world!", None),
        ("G2 X1 I3", "line 2: G2 is not an arc: I and J, or R, must give a centre equally far"),
        ("G3 X1", "line 2: G3 is not an arc"),
        ("G2 X9 R1", "line 2: G2 is not an arc"),
        ("G5 X1", "line 2: G5 is not supported"),
        ("M428\nG43.5", "line 3: G43.5 is not supported: motion codes are .*, G43.4$"),
        ("G1 X1 U4", "line 2: word U4 of a move is not known: this machine has X Y Z A C E F"),
        ("G1 X1 F0", "line 2: F is 0: a feed must be above 0"),
        ("X1", "line 2: 'X1' begins with no command"),
        ("G1 " + "X1 " * 400000, "line 2 is 1200003 characters long"),
        ("T1", "line 2: T1 is not supported"),
    ],
)
def test_an_unreadable_line_is_refused_with_its_line_number(line: str, message: str | None) -> None:
    if message is None:
        assert "HELLO" in _read(f"G21\n{line}").ignored
        return
    with pytest.raises(GcodeError, match=message):
        _read(f"G21\n{line}")


def test_a_long_line_of_blanks_is_refused_at_once() -> None:
    with pytest.raises(GcodeError, match=r"line 1: .* cannot be read"):
        _read("G28" + "  X" * 600 + " !")


def test_an_empty_text_is_an_empty_program() -> None:
    parsed = _read("; nothing\n\n%\n(only words)")
    assert (len(parsed.line), parsed.layers, parsed.parts) == (0, 0, ())


@given(st.text(alphabet="GMXYZACEFSN0123456789.-+ ;()*\x00é", max_size=40))
def test_any_line_is_read_or_refused_with_a_sentence(line: str) -> None:
    try:
        numbers = parse_gcode([line], MACHINE).end
        message = "line 1"
    except GcodeError as error:
        numbers, message = np.zeros(0), str(error)
    assert np.isfinite(numbers).all()
    assert message.startswith("line 1")
