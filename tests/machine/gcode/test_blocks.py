"""G-code blocks of a machine: written for its firmware, or refused with advice."""

import re
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.firmware import dialects
from machine.gcode.blocks import block_problems, filled_start, refused_lines
from machine.gcode.writer import write_gcode
from profiles.errors import ProfileError
from profiles.profile import load, shipped
from tests.machine.hand import printed

MARLIN_IN_LINUXCNC = (
    "machine.dialect is linuxcnc, but machine.gcode.start and machine.gcode.end are written for another firmware: LinuxCNC does "
    "not take 'M83', 'M140 S60', 'M104 S150', ...; use or inherit a machine of that dialect (linuxcnc_xyzac), or write "
    "machine.gcode.start and machine.gcode.end in its words"
)


@pytest.mark.parametrize("machine", shipped("machine"))
def test_the_blocks_of_every_shipped_machine_are_written_for_its_firmware(machine: str) -> None:
    assert block_problems(load(machine, settings=["process.line_width_mm=0.45"])) == []


def test_a_program_with_the_blocks_of_another_firmware_is_not_written() -> None:
    with pytest.raises(ProfileError) as refused:
        write_gcode(printed()[3], load(settings=["machine.dialect=linuxcnc"]))
    assert str(refused.value) == MARLIN_IN_LINUXCNC


def test_a_user_machine_that_inherits_another_firmware_s_blocks_is_refused_before_any_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own, out = tmp_path / "mill.toml", tmp_path / "out.gcode"
    own.write_text('inherits = "generic_ac"\n[machine]\ndialect = "linuxcnc"\n')
    assert main(["profiles", "check", str(own)]) == 1
    assert MARLIN_IN_LINUXCNC in capsys.readouterr().err
    assert main(["export", "demo:tree", "-o", str(out), "--machine", str(own)]) == 1
    assert capsys.readouterr().err == f"tiltprint: {MARLIN_IN_LINUXCNC}\n"
    blocks = 'start = "M109 P{first_layer_nozzle_c}"\nend = "M104 P0"\n'
    own.write_text(f'inherits = "generic_ac"\n[machine]\ndialect = "linuxcnc"\n[machine.gcode]\n{blocks}')
    assert main(["profiles", "check", str(own)]) == 0


@pytest.mark.parametrize(
    ("dialect", "line", "is_refused"),
    [
        ("linuxcnc", "M83", True),
        ("linuxcnc", "G28 X Y Z", True),
        ("linuxcnc", "G28 X0 Y0 (home) ; by hand", False),
        ("linuxcnc", "G92 E0", True),
        ("linuxcnc", "M67 E0 Q5", False),
        ("linuxcnc", "M104 S215", True),
        ("linuxcnc", "M104 P215", False),
        ("linuxcnc", "G17 G21 M84", True),
        ("linuxcnc", "o<heat> call [215]", False),
        ("linuxcnc", "#<_hot> = 215", False),
        ("grblhal", "G92 E0", True),
        ("grblhal", "M104 S215", False),
        ("marlin", "home_ab", True),
        ("marlin", "M140 P60", True),
        ("marlin", "M140 S60", False),
        ("marlin", "M117 Printing a spoon", False),
        ("marlin", "T0", False),
        ("klipper", "home_ab", False),
        ("klipper", "PRINT_START BED=60", False),
        ("reprapfirmware", "if sensors.analog[0].lastReading > 50", False),
        ("reprapfirmware", 'M98 P"homeall.g"', False),
        ("reprapfirmware", "home_ab", True),
    ],
)
def test_a_line_is_refused_where_its_firmware_refuses_it(dialect: str, line: str, is_refused: bool) -> None:
    assert list(refused_lines([line, ";a comment", ""], dialects()[dialect])) == ([line] if is_refused else [])


@pytest.mark.parametrize("dialect", ["marlin", "reprapfirmware"])
def test_after_a_restart_motors_are_enabled_before_axis_positions_are_set(dialect: str) -> None:
    motors, axes = dialects()[dialect].stands
    assert (motors, axes.split()[0]) == ("M17", "G92")


def test_the_motors_of_a_manually_levelled_table_are_enabled_from_the_start() -> None:
    """Marlin (planner.cpp) and RepRapFirmware energise a motor by its first move, not by G92: the first part has no turn."""
    starts = {name: filled_start(load(machine=name)) for name in shipped("machine")}
    levelled = {name: lines for name, lines in starts.items() if any(re.match(r"G92 [ABCUV]0", line) for line in lines)}
    assert sorted(levelled) == ["gen5x", "generic_ac", "open5x_prusa_i3", "open5x_voron0"]
    for name, lines in levelled.items():
        homing = next(number for number, line in enumerate(lines) if line.startswith("G28"))
        assert lines[:homing].count("M17") == 1, name
