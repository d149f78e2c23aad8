import os
import select
import time
from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from machine.simulator.board import BuildOptions, Heater
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.simulator import SimulatedPrinter
from mdp.pose import Pose, rotation
from profiles.profile import load
from tests.machine.peers import PATIENCE_S, happened

MACHINE = load().machine
HOT = "M104 S200\nM109 S200\n"


def printer(build: BuildOptions | None = None) -> SimulatedFirmware:
    return SimulatedFirmware(MACHINE, replace(build or BuildOptions(advanced_ok=False), home_start=False))


def answer(firmware: SimulatedFirmware, text: str | bytes, until_s: float = inf) -> list[str]:
    firmware.receive(text if isinstance(text, bytes) else text.encode())
    return firmware.advance(until_s).decode().splitlines()


def ran(text: str) -> SimulatedFirmware:
    firmware = printer()
    answer(firmware, text)
    return firmware


def test_a_missing_checksum_is_refused_in_marlins_words() -> None:
    assert answer(printer(), "N1 G28\n") == ["Error:No Checksum with line number, Last Line: 0", "Resend: 1", "ok"]


def test_ok_is_withheld_while_fifteen_blocks_are_planned() -> None:
    firmware = printer(BuildOptions(advanced_ok=False, busy=False))
    moves = "".join(f"G1 X{i} F60\n" for i in range(1, 40))
    assert answer(firmware, moves, until_s=0.5) == ["ok"] * 15
    assert len(answer(firmware, "", until_s=2.5)) in (2, 3)


def test_waiting_for_heat_reports_temperatures_every_second_until_they_are_reached() -> None:
    firmware = printer()
    *reports, last = answer(firmware, "M109 S200\n")
    assert last == "ok"
    assert 20 < len(reports) < 120
    assert firmware.board.nozzle.at(firmware.board.now_s) == pytest.approx(199.0, abs=0.1)


def test_after_kill_there_is_silence_until_reset() -> None:
    firmware = ran(HOT + "M112\n")
    assert answer(firmware, "G28\nM105\n") == []
    assert firmware.record().nozzle_target_c == 0
    firmware.reset()
    assert answer(firmware, "M110 N0\n")[0] == "start"


def test_m410_ends_the_current_move_and_drops_the_rest() -> None:
    firmware = printer()
    answer(firmware, "G1 X10 F60\nG1 X20\nG1 X30\n", until_s=5.0)
    answer(firmware, "M410\n", until_s=5.0)
    assert firmware.record().end[-1, 0] == pytest.approx(5.0, abs=0.3)
    assert answer(firmware, "M114\n", until_s=6.0)[0].startswith(f"X:{firmware.record().end[-1, 0]:.2f} ")


def test_m114_and_g92_report_all_axes() -> None:
    said = answer(printer(), "G92 X1 A-30 C725 E2\nM114\n")
    assert said[0] == said[2]
    assert said[0].startswith("X:1.00 Y:0.00 Z:0.00 A:-30.00 C:725.00 E:2.00 Count X:0 ")


def test_homing_is_on_record_as_an_event() -> None:
    firmware = ran("G28 X Y\n")
    assert firmware.record().events[-1][1] == "homed XY"
    assert firmware.board.motion.position[:3] == [-160.0, -160.0, 0.0]


def test_heaters_and_fan_at_the_end_are_on_record() -> None:
    record = ran("M140 S60\nM104 S210\nM106 S127.5\n").record()
    assert (record.nozzle_target_c, record.bed_target_c, record.fan) == (210.0, 60.0, 0.5)
    record = ran("M140 S60\nM106\nM107\nM140 S0\n").record()
    assert (record.bed_target_c, record.fan) == (0.0, 0.0)


def test_commands_may_be_written_with_zeros_and_without_blanks() -> None:
    record = ran("G01X5\nG1Y6\nM0104S33\nG92.9 X0\n").record()
    assert record.end[-1, :2].tolist() == [5.0, 6.0]
    assert (record.nozzle_target_c, record.unknown) == (33.0, 1)


@given(
    st.lists(st.sampled_from(["G1", "G0", " X", "Y-", "E1", "9", ".", "-", "N", "*", ";", "\n", "M109", " S", "G4", "G28", "M1"]))
)
def test_no_text_breaks_the_firmware(pieces: list[str]) -> None:
    firmware = printer()
    answer(firmware, "".join(pieces) + "\n")
    assert answer(firmware, "M105\n")[-1].startswith("ok T:")


@given(st.binary(max_size=200))
def test_no_bytes_break_the_firmware(data: bytes) -> None:
    firmware = printer()
    answer(firmware, data + b"\n")
    assert firmware.dead == (happened(firmware.record(), "M112"))
    assert firmware.dead or answer(firmware, "M105\n")[-1].startswith("ok T:")


def test_a_wait_of_years_is_over_at_once() -> None:
    assert answer(printer(), "G4 S999999999\n")[-1] == "ok"


def test_a_full_uart_ring_drops_bytes() -> None:
    firmware = printer(BuildOptions(rx_ring=128))
    answer(firmware, b"G4 S50\n" * 4, until_s=0.1)
    answer(firmware, b"G1 X1\n" * 50, until_s=0.1)
    assert firmware.record().lost_bytes == 300 - 127


@pytest.mark.parametrize(("command", "seconds"), [
    ("G1 X100 F600", 2 * 10 / 1500 + (100 - 100 / 1500) / 10),  # 0 to 10 mm/s and back, the rest at 10
    ("G1 A3 F6000", 2 * (3 / 200) ** 0.5),  # too short to reach 30 deg/s: a triangle
    ("G1 Z50 F60000", None),
])  # fmt: skip
def test_moves_take_as_long_as_a_trapezoid_does(command: str, seconds: float | None) -> None:
    duration = ran(command + "\n").record().duration_s[0]
    if seconds is None:
        assert 50 / 15 < duration < 50 / 15 + 1
    else:
        assert duration == pytest.approx(seconds, rel=1e-9)


@given(st.floats(30, 290), st.floats(21, 29))
def test_a_heater_is_at_a_temperature_when_it_reports_that(target: float, early: float) -> None:
    heater = Heater("nozzle", 300.0, 60.0)
    heater.set(target, 0.0)
    assert heater.at(heater.reaches(early)) == pytest.approx(early)
    heater.set(0.0, 500.0)
    assert heater.at(heater.reaches(early)) == pytest.approx(early)
    assert heater.reaches(target + 5) == inf


def test_deposited_plastic_is_on_the_workpiece_in_every_pose_of_the_table() -> None:
    record = ran(HOT + "M83\nG0 A90 Y10\nG1 X10 E1\nG1 E1\nG1 X20\nG1 C90 E2\n").record()
    segments, volumes = record.deposited(1.75)
    assert volumes == pytest.approx([pi / 4 * 1.75**2, pi / 2 * 1.75**2])
    pivot = np.array(MACHINE.tilt.point_mm)
    by_hand = rotation(MACHINE, Pose(90.0, 0.0)).T @ (np.array([[0, 10, 0], [10, 10, 0]]) - pivot).T
    assert segments[0] == pytest.approx((by_hand + pivot[:, None]).T, abs=1e-9)
    assert segments[0][1] - segments[0][0] == pytest.approx([10, 0, 0])


def test_a_machine_with_other_letters_is_spoken_to_in_them() -> None:
    firmware = SimulatedFirmware(load(machine="fractal5pro").machine, BuildOptions())
    answer(firmware, "G1 B30 A45\n")
    assert firmware.record().end[0, 3:5].tolist() == [30.0, 45.0]


def test_the_terminal_answers_a_plain_serial_program() -> None:
    with (
        SimulatedPrinter(MACHINE, build=BuildOptions(home_start=False)) as simulated,
        serial.Serial(simulated.path, 250000, timeout=PATIENCE_S) as host,
    ):
        host.write(b"M105\nG1 X5\n")
        assert host.readline().startswith(b"ok T:20.00")
        assert host.readline() == b"ok P14 B3\n"
        assert simulated.record.end[0, 0] == 5.0


def test_ten_times_real_time_is_ten_times_real_time() -> None:
    with SimulatedPrinter(MACHINE, speed=10.0) as simulated:
        host = os.open(simulated.path, os.O_RDWR | os.O_NOCTTY)
        began = time.monotonic()
        os.write(host, b"G4 S5\n")
        said = b""
        while b"ok" not in said and select.select([host], [], [], PATIENCE_S)[0]:
            said += os.read(host, 100)
        os.close(host)
    assert time.monotonic() - began > 0.45
    assert said.count(b"busy") == 2


def test_while_it_heats_the_printer_always_has_a_next_moment_ahead() -> None:
    firmware = SimulatedFirmware(MACHINE)
    firmware.receive(b"M155 S2\nM140 S60\nM190 S60\n")
    now_s, reports = 0.0, 0
    while reports < 20:
        reports += firmware.advance(now_s).count(b"W:?")
        assert firmware.next_s() > now_s
        now_s = firmware.next_s()
