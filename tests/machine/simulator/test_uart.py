"""A UART: its speed, overflow, and lines damaged by overflow; time is virtual unless a terminal is used."""

import time
from itertools import pairwise

import pytest
import serial

from machine.link.protocol.framing import frame
from machine.simulator.board import BuildOptions
from machine.simulator.cable import Cable, Uart
from machine.simulator.faults import Fault, FaultScript
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.simulator import SimulatedPrinter
from profiles.profile import load
from tests.machine.peers import PATIENCE_S

MACHINE = load().machine
LINE = b"M117 " + b"x" * 57 + b"\n"  # 63 bytes, as a usual stroke with number and checksum
RING = BuildOptions(advanced_ok=False, rx_ring=128, home_start=False)


def uart(
    baud: int, build: BuildOptions = RING, speed: float = 1.0, script: FaultScript | None = None
) -> tuple[SimulatedFirmware, Uart]:
    firmware = SimulatedFirmware(MACHINE, build)
    return firmware, Uart(Cable(firmware, script, speed), baud)


def ping_pong_lines_per_s(baud: int, size: int, lines: int = 200) -> float:
    """Lines a second of a sender that waits for each `ok` of 16 bytes (with ADVANCED_OK)."""
    _, line = uart(baud, BuildOptions(rx_ring=128))
    now_s = 0.0
    for number in range(1000, 1000 + lines):
        said = line.exchange(LINE[63 - size :] if number else b"", now_s)
        while not said.endswith(b"\n"):
            now_s = line.due_s(now_s)
            said += line.exchange(b"", now_s)
    return lines / now_s


@pytest.mark.parametrize(("baud", "wanted"), [(115200, 11520 / (63 + 10)), (250000, 25000 / (63 + 10))])
def test_ping_pong_is_as_fast_as_a_line_and_its_ok_take(baud: int, wanted: float) -> None:
    assert ping_pong_lines_per_s(baud, 63) == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize(("baud", "wanted"), [(115200, 183), (250000, 397)])
def test_a_full_line_carries_what_its_rate_allows(baud: int, wanted: int) -> None:
    firmware, line = uart(baud)
    line.exchange(LINE * 1000, 0.0)
    line.exchange(b"", 1.0)
    assert firmware.record().lines == pytest.approx(wanted, abs=1)


def test_bytes_arrive_one_after_the_other() -> None:
    _, line = uart(10)  # a byte a second
    line.exchange(b"M110\n", 0.0)
    heard = [line.exchange(b"", 0.5 + second) for second in range(10)]
    assert heard == [b"", b"", b"", b"", b"", b"", b"o", b"k", b"\n", b""]


def test_the_simulation_does_not_depend_on_how_often_it_is_polled() -> None:
    said = []
    for steps in (1, 7, 1000):
        _, line = uart(115200, BuildOptions(rx_ring=128))
        text = b"G1 X5 F60\n" * 3 + b"".join(b"G1 X%d F6000\n" % (i % 50) for i in range(300))
        said.append(line.exchange(text, 0.0) + b"".join(line.exchange(b"", (k + 1) / steps * 9.0) for k in range(steps)))
    assert said[0] == said[1] == said[2]


def test_a_flood_overflows_the_ring_and_tails_are_run_unchecked() -> None:
    firmware, line = uart(250000, BuildOptions(advanced_ok=False, rx_ring=128, busy=False, home_start=False))
    line.exchange(b"".join(frame(n, f"G1 X{n % 90}.123 Y{n % 70}.456 E0.03214 F3000") for n in range(1, 400)), 0.0)
    said = line.exchange(b"", 60.0).decode()
    assert firmware.record().lost_bytes > 0
    assert "Resend: " in said
    assert "Unknown command" in said


def test_a_blocked_firmware_lets_its_ring_overflow_but_a_small_window_lives() -> None:
    firmware, line = uart(115200, RING, 1.0, FaultScript((Fault("block", 2, seconds=0.06),)))
    line.exchange(b"G21\n" + b"G21\n" * 31, 0.0)
    assert line.exchange(b"", 1.0) == b"ok\n" * 32
    assert firmware.record().lost_bytes == 0
    firmware, line = uart(115200, RING, 1.0, FaultScript((Fault("block", 2, seconds=0.06),)))
    line.exchange(b"G21\n" * 200, 0.0)
    line.exchange(b"", 1.0)
    assert firmware.record().lost_bytes > 300


def test_the_terminal_paces_bytes_in_real_time() -> None:
    with SimulatedPrinter(MACHINE, baud=115200) as printer, serial.Serial(printer.path, timeout=PATIENCE_S) as host:
        began_s = time.monotonic()
        for first, _ in pairwise(range(51)):
            host.write(LINE)
            assert host.readline().startswith(b"ok"), first
        took_s = time.monotonic() - began_s
    assert took_s >= 50 * (63 + 10) / 11520
