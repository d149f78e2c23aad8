"""Printing: the stream to a printer, or to the simulated one on a pseudo-terminal, shown to the person watching."""

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from math import inf, isfinite
from pathlib import Path

from machine.app.interrupts import stopping
from machine.app.journals import new_journal
from machine.app.keys import Keyboard, Typing, can_type
from machine.app.match import printer_at
from machine.app.pipeline import Program
from machine.app.progress import Ticker, is_terminal, say
from machine.app.report import duration, show
from machine.app.screen import Course, Screen, Words
from machine.app.traffic import TrafficLog, new_log, tapped
from machine.dialects import DIALECTS
from machine.link.answer import Answer, Kind
from machine.link.control import Control
from machine.link.habits import Habits
from machine.link.inquiry import Found
from machine.link.job import Begin
from machine.link.journal import Journal
from machine.link.progress import Progress, Schedule
from machine.link.simulator import SimulatedPrinter
from machine.link.stream import Outcome, print_lines
from profiles.errors import OutputError, PrinterError
from profiles.machine import Machine
from profiles.profile import Profile

SIMULATED = "sim"
USB_BYTES, QUEUE = 1024, 16  # the simulated printer is a board with native USB: more lines at a time halve what a line costs
HEATERS = {
    True: "heaters off",
    False: "the printer did not confirm that its heaters are off: look at it",
    None: "nothing had been sent yet",
}
Follow = Callable[[Progress], None]


def check_port(port: str, baud: int, sim_speed: float) -> Answer | None:
    """What answers at a port, refused at once when it is no printer; None for the simulated one. Raises PrinterError."""
    check_speed(sim_speed)
    return None if port == SIMULATED else printer_at(port, baud)


def paced(port: str) -> bool:
    """Whether bytes take the time that the baud rate says: not over native USB, a network or a pseudo-terminal."""
    if port == SIMULATED or "://" in port:
        return False
    device = Path(port).resolve()  # of a stable name under /dev/serial/by-id
    return device.parent.name != "pts" and not device.name.startswith(("ttyACM", "cu.usbmodem"))


def check_speed(sim_speed: float) -> None:
    """Refuse a speed at which no simulated printer can run."""
    if not (isfinite(sim_speed) and sim_speed >= 0):
        raise PrinterError(f"--sim-speed is {sim_speed:g}: it must be 0 (as fast as possible) or a number above")


def check_dialect(machine: Machine) -> None:
    """Refuse a machine whose firmware takes no lines over a serial port."""
    if not DIALECTS[machine.dialect].serial:
        streamed = ", ".join(name for name, dialect in DIALECTS.items() if dialect.serial)
        raise PrinterError(
            f"{machine.name} speaks {machine.dialect}, which opens files itself: use export; print serves the dialects {streamed}"
        )


def print_program(
    program: Program,
    profile: Profile,
    port: str,
    baud: int,
    sim_speed: float,
    follow: Follow | None = None,
    *,
    name: str = "",
    log: Path | None = None,
    source: Path | None = None,
    journal: Path | None = None,
) -> int:
    """Stream a program; sim_speed times real time on the simulated printer, 0: as fast as possible.

    follow: is told the progress besides the person at the terminal; name: of the model; log: file for the traffic, else a
    new one in the state folder. source: the G-code file that is printed, None: the program is kept beside the journal;
    journal: its file, else a new one in the state folder, for a printer that is not simulated.
    """
    title = f"{name or 'print'} to {'the simulated printer' if port == SIMULATED else port}"
    wanted = port != SIMULATED or journal is not None
    keeping = _journal(program, profile, name or "print", source, journal) if wanted else nullcontext()
    with new_log("print", title) if log is None else TrafficLog(log, title) as kept, _pointing_to(kept), keeping as story:
        if port != SIMULATED:
            return ended(streamed(program, profile, port, baud, title, kept, follow, story), kept, story)
        return _print_simulated(program, profile, baud, sim_speed or inf, title, kept, follow, story)


def _journal(
    program: Program, profile: Profile, name: str, source: Path | None, file: Path | None
) -> AbstractContextManager[Journal | None]:
    """The print's journal; a print that was not told where to keep it goes on without one where none can be written."""
    try:
        return new_journal(program.lines, profile, name, source, file)
    except OutputError as error:
        if file is not None:
            raise
        say(f"this print cannot be resumed when it is cut off: {error}")
        return nullcontext()


def _print_simulated(
    program: Program,
    profile: Profile,
    baud: int,
    speed: float,
    title: str,
    log: TrafficLog,
    follow: Follow | None,
    journal: Journal | None,
) -> int:
    """Stream to the simulated printer and tell what it has done."""
    usb = profile.model_copy(update={"machine": profile.machine.model_copy(update={"receive_bytes": USB_BYTES})})
    with SimulatedPrinter(profile.machine, speed, Habits(queue=QUEUE)) as printer:
        pace = speed if isfinite(speed) else None
        outcome = streamed(program, usb, printer.path, baud, title, log, follow, journal, pace=pace)
        record = printer.record
    if outcome.cancelled:
        return ended(outcome, log)
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


def streamed(
    program: Program,
    profile: Profile,
    port: str,
    baud: int,
    title: str,
    log: TrafficLog,
    follow: Follow | None = None,
    journal: Journal | None = None,
    begin: Callable[[Found], Begin] | None = None,
    pace: float | None = 1.0,
) -> Outcome:
    """Stream a program while a person watches: screen or lines, keys, Ctrl-C, log, journal.

    begin: of a resumed print. pace: seconds of the print that pass in one of the clock; None: as fast as it goes.
    """
    stop, control, words, course = threading.Event(), Control(), Words(), Course(program.run)

    def traffic(direction: str, data: bytes) -> None:
        log.note(direction, data)
        words.hear(direction, data)

    with stopping(stop), ExitStack() as stack:
        tell = _Late(stack, _shown(title, course, control, words))

        def begun(found: Found) -> Begin:
            decided = Begin(1, ()) if begin is None else begin(found)
            tell.open()
            return decided

        if begin is None:
            tell.open()

        def on_progress(progress: Progress) -> None:
            tell(progress)
            if follow is not None:
                follow(progress)

        return print_lines(
            program.lines,
            port,
            baud,
            on_progress,
            stop,
            Schedule(course.remaining_s, pace),
            limit=DIALECTS[profile.machine.dialect].longest_line,
            control=control,
            profile=profile,
            medium=tapped(traffic),
            journal=journal,
            begin=None if begin is None else begun,
        )


class _Late:
    """What shows the progress, from open() on: while a person is asked something the terminal is theirs."""

    def __init__(self, stack: ExitStack, shown: AbstractContextManager[Follow]) -> None:
        self._stack, self._shown = stack, shown
        self._tell: Follow | None = None

    def open(self) -> None:
        self._tell = self._stack.enter_context(self._shown)

    def __call__(self, progress: Progress) -> None:
        if self._tell is not None:
            self._tell(progress)


@contextmanager
def _shown(title: str, course: Course, control: Control, words: Words) -> Iterator[Follow]:
    """What shows the progress: a screen with keys on a terminal, plain lines elsewhere. Ends with the terminal as before."""
    if not is_terminal():
        yield _Lines()
        return
    board = Keyboard(control)
    with ExitStack() as stack:
        keys = can_type()
        if keys:
            stack.enter_context(Typing(board.press))
        screen = stack.enter_context(Screen(title, course, words, lambda: board.hint, keys))

        def tell(progress: Progress) -> None:
            board.follow(progress)
            screen.tell(progress)

        yield tell


class _Lines:
    """Plain lines: one every few seconds, and at once when something has changed."""

    def __init__(self) -> None:
        self._ticker, self._last = Ticker(), ("printing", "")

    def __call__(self, progress: Progress) -> None:
        before, self._last = self._last, (progress.state, progress.message)
        self._ticker.tick(status(progress), at_once=before != self._last)


@contextmanager
def _pointing_to(log: TrafficLog) -> Iterator[None]:
    """Say where the traffic is when the print goes wrong, and that it is not kept when it is not."""
    if log.trouble:
        say(f"the traffic is not logged: {log.file}: {log.trouble}")
    try:
        yield
    except PrinterError:
        _point_to(log)
        raise
    except KeyboardInterrupt:  # the second one: nobody waited for the printer's word
        say("ended at once: whether the heaters are off is not known, look at the printer")
        raise


def _point_to(log: TrafficLog) -> None:
    if not log.trouble:
        say(f"all that was sent and received is in {log.file}")


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
    return f"{progress.state}: " + ", ".join(told) + (f"; {progress.message}" if progress.message else "")


def ended(outcome: Outcome, log: TrafficLog | None = None, journal: Journal | None = None) -> int:
    """Tell how the print ended, where its log is when the printer had something to say, and how to go on with a stopped one.

    130 when a person stopped it.
    """
    for warning in outcome.warnings:
        say(f"the printer said: {warning}")
    if outcome.warnings and log is not None:
        _point_to(log)
    if outcome.cancelled:
        say(f"tiltprint: interrupted after {outcome.acknowledged} lines; {HEATERS[outcome.heaters_off]}")
        if journal is not None and journal.last.executed:
            say(f"tiltprint resume {journal.path} goes on with it")
        return 130
    told = f"printed {outcome.acknowledged} lines in {duration(outcome.elapsed_s)}, {outcome.repeated} repeated"
    show(f"{told} ({Answer(Kind.PRINTER, outcome.firmware).firmware[:60]})\n")
    return 0
