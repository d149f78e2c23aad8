"""Probing commands of each firmware: the stop position and the answer."""

import pytest

from machine.simulator.contact import TrueBall
from machine.simulator.firmware import SimulatedFirmware
from tests.machine.setup.calibration.touches import machine_of
from tests.machine.simulator.faulty_table import FaultyTable

BALL = TrueBall(10.0, (20.0, 0.0, 45.0))


def says(name: str, *lines: str, **table: float) -> list[str]:
    machine = machine_of(name)
    firmware = SimulatedFirmware(machine, table=FaultyTable(machine, BALL, **table))
    firmware.receive("".join(f"{line}\n" for line in ("G28", "G90", "G1 X20 Y0 Z70 F3000", *lines)).encode())
    return firmware.advance().decode().splitlines()


@pytest.mark.parametrize("name", ["generic_ac", "gen5x"])
def test_g38_stops_where_the_ball_is_met(name: str) -> None:
    assert any(line.startswith("X:20.00") and " Z:55.00" in line for line in says(name, "G38.3 Z50 F180", "M114"))


@pytest.mark.parametrize("name", ["generic_ac", "gen5x"])
def test_g38_ends_at_its_target_where_nothing_is_met(name: str) -> None:
    assert any(" Z:60.00" in line for line in says(name, "G38.3 Z60 F180", "M114"))
    assert any(" Z:50.00" in line for line in says(name, "G38.3 Z50 F180", "M114", silent_from=1))


def test_g38_does_not_move_when_the_probe_has_triggered_before() -> None:
    assert any(" Z:70.00" in line for line in says("generic_ac", "G38.3 Z50 F180", "M114", early_from=1))


def test_klipper_says_where_the_bed_is() -> None:
    assert "// Result: at 20.000,0.000 estimate contact at z=55.000000" in says("fractal5pro", "PROBE PROBE_SPEED=3.0 SAMPLES=1")


def test_klipper_probes_to_the_end_of_its_travel_and_reports_no_contact() -> None:
    answers = says("fractal5pro", "PROBE", "M114", silent_from=1)
    assert "!! No trigger on probe after full movement" in answers
    assert any("Z:-150.000" in line for line in answers)


def test_klipper_says_that_the_probe_has_triggered_before() -> None:
    assert "!! Probe triggered prior to movement" in says("fractal5pro", "PROBE", early_from=1)


@pytest.mark.parametrize(("name", "line"), [("generic_ac", "G38.3 Z50"), ("gen5x", "G38.3 Z50"), ("fractal5pro", "PROBE")])
def test_a_printer_without_a_probe_does_not_know_the_command(name: str, line: str) -> None:
    firmware = SimulatedFirmware(machine_of(name))
    firmware.receive(f"{line}\n".encode())
    firmware.advance()
    assert firmware.record().unknown == 1
