"""Programs of other slicers and hand-written ones: read as their firmware would, or refused with the line."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.dryrun import dry_run
from machine.firmware import dialects
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from mdp.save import stl
from profiles.errors import GcodeError
from profiles.machine import Machine
from profiles.profile import load
from tests.machine.firmware.test_dialects import both, profile
from tests.shapes import box


def read(text: str, dialect: str = "marlin", coordinates: str = "table") -> ParsedProgram:
    return parse_gcode(text.splitlines(), profile(dialect, coordinates).machine)


def ends(text: str, dialect: str = "marlin", coordinates: str = "table") -> list[list[float]]:
    parsed = read(text, dialect, coordinates)
    return np.column_stack([parsed.end, parsed.filament_mm]).round(4).tolist()


class TestSlicers:
    """Constructs that slicers for three axes write."""

    @pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="PrusaSlicer is not installed")
    @pytest.mark.parametrize(("flavour", "dialect"), [("marlin2", "marlin"), ("marlin", "klipper"), ("reprapfirmware",) * 2])
    def test_prusaslicer_s_filament_and_layers_are_read(self, tmp_path: Path, flavour: str, dialect: str) -> None:
        (tmp_path / "box.stl").write_bytes(stl(box(10, 10, 6)))
        command = ["prusa-slicer", "-g", "--gcode-flavor", flavour, "--output", "box.gcode", "box.stl"]
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
        text = (tmp_path / "box.gcode").read_text()
        machine = load("three_axis", settings=[f"machine.dialect={dialect}"]).machine
        parsed = parse_gcode(text.splitlines(), machine)
        used_mm = float(re.search(r"filament used \[mm\] = ([0-9.]+)", text)[1])  # type: ignore[index]
        assert parsed.filament_mm.max() == pytest.approx(used_mm, abs=0.02)
        assert parsed.layers == text.count(";LAYER_CHANGE")
        assert parsed.ignored == {}

    def test_cura_s_layers_types_and_absolute_filament_are_read(self) -> None:
        text = (
            "M82\nG92 E0\n;LAYER_COUNT:2\n;LAYER:0\nG0 F9000 X1 Y1 Z0.2\n;TYPE:WALL-OUTER\nG1 F1200 X9 E0.5\n;LAYER:1\nG1 X1 E1"
        )
        parsed = read(text)
        assert (parsed.layers, parsed.types[1], parsed.e_mm.tolist()) == (2, "WALL-OUTER", [0.0, 0.5, 0.5])

    def test_slic3r_s_machinekit_pushes_by_an_axis(self) -> None:
        machine = profile("linuxcnc").machine
        assert parse_gcode(["G92 U0", "G1 X5 U2", "G92 U0", "G1 X9 U1"], machine).e_mm.tolist() == [2.0, 1.0]


class TestFirmwares:
    """Commands that only particular firmwares understand."""

    def test_firmware_retraction_pulls_what_m207_says_and_pushes_it_again(self) -> None:
        parsed = read("M83\nM207 S1.5 F1800\nG1 X1 E2\nG10\nG10\nG0 X5\nG11\nG1 X9 E2")
        assert parsed.e_mm.tolist() == [2.0, -1.5, 0.0, 1.5, 2.0]

    def test_firmware_retraction_does_not_shift_absolute_filament(self) -> None:
        assert [row[5] for row in ends("M82\nG1 X1 E2\nG10\nG11\nG1 X2 E3")] == [2.0, -1.0, 2.0, 3.0]

    def test_flow_and_speed_overrides_count_as_the_firmware_counts_them(self) -> None:
        parsed = read("M82\nG1 X1 E2 F600\nM221 S50\nM220 S200\nG1 X2 E4\nG2 X4 I1 J0 E6\nM221 S100\nG1 X5 E7")
        assert (parsed.filament_mm[[0, 1, -2, -1]].tolist(), parsed.feed[1]) == ([2.0, 3.0, pytest.approx(4.0), 5.0], 1200.0)

    def test_volumetric_filament_is_read_in_cubic_millimetres(self) -> None:
        parsed = read("M200 D2\nM83\nG1 X1 E3.14159265\nM200 D0\nG1 X2 E1")
        assert parsed.e_mm.tolist() == pytest.approx([1.0, 1.0], abs=1e-8)

    def test_reprapfirmware_s_g10_with_p_heats_a_tool(self) -> None:
        events = read("G10 P0 S205\nM116\nM568 P0 S200 A0", "reprapfirmware").events
        assert [(e.code, e.value) for e in events] == [("M104", 205.0), ("M109", 205.0), ("M104", 0.0)]

    def test_reprapfirmware_s_endstop_moves_home_an_axis(self) -> None:
        parsed = read("G91\nG1 H1 Z-300 F400\nG90\nG1 X5", "reprapfirmware")
        assert [(e.code, e.letters) for e in parsed.events] == [("G28", "Z")]
        assert parsed.end[0].tolist() == [5.0, 0.0, 0.0, 0.0, 0.0]

    def test_modes_of_the_filament_follow_each_firmware_s_rule(self) -> None:
        text = "M83\nG1 X1 E1\nG90\nG1 X2 E1"
        assert [ends(text, dialect)[1][5] for dialect in ("marlin", "reprapfirmware", "klipper")] == [1.0, 2.0, 2.0]
        assert ends("M82\nG91\nG1 X1 E1\nG1 X1 E1", "klipper")[1][5] == 2.0

    def test_a_cnc_line_holds_modes_and_one_motion(self) -> None:
        assert ends("G21 G91 G1 X5 F600 M8\nX5 Y1\nG90 G0 X1", "linuxcnc") == [
            [5, 0, 0, 0, 0, 0], [10, 1, 0, 0, 0, 0], [1, 1, 0, 0, 0, 0],
        ]  # fmt: skip

    def test_inverse_time_and_rapids_become_feeds_of_the_same_duration(self) -> None:
        parsed = read("G93\nG1 X30 A90 F2\nG94\nG1 X0 F600\nG0 X30", "linuxcnc")
        assert parsed.feed.tolist() == [60.0, 600.0, 18000.0]

    def test_klipper_s_feed_of_a_pure_turn_is_that_of_the_axis_that_moves_farthest(self) -> None:
        assert read("G1 A30 C40 F600", "klipper").feed.tolist() == [750.0]
        assert read("G1 A30 C40 F600").feed.tolist() == [600.0]

    def test_a_comment_in_parentheses_may_hold_a_semicolon(self) -> None:
        assert ends("G1 X1 (left; not right) Y2 ; (done") == [[1, 2, 0, 0, 0, 0]]

    def test_moves_after_the_end_of_a_cnc_program_are_ignored(self) -> None:
        assert len(read("G1 X1 F60\nM2\nG1 X2", "linuxcnc").line) == 1

    def test_steppers_that_are_not_waited_for_turn_with_the_next(self) -> None:
        text = "MANUAL_STEPPER STEPPER=stepper_a MOVE=30 SPEED=10 SYNC=0\nMANUAL_STEPPER STEPPER=stepper_c MOVE=40 SPEED=10"
        parsed = read(text, "klipper_steppers")
        assert parsed.end.tolist() == [[0.0, 0.0, 0.0, 30.0, 40.0]]
        assert parsed.feed.tolist() == [750.0]


@pytest.mark.parametrize(
    ("line", "dialect", "message"),
    [
        ("G93", "marlin", "line 2: G93 is not supported: Marlin has no inverse time feed"),
        ("G93\nG1 X1", "linuxcnc", "line 3: after G93 every move needs its own F"),
        ("G1 X1 G2 Y2", "linuxcnc", "line 2: .* holds two motions, G1 and G2"),
        ("G10 L2 P1 X0", "linuxcnc", "line 2: G10 L2 is not supported"),
        ("#1=5", "linuxcnc", "line 2: '#1=5': parameters and O words are not supported"),
        ("o100 sub", "linuxcnc", "line 2: .*parameters and O words"),
        ("G1 X[1+2]", "linuxcnc", "line 2: .* cannot be read"),
        ("G43.4", "klipper", "line 2: G43.4 is not supported"),
        ("G1 A5", "klipper_steppers", "line 2: word A5 of a move is not known: this machine has X Y Z E F"),
        ("MANUAL_STEPPER STEPPER=stepper_a MOVE=far", "klipper", "line 2: MOVE is 'FAR': a number is expected"),
        ("MANUAL_STEPPER STEPPER=stepper_a MOVE=5 SPEED=0", "klipper", "line 2: SPEED is 0: it must be above 0"),
        ("G18", "linuxcnc", "line 2: G18 is not supported"),
    ],
)
def test_a_command_unknown_to_the_firmware_is_refused_with_its_line_number(line: str, dialect: str, message: str) -> None:
    with pytest.raises(GcodeError, match=message):
        read(f"G21\n{line}", dialect)


def test_homing_while_the_firmware_follows_the_table_is_refused() -> None:
    with pytest.raises(GcodeError, match="line 2: homing while the firmware follows the table: M429 first"):
        read("M428\nG28", "linuxcnc", "workpiece")


MACHINES = st.sampled_from([profile(dialect).machine for dialect in dialects()])
COMMANDS = ("G1 ", "G0 ", "G2 ", "G10", "G92 ", "M104 S", "G93 ", "M428", "HOME_A", "MANUAL_STEPPER STEPPER=stepper_a MOVE=")
WORDS = ("X", "A", "E-", "F", "I1J", "nan", "1e5", "SPEED=", "SYNC=0", "-", ".", "0", "99999999999")
SIGNS = ("(", ")", ";", "*", "N5 ", "\t", "\x00", "ÿ")
SCRAPS = st.sampled_from([*COMMANDS, *WORDS, *SIGNS])


def outcome(lines: list[str], machine: Machine) -> tuple[str | None, np.ndarray]:
    """The refusal, and the numbers read from the lines; the logarithm of the feed, because it must be above 0."""
    try:
        parsed = parse_gcode(lines, machine)
    except GcodeError as error:
        return str(error), np.zeros(1)
    return None, np.concatenate([parsed.end.ravel(), np.log(parsed.feed)])


@settings(max_examples=300, deadline=None)
@given(st.lists(st.lists(SCRAPS, max_size=8).map("".join), max_size=6), MACHINES)
def test_any_scraps_are_read_or_refused_with_a_line(lines: list[str], machine: Machine) -> None:
    said, numbers = outcome(lines, machine)
    assert re.match(r"line [1-6]\b", said or "line 1 is fine")
    assert np.isfinite(numbers).all()


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(list(dialects())), st.integers(0, 5000), st.binary(min_size=1, max_size=3), st.booleans())
def test_generated_gcode_with_a_few_bytes_changed_never_crashes_the_reader(
    dialect: str, begin: int, rubbish: bytes, insert: bool
) -> None:
    chosen, lines, _ = both(dialect, "table")
    text = "\n".join(lines[:200])
    begin %= len(text)
    edited = text[:begin] + rubbish.decode("latin-1") + text[begin + (0 if insert else len(rubbish)) :]
    said, numbers = outcome(edited.split("\n"), chosen.machine)
    assert said is None or said.startswith("line ")
    assert np.isfinite(numbers).all()


@pytest.mark.parametrize("line", ["G1 " + "X1 " * 400_000, "(" * 1_000_000, "G1" + " " * 1_000_000 + "X", "A" * 1_000_000])
def test_a_line_of_a_megabyte_is_refused_at_once(line: str) -> None:
    with pytest.raises(GcodeError, match=r"line 1 is \d+ characters long"):
        read(line)


def test_a_comment_of_a_megabyte_is_no_matter() -> None:
    assert ends("G1 X1 ;" + "(" * 1_000_000)[0][0] == 1.0


def test_strokes_of_a_hand_edited_program_in_workpiece_coordinates_keep_their_positions() -> None:
    parsed = read("M428\nG1 X10 Y0 Z5 F600\nG1 A90 C0 U0\nG1 X11 U1\nM429", "linuxcnc", "workpiece")
    stroke = np.flatnonzero(parsed.kind == MoveKind.EXTRUDE)[0]
    assert parsed.end[stroke, 0] - parsed.start[stroke, 0] == pytest.approx(1.0, abs=1e-9)
    assert parsed.end[stroke, 3] == 90.0


@pytest.mark.parametrize(("start", "end"), [("PRINT_START BED=60 EXTRUDER=210", "PRINT_END"), ('M98 P"start.g"', 'M98 P"end.g"')])
def test_a_custom_macro_may_home_and_heat_invisibly(start: str, end: str) -> None:
    klipper = load("three_axis", settings=["machine.dialect=klipper"])
    print_ = ["M104 S210", "G1 Z0.2 F600", "G1 X50 Y50", "M83", "G1 X90 E1"]

    def severities(lines: list[str]) -> dict[str, str]:
        findings = dry_run(lines, klipper).findings
        return {f.code: f.severity for f in findings if f.code in ("not-homed", "cold-extrusion", "heater-on")}

    assert severities(print_) == dict.fromkeys(("not-homed", "cold-extrusion", "heater-on"), "error")
    assert severities([start, *print_]) == {"not-homed": "warning", "cold-extrusion": "warning", "heater-on": "error"}
    assert severities([start, *print_[1:], end]) == {"not-homed": "warning", "cold-extrusion": "warning"}
    assert severities([*print_, end])["heater-on"] == "warning"


def test_temperatures_that_no_nozzle_reaches_leave_an_expected_range_that_can_be() -> None:
    hot = ["G28", "M104 S200", "M109 S200", "G1 Z0.2 F600", "M104 S1000", "M83", "G1 X90 E1"]
    machine = load("three_axis").machine
    (message,) = [f.message for f in dry_run(hot, load("three_axis")).findings if f.code == "temperature"]
    least, most = map(float, re.findall(r"(\d+) to (\d+) are expected", message)[0])
    assert least < most == machine.nozzle_limit_c
