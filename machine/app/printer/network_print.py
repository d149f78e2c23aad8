"""Network print: a program handed over to a print server, started there and followed to its end."""

from collections.abc import Callable
from functools import partial

from machine.app.printer.stream import PrintJob
from machine.app.terminal.interrupts import calling
from machine.app.terminal.plain import plain_line, show
from machine.app.terminal.print_display import Follow, PrintDisplay
from machine.app.terminal.progress import reporting, say
from machine.app.terminal.screen import Course, Words
from machine.app.terminal.server_keys import ServerKeyboard
from machine.link.pending_commands import Control
from machine.link.progress import ProgramPosition, Progress
from machine.network.follow import End, follow_print
from machine.network.gcode_upload import GcodeUpload
from machine.network.server import JobStatus, PrintServer
from machine.view.quantities import duration
from profiles.errors import FirmwareError

LIMITS = (
    "the server prints its own copy: this computer may go, but there is no journal to resume from after a power cut, "
    "and pausing and cancelling do what the server's own macros say"
)


def hand_over(server: PrintServer, upload: GcodeUpload, named: str) -> str:
    """Upload with progress; returns the name by which the server prints it. Raises ServerError."""
    if upload.name != named:
        say(f"{named} becomes {upload.name} there")
    if server.has(upload.name):
        say(f"replaces the {upload.name} that is there")
    total, gone = len(upload.content), 0
    with reporting() as report:

        def sent(count: int) -> None:
            nonlocal gone
            gone = count
            state = f"{_megabytes(count)} of {_megabytes(total)}" if count < total else "the server reads it"
            report(f"uploading {upload.name}: {state}", count / total if total else None)

        try:
            file = server.upload(upload, sent)
        except KeyboardInterrupt:
            kept = "keeps nothing of" if gone < total else "may hold all of"
            say(f"upload broken off: {server.name} {kept} {upload.name}")
            raise
    say(f"{file} is on {server.name}, {_megabytes(total)}, complete")
    return file


def print_there(server: PrintServer, job: PrintJob, upload: GcodeUpload, file: str, follow: Follow | None) -> int:
    """Have a file printed and show it until it ends or the person leaves; 130 when a person stopped or left it.

    Raises ServerError, FirmwareError.
    """
    say(LIMITS)
    control, course = Control(), Course(job.program.run)
    board = ServerKeyboard(control, server.name)
    progress = ServerProgress(upload, job.program.lines, course.remaining_s)
    with PrintDisplay(f"{file} on {server.name}", course, board, Words()) as display, calling(board.interrupt):
        display.open()

        def on_status(status: JobStatus, message: str) -> None:
            now = progress.at(status, message)
            display(now)
            if follow is not None:
                follow(now)

        try:
            end = follow_print(server, file, len(upload.content), on_status, control, board.gone)
        except KeyboardInterrupt:
            say("ended at once: whether the print has been cancelled is not known, look at the printer")
            raise
    return _report_end(end, file, server.name, progress)


def _report_end(end: End, file: str, server: str, progress: "ServerProgress") -> int:
    if end is End.STOPPED:
        raise FirmwareError(f"emergency stop: {server} has taken it; restart the printer before the next print")
    if end is End.DONE:
        show(f"printed {file} on {server} in {duration(progress.elapsed_s)}\n")
        return 0
    said = {
        End.LEFT: f"{file} goes on printing on {server}",
        End.CANCELLED: f"the print was cancelled on {server} after {progress.line} lines",
    }
    say(f"tiltprint: interrupted; {said[end]}")
    return 130


class ServerProgress:
    """What a server tells, as the progress of a print; part and layer are those of the place up to which it has read the file."""

    def __init__(self, upload: GcodeUpload, lines: tuple[str, ...], remaining_s: Callable[[int], float]) -> None:
        self._line_at, self._lines, self._remaining_s = upload.line_at, lines, remaining_s
        self._place = ProgramPosition()
        self.line, self.elapsed_s = 0, 0.0

    def at(self, status: JobStatus, message: str) -> Progress:
        """The progress at a moment. message: goes before the server's own."""
        self.elapsed_s = max(self.elapsed_s, status.elapsed_s or 0.0)
        self._read_to(self._line_at(status.bytes_read or 0))
        feed = status.feed_percent or 100.0
        make = partial(Progress, sent=self.line, acknowledged=self.line, total=len(self._lines), file_line=self.line)
        return make(
            elapsed_s=self.elapsed_s,
            left_s=self._remaining_s(self.line) * 100.0 / feed,
            share=self._place.share(self.line, len(self._lines)),
            temperature=status.temperature,
            part=self._place.part,
            parts=self._place.parts,
            layer=self._place.layer,
            state=status.phase.value,
            feed_percent=feed,
            flow_percent=status.flow_percent or 100.0,
            message=plain_line(message or status.message),
        )

    def _read_to(self, line: int) -> None:
        for text in self._lines[self.line : line]:
            self._place.read_comment(text)
            if text.startswith("M73"):
                self._place.read_m73(text, self.elapsed_s)
        self.line = max(self.line, line)


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.1f} MB"
