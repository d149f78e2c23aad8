"""Measure the serial link: its share of a UART's bandwidth, lines a second over a pseudo-terminal, memory over millions of lines.

Run: python -m tools.bench_link [terminal] [sim] [uart] [virtual] [memory] [alone] [--lines 100000] [--file FILE.gcode]
(without a name: all of them)

sim: as `print --port sim` streams, its serial log, limits of the machine and display of progress included;
--file: a program of its own for it.
"""

import argparse
import resource
import sys
from collections.abc import Iterator
from multiprocessing import Pipe, Process
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

from machine.link.medium import Medium
from machine.link.protocol import connection as protocol
from machine.link.protocol.framing import frame
from machine.link.stream import print_lines
from machine.printing.serial_log import SerialLog, tap
from machine.printing.serial_print import QUEUE, USB_BYTES
from machine.simulator.board import BuildOptions
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.simulator import SimulatedPrinter
from profiles.profile import load
from tests.machine.virtual_printer import PATH, VirtualPrinter

PARTS = ["terminal", "sim", "uart", "virtual", "memory", "alone"]
BAUDS = (115200, 250000)
LINE_BYTES = 63
UART_LINES = 4000
MILLIONS = (1, 5)
RESTING = "G1 F12000 X100.00000 Y100.00000 Z10.00000 A0.00000 C0.0000000"


def program(n: int) -> list[str]:
    """n moves of the usual length, heated."""
    moves = [f"G1 X{20 + i % 60}.{i % 1000:03d} Y{10 + i % 50}.517 E0.03214 F2400" for i in range(n)]
    return ["G21", "G90", "M83", "M104 S210", "M109 S210", *moves, "M104 S0"]


def resting(n: int) -> list[str]:
    """n lines that are LINE_BYTES long on the wire and move nothing, so that only the line counts."""
    return [_padded(number) for number in range(4, 4 + n)]


def _padded(number: int) -> str:
    """M115, M105 and M155 come before number 4; the checksum has one to three digits."""
    whole = LINE_BYTES - len(frame(number, ""))
    lengths = (length for length in range(whole - 2, whole + 3) if len(frame(number, RESTING[:length])) == LINE_BYTES)
    return RESTING[: next(lengths, whole)]


def used(lines: list[str], baud: int, build: BuildOptions, terminal: bool) -> tuple[float, float, int, int]:
    """Lines a second, share of the bandwidth used from the first to the last line, resends and lost bytes over a paced UART."""
    sent, times = [0], []

    def traffic(way: str, data: bytes) -> None:
        if way == ">" and b" G1 " in data:
            sent[0] += len(data)
            times.append(clock())

    if terminal:
        clock, (here, there) = perf_counter, Pipe()
        printer = Process(target=serve, args=(there, build, baud))
        printer.start()
        outcome = print_lines(lines, here.recv(), baud, medium=tap(traffic))
        here.send("end")
        lost = here.recv()
        printer.join()
    else:
        virtual = VirtualPrinter(load().machine, build, baud=baud)
        clock = virtual.medium.now_s
        outcome = print_lines(lines, PATH, baud, medium=tap(traffic, virtual.medium))
        lost = virtual.record.lost_bytes
    seconds = times[-1] - times[0]
    return len(lines) / seconds, sent[0] * 10 / baud / seconds, outcome.repeated, lost


def serve(host: Connection, build: BuildOptions, baud: int) -> None:
    """A paced printer in a process of its own, until the host says that it has enough."""
    with SimulatedPrinter(load().machine, build=build, baud=baud, speed=1.0) as printer:
        host.send(printer.path)
        host.recv()
        host.send(printer.record.lost_bytes)


def over_the_terminal(lines: list[str], build: BuildOptions) -> tuple[float, float]:
    """Seconds of the clock and of the processor for a whole print, greeting included."""
    with SimulatedPrinter(load().machine, build=build) as printer:
        wall, work = perf_counter(), process_time()
        print_lines(lines, printer.path, 250000)
        return perf_counter() - wall, process_time() - work


def as_print_does(lines: list[str]) -> tuple[float, float]:
    """The same for the built-in printer."""
    profile = load()
    usb = profile.model_copy(update={"machine": profile.machine.model_copy(update={"receive_bytes": USB_BYTES})})
    with TemporaryDirectory() as folder, SimulatedPrinter(profile.machine, build=BuildOptions(queue=QUEUE)) as printer:
        log = SerialLog(Path(folder) / "print.log", "bench")
        wall, work = perf_counter(), process_time()
        print_lines(lines, printer.path, 250000, profile=usb, medium=tap(log.note), on_progress=lambda progress: None)
        log.close()
        return perf_counter() - wall, process_time() - work


def sender_alone(lines: list[str]) -> float:
    """Processor seconds that the connection takes for these lines with answers out of the air."""
    connection, began = protocol.Connection(), process_time()
    connection.tick(1.0)
    connection.receive(b"ok N0 P15 B3\nok N1 P15 B3\nok T:20.00 /0.00\n", 1.0)
    for number, line in enumerate(lines, 3):
        while not connection.can_send(line):
            connection.tick(1.0)
            if said := answers(connection.take()):
                connection.receive(said, 1.0)
            else:
                connection.receive(b"ok N%d P15 B3\n" % connection.window.wire_number(number - 1), 1.0)
        connection.send(line, 1.0)
    return process_time() - began


def answers(data: bytes) -> bytes:
    """What a printer says at once to a new beginning of the numbers."""
    return b"ok N1000 P15 B3\n" if b"M110" in data else b""


def firmware_alone(lines: list[str]) -> float:
    """Processor seconds that the simulated firmware takes for these lines."""
    framed = [frame(number, line) for number, line in enumerate(lines, 1)]
    firmware, began = SimulatedFirmware(load().machine), process_time()
    for line in framed:
        firmware.receive(line)
        firmware.advance()
    return process_time() - began


class Echo:
    """A wire to a peer that takes every line at once and keeps nothing."""

    name = "echo"

    def __init__(self) -> None:
        self._said = bytearray()

    def write(self, data: bytes) -> None:
        """Every numbered line is acknowledged."""
        for line in data.split(b"\n"):
            number, _, command = line[1:].partition(b" ")
            if command.startswith(b"M105"):
                self._said += b"ok T:20.00 /0.00 B:20.00 /0.00\n"
            elif line[:1] == b"N":
                self._said += b"ok N%s P15 B3\n" % (number if not command.startswith(b"M110") else command[6:].partition(b"*")[0])

    def read(self) -> bytes:
        """All answers so far."""
        said = bytes(self._said)
        self._said.clear()
        return said

    def discard(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        """Nothing is held."""


def memory(millions: int) -> tuple[float, float]:
    """Greatest resident memory, MB, and lines a second of a process that streams a file of a number of lines."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "long.gcode"
        with path.open("w") as file:
            for i in range(1_000_000 * millions):
                file.write(f"G1 X{20 + i % 60}.{i % 1000:03d} Y{10 + i % 50}.517 E0.03214\n")
        began, now = perf_counter(), [0.0]

        def clock() -> float:
            now[0] += 1e-4
            return now[0]

        print_lines(read(path), "echo", medium=Medium(lambda name, baud: Echo(), clock, lambda seconds: None))
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1e6 * millions / (perf_counter() - began)


def read(path: Path) -> Iterator[str]:
    """The lines of a file, one at a time."""
    with path.open() as file:
        yield from file


def main() -> None:
    """Print one line for each measurement."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", choices=PARTS)
    parser.add_argument("--lines", type=int, default=100000)
    parser.add_argument("--file", type=Path)
    asked = parser.parse_args()
    what = asked.what or PARTS
    lines = program(asked.lines)
    kinds = (("window", True), ("ping-pong", False))
    for name, advanced in kinds if "terminal" in what else ():
        wall_s, work_s = over_the_terminal(lines, BuildOptions(advanced_ok=advanced))
        print(f"{name:10s} {len(lines) / wall_s:8.0f} lines/s  ({len(lines)} lines in {wall_s:.1f} s, processor {work_s:.1f} s)")
    if "sim" in what:
        printed = lines if asked.file is None else asked.file.read_text().splitlines()
        wall_s, work_s = as_print_does(printed)
        figures = f"({len(printed)} lines in {wall_s:.1f} s, {1e6 * work_s / len(printed):.1f} us of processor a line)"
        print(f"{'sim':10s} {len(printed) / wall_s:8.0f} lines/s  {figures}")
    for where in (kind for kind in ("uart", "virtual") if kind in what):
        for baud in BAUDS:
            for name, advanced in kinds:
                build = BuildOptions(advanced_ok=advanced, rx_ring=128)
                rate, share, again, lost = used(resting(UART_LINES), baud, build, where == "uart")
                figures = f"{rate:6.1f} lines/s, {100 * share:5.1f} % of the line, {again} resends, {lost} bytes lost"
                print(f"{where:8s} {baud:7d} {name:10s} {figures}", flush=True)
    if "alone" in what:
        print(f"{'sender':10s} {len(lines) / sender_alone(lines):8.0f} lines/s alone")
        print(f"{'firmware':10s} {len(lines) / firmware_alone(lines):8.0f} lines/s alone")
    for millions in MILLIONS if "memory" in what else ():
        peak_mb, rate = memory(millions)
        print(f"memory     {millions} million lines: {peak_mb:.1f} MB at most, {rate:.0f} lines/s")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
