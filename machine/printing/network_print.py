"""Network print: a program handed over to a print server, started there and followed to its end; one that runs there followed."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import monotonic

from machine.dryrun.timeline import Timeline, UnknownTimeline
from machine.gcode.line_text import read_line
from machine.link.pending_commands import CancelledError
from machine.link.progress import ProgramPosition, Progress, last_known
from machine.notices import plain_line, reporting, say, show
from machine.pipeline.programs import LoadedProgram
from machine.printing.attendance import Observers, ServerAttendance
from machine.printing.rescue import STOPPED
from machine.printing.serial_log import SerialLog, new_log
from machine.printing.server_checks import check_free
from machine.printing.servers.follow import End, OnStatus, follow_print
from machine.printing.servers.gcode_upload import GcodeUpload
from machine.printing.servers.server import ACTIVE, JobStatus, PrintServer
from machine.printing.servers.servers import open_server
from machine.quantities import duration
from profiles.errors import FirmwareError, ServerError

LIMITS = (
    "the server prints its own copy: this computer may go, but there is no journal to resume from after a power cut, "
    "and pausing and cancelling do what the server's own macros say"
)


@contextmanager
def server_session(address: str, title: str, kind: str, file: Path | None = None) -> Iterator[tuple[PrintServer, SerialLog]]:
    """A session with a server and the log of it, without keys. kind, file: of the log. Raises ServerError, ProfileError."""
    with new_log(kind, title, file) as record:
        if record.trouble:
            say(f"what is asked and answered is not logged: {record.file}: {record.trouble}")
        with open_server(address, record.note) as server:
            yield server, record


def hand_over(server: PrintServer, upload: GcodeUpload, named: str, person: ServerAttendance | None = None) -> str:
    """Upload with progress; returns the name by which the server prints it. Raises ServerError, CancelledError when the person
    gives it up."""
    if upload.name != named:
        say(f"{named} becomes {upload.name} there")
    if server.has(upload.name):
        say(f"replaces the {upload.name} that is there")
    total, gone = len(upload.content), 0
    with reporting() if person is None else person.uploading() as report:

        def sent(count: int) -> None:
            nonlocal gone
            if person is not None and person.gives_up():
                raise CancelledError
            gone = count
            state = f"{_megabytes(count)} of {_megabytes(total)}" if count < total else "the server reads it"
            report(f"uploading {upload.name}: {state}", count / total if total else None)

        try:
            file = server.upload(upload, sent)
        except (KeyboardInterrupt, CancelledError):
            holds = "keeps nothing of" if gone < total else "may hold all of"
            say(f"upload broken off: {server.name} {holds} {upload.name}")
            raise
    say(f"{file} is on {server.name}, {_megabytes(total)}, complete")
    return file


def print_there(server: PrintServer, job: LoadedProgram, observers: Observers, person: ServerAttendance) -> End:
    """Hand a program over, have it printed and show it until it ends or the person leaves; says how it ended.

    Raises ServerError, FirmwareError after an emergency stop, CancelledError when the person gives it up before it has begun.
    """
    upload = GcodeUpload(job.name, job.program.lines)
    file = hand_over(server, upload, job.name, person)
    check_free(server.name, server.status())  # somebody else may have begun while the program was made
    if person.gives_up():
        raise CancelledError
    say(LIMITS)
    timeline = Timeline(job.program.run)
    progress = ServerProgress(upload, job.program.lines, timeline.remaining_s)
    with _shown(person, observers, timeline, progress) as on_status:
        end = follow_print(server, file, len(upload.content), on_status=on_status, control=person.control, left=person.gone)
    _report_end(end, file, server.name, progress)
    return end


def running_print(server: PrintServer) -> JobStatus:
    """Where the print stands that a server is at. Raises ServerError when there is none."""
    status = server.status()
    if status.phase not in ACTIVE:
        raise ServerError(
            f"{server.name} prints nothing now ({status.message or status.phase.value}): there is nothing to follow"
        )
    return status


def follow_there(server: PrintServer, now: JobStatus, observers: Observers, person: ServerAttendance) -> End:
    """Show a print that a server is at already until it ends or the person leaves; says how it ended. now: of running_print().

    Raises ServerError, FirmwareError after an emergency stop.
    """
    progress = ReportedProgress()
    with _shown(person, observers, UnknownTimeline(), progress) as on_status:
        end = follow_print(server, now.file, 0, on_status=on_status, control=person.control, left=person.gone, running=now)
    _report_end(end, file_name(now), server.name, progress)
    return end


def file_name(status: JobStatus) -> str:
    """What a server prints, as a person is told."""
    return status.file or "its file"


@contextmanager
def _shown(
    person: ServerAttendance, observers: Observers, timeline: Timeline, progress: "ReportedProgress"
) -> Iterator[OnStatus]:
    """Takes what the server tells, and shows it."""
    with person.show(observers, timeline) as display:
        display.open()

        def on_status(status: JobStatus, message: str) -> None:
            now = progress.at(status, message)
            display(now)
            if observers.follow is not None:
                observers.follow(now)

        try:
            yield on_status
        except KeyboardInterrupt:
            say("ended at once: whether the print has been cancelled is not known, look at the printer")
            raise


def _report_end(end: End, file: str, server: str, progress: "ReportedProgress") -> None:
    if end is End.STOPPED:
        raise FirmwareError(f"{STOPPED.format(server=server)}{progress.last_known}")
    if end is End.DONE:
        show(f"printed {file} on {server} in {duration(progress.elapsed_s)}\n")
        return
    after = f" after {progress.line} lines" if progress.line else ""
    said = {End.LEFT: f"{file} goes on printing on {server}", End.CANCELLED: f"the print was cancelled on {server}{after}"}
    say(f"tiltprint: interrupted; {said[end]}")


class ReportedProgress:
    """What a server tells of a print whose program is not known here, as the progress of a print."""

    def __init__(self) -> None:
        self.line, self.elapsed_s = 0, 0.0
        self._last_status: JobStatus | None = None
        self._last_status_s = monotonic()

    @property
    def last_known(self) -> str:
        """The temperatures that were told last, behind the last words of a print."""
        return "" if self._last_status is None else last_known(self._last_status.temperature, monotonic() - self._last_status_s)

    def at(self, status: JobStatus, message: str) -> Progress:
        """The progress at a moment. message: goes before the server's own."""
        if status is not self._last_status:  # a server that does not answer leaves what it told last
            self._last_status, self._last_status_s = status, monotonic()
        self.elapsed_s = max(self.elapsed_s, status.elapsed_s or 0.0)
        return Progress(
            elapsed_s=self.elapsed_s,
            share=status.share,
            temperature=status.temperature,
            heat_age_s=monotonic() - self._last_status_s,
            state=status.phase.value,
            feed_percent=status.feed_percent or 100.0,
            flow_percent=status.flow_percent or 100.0,
            message=plain_line(message or status.message),
        )


class ServerProgress(ReportedProgress):
    """The same of a known program; part and layer are those of the place up to which the server has read the file."""

    def __init__(self, upload: GcodeUpload, lines: Sequence[str], remaining_s: Callable[[int], float]) -> None:
        super().__init__()
        self._line_at, self._lines, self._remaining_s = upload.line_at, lines, remaining_s
        self._position = ProgramPosition()

    def at(self, status: JobStatus, message: str) -> Progress:
        """The progress at a moment. message: goes before the server's own."""
        progress = super().at(status, message)
        self._read_to(self._line_at(status.bytes_read or 0))
        return replace(
            progress,
            sent=self.line,
            acknowledged=self.line,
            total=len(self._lines),
            file_line=self.line,
            left_s=self._remaining_s(self.line) * 100.0 / progress.feed_percent,
            share=self._position.share(self.line, len(self._lines)),
            part=self._position.part,
            parts=self._position.parts,
            layer=self._position.layer,
        )

    def _read_to(self, line: int) -> None:
        for text in self._lines[self.line : line]:
            self._position.read_comment(text)
            if text[:1] in "Mm":
                self._position.read_m73(read_line(text).command, self.elapsed_s)
        self.line = max(self.line, line)


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.1f} MB"
