"""Serial link: `python tools/bench/link.py [terminal] [sim] [virtual]` (by default all of them).

terminal: lines per second over a pseudo-terminal. sim: as streamed by `print --port sim`, with its serial log, the machine's
limits and the progress display; `--file` streams another program. virtual: fraction of a UART's bandwidth used, in virtual time.
"""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from machine.link.protocol.framing import frame
from machine.link.stream import print_lines
from machine.printing.serial_log import SerialLog, tap
from machine.printing.serial_print import QUEUE, USB_BYTES
from machine.simulator.board import BuildOptions
from machine.simulator.simulator import SimulatedPrinter
from profiles.profile import load
from tests.machine.virtual_printer import PATH, VirtualPrinter
from tools.bench.harness import Used, heading, options_of, row, run, timed

PARTS = ["terminal", "sim", "virtual"]
KINDS = (("window", True), ("one at a time", False))  # with ADVANCED_OK and without
BAUDS = (115200, 250000)
LINE_BYTES = 63
UART_LINES = 4000
RESTING = "G1 F12000 X100.00000 Y100.00000 Z10.00000 A0.00000 C0.0000000"


def program(n: int) -> list[str]:
    """A heated program of n typical moves."""
    moves = [f"G1 X{20 + i % 60}.{i % 1000:03d} Y{10 + i % 50}.517 E0.03214 F2400" for i in range(n)]
    return ["G21", "G90", "M83", "M104 S210", "M109 S210", *moves, "M104 S0"]


def resting(n: int) -> list[str]:
    """n lines of LINE_BYTES on the wire that move nothing, so that only the line counts."""
    return [_padded(number) for number in range(4, 4 + n)]


def _padded(number: int) -> str:
    """A line of LINE_BYTES for a number from 4, after M115, M105 and M155; its checksum has one to three digits."""
    whole = LINE_BYTES - len(frame(number, ""))
    lengths = (length for length in range(whole - 2, whole + 3) if len(frame(number, RESTING[:length])) == LINE_BYTES)
    return RESTING[: next(lengths, whole)]


def used(lines: list[str], baud: int, build: BuildOptions) -> tuple[float, float, int, int]:
    """Lines per second, fraction of the bandwidth used between the first and the last line, resends and lost bytes over a paced
    UART."""
    sent, times = [0], []
    printer = VirtualPrinter(load().machine, build, baud=baud)

    def traffic(way: str, data: bytes) -> None:
        if way == ">" and b" G1 " in data:
            sent[0] += len(data)
            times.append(printer.now_s)

    outcome = print_lines(lines, PATH, baud, medium=tap(traffic, printer.medium))
    seconds = times[-1] - times[0]
    return len(lines) / seconds, sent[0] * 10 / baud / seconds, outcome.repeated, printer.record.lost_bytes


def over_the_terminal(lines: list[str], build: BuildOptions) -> Used:
    """Stream a whole print, including the greeting."""
    with SimulatedPrinter(load().machine, build=build) as printer:
        return timed(lambda: print_lines(lines, printer.path, 250000))[1]


def as_print_does(lines: list[str]) -> Used:
    """Stream a program to the built-in printer like `print --port sim`."""
    profile = load()
    usb = profile.model_copy(update={"machine": profile.machine.model_copy(update={"receive_bytes": USB_BYTES})})
    with TemporaryDirectory() as folder, SimulatedPrinter(profile.machine, build=BuildOptions(queue=QUEUE)) as printer:
        log = SerialLog(Path(folder) / "print.log", "bench")
        options = {"profile": usb, "medium": tap(log.note), "on_progress": lambda progress: None}
        spent = timed(lambda: print_lines(lines, printer.path, 250000, **options))[1]
        log.close()
        return spent


def bench(given: argparse.Namespace) -> None:
    """Print the requested tables."""
    what, lines = given.what or PARTS, program(given.lines)
    streams = {}
    if "terminal" in what:
        streams |= {name: (lines, over_the_terminal(lines, BuildOptions(advanced_ok=advanced))) for name, advanced in KINDS}
    if "sim" in what:
        printed = lines if given.file is None else given.file.read_text().splitlines()
        streams["as print --port sim"] = printed, as_print_does(printed)
    heading("sender", "lines", "lines/s", "core us a line")
    for name, (sent, spent) in streams.items():
        row(name, len(sent), f"{len(sent) / spent.wall_s:.0f}", f"{1e6 * spent.core_s / len(sent):.1f}")
    heading("baud", "sender", "lines/s", "share of the bandwidth %", "resends", "lost bytes")
    for baud in BAUDS if "virtual" in what else ():
        for name, advanced in KINDS:
            build = BuildOptions(advanced_ok=advanced, rx_ring=128)
            rate, share, again, lost = used(resting(UART_LINES), baud, build)
            row(baud, name, f"{rate:.1f}", f"{100 * share:.1f}", again, lost)


if __name__ == "__main__":
    parser = options_of(__doc__, models=False)
    parser.add_argument("what", nargs="*", metavar="|".join(PARTS))
    parser.add_argument("--lines", type=int, default=100000)
    parser.add_argument("--file", type=Path)
    run(parser, bench)
