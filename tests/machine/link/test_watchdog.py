"""The watchdog ends a print whose heaters stay away from their target or are not reported, and no other print."""

from collections.abc import Callable
from contextlib import nullcontext

import pytest

from machine.link.protocol.events import Event, Kind, Temperature, read_event
from machine.link.stream import print_lines
from machine.link.watchdog import PrinterReports
from machine.printing.serial_log import tap
from machine.simulator.board import BuildOptions
from machine.simulator.faults import Fault, FaultScript
from profiles.errors import PrinterError
from profiles.profile import load
from tests.machine.virtual_printer import PATH, VirtualPrinter

PROFILE = load()
LAST_S = 598.0  # duration of the reports that watched() gives


def watched(nozzle: Callable[[float], float], target_c: float = 200.0, seconds: int = 600, every_s: int = 2) -> PrinterReports:
    """A watchdog that has seen a nozzle with the given temperature curve, and an idle bed."""
    watchdog = PrinterReports(0.0, (300.0, 110.0))
    for second in range(0, seconds, every_s):
        watchdog.read(Event(Kind.TEMPERATURE, temperature=Temperature(nozzle(second), target_c, 60.0, 60.0)), float(second))
        watchdog.check_silence(float(second))
    return watchdog


@pytest.mark.parametrize("course", [
    lambda s: 200.0,
    lambda s: 20.0 + 0.31 * s,  # ten minutes to the target
    lambda s: 200.0 + 15.0 * (-1) ** (s // 2),  # a poor thermostat
    lambda s: 260.0 - 0.3 * s if s < 200 else 200.0,  # cooling down to the target
    lambda s: 150.0 if s % 100 < 50 else 200.0,  # a gust of air, and back in time
], ids=["steady", "slow", "swinging", "cooling", "gusts"])  # fmt: skip
def test_a_heater_that_is_or_comes_near_its_target_is_left_alone(course: Callable[[float], float]) -> None:
    assert watched(course).temperature_s == LAST_S


@pytest.mark.parametrize(("course", "words"), [
    (lambda s: 200.0 if s < 100 else 150.0, r"nozzle has been at 150 °C for 6\d s although 200 is wanted"),
    (lambda s: 20.0, "nozzle has been at 20 °C"),
    (lambda s: min(200.0 + 0.5 * s, 260.0), "nozzle has been at 2"),
    (lambda s: 320.0, "nozzle is at 320 °C: this machine allows at most 300"),
], ids=["fell off", "never warm", "runs away", "too hot"])  # fmt: skip
def test_a_heater_that_stays_away_from_its_target_ends_the_print(course: Callable[[float], float], words: str) -> None:
    with pytest.raises(PrinterError, match=words):
        watched(course)


def test_a_heater_that_is_off_may_have_any_temperature() -> None:
    def cooling(second: float) -> float:
        return 150.0 - 0.1 * second

    assert watched(cooling, target_c=0.0).temperature_s == LAST_S
    with pytest.raises(PrinterError, match="nozzle has been at"):
        watched(cooling, target_c=200.0)


def test_a_cold_bed_is_noticed_too() -> None:
    watchdog = PrinterReports(0.0)
    for second in range(180):
        watchdog.read(Event(Kind.TEMPERATURE, temperature=Temperature(200.0, 200.0, 20.0, 60.0)), float(second))
    with pytest.raises(PrinterError, match="the bed has been at 20 °C for 181 s although 60 is wanted"):
        watchdog.read(Event(Kind.TEMPERATURE, temperature=Temperature(200.0, 200.0, 20.0, 60.0)), 181.0)


def test_silence_about_a_heater_that_is_on_ends_the_print() -> None:
    watchdog = watched(lambda s: 200.0, seconds=100)
    watchdog.check_silence(200.0)
    with pytest.raises(PrinterError, match=r"has reported no temperature for 1.. s although a heater is on"):
        watchdog.check_silence(230.0)


@pytest.mark.parametrize(("target_c", "ends"), [(None, False), (0.0, False), (200.0, True)], ids=["no report", "cold", "hot"])
def test_silence_is_judged_of_a_printer_that_reported_a_heater_on_alone(target_c: float | None, ends: bool) -> None:
    watchdog = PrinterReports(0.0)
    if target_c is not None:
        watchdog.read(Event(Kind.TEMPERATURE, temperature=Temperature(target_c, target_c)), 0.0)
    with pytest.raises(PrinterError) if ends else nullcontext() as error:
        watchdog.check_silence(1e6)
    assert (error is not None) == ends


def test_a_printer_without_reports_may_be_at_a_slow_command_for_long() -> None:
    lines = ["M104 S200", "M109 S200", "G4 S900", "G1 X5 F600"]
    printer = VirtualPrinter(PROFILE.machine, BuildOptions(autoreport=False))
    assert not print_lines(lines, PATH, medium=printer.medium, profile=PROFILE).cancelled
    assert printer.now_s > 900.0


def test_a_heater_that_fails_in_mid_print_ends_it_with_heaters_off() -> None:
    lines = ["M104 S200", "M109 S200", *(f"G1 X{k % 50} F600" for k in range(3000))]
    printer = VirtualPrinter(PROFILE.machine, faults=FaultScript((Fault("heater failure", at=40, unit="line"),)), most_s=5000.0)
    with pytest.raises(PrinterError, match="the printer reported: Error:Thermal Runaway, system stopped! Heater_ID: 0"):
        print_lines(lines, PATH, medium=printer.medium, profile=PROFILE)
    assert printer.record.nozzle_target_c == 0.0


def test_a_bed_that_cannot_be_heated_may_be_as_warm_as_its_room() -> None:
    profile = load(settings=["machine.bed_limit_c=0"])
    lines = ["M104 S200", "M109 S200", *(f"G1 X{k % 50} F600" for k in range(100))]
    printer = VirtualPrinter(profile.machine)
    assert not print_lines(lines, PATH, medium=printer.medium, profile=profile).cancelled


STRANGER = load(settings=["machine.dialect=klipper"])  # its printer does not know M486
PARTS = [line for part in range(9) for line in (f"M486 S{part}", f"G1 X{part + 1} F6000", "M73 P5 R1", "M486 S-1")]


def test_a_command_unknown_to_the_firmware_is_sent_once_and_then_omitted() -> None:
    printer, sent = VirtualPrinter(STRANGER.machine), list[bytes]()
    medium = tap(lambda way, data: sent.append(data) if way == ">" else None, printer.medium)
    outcome = print_lines(["G28", *PARTS], PATH, medium=medium, profile=STRANGER)
    assert outcome.warnings == ()
    assert b"".join(sent).count(b"M486") == 1
    assert b"".join(sent).count(b"M73") == 9
    assert len(printer.record.end) == 9


def test_an_essential_command_is_sent_although_the_firmware_does_not_know_it() -> None:
    reports = PrinterReports(0.0)
    for said in ('Unknown command: "M104 S200"', 'Unknown command: "M900 K0.1"'):
        reports.read(Event(Kind.ECHO, said), 0.0)
    assert not reports.leaves_out("M104 S210")
    assert reports.leaves_out("M900 K0.2")


@pytest.mark.parametrize("said", [
    b'echo:Unknown command: "M900 K1"', b'// Unknown command:"M900"', b"Warning: M900: Command is not supported",
])  # fmt: skip
def test_every_firmware_s_words_for_an_unknown_command_are_counted_as_one(said: bytes) -> None:
    reports = PrinterReports(0.0)
    for _ in range(19):
        reports.read(read_event(said), 0.0)
    assert reports.warnings == ["Unknown command: M900 (x 19)"]


def test_a_printer_that_waits_for_the_user_is_reported_until_it_continues() -> None:
    shown: list[str] = []
    printer = VirtualPrinter(
        PROFILE.machine, faults=FaultScript((Fault("error", at=9, unit="line", text="echo:busy: paused for user"),))
    )
    print_lines(
        ["G28", "G1 X5 F600", *["G4 S1"] * 8],
        PATH,
        medium=printer.medium,
        on_progress=lambda progress: shown.append(progress.message),
    )
    assert list(dict.fromkeys(shown)) == ["", "the printer waits for you: look at its display"]
    assert shown[-1] == ""
