"""Stops: the print pauses before a layer with the tip aside, in the firmware's words; a layer that does not exist is refused."""

import pytest

from machine.dryrun.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.planning.plan import plan
from machine.planning.stops import parse_stops
from profiles.errors import SliceError
from profiles.profile import load
from tests.machine.hand import post_and_arm, squares


def written(dialect: str, pauses: list[str], changes: list[str], *settings: str) -> list[str]:
    machine = "linuxcnc_xyzac" if dialect == "linuxcnc" else "generic_ac"
    profile = load(machine, settings=[f"machine.dialect={dialect}", "machine.purge_mm=0", *settings])
    decomposition = post_and_arm(profile.machine)
    sliced = [squares(part, profile) for part in decomposition.parts]
    program = plan(decomposition, sliced, profile, parse_stops(pauses, changes))
    return list(write_gcode(program, profile))


@pytest.mark.parametrize(
    ("dialect", "pause", "change"),
    [
        ("marlin", "M0", "M600"),
        ("klipper", "PAUSE", "PAUSE"),
        ("reprapfirmware", "M226", "M600"),
        ("linuxcnc", "M0", "M0"),
    ],
)
def test_the_print_stops_before_a_layer_in_the_words_of_the_firmware(dialect: str, pause: str, change: str) -> None:
    lines = written(dialect, ["1:3"], ["2:0.2mm"])
    assert [line for line in lines if ";PAUSE:" in line] == [
        f"{pause} ;PAUSE:pause before layer 3 of part 1",
        f"{change} ;PAUSE:filament change before layer 2 of part 2",
    ]


def test_the_tip_waits_above_everything_printed_with_the_filament_retracted() -> None:
    lines = written("marlin", ["1:3"], [])
    findings = dry_run(lines, load()).findings
    assert [finding.code for finding in findings if finding.severity == "error"] == ["air"]  # the post is three layers high
    at = next(k for k, line in enumerate(lines) if ";PAUSE:" in line)
    assert lines[at - 2 : at] == [";WIPE_END", "G0 Z10.400 F600"]
    assert lines[at - 3].endswith("E-0.80000 F5250")


def test_a_pause_is_not_the_end_of_its_part() -> None:
    lines = written("marlin", ["1:3", "2:2"], [], 'machine.gcode.after_part="M117 done"')
    places = [line.split(" ")[0] for line in lines if line == "M117 done" or line.startswith(";PART:") or ";PAUSE:" in line]
    assert places == [";PART:1", "M0", "M117", ";PART:2", "M0", "M117"]


@pytest.mark.parametrize(
    ("pause", "sentence"),
    [
        ("twelve", "--pause twelve: PART:LAYER or PART:HEIGHTmm is expected, counted from 1, such as 2:15 or 1:8.4mm"),
        ("3:1", "--pause 3:1: there is no part 3, the parts are 1 to 2"),
        ("2:4", "--pause 2:4: part 2 has no layer 4, its layers are 1 to 3"),
        ("1:9mm", "--pause 1:9mm: part 1 is only 0.6 mm high"),
    ],
)
def test_a_stop_where_nothing_is_printed_is_refused(pause: str, sentence: str) -> None:
    with pytest.raises(SliceError) as refused:
        written("marlin", [pause], [])
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("dialect", "line"),
    [("marlin", "M900 K0.05"), ("klipper", "SET_PRESSURE_ADVANCE ADVANCE=0.05"), ("reprapfirmware", "M572 D0 S0.05")],
)
def test_pressure_advance_is_set_in_the_words_of_the_firmware(dialect: str, line: str) -> None:
    lines = written(dialect, [], [], "material.pressure_advance=0.05")
    assert lines.index(line) < lines.index(";LAYER_CHANGE")


@pytest.mark.parametrize("typed", ["2:15", "1:8.4mm", "1:1234.56789mm", "1:0.00001mm", "3:20mm"])
def test_a_stop_is_named_as_it_was_typed(typed: str) -> None:
    assert [(stop.option, stop.at) for stop in parse_stops([typed], [])] == [("pause", typed)]
