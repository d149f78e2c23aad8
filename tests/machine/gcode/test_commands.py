"""The command table: heating commands are recognised in every firmware's spelling, and none is sent to a machine that stays
cold."""

import ast
from inspect import getsource

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.firmware import Dialect, dialect_of, dialects
from machine.gcode.blocks import cold_block, filled_start
from machine.gcode.commands import EVERY, NOTHING_KNOWN, Heat, command_in, command_named, heat_in
from machine.gcode.modes import MODES
from machine.gcode.reader.codes import MACROS, NOTED, WITHOUT_EFFECT, do_command
from machine.link.protocol.framing import command_of
from machine.printing.settings_queries import QUESTIONS
from machine.setup.calibration.program import calibration_lines, calibration_pen, cold_start, plan_touches
from machine.simulator.commands import COMMANDS as SIMULATED
from machine.workbench.printing.at_hand import homing_lines
from profiles.errors import LocalProtocolError, MoveError
from profiles.profile import Profile, load, shipped

NAMES = shipped("machine")
HOMED = [name for name in NAMES if not dialect_of(load(name).machine).homed_before]
# Written from each firmware's own documentation, not from the table.
HEATING = {
    "marlin": ("M104 S200", "M104 I1", "M109 S200", "M109 R0", "M140 S60", "M190 S60", "M190 R20", "M141 S40", "M191 S40",
               "N10 M104 S200"),
    "reprapfirmware": (
        "M104 S200", "M109 S200", "M116", "M116 P0", "M140 S60", "M140 S60 R30", "M141 S40", "M190 S60", "M191 S40",
        "G10 P0 S210", "G10 P0 R210", "G10 P0 S0 R180", "G10 S210", "M568 P0 S210", "M568 P0 A2", "M104 S{var.hot}",
    ),
    "klipper": (
        "M104 S200", "M109 S200", "M140 S60", "M190 S60", "M141 S40", "M191 S40",
        "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=200", 'SET_HEATER_TEMPERATURE HEATER="heater_bed" TARGET=60',
        "TEMPERATURE_WAIT SENSOR=extruder MINIMUM=190",
    ),
    "linuxcnc": ("M104 P200", "M109 P200", "M140 P60", "M190 P60", "G21 M104 P200"),
    "grblhal": ("M104 S200", "M109 S200", "M140 S60", "M190 S60"),
}  # fmt: skip
UNSURE = {
    "marlin": ("G29", "G26 H200", "M303 S200", "M600", "M701", "M24", "PRINT_START", "M2000"),
    "reprapfirmware": ('M98 P"prime.g"', "M144 S1", "G32", "M703", "M1234", "if true", 'M32 "print.g"'),
    "klipper": (
        "PRINT_START BED=60 EXTRUDER=215",
        "start_print",
        "RESUME",
        "PID_CALIBRATE HEATER=extruder TARGET=200",
        "HOME_ALL",
    ),
    "linuxcnc": ("o<heat> call [200]", "M150", "#<_hot> = 200"),
    "grblhal": ("M710",),
}
COLD = {
    "marlin": ("G28 X Y Z", "G92 A0 C0", "M117 M104 S200", "G10 S1", "M104 S0", "M140 S0", "M150 R255", "; M104 S200", "T0"),
    "reprapfirmware": ("G28", "G10", "G10 P0 X1 Y2", "G11", "M568 P0 S0 R0", "G10 P0 S0 R-273.1", "T0", "M106 P0 S1"),
    "klipper": (
        "home_ab",
        "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=0",
        "TURN_OFF_HEATERS",
        "MANUAL_STEPPER STEPPER=a MOVE=1",
    ),
    "linuxcnc": ("M104 P0", "(MSG, M104 P200)", "M429", "G17 G21 G90 G94"),
    "grblhal": ("M850", "M140 S0"),
}


def of(rows: dict[str, tuple[str, ...]]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("dialect", "line"), [(name, line) for name, lines in rows.items() for line in lines])


def spellings(line: str) -> set[str]:
    """One command in upper or lower case, with or without a space after its name, with a leading zero and with a comment."""
    tight = line.replace(" ", "", 1) if line[1:2].isdigit() and line.count(" ") else line
    zero = f"{line[0]}0{line[1:]}" if line[1:2].isdigit() and line[0] in "GM" else line
    return {line, line.lower(), line.upper(), tight, tight.lower(), zero, f"  {line} ; M104 S0"}


@of(HEATING)
def test_a_command_that_heats_or_waits_for_heat_is_recognized_in_every_spelling(dialect: str, line: str) -> None:
    assert {heat_in(spelled, dialects()[dialect]) for spelled in spellings(line)} == {Heat.HEATS}


@of(UNSURE)
def test_macros_files_cycles_and_what_is_not_known_may_heat(dialect: str, line: str) -> None:
    assert heat_in(line, dialects()[dialect]) is Heat.UNSURE


@of(COLD)
def test_a_command_that_neither_heats_nor_waits_for_heat_is_cold(dialect: str, line: str) -> None:
    assert heat_in(line, dialects()[dialect]) is Heat.COLD


@given(st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), max_size=30), st.sampled_from(sorted(dialects())))
def test_any_text_is_judged_and_one_that_begins_with_no_known_command_is_not_cold(text: str, dialect: str) -> None:
    heat = heat_in(f"ZZ{text}", dialects()[dialect])
    assert heat is Heat.UNSURE


def cold_homing(profile: Profile) -> list[list[str]]:
    """The start of a measurement, and the homing of a machine by the user."""
    measuring = list(cold_start(calibration_pen(profile)))
    dialect = dialect_of(profile.machine)
    return [measuring] if dialect.homed_before else [measuring, homing_lines(filled_start(profile), dialect)]


@pytest.mark.parametrize("name", NAMES)
def test_a_cold_procedure_of_a_shipped_machine_sends_no_command_that_may_heat(name: str) -> None:
    profile = load(name)
    machine = profile.machine
    touching = [list(calibration_lines(profile, plan_touches(machine, 30.0)))] if machine.tilts else []
    for lines in [*cold_homing(profile), *touching]:
        assert [line for line in lines if heat_in(line, dialect_of(machine)) is not Heat.COLD] == []


@pytest.mark.parametrize("name", HOMED)
def test_a_cold_procedure_stays_cold_even_if_the_start_block_heats(name: str) -> None:
    profile, dialect = load(name), dialect_of(load(name).machine)
    heating = [line for line in HEATING[profile.machine.dialect] if "{" not in line]  # a placeholder in a block
    for spelled in sorted(spelled for line in heating for spelled in spellings(line)):
        for lines in cold_homing(with_start(profile, f"{spelled}\n{profile.machine.gcode.start}\n{spelled}")):
            assert {heat_in(sent, dialect) for sent in lines} == {Heat.COLD}
            assert any("G28" in sent for sent in lines)


def with_start(profile: Profile, start: str) -> Profile:
    gcode = profile.machine.gcode.model_copy(update={"start": start})
    return profile.model_copy(update={"machine": profile.machine.model_copy(update={"gcode": gcode})})


KLIPPER = load("fractal5pro")


def test_a_macro_before_the_machine_is_homed_is_refused_and_one_after_it_is_left_out_and_said() -> None:
    dialect = dialect_of(KLIPPER.machine)
    for start in ("PRINT_START BED=60", "PRINT_START BED=60\nG28", "M104 S100\nPREPARE\nhome_ab"):
        with pytest.raises(
            MoveError, match=r"may heat \(it runs a macro, a file or a cycle of the machine's own, or is not known\)"
        ):
            cold_block(start.splitlines(), dialect)
    lines, left_out = cold_block(["G28", "G92 E0", "LINE_PURGE", "M109 S200"], dialect)
    assert (lines, left_out) == (["G28", "G92 E0"], ["LINE_PURGE"])
    said = list(cold_start(calibration_pen(with_start(KLIPPER, "home_ab\nG28\nLINE_PURGE"))))
    assert said[0] == "; left out because it may heat: LINE_PURGE"


@pytest.mark.parametrize("dialect", ["marlin", "reprapfirmware"])
def test_asking_a_printer_for_its_settings_neither_heats_nor_moves_it(dialect: str) -> None:
    questions = QUESTIONS[dialects()[dialect].firmware]
    assert {heat_in(question, dialects()[dialect]) for question in questions} == {Heat.COLD}
    assert not any(command_in(question).moves for question in questions)


def test_a_line_that_homes_and_heats_at_once_is_refused() -> None:
    with pytest.raises(MoveError, match="'G28 M104 S200' may heat"):
        cold_block(["G28 M104 S200"], dialects()["reprapfirmware"])


def test_a_tool_is_selected_cold_when_its_temperature_has_been_set_to_nothing() -> None:
    lines = list(cold_start(calibration_pen(load("open5x_jubilee"))))
    assert lines.index("M568 P0 S0") < lines.index("T0")


def test_every_command_of_the_reader_and_the_simulated_printer_is_in_the_table() -> None:
    matched = [node.value.value for node in ast.walk(ast.parse(getsource(do_command))) if isinstance(node, ast.MatchValue)]
    assert "G1" in matched
    names = {*matched, *NOTED, *WITHOUT_EFFECT, *MACROS, *MODES, *SIMULATED}
    assert {name for name in names if command_named(name) is NOTHING_KNOWN} == set()


@pytest.mark.parametrize("dialect", dialects().values(), ids=dialects())
def test_switching_the_frame_changes_what_the_rest_of_a_program_means(dialect: Dialect) -> None:
    assert all(command_named(word, dialect.commands).changes or EVERY[word].changes for word in switches(dialect))


def switches(dialect: Dialect) -> list[str]:
    return [word for word in (dialect.follow_on, dialect.follow_off) if word]


@pytest.mark.parametrize("line", ["M112", "m112", "M0112", "M00", "M 0", "M410 ; now"])
def test_a_command_reserved_for_the_sender_is_refused_in_every_spelling(line: str) -> None:
    with pytest.raises(LocalProtocolError, match="remove it from the program"):
        command_of(line, 1)


@pytest.mark.parametrize(("line", "name"), [("g1x5", "G1"), ("G01 X5", "G1"), ("m0104s200", "M104"), ("T3", "T")])
def test_a_command_is_found_in_every_spelling(line: str, name: str) -> None:
    assert command_in(line) is EVERY[name]
