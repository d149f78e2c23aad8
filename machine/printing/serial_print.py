"""Serial print: stream a program to a printer at a port, or to the simulated one on a pseudo-terminal."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import replace
from math import inf, isfinite

from machine.dryrun.dryrun import Timeline
from machine.link.identification import Answer, Kind
from machine.link.journal import Journal
from machine.link.port import open_port
from machine.link.print_state import PrintState, PrintStatus
from machine.link.resume import ResumePoint
from machine.link.shutdown import Heaters
from machine.link.status import PrinterStatus
from machine.link.stream import Outcome, print_lines
from machine.notices import say, show
from machine.pipeline.programs import LoadedProgram
from machine.printing.destination import AtPrinter, SerialPort, Simulated
from machine.printing.history import Reach, recorded
from machine.printing.job import DONE, End, Person, PrintJob, Scene
from machine.printing.journal_folder import new_journal
from machine.printing.ports import describe_answer, identify_printer
from machine.printing.serial_log import SerialLog, new_log, tap
from machine.printing.servers.server import Identity
from machine.quantities import amount, duration
from machine.simulator.board import BuildOptions
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import OutputError, PrinterError
from profiles.machine import Machine

USB_BYTES, QUEUE = 1024, 16  # the simulated board has native USB: sending more lines at once halves the cost per line
HEATERS = {
    True: "heaters off",
    False: "the printer did not confirm that its heaters are off: look at it",
    None: "nothing had been sent yet",
}
Begin = Callable[[PrinterStatus], ResumePoint]  # begins a resumed print: decides where it continues, given the printer's status


class SerialPrinter:
    """The printer at a port, or the simulated one, which is not identified."""

    def __init__(self, job: PrintJob, at: AtPrinter, person: Person) -> None:
        self.person = person
        self.identity = Identity("")
        self._job, self._at = job, at

    def greet(self) -> None:
        """Identify the printer at the port. Raises PrinterError."""
        if isinstance(self._at, SerialPort):
            with open_port(self._at.name, self._at.baud) as wire:
                self.identity = Identity("", identify_printer(wire, self._at.baud))

    def print(self, loaded: LoadedProgram) -> End:
        """Stream the program, with a log and a journal, and report how it ended."""
        return recorded(loaded, self._at.name, lambda reach: self._print(loaded, reach))

    def _print(self, loaded: LoadedProgram, reach: Reach) -> End:
        simulated = isinstance(self._at, Simulated)
        journalled = self._journal(loaded) if not simulated or self._job.journal is not None else nullcontext()
        title = f"{loaded.name} to {'the simulated printer' if simulated else self._at.name}"
        with new_log("print", title, self._job.log) as log, _pointing_to(log), journalled as journal:
            if isinstance(self._at, Simulated):
                return _print_simulated(loaded, self._at, Scene(title, log, journal), self.person, reach)
            outcome = stream_program(loaded, self._at, Scene(title, log, journal), self.person, reach)
            return report_end(outcome, log, journal)

    def _journal(self, loaded: LoadedProgram) -> AbstractContextManager[Journal | None]:
        """The journal. If a journal in the state folder cannot be written, the print continues without one."""
        file = self._job.journal
        try:
            return new_journal(loaded.program.lines, loaded.profile, loaded.name, loaded.source, file)
        except OutputError as error:
            if file is not None:
                raise
            say(f"this print cannot be resumed if it is interrupted: {error}")
            return nullcontext()

    def fits(self, machine: Machine) -> str:
        """Sentence for the user: the printer matches the machine of the profile."""
        if isinstance(self._at, Simulated):
            times = "" if self._at.speed == 1.0 else f"{self._at.speed:g} times "
            speed = f"{times}as fast as a real one" if self._at.speed else "as fast as it can"
            return f"a simulated {machine.name}, {speed}"
        assert self.identity.printer is not None
        described = describe_answer(self.identity.printer, self._at.baud)
        return f"{described}, answers at {self._at.name} and is one for {machine.name}"


def _print_simulated(loaded: LoadedProgram, at: Simulated, scene: Scene, person: Person, reach: Reach) -> End:
    """Stream to the simulated printer and report what it has done."""
    machine = loaded.profile.machine
    usb = loaded.profile.model_copy(update={"machine": machine.model_copy(update={"receive_bytes": USB_BYTES})})
    speed = at.speed or inf
    with SimulatedPrinter(machine, speed, build=BuildOptions(queue=QUEUE)) as printer:
        pace, port = speed if isfinite(speed) else None, SerialPort(printer.path)
        outcome = stream_program(replace(loaded, profile=usb), port, scene, person, reach, pace=pace)
        record = printer.record
    if outcome.cancelled:
        return report_end(outcome, scene.log)
    _, volumes = record.deposited(loaded.profile.material.diameter_mm)
    planned = float(loaded.program.run.segment_mm3.sum())
    laid = f"{amount(volumes.sum() / 1000)} cm³ of plastic laid (planned {amount(planned / 1000)})"
    heaters = "heaters off" if record.nozzle_target_c == record.bed_target_c == 0.0 else "heaters still on"
    moves = f"{len(record.start)} moves in {duration(float(record.duration_s.sum()))} of printing time"
    show(f"simulated printer: {moves}, {laid}, {heaters}\n")
    if record.clamped or record.unknown:
        raise PrinterError(
            f"the simulated printer met {record.clamped} coordinates out of limits and {record.unknown} unknown commands"
        )
    return DONE


def stream_program(
    loaded: LoadedProgram,
    at: SerialPort,
    scene: Scene,
    person: Person,
    reach: Reach,
    *,
    begin: Begin | None = None,
    pace: float | None = 1.0,
) -> Outcome:
    """Stream a program while the user watches and controls it; a resumed print is shown once it begins to print. reach: called
    with the lines that the printer has acknowledged; pace: seconds of the print per second of the clock, None: as fast as
    possible."""
    timeline = Timeline(loaded.program.run)

    def traffic(direction: str, data: bytes) -> None:
        scene.log.note(direction, data)
        scene.messages.hear(direction, data)

    with ExitStack() as stack:
        tell = stack.enter_context(person.show(scene))
        begun = begin is None
        if begun:
            tell(None)

        first = 1

        def begin_then_show(status: PrinterStatus) -> ResumePoint:
            nonlocal begun, first
            assert begin is not None
            start = begin(status)
            begun, first = True, start.line
            tell(None)
            return start

        def on_progress(status: PrintStatus) -> None:
            if begun:
                reach(first, status.file_line)
                ends = status.state is PrintState.CANCELLING
                left_s = None if ends else time_left_s(timeline.remaining_s, first, status, pace)
                tell(replace(status, left_s=left_s, layers=timeline.layers(status.part), at=timeline.at(status.file_line)))

        return print_lines(
            loaded.program.lines,
            at.name,
            at.baud,
            on_progress=on_progress,
            control=person.commands,
            profile=loaded.profile,
            medium=tap(traffic),
            journal=scene.journal,
            begin=None if begin is None else begin_then_show,
        )


def time_left_s(remaining_s: Callable[[int], float], first: int, status: PrintStatus, pace: float | None) -> float | None:
    """Time left of a print that began at a line of its file, s; None while unknown.

    remaining_s: seconds of the program after a line, at its own feed rates. pace: seconds of the print per second of the clock;
    None: the mean pace so far, whatever the feed.
    """
    left_s = remaining_s(status.file_line)
    if pace is not None:
        return left_s / pace * 100.0 / status.feed_percent
    done_s = remaining_s(first - 1) - left_s
    return left_s * status.elapsed_s / done_s if done_s > 0 else None


@contextmanager
def _pointing_to(log: SerialLog) -> Iterator[None]:
    """Report where the serial log is when the print fails, and at the start if nothing can be logged."""
    log.say_trouble()
    try:
        yield
    except PrinterError:
        _point_to(log)
        raise
    except KeyboardInterrupt:  # the second one: the printer's confirmation was not awaited
        say("ended at once: whether the heaters are off is not known, look at the printer")
        raise


def _point_to(log: SerialLog) -> None:
    """Close the log and report where it is, and whether it is complete."""
    log.close()
    if log.trouble:
        say(f"what was sent and received is not wholly in {log.file}: {log.trouble}")
    else:
        say(f"all that was sent and received is in {log.file}")


def report_end(outcome: Outcome, log: SerialLog | None = None, journal: Journal | None = None) -> End:
    """Report how the print ended, the log if the printer sent warnings, and how to resume a stopped print or why it is
    impossible. Closes the journal first: only what is on disk is promised."""
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
        sentence = f"the print was cancelled after {outcome.acknowledged} lines; {heaters}"
        say(f"tiltprint: {sentence}")
        if outcome.kept:
            say(outcome.kept)
        if journal is not None and journal.last.executed and not journal.trouble:
            say(f"tiltprint resume {journal.path} continues it")
        return End(PrintState.CANCELLED, sentence)
    summary = f"printed {outcome.acknowledged} lines in {duration(outcome.elapsed_s)}, {outcome.repeated} repeated"
    show(f"{summary} ({Answer(Kind.PRINTER, outcome.firmware).firmware[:60]})\n")
    return DONE
