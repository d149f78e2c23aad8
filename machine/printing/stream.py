"""Stream: a program to a printer, or to the simulated one on a pseudo-terminal, shown to the person watching."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from math import inf, isfinite
from pathlib import Path

from machine.cli.terminal.interrupts import stopping
from machine.cli.terminal.print_display import Follow
from machine.dryrun.timeline import Timeline
from machine.firmware import dialect_of
from machine.link.identification import Answer, Kind
from machine.link.journal import Journal
from machine.link.progress import Progress, Schedule
from machine.link.resume import ResumePoint
from machine.link.shutdown import Heaters
from machine.link.status import PrinterStatus
from machine.link.stream import Outcome, print_lines
from machine.notices import say, show
from machine.pipeline.programs import LoadedProgram
from machine.pipeline.requests import SIMULATED, PrintRequest
from machine.printing.attendance import Attendance, AtTerminal, Observers
from machine.printing.journal_folder import new_journal
from machine.printing.serial_log import SerialLog, new_log, tap
from machine.quantities import duration
from machine.simulator.board import BuildOptions
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import OutputError, PrinterError

USB_BYTES, QUEUE = 1024, 16  # the simulated printer is a board with native USB: more lines at a time halve what a line costs
HEATERS = {
    True: "heaters off",
    False: "the printer did not confirm that its heaters are off: look at it",
    None: "nothing had been sent yet",
}


def print_program(
    job: LoadedProgram, request: PrintRequest, follow: Follow | None = None, attendance: Attendance | None = None
) -> int:
    """Stream a program to the printer asked for and say how it ended; 130 when a person stopped it. Raises PrinterError.

    attendance: of a person who is not at the terminal.
    """
    simulated = request.port == SIMULATED
    title = f"{job.name} to {'the simulated printer' if simulated else request.port}"
    journalled = _journal(job, request.journal) if not simulated or request.journal is not None else nullcontext()
    with new_log("print", title, request.log) as log, _pointing_to(log), journalled as journal:
        observers = Observers(log, journal, follow)
        if simulated:
            return _print_simulated(job, request, observers, attendance)
        return report_end(stream_program(job, request, observers, attendance=attendance), log, journal)


def _journal(job: LoadedProgram, file: Path | None) -> AbstractContextManager[Journal | None]:
    """The print's journal; a print that was not told where to keep it goes on without one where none can be written."""
    try:
        return new_journal(job.program.lines, job.profile, job.name, job.source, file)
    except OutputError as error:
        if file is not None:
            raise
        say(f"this print cannot be resumed when it is cut off: {error}")
        return nullcontext()


def _print_simulated(job: LoadedProgram, request: PrintRequest, observers: Observers, attendance: Attendance | None) -> int:
    """Stream to the simulated printer and tell what it has done."""
    machine = job.profile.machine
    usb = job.profile.model_copy(update={"machine": machine.model_copy(update={"receive_bytes": USB_BYTES})})
    speed = request.sim_speed or inf
    with SimulatedPrinter(machine, speed, build=BuildOptions(queue=QUEUE)) as printer:
        pace = speed if isfinite(speed) else None
        there = replace(request, port=printer.path)
        outcome = stream_program(replace(job, profile=usb), there, observers, pace=pace, attendance=attendance)
        record = printer.record
    if outcome.cancelled:
        return report_end(outcome, observers.log)
    segments, volumes = record.deposited(job.profile.material.diameter_mm)
    planned = float(job.program.run.segment_mm3.sum())
    laid = f"{len(segments)} strokes laid {volumes.sum() / 1000:.3f} cm3 (planned {planned / 1000:.3f})"
    heaters = f"heaters at {record.nozzle_target_c:g} and {record.bed_target_c:g} deg C at the end"
    show(f"simulated printer: {len(record.start)} moves in {duration(float(record.duration_s.sum()))}, {laid}, {heaters}\n")
    if record.clamped or record.unknown:
        raise PrinterError(
            f"the simulated printer met {record.clamped} coordinates out of limits and {record.unknown} unknown commands"
        )
    return 0


def stream_program(
    job: LoadedProgram,
    request: PrintRequest,
    observers: Observers,
    *,
    begin: Callable[[PrinterStatus], ResumePoint] | None = None,
    pace: float | None = 1.0,
    attendance: Attendance | None = None,
) -> Outcome:
    """Stream a program while a person watches, at the terminal without an `attendance`: display, commands, Ctrl-C, log, journal.

    begin: of a resumed print. pace: seconds of the print that pass in one of the clock; None: as fast as it goes.
    """
    person, timeline = attendance or AtTerminal(), Timeline(job.program.run)

    def traffic(direction: str, data: bytes) -> None:
        observers.log.note(direction, data)
        person.words.hear(direction, data)

    with stopping(person.stop), person.show(observers, timeline) as display:

        def begin_then_show(status: PrinterStatus) -> ResumePoint:
            start = ResumePoint(1, ()) if begin is None else begin(status)
            display.open()
            return start

        if begin is None:
            display.open()

        def on_progress(progress: Progress) -> None:
            display(progress)
            if observers.follow is not None:
                observers.follow(progress)

        return print_lines(
            job.program.lines,
            request.port,
            request.baud,
            on_progress=on_progress,
            stop=person.stop,
            schedule=Schedule(timeline.remaining_s, pace),
            limit=dialect_of(job.profile.machine).longest_line,
            control=person.control,
            profile=job.profile,
            medium=tap(traffic),
            journal=observers.journal,
            begin=None if begin is None else begin_then_show,
        )


@contextmanager
def _pointing_to(log: SerialLog) -> Iterator[None]:
    """Say where the serial log is when the print goes wrong, and that nothing is logged when that is so."""
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


def _point_to(log: SerialLog) -> None:
    """Say where the log is, and whether it is whole; it ends here."""
    log.close()
    if log.trouble:
        say(f"what was sent and received is not wholly in {log.file}: {log.trouble}")
    else:
        say(f"all that was sent and received is in {log.file}")


def report_end(outcome: Outcome, log: SerialLog | None = None, journal: Journal | None = None) -> int:
    """Tell how the print ended, where its log is when the printer had something to say, and how to go on with a stopped one, or
    that this is not possible. Closes the journal first: only what is on the disk is promised. 130 when a person stopped it.
    """
    if journal is not None:
        journal.close()
        if journal.trouble:
            say(journal.warning)
    for warning in outcome.warnings:
        say(f"the printer said: {warning}")
    if outcome.warnings and log is not None:
        _point_to(log)
    if outcome.cancelled:
        heaters = f"{Heaters.HALTED.value}: {outcome.halted}" if outcome.halted else HEATERS[outcome.heaters_off]
        say(f"tiltprint: interrupted after {outcome.acknowledged} lines; {heaters}")
        if journal is not None and journal.last.executed and not journal.trouble:
            say(f"tiltprint resume {journal.path} goes on with it")
        return 130
    summary = f"printed {outcome.acknowledged} lines in {duration(outcome.elapsed_s)}, {outcome.repeated} repeated"
    show(f"{summary} ({Answer(Kind.PRINTER, outcome.firmware).firmware[:60]})\n")
    return 0
