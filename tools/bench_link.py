"""Measure the serial link: acknowledged lines a second over a pseudo-terminal, and what each half costs alone.

Run: python tools/bench_link.py [LINES]     (default 100000; figures of a run stand in docs/serial.md)
"""

import sys
from time import perf_counter, process_time

from machine.link.firmware import Firmware, Habits
from machine.link.framing import frame
from machine.link.protocol import Protocol
from machine.link.simulator import SimulatedPrinter
from machine.link.stream import print_lines
from profiles.profile import load


def program(n: int) -> list[str]:
    """n moves of the usual length, heated."""
    moves = [f"G1 X{20 + i % 60}.{i % 1000:03d} Y{10 + i % 50}.517 E0.03214 F2400" for i in range(n)]
    return ["G21", "G90", "M83", "M104 S210", "M109 S210", *moves, "M104 S0"]


def over_the_terminal(lines: list[str], habits: Habits) -> tuple[float, float]:
    """Seconds of the clock and of the processor for a whole print, greeting included."""
    with SimulatedPrinter(load().machine, habits=habits) as printer:
        wall, work = perf_counter(), process_time()
        print_lines(lines, printer.path, 250000)
        return perf_counter() - wall, process_time() - work


def sender_alone(lines: list[str]) -> float:
    """Seconds that the protocol takes for these lines with answers out of the air."""
    protocol, began = Protocol(), perf_counter()
    protocol.tick(1.0)
    protocol.receive(b"ok N0 P15 B3\nok N1 P15 B3\nok T:20.00 /0.00\n", 1.0)
    for number, line in enumerate(lines, 3):
        while not protocol.room(line):
            protocol.take()
            protocol.receive(b"ok N%d P15 B3\n" % (number - 1), 1.0)
        protocol.send(line, 1.0)
    return perf_counter() - began


def firmware_alone(lines: list[str]) -> float:
    """Seconds that the simulated firmware takes for these lines."""
    framed = [frame(number, line) for number, line in enumerate(lines, 1)]
    firmware, began = Firmware(load().machine), perf_counter()
    for line in framed:
        firmware.receive(line)
        firmware.advance()
    return perf_counter() - began


def main() -> None:
    """Print one line for each measurement."""
    lines = program(int(sys.argv[1]) if len(sys.argv) > 1 else 100000)
    n = len(lines)
    for name, habits in (("window", Habits()), ("ping-pong", Habits(advanced_ok=False))):
        wall_s, work_s = over_the_terminal(lines, habits)
        print(f"{name:10s} {n / wall_s:8.0f} lines/s  ({n} lines in {wall_s:.1f} s, processor {work_s:.1f} s)")
    print(f"{'sender':10s} {n / sender_alone(lines):8.0f} lines/s alone")
    print(f"{'firmware':10s} {n / firmware_alone(lines):8.0f} lines/s alone")


if __name__ == "__main__":
    main()
