"""Server print: upload a program to a print server, start it there and follow it; or follow a print that is running there."""

from collections.abc import Sequence
from dataclasses import replace
from time import monotonic

from machine.dryrun.dryrun import Timeline
from machine.firmware import dialect_of
from machine.gcode.line_text import read_line
from machine.link.pending_commands import CancelledError
from machine.link.print_state import PrintState, PrintStatus, ProgramPosition, last_known
from machine.notices import say, show
from machine.pipeline.programs import LoadedProgram
from machine.printing.checks import check_free
from machine.printing.history import Reach, recorded
from machine.printing.job import DONE, NOT_BEGUN, Does, End, Person, PrintJob, Scene
from machine.printing.rescue import STOPPED
from machine.printing.serial_log import SerialLog
from machine.printing.servers.follow import Follower
from machine.printing.servers.server import GcodeUpload, Identity, PrintServer
from machine.quantities import amount, duration
from profiles.errors import FirmwareError, NoAnswerError, ServerError
from profiles.machine import Machine

LIMITS = (
    "the server prints its own copy: this computer may be off, but there is no journal to resume from after a power cut, "
    "and pausing and cancelling do what the server's own macros say"
)


class ServerPrinter:
    """The printer behind a print server, which prints without this program: the user may leave it printing."""

    def __init__(self, job: PrintJob, server: PrintServer, log: SerialLog, person: Person) -> None:
        self.server, self.person = server, person
        self.identity = Identity("")
        self._job, self._log = job, log

    def greet(self) -> None:
        """Identify the server; before a print also check that it is free."""
        self.identity = self.server.greet()
        say(f"{self.identity.text} answers at {self.server.name}")
        if self._job.starts and self._job.does is Does.PRINT:
            check_free(self.server.name, self.server.status())

    def fits(self, machine: Machine) -> str:
        """Sentence for the user: the server answers, and its printer matches the machine of the profile."""
        free = ", is free," if self._job.starts else ""
        return f"{self.identity.text} answers at {self.server.name}{free} and prints for {machine.name}"

    def send(self, loaded: LoadedProgram) -> End:
        """Upload the program, start it if the job says so, and do not follow it."""
        try:
            file = hand_over(self.server, GcodeUpload(loaded.name, loaded.program.lines), loaded.name, self._scene(), self.person)
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
        """Upload the program, start it if the job says so, and show it until it ends or the user leaves.

        Raises ServerError, and FirmwareError after an emergency stop.
        """
        if not self._job.starts:
            return self.send(loaded)
        return recorded(loaded, self.server.name, lambda reach: self._print(loaded, reach))

    def _print(self, loaded: LoadedProgram, reach: Reach) -> End:
        person, server, upload = self.person, self.server, GcodeUpload(loaded.name, loaded.program.lines)
        try:
            file = hand_over(server, upload, loaded.name, self._scene(), person)
            check_free(server.name, server.status())  # another client may have started a print in the meantime
            if person.cancels():
                return NOT_BEGUN
        except CancelledError:
            return NOT_BEGUN
        say(LIMITS)
        return self._follow(file, loaded.name, ReportedProgress(upload, loaded, reach), self._scene())

    def follow(self, now: PrintStatus) -> End:
        """Show a running print until it ends or the user leaves. now: result of running_print().

        Raises ServerError, and FirmwareError after an emergency stop.
        """
        scene = replace(self._scene(), beginning="a file that is not known here")
        return self._follow(now.file, file_name(now), ReportedProgress(), scene, now)

    def _follow(
        self, file: str, name: str, progress: "ReportedProgress", scene: Scene, running: PrintStatus | None = None
    ) -> End:
        """Start a file, or follow a running print, and report how it ended. name: for the user."""
        server, person, profile = self.server, self.person, self._job.profile
        babystep = server.babystep or ("" if profile is None else dialect_of(profile.machine).babystep)
        with person.show(scene) as tell:
            tell(None)
            follower = Follower(
                server,
                file,
                progress.size,
                on_status=lambda status, message: tell(progress.at(status, message)),
                control=person.commands,
                left=person.left,
                running=running,
                babystep=babystep,
            )
            try:
                state = follower.run()
            except KeyboardInterrupt:
                say("ended at once: whether the print has been cancelled is not known, look at the printer")
                raise
        file = file or name
        if state is PrintState.FAILED:
            raise FirmwareError(f"{STOPPED.format(server=server.name)}{progress.last_known}")
        if follower.kept:
            say(follower.kept)
        if state is PrintState.DONE:
            show(f"printed {file} on {server.name} in {duration(progress.elapsed_s)}\n")
            return DONE
        if state is PrintState.LEFT:
            say(f"tiltprint: interrupted; {file} keeps printing on {server.name}")
            return End(state, f"{name} keeps printing on {server.name}: this page no longer follows it")
        after = f" after {progress.line} lines" if progress.line else ""
        sentence = f"the print was cancelled on {server.name}{after}"
        say(f"tiltprint: {sentence}")
        return End(state, sentence)

    def _scene(self) -> Scene:
        return Scene(self._log.title, self._log, server=self.server.name)


def hand_over(server: PrintServer, upload: GcodeUpload, named: str, scene: Scene, person: Person) -> str:
    """Upload with progress and return the file's name on the server. Raises ServerError, CancelledError."""
    if upload.name != named:
        say(f"{named} becomes {upload.name} there")
    if server.has(upload.name):
        say(f"replaces the {upload.name} that is there")
    total, gone = len(upload.content), 0
    with person.show(replace(scene, uploads=True)) as tell:

        def sent(count: int) -> None:
            nonlocal gone
            if person.cancels():
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
    """Status of the print that is running on a server. Raises ServerError when none is."""
    status = server.status()
    if not status.state.is_printing:
        raise ServerError(f"{server.name} prints nothing now ({status.message or status.state}): there is nothing to follow")
    return status


def file_name(status: PrintStatus) -> str:
    """Name of the file that a server prints, for the user."""
    return status.file or "its file"


class ReportedProgress:
    """Progress of a print on a server; part and layer follow from how far the server has read a program that is known here. size:
    of the file, bytes, 0: unknown. reach: called with the lines that the server has read."""

    def __init__(
        self, upload: GcodeUpload | None = None, loaded: LoadedProgram | None = None, reach: Reach = lambda first, last: None
    ) -> None:
        self.line, self.elapsed_s = 0, 0.0
        self.size = 0 if upload is None else len(upload.content)
        self._upload, self._position, self._reach = upload, ProgramPosition(), reach
        self._lines: Sequence[str] = () if loaded is None else loaded.program.lines
        self._timeline = None if loaded is None else Timeline(loaded.program.run)
        self._last_status: PrintStatus | None = None
        self._last_status_s = monotonic()

    @property
    def last_known(self) -> str:
        """The newest temperatures, in words, for the end of a print."""
        return "" if self._last_status is None else last_known(self._last_status.temperature, monotonic() - self._last_status_s)

    def at(self, status: PrintStatus, message: str) -> PrintStatus:
        """The status with its age, part and layer. message: replaces the server's own."""
        if status is not self._last_status:  # a silent server leaves its last status
            self._last_status, self._last_status_s = status, monotonic()
        self.elapsed_s = max(self.elapsed_s, status.elapsed_s)
        heat_age_s = monotonic() - self._last_status_s
        status = replace(status, elapsed_s=self.elapsed_s, heat_age_s=heat_age_s, message=message or status.message)
        position, timeline = self._position, self._timeline
        if self._upload is None or timeline is None:
            return status
        self._read_to(self._upload.line_at(status.bytes_read or 0))
        self._reach(1, self.line)
        remaining_s = timeline.remaining_s(self.line)
        return replace(
            status,
            sent=self.line,
            acknowledged=self.line,
            total=len(self._lines),
            file_line=self.line,
            left_s=None if status.state is PrintState.CANCELLING else remaining_s * 100.0 / status.feed_percent,
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
    return f"{amount(count / 1e6, 1)} MB"
