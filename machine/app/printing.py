"""Printing: the stream to a printer, or to the simulated one on a pseudo-terminal, shown to the person watching."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf, isfinite
from types import FrameType

from machine.app.pipeline import Program
from machine.app.progress import Ticker, say
from machine.app.report import duration, show
from machine.dialects import DIALECTS
from machine.link.port import open_port
from machine.link.progress import Progress
from machine.link.simulator import SimulatedPrinter
from machine.link.stream import Outcome, print_lines
from profiles.errors import PrinterError
from profiles.machine import Machine
from profiles.profile import Profile

SIMULATED = "sim"


def check_port(port: str, baud: int, sim_speed: float) -> None:
    """Refuse at once a port that cannot be opened; raises PrinterError."""
    if not (isfinite(sim_speed) and sim_speed >= 0):
        raise PrinterError(f"--sim-speed is {sim_speed:g}: it must be 0 (as fast as possible) or a number above")
    if port != SIMULATED:
        with open_port(port, baud):
            pass


def check_dialect(machine: Machine, port: str) -> None:
    """Refuse a machine whose firmware takes no lines over a serial port, or that the simulated printer cannot stand for."""
    if not DIALECTS[machine.dialect].serial:
        streamed = ", ".join(name for name, dialect in DIALECTS.items() if dialect.serial)
        raise PrinterError(
            f"{machine.name} speaks {machine.dialect}, which opens files itself: use export; print serves the dialects {streamed}"
        )
    if port == SIMULATED and machine.coordinates == "workpiece":
        raise PrinterError(
            f"{machine.name}: the simulated printer does not follow the table: machine.coordinates must be table, not workpiece"
        )


def print_program(
    program: Program, profile: Profile, port: str, baud: int, sim_speed: float, follow: Callable[[Progress], None] | None = None
) -> int:
    """Stream a program; sim_speed times real time on the simulated printer, 0: as fast as possible.

    follow: is told, like the person watching, how far the print is.
    """
    if port != SIMULATED:
        return _ended(_stream(program, profile, port, baud, follow))
    with SimulatedPrinter(profile.machine, sim_speed or inf) as printer:
        outcome = _stream(program, profile, printer.path, baud, follow)
        record = printer.record
    if outcome.cancelled:
        return _ended(outcome)
    segments, volumes = record.deposited(profile.material.diameter_mm)
    planned = float(program.run.segment_mm3.sum())
    laid = f"{len(segments)} strokes laid {volumes.sum() / 1000:.3f} cm3 (planned {planned / 1000:.3f})"
    heaters = f"heaters at {record.nozzle_target_c:g} and {record.bed_target_c:g} deg C at the end"
    show(f"simulated printer: {len(record.start)} moves in {duration(float(record.duration_s.sum()))}, {laid}, {heaters}\n")
    if record.clamped or record.unknown:
        raise PrinterError(
            f"the simulated printer met {record.clamped} coordinates out of limits and {record.unknown} unknown commands"
        )
    return 0


def _stream(
    program: Program, profile: Profile, port: str, baud: int, follow: Callable[[Progress], None] | None = None
) -> Outcome:
    ticker = Ticker()
    stop = threading.Event()

    def show_progress(progress: Progress) -> None:
        ticker.tick(status(progress))
        if follow is not None:
            follow(progress)

    with _stopping(stop):
        outcome = print_lines(
            program.lines,
            port,
            baud,
            show_progress,
            stop,
            program.run.time_s,
            limit=DIALECTS[profile.machine.dialect].longest_line,
        )
    ticker.close()
    return outcome


@contextmanager
def _stopping(stop: threading.Event) -> Iterator[None]:
    """Ctrl-C and a termination request end the print safely instead of tearing it down; a second one interrupts at once."""

    def ask(number: int, frame: FrameType | None) -> None:
        del number, frame
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    signals = (signal.SIGINT, signal.SIGTERM) if threading.current_thread() is threading.main_thread() else ()
    before = {number: signal.signal(number, ask) for number in signals}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def status(progress: Progress) -> str:
    """One line that tells where a print stands."""
    told = [f"{100 * progress.share:.0f} %" if progress.share is not None else f"line {progress.acknowledged}"]
    if progress.part is not None:
        told.append(f"part {progress.part}" + (f" of {progress.parts}" if progress.parts else ""))
    if progress.layer is not None:
        told.append(f"layer {progress.layer}")
    nozzle, bed = progress.temperature.nozzle_c, progress.temperature.bed_c
    if nozzle is not None:
        told.append(f"nozzle {nozzle:.0f} C" + (f", bed {bed:.0f} C" if bed is not None else ""))
    if progress.left_s is not None:
        told.append(f"{duration(progress.left_s)} left")
    return "printing: " + ", ".join(told)


def _ended(outcome: Outcome) -> int:
    """Tell how the print ended; 130 when a person stopped it."""
    for warning in outcome.warnings:
        say(f"the printer said: {warning}")
    if outcome.cancelled:
        heaters = "heaters off" if outcome.heaters_off else "the printer did not confirm that its heaters are off: look at it"
        say(f"tiltprint: interrupted after {outcome.acknowledged} lines; {heaters}")
        return 130
    told = f"printed {outcome.acknowledged} lines in {duration(outcome.elapsed_s)}, {outcome.repeated} repeated"
    show(f"{told} ({outcome.firmware[:60]})\n")
    return 0
