"""Serial log: the traffic of the line, one file per print, limited in size; and the printer's newest messages."""

import os
import time
from collections import deque
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from io import BufferedWriter
from pathlib import Path
from typing import Self

from machine.link.medium import SERIAL, Medium, Traffic, Wire
from machine.link.protocol.events import Kind, read_event
from machine.notices import say
from profiles.errors import reason
from profiles.files import dated_name, keep_newest
from profiles.folders import state_folder

KEPT = 10  # logs of each kind
LIMIT_BYTES = 64_000_000  # per log: about 600,000 lines with their answers
PIECES = 4  # the first is kept, the others are the newest
WORDS_KEPT = 50  # messages of a printer
LONGEST_BYTES = 4096  # longest unfinished line
UNWRITTEN_S = 1.0  # at most this much is lost in a crash: writing each chunk at once would cost as much as sending it


class SerialLog:
    """`with SerialLog(file) as log:` pass each chunk sent (">") or received ("<") to log.note(direction, data).

    Chunks are joined to whole lines, each with the time of its end. A log never disturbs the print: if it cannot be written it
    ends, and `trouble` says why.
    """

    def __init__(self, file: Path, title: str, limit_bytes: int = LIMIT_BYTES) -> None:
        self.file, self.title = file, title
        self.trouble = ""
        self._torn: dict[str, bytes] = {}  # unfinished line of each direction
        self._flushed_s = 0.0
        self._second, self._clock = -1, ""
        self._piece_bytes, self._written, self._piece = limit_bytes // PIECES, 0, 0
        self._out = self._open(file)
        self._write(f"# tiltprint, {datetime.now():%Y-%m-%d %H:%M:%S}, {title}\n", flush=True)

    def note(self, direction: str, data: bytes) -> None:
        """Record a chunk of bytes; direction "#" is a remark of this program."""
        now_s = time.time()
        data = self._torn.get(direction, b"") + data
        end = data.rfind(b"\n") + 1
        self._torn[direction] = data[end:]
        if end:
            flush = now_s > self._flushed_s + UNWRITTEN_S
            if flush:
                self._flushed_s = now_s
            self._write(_stamped(data[: end - 1], f"{self._stamp(now_s)} {direction} "), flush)

    def say_trouble(self, what: str = "the traffic") -> None:
        """Report that the log cannot be written, if that is so. what: the content that is not logged."""
        if self.trouble:
            say(f"{what} is not logged: {self.file}: {self.trouble}")

    def remark(self, text: str) -> None:
        """Add a remark of this program."""
        self.note("#", f"{text}\n".encode())

    def close(self) -> None:
        """Write what is buffered, including unfinished lines."""
        for direction, line in self._torn.items():
            if line:
                self._write(f"{self._stamp(time.time())} {direction} {_readable(line)} (unfinished)\n")
        self._torn = {}
        if self._out is not None:
            try:
                self._out.close()
            except OSError as error:
                self._fail(error)
            self._out = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _stamp(self, now_s: float) -> str:
        second = int(now_s)
        if second != self._second:
            self._second, self._clock = second, time.strftime("%H:%M:%S", time.localtime(second))
        return f"{self._clock}.{int(1000 * (now_s - second)):03d}"

    def _write(self, text: str, flush: bool = False) -> None:
        if self._out is None:
            return
        try:
            if self._written >= self._piece_bytes:
                self._next_piece()
            self._written += self._out.write(text.encode("ascii", "backslashreplace"))
            if flush:
                self._out.flush()
        except OSError as error:
            self._fail(error)

    def _next_piece(self) -> None:
        """Continue in a new file; the first and the newest pieces are kept, together within the limit."""
        assert self._out is not None
        self._out.close()
        self._piece, self._written = self._piece + 1, 0
        if self._piece >= PIECES:
            piece_of(self.file, self._piece - PIECES + 1).unlink(missing_ok=True)
        self._out = self._open(piece_of(self.file, self._piece))

    def _open(self, file: Path) -> BufferedWriter | None:
        try:
            return open(file, "wb", opener=lambda name, flags: os.open(name, flags, 0o600))
        except OSError as error:
            self._fail(error)
            return None

    def _fail(self, error: OSError) -> None:
        self.trouble = reason(error)
        self._out = None


class TappedWire:
    """A wire that reports every byte, including those of a safe end or an emergency stop."""

    def __init__(self, wire: Wire, tell: Traffic) -> None:
        self._wire, self._tell = wire, tell
        self.name = wire.name

    def write(self, data: bytes) -> None:
        """Send all bytes."""
        self._tell(">", data)
        self._wire.write(data)

    def read(self) -> bytes:
        """The bytes received."""
        data = self._wire.read()
        if data:
            self._tell("<", data)
        return data

    def discard(self) -> None:
        """Discard bytes that are not sent yet."""
        self._wire.discard()

    def close(self) -> None:
        """Close the wire."""
        self._wire.close()


def tap(tell: Traffic, medium: Medium = SERIAL) -> Medium:
    """A medium whose wires report all traffic."""
    return replace(medium, open=lambda name, baud: TappedWire(medium.open(name, baud), tell))


def _stamped(lines: bytes, stamp: str) -> str:
    """Whole lines, each after its time stamp; empty lines are omitted."""
    text = lines.decode("latin-1")
    usual = text.isascii() and text.replace("\n", "").isprintable()
    if usual and "\n\n" not in f"\n{text}\n":
        return stamp + text.replace("\n", "\n" + stamp) + "\n"
    return "".join(f"{stamp}{_readable(line)}\n" for line in lines.split(b"\n") if line)


def _readable(line: bytes) -> str:
    """A line as ASCII; unprintable bytes are escaped, so that each can be read."""
    text = line.decode("latin-1").rstrip("\r")
    return text if text.isascii() and text.isprintable() else text.encode("unicode_escape").decode("ascii")


def piece_of(file: Path, piece: int) -> Path:
    """File of a log's piece: print.log, print.1.log, print.2.log."""
    return file.with_name(f"{file.stem}.{piece}{file.suffix}") if piece else file


def new_log(kind: str, title: str, file: Path | None = None) -> SerialLog:
    """A log in the file, else in a new file of the state folder named after kind and time; the oldest of the kind are deleted."""
    if file is not None:
        return SerialLog(file, title)
    folder = state_folder() / "logs"
    with suppress(OSError):  # a file that cannot be deleted stays; the log itself reports whether it can be written
        folder.mkdir(0o700, exist_ok=True)
        files = [*folder.glob(f"{kind}-*.log")]
        kept = keep_newest((file for file in files if "." not in file.stem), KEPT - 1, lambda file: file.name)
        for file in files:  # pieces are deleted with the first of their log
            if file.with_name(f"{file.stem.partition('.')[0]}.log") not in kept:
                file.unlink(missing_ok=True)
    return SerialLog(folder / f"{kind}-{dated_name()}.log", title)


class PrinterMessages:
    """The newest messages of a printer; hear() is called with chunks of bytes in the port's thread."""

    def __init__(self, most: int = WORDS_KEPT) -> None:
        self.last: deque[str] = deque(maxlen=most)
        self._half, self._message = b"", ""
        self._newest, self._times = "", 0

    def hear(self, direction: str, data: bytes) -> None:
        """Take received bytes; others are ignored."""
        if direction != "<":
            return
        *lines, self._half = (self._half + data).split(b"\n")
        self._half = self._half[-LONGEST_BYTES:]
        for line in lines:
            if line[:2] != b"ok" and (text := printer_message(line)):
                self._append(text)

    def _append(self, text: str) -> None:
        """Append a message; a repeated one is counted instead."""
        again = text == self._newest and bool(self.last)
        self._newest, self._times = text, self._times + 1 if again else 1
        if again:
            self.last[-1] = f"{text} (x {self._times})"
        else:
            self.last.append(text)

    def add(self, text: str) -> None:
        """Add the stream's current message once, however long it stays."""
        if text and text != self._message:
            self._append(text)
        self._message = text


def printer_message(line: bytes) -> str:
    """The message in a line for the user; "" for reports and answers."""
    event = read_event(line)
    if event.kind is Kind.START:
        return "the printer has started"
    if event.kind is Kind.ACTION:
        return f"the printer asks: {event.text}"
    if unknown := event.unknown_command:
        return f"Unknown command: {unknown}"
    return event.text if event.kind in (Kind.ECHO, Kind.FAULT, Kind.LINE_ERROR, Kind.UNKNOWN) else ""
