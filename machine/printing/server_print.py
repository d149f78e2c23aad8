"""Server print: a program handed over to a print server, started there and followed to its end; one that runs there followed."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path
from time import monotonic

from machine.dryrun.dryrun import Timeline
from machine.gcode.line_text import read_line
from machine.link.pending_commands import CancelledError
from machine.link.print_state import PrintState, PrintStatus, last_known
from machine.link.progress import ProgramPosition
from machine.notices import say, show
from machine.pipeline.programs import LoadedProgram
from machine.printing.checks import (
    CLEAN,
    check,
    check_free,
    error_sentences,
    server_machine_sentences,
    server_program_sentences,
)
from machine.printing.destination import Server
from machine.printing.job import CANCELLED, DONE, NOT_BEGUN, Does, End, Person, PrintJob, Scene
from machine.printing.rescue import STOPPED
from machine.printing.serial_log import SerialLog, new_log
from machine.printing.servers.follow import OnStatus, follow_print
from machine.printing.servers.gcode_upload import GcodeUpload
from machine.printing.servers.server import PrintServer, ServerIdentity
from machine.printing.servers.servers import open_server
from machine.program import Program
from machine.quantities import duration
from profiles.errors import FirmwareError, NoAnswerError, ServerError
from profiles.machine import Machine

LIMITS = (
    "the server prints its own copy: this computer may go, but there is no journal to resume from after a power cut, "
    "and pausing and cancelling do what the server's own macros say"
)


@contextmanager
def server_session(server: Server, title: str, kind: str, file: Path | None = None) -> Iterator[tuple[PrintServer, SerialLog]]:
    """A session with a server and the log of it, without keys. kind, file: of the log. Raises ServerError, ProfileError."""
    with new_log(kind, title, file) as record:
        if record.trouble:
            say(f"what is asked and answered is not logged: {record.file}: {record.trouble}")
        with open_server(server, record.note) as session:
            yield session, record


class ServerPrinter:
    """The `Printer` behind a print server, which prints without this program: a person may leave it printing."""

    def __init__(self, job: PrintJob, at: Server, server: PrintServer, log: SerialLog, person: Person) -> None:
        self.server = server
        self._job, self._at, self._log, self._person = job, at, log, person
        self._greeting = ServerIdentity("")

    def greet(self) -> None:
        """Ask the server who it is, and whether it is free where something is to be printed."""
        self._greeting = self.server.greet()
        say(f"{self._greeting.text} answers at {self.server.name}")
        if self._job.starts and self._job.does is Does.PRINT:
            check_free(self.server.name, self.server.status())

    def fit(self, machine: Machine) -> None:
        """Refuse a machine whose dialect the server's firmware does not read, whose axes or macros it lacks."""
        free = ", is free," if self._job.starts else ""
        passed = f"{self._greeting.text} answers at {self.server.name}{free} and prints for {machine.name}"
        sentences = server_machine_sentences(self._at, self._greeting, machine)
        if check(sentences, self._job.force):
            self._person.passed(passed)

    def ready(self, loaded: LoadedProgram) -> Program:
        """Refuse a program made for another machine, outside the limits that the server tells, or with macros it lacks."""
        force = self._job.force
        sentences = chain(server_program_sentences(self._greeting, loaded), error_sentences(loaded, force))
        if check(sentences, force):
            self._person.passed(CLEAN)
        if self._job.starts:
            self._person.passed(LIMITS)
        return loaded.program

    def send(self, loaded: LoadedProgram) -> End:
        """Hand it over, and have it printed where the job says so, without following it."""
        try:
            file = hand_over(
                self.server, GcodeUpload(loaded.name, loaded.program.lines), loaded.name, self._scene(), self._person
            )
        except CancelledError:
            return NOT_BEGUN
        if self._job.starts:
            check_free(self.server.name, self.server.status())
            self._start(file)
        sentence = f"{file} {'prints' if self._job.starts else 'waits'} on {self.server.name}"
        show(f"{sentence}\n")
        return End(PrintState.DONE, sentence)

    def _start(self, file: str) -> None:
        try:
            self.server.start(file)
        except KeyboardInterrupt:
            say(f"interrupted while {file} was being started: look whether {self.server.name} prints it")
            raise
        except NoAnswerError as error:
            raise ServerError(f"{error}; whether it prints {file} is not known: look at the printer") from None

    def print(self, loaded: LoadedProgram) -> End:
        """Hand it over, have it printed and show it until it ends or the person leaves.

        Raises ServerError, FirmwareError after an emergency stop.
        """
        person, server, upload = self._person, self.server, GcodeUpload(loaded.name, loaded.program.lines)
        try:
            file = hand_over(server, upload, loaded.name, self._scene(), person)
            check_free(server.name, server.status())  # somebody else may have begun while the program was made
            if person.gives_up():
                return NOT_BEGUN
        except CancelledError:
            return NOT_BEGUN
        say(LIMITS)
        known = ReportedProgress(upload, loaded)
        with _shown(person, self._scene(), known) as on_status:
            state = follow_print(
                server, file, len(upload.content), on_status=on_status, control=person.commands, left=person.left
            )
        return _report_end(state, file, loaded.name, server.name, known)

    def follow(self, now: PrintStatus) -> End:
        """Show a print that the server is at already until it ends or the person leaves. now: of running_print().

        Raises ServerError, FirmwareError after an emergency stop.
        """
        person, server, reported = self._person, self.server, ReportedProgress()
        scene = replace(self._scene(), beginning="a file that is not known here")
        with _shown(person, scene, reported) as on_status:
            state = follow_print(server, now.file, 0, on_status=on_status, control=person.commands, left=person.left, running=now)
        return _report_end(state, file_name(now), file_name(now), server.name, reported)

    def _scene(self) -> Scene:
        return Scene(self._log.title, self._log, server=self.server.name)


def hand_over(server: PrintServer, upload: GcodeUpload, named: str, scene: Scene, person: Person) -> str:
    """Upload with progress; returns the name by which the server prints it. Raises ServerError, CancelledError when the person
    gives it up."""
    if upload.name != named:
        say(f"{named} becomes {upload.name} there")
    if server.has(upload.name):
        say(f"replaces the {upload.name} that is there")
    total, gone = len(upload.content), 0
    with person.show(replace(scene, uploads=True)) as tell:

        def sent(count: int) -> None:
            nonlocal gone
            if person.gives_up():
                raise CancelledError
            gone = count
            state = f"{_megabytes(count)} of {_megabytes(total)}" if count < total else "the server reads it"
            message = f"uploading {upload.name}: {state}"
            tell(PrintStatus(PrintState.UPLOADING, message=message, share=count / total if total else None))

        try:
            file = server.upload(upload, sent)
        except (KeyboardInterrupt, CancelledError):
            holds = "keeps nothing of" if gone < total else "may hold all of"
            say(f"upload broken off: {server.name} {holds} {upload.name}")
            raise
    say(f"{file} is on {server.name}, {_megabytes(total)}, complete")
    return file


def running_print(server: PrintServer) -> PrintStatus:
    """Where the print stands that a server is at. Raises ServerError when there is none."""
    status = server.status()
    if not status.state.is_printing:
        raise ServerError(f"{server.name} prints nothing now ({status.message or status.state}): there is nothing to follow")
    return status


def file_name(status: PrintStatus) -> str:
    """Name of the file that a server prints, for a person."""
    return status.file or "its file"


@contextmanager
def _shown(person: Person, scene: Scene, progress: "ReportedProgress") -> Iterator[OnStatus]:
    """Takes what the server tells, and shows it."""
    with person.show(scene) as tell:
        tell(None)
        try:
            yield lambda status, message: tell(progress.at(status, message))
        except KeyboardInterrupt:
            say("ended at once: whether the print has been cancelled is not known, look at the printer")
            raise


def _report_end(state: PrintState, file: str, name: str, server: str, progress: "ReportedProgress") -> End:
    if state is PrintState.FAILED:
        raise FirmwareError(f"{STOPPED.format(server=server)}{progress.last_known}")
    if state is PrintState.DONE:
        show(f"printed {file} on {server} in {duration(progress.elapsed_s)}\n")
        return DONE
    if state is PrintState.LEFT:
        say(f"tiltprint: interrupted; {file} goes on printing on {server}")
        return End(state, f"{name} goes on printing on {server}: this page follows it no more")
    after = f" after {progress.line} lines" if progress.line else ""
    say(f"tiltprint: interrupted; the print was cancelled on {server}{after}")
    return CANCELLED


class ReportedProgress:
    """Progress of a print on a server. Where the program is known here, part and layer follow from the position up to which the
    server has read the file."""

    def __init__(self, upload: GcodeUpload | None = None, loaded: LoadedProgram | None = None) -> None:
        self.line, self.elapsed_s = 0, 0.0
        self._upload, self._position = upload, ProgramPosition()
        self._lines: Sequence[str] = () if loaded is None else loaded.program.lines
        self._timeline = Timeline(None if loaded is None else loaded.program.run)
        self._last_status: PrintStatus | None = None
        self._last_status_s = monotonic()

    @property
    def last_known(self) -> str:
        """The temperatures that were told last, behind the last words of a print."""
        return "" if self._last_status is None else last_known(self._last_status.temperature, monotonic() - self._last_status_s)

    def at(self, status: PrintStatus, message: str) -> PrintStatus:
        """The status with how old it is, and what the program tells of the line that it has reached. message: goes before the
        server's own."""
        if status is not self._last_status:  # a server that does not answer leaves what it told last
            self._last_status, self._last_status_s = status, monotonic()
        self.elapsed_s = max(self.elapsed_s, status.elapsed_s)
        heat_age_s = monotonic() - self._last_status_s
        status = replace(status, elapsed_s=self.elapsed_s, heat_age_s=heat_age_s, message=message or status.message)
        if self._upload is None:
            return status
        self._read_to(self._upload.line_at(status.bytes_read or 0))
        position, timeline = self._position, self._timeline
        return replace(
            status,
            sent=self.line,
            acknowledged=self.line,
            total=len(self._lines),
            file_line=self.line,
            left_s=timeline.remaining_s(self.line) * 100.0 / status.feed_percent,
            share=position.share(self.line, len(self._lines)),
            part=position.part,
            parts=position.parts,
            layer=position.layer,
            layers=timeline.layers(position.part),
            at=timeline.at(self.line),
        )

    def _read_to(self, line: int) -> None:
        for text in self._lines[self.line : line]:
            self._position.read_comment(text)
            if text[:1] in "Mm":
                self._position.read_m73(read_line(text).command, self.elapsed_s)
        self.line = max(self.line, line)


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.1f} MB"
