"""Journal: how far a print has come, on disk, so that another run can go on where this one was cut off.

A file of lines: eight hexadecimal digits of a CRC-32, a blank, a JSON value. The first holds what is printed and for which
machine, every other one a state of its own, so that the last good one is enough. Lines are only ever appended, each in one piece.
The file is locked as long as its print runs; the system lets go of it when the program dies, however it does.
"""

import errno
import json
import os
import sys
import threading
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from os.path import isdir, isfile, lexists
from pathlib import Path
from typing import Any, Self
from zlib import crc32

from profiles.errors import JournalError, OutputError, reason

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]
if sys.platform == "win32":
    import msvcrt

FORMAT = 2  # in 1 the height or the table might have changed after the line that was recorded last
PAUSED, FINISHED, LEFT, RESUMED = "paused", "finished", "left", "resumed in "  # left: the print was ended, the tip lifted
EVERY_LINES = 16  # the sender never gets so many lines ahead of the newest record,
EVERY_S = 0.1  # which is not older than this when something has happened since
SYNC_S = 1.0  # so old may the disk be after a power cut of the computer
LONGEST_BYTES = 1_000_000  # of one record; the first one holds the resolved profile
BEYOND_MM = 1e9  # and deg: no machine has such a place, and no filament such a length
LOCKED_BYTE = 1 << 30  # on Windows, where nobody else can read what is locked: far behind the end, which LockFileEx allows
PRIVATE = 0o600  # what a person prints concerns nobody else
# Windows would write carriage returns into a file that is not opened as binary.
_FLAGS = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)


@dataclass(frozen=True)
class JournalHeading:
    """What is printed: the program's file with its SHA-256, the name for people, and the resolved profile as plain values."""

    program: str
    sha256: str
    name: str
    profile: dict[str, Any]


@dataclass(frozen=True)
class Checkpoint:
    """Lines of the program, from 1: sent, acknowledged, surely executed; the newest acknowledged wire number; the pose X Y Z tilt
    turn E after the acknowledged line (of a tip that was taken away from the print, where it stands), unwrapped, None where it is
    not known; what the print was doing.
    """

    sent: int = 0
    acknowledged: int = 0
    executed: int = 0
    number: int = 0
    pose: tuple[float | None, ...] = ()
    state: str = "printing"


@dataclass(frozen=True)
class JournalContents:
    """A journal that was read: its heading, its last checkpoint, how many records a torn end has cost, and where that begins."""

    heading: JournalHeading
    last: Checkpoint
    torn: int
    whole_bytes: int

    @property
    def finished(self) -> bool:
        """Whether the print ran to its end."""
        return self.last.state == FINISHED

    @property
    def continued_in(self) -> str | None:
        """The journal of the run that went on with this print."""
        before, resumed, name = self.last.state.partition(RESUMED)
        return name if resumed and not before else None


class Journal:
    """`with Journal(path, heading) as journal:` update() as often as wished, write() what must not be lost.

    Writing costs one system call a record; a thread of its own brings the file to the disk, so that a slow disk never holds up
    the line. A journal that can no longer be written ends silently, `trouble` says why. Raises OutputError when it cannot be
    begun.
    """

    def __init__(self, path: Path, heading: JournalHeading) -> None:
        self.path, self.trouble = path, ""
        self.last = Checkpoint()
        self._noted_s = 0.0
        self._dirty, self._hurry, self._end = threading.Event(), threading.Event(), threading.Event()
        try:
            self._file = os.open(path, _FLAGS, PRIVATE)
        except FileExistsError:
            raise OutputError(f"journal {path} exists already: each print has one of its own, choose another name") from None
        except OSError as error:
            raise OutputError(f"journal {path} cannot be written: {reason(error)}") from None
        lock(self._file)  # before the heading: whoever can read that sees the lock
        self._write({"format": FORMAT} | asdict(heading))
        self._sync_thread = threading.Thread(target=self._sync, name="journal", daemon=True)
        self._sync_thread.start()

    def update(self, checkpoint: Checkpoint, now_s: float) -> None:
        """Write a checkpoint when the newest record is old."""
        if now_s - self._noted_s >= EVERY_S and checkpoint != self.last:
            self._noted_s = now_s
            self.write(checkpoint)

    def record_due(self, line: int, lines: int = EVERY_LINES) -> bool:
        """Whether a record is due before this line is sent, so that the newest one is less than so many lines behind."""
        return line - self.last.sent >= lines

    def write(self, checkpoint: Checkpoint, hurry: bool = False) -> None:
        """Write a checkpoint at once; hurry: to the disk, too, for a computer may lose its power with its printer."""
        self.last = checkpoint
        self._write(_as_list(checkpoint))
        if hurry:
            self._hurry.set()

    def close(self) -> None:
        """Bring everything to the disk and end."""
        if not self._end.is_set():
            self._end.set()
            self._dirty.set()
            self._hurry.set()
            self._sync_thread.join()
            self._to_disk()
            os.close(self._file)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _write(self, value: Any) -> None:
        if self.trouble or self._end.is_set():
            return
        record = _record(value)
        try:
            if os.write(self._file, record) < len(record):
                self.trouble = "the disk is full"
        except OSError as error:
            self.trouble = reason(error)
        self._dirty.set()

    def _sync(self) -> None:
        """fsync once a second, or in a hurry, in a thread: an SD card may take longer over it than a printer waits."""
        while not self._end.is_set():
            self._dirty.wait()
            self._dirty.clear()
            self._hurry.clear()
            self._to_disk()
            self._hurry.wait(SYNC_S)

    def _to_disk(self) -> None:
        try:
            os.fsync(self._file)
        except OSError as error:
            self.trouble = self.trouble or reason(error)


def is_being_printed(path: Path) -> bool:
    """Whether the print of a journal that was read runs now; False where that cannot be known, as on a disk without locks."""
    try:
        with path.open("rb") as file:
            return not lock(file.fileno(), shared=True)
    except OSError:
        return False


def lock(descriptor: int, shared: bool = False) -> bool:
    """Lock an open file until it is closed; False when another process holds it. shared: with others who only look."""
    try:
        if sys.platform == "win32":
            os.lseek(descriptor, LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        elif fcntl is not None:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in (errno.EAGAIN, errno.EACCES)
    return True


def mark_resumed(path: Path, contents: JournalContents, rest: Path) -> None:
    """Note in a journal which one goes on with its print; a torn end is cut off. Raises JournalError."""
    try:
        with path.open("r+b") as file:
            file.truncate(contents.whole_bytes)
            file.seek(0, os.SEEK_END)
            file.write(_record(_as_list(replace(contents.last, state=f"{RESUMED}{rest}"))))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise JournalError(f"journal {path} cannot be written: {reason(error)}") from None


def _record(value: Any) -> bytes:
    text = json.dumps(value, separators=(",", ":"), allow_nan=False).encode("ascii")
    return b"%08x %s\n" % (crc32(text), text)


def _as_list(checkpoint: Checkpoint) -> list[Any]:
    return [checkpoint.sent, checkpoint.acknowledged, checkpoint.executed, checkpoint.number, checkpoint.pose, checkpoint.state]


def read_journal(path: Path) -> JournalContents:
    """The contents of a journal. Raises JournalError with one sentence when it is none, or damaged before its end."""
    heading: JournalHeading | None = None
    last, bad, whole_bytes = Checkpoint(), 0, 0
    for number, (value, size) in enumerate(_records(path), 1):
        whole_bytes += size if value is not None else 0
        if value is None:
            bad += 1
        elif bad:
            raise JournalError(f"journal {path} is damaged: record {number - bad} of it cannot be read although later ones can")
        elif heading is None:
            heading = _heading(path, value)
        else:
            last = _checkpoint(path, value, number)
        if heading is None:
            raise JournalError(f"{path} is no journal of a print: its first line is not the heading of one")
    if heading is None:
        raise JournalError(f"journal {path} is empty")
    return JournalContents(heading, last, bad, whole_bytes)


def _records(path: Path) -> Iterator[tuple[Any, int]]:
    """The value and size of each line, None where its checksum is wrong, its end is missing or it is no JSON."""
    if lexists(path) and not isfile(path) and not isdir(path):  # a pipe would be waited for
        raise JournalError(f"journal {path} cannot be read: it is no file")
    try:
        with path.open("rb") as file:
            while line := file.readline(LONGEST_BYTES):
                yield _value(line), len(line)
    except OSError as error:
        raise JournalError(f"journal {path} cannot be read: {reason(error)}") from None


def _value(line: bytes) -> Any:
    text = line[9:-1]
    if not line.endswith(b"\n") or line[:9] != b"%08x " % crc32(text):
        return None
    try:
        return json.loads(text)
    except (ValueError, RecursionError):  # not written by this program: its checksum is right
        return None


def _heading(path: Path, value: Any) -> JournalHeading:
    if not isinstance(value, dict) or value.get("format") != FORMAT:
        raise JournalError(f"journal {path} is of another version of this program: this one reads format {FORMAT}")
    match value:
        case {"program": str(program), "sha256": str(sha256), "name": str(name), "profile": dict(profile)}:
            return JournalHeading(program, sha256, name, profile)
    raise JournalError(f"journal {path} is damaged: its heading does not tell program and profile")


def _checkpoint(path: Path, value: Any, number: int) -> Checkpoint:
    match value:
        case [int(sent), int(acknowledged), int(executed), int(wire), list(pose), str(state)] if _is_pose(pose):
            return Checkpoint(sent, acknowledged, executed, wire, tuple(pose), state)
    raise JournalError(f"journal {path} is damaged: record {number} holds no state of a print")


def _is_pose(values: list[Any]) -> bool:
    return all(value is None or (isinstance(value, int | float) and abs(value) < BEYOND_MM) for value in values)
