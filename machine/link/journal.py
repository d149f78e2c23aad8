"""Journal: the progress of a print, on disk, from which another run can resume it.

A file of lines: eight hexadecimal digits of a CRC-32, a blank, a JSON value. The first, padded to whole blocks, holds the program
and the machine. SLOTS more of one block each hold states of the print; the one with the highest number is the newest.

The file has its full size, on the disk, before the print begins, and records are overwritten in place: a disk that fills up later
loses none. The slot changes with each fsync, so that the disk always holds a complete record.

A journal is trusted only if its newest record is the newest of its print. The first record that cannot be written or synced is
therefore final: the journal is marked as incomplete and is refused by readers. A computer that restarts loses what was not yet on
the disk; `computer_ran_on` shows whether that may have happened. The mark overwrites the first byte of the journal in place,
which needs no free block. A disk that can no longer be written (a stick that was removed, a read-only remount) cannot take that
mark, so the same is noted under the journal's key in other folders.

The file is locked while its print runs; the system releases the lock when the program dies.
"""

import json
import os
import sys
import threading
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from os.path import isdir, isfile, lexists, samestat
from pathlib import Path
from typing import IO, Any, Self
from uuid import uuid4
from zlib import crc32

from machine.link.print_state import PrintState
from profiles.errors import JournalError, OutputError, reason
from profiles.files import lock
from profiles.folders import state_folders

FORMAT = 3  # in 2 a full disk ended the journal without a trace, in 1 the newest record might lack a change of height
# States with another word in the file. CANCELLED: the print was ended for any reason, and the tip lifted off it.
WORDS = {PrintState.DONE: "finished", PrintState.CANCELLED: "left"}
STATES = {state.value: state for state in PrintState} | {word: state for state, word in WORDS.items()}
RESUMED = "resumed in "  # followed by the path of another journal, in place of a state
EVERY_LINES = 4  # the sender is fewer lines than this ahead of the newest record,
EVERY_S = 0.1  # which is at most this old if anything has happened since
SYNC_S = 1.0  # between syncs; after a restart of the computer the disk is older by this and the time of an fsync
BLOCK_BYTES = 4096  # a disk writes a block completely or damages only that block
SLOTS = 3  # one on its way to the disk, one being written, one safe
LONGEST_BYTES = 1_000_000  # longest heading, which holds the resolved profile
BEYOND_MM = 1e9  # and deg: beyond any machine's positions and any filament's length
PRIVATE = 0o600  # prints are private to the user
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")  # Linux only
MARK = b"!"
MEMORY = Path("/dev/shm")  # Linux's memory file system: writable when no disk is, and kept until the computer restarts
BINARY = getattr(os, "O_BINARY", 0)  # Windows would write carriage returns otherwise


@dataclass(frozen=True)
class JournalHeading:
    """The printed program."""

    program: str  # its file
    sha256: str
    name: str  # for users
    profile: dict[str, Any]  # the resolved profile as plain values


@dataclass(frozen=True)
class Checkpoint:
    """Progress of a print; lines of the program count from 1."""

    sent: int = 0
    acknowledged: int = 0
    executed: int = 0  # surely
    number: int = 0  # wire number of the newest acknowledged line
    # X Y Z tilt turn E after the acknowledged line, unwrapped, or of a tip that has left the print; None: unknown.
    pose: tuple[float | None, ...] = ()
    state: PrintState = PrintState.PRINTING
    z_offset_mm: float = 0.0  # offset set by the user, as sent to the firmware
    shifts_z: bool = True  # whether the firmware can change it
    continued_in: str | None = None  # the journal of the run that resumed the print


@dataclass(frozen=True)
class JournalContents:
    """The contents of a journal."""

    heading: JournalHeading
    last: Checkpoint  # the newest
    torn: int  # records damaged by a power cut of the computer
    records: int  # number of the newest one, from 1; 0 without records
    computer_ran_on: bool  # it has surely not restarted since the print began, so no record is lost

    @property
    def finished(self) -> bool:
        """Whether the print finished."""
        return self.last.state is PrintState.DONE


class Journal:
    """`with Journal(path, heading) as journal:` call update() regularly, write() for records that must not be lost.

    A record costs one write; a separate thread syncs the file, so that a slow disk never holds up the line. `trouble` is "" as
    long as every record was written and synced, then the reason; the print continues. Raises OutputError when the journal cannot
    be created.
    """

    def __init__(self, path: Path, heading: JournalHeading) -> None:
        self.path, self.trouble = path, ""
        self.last = Checkpoint()
        self._key, self._noted_s = uuid4().hex, 0.0
        self._records = self._slot = 0
        self._unsynced = self._marked = False  # marked: refused by readers as incomplete
        self._writing, self._syncing = threading.Lock(), threading.Lock()
        self._dirty, self._hurry, self._end = threading.Event(), threading.Event(), threading.Event()
        values = {"format": FORMAT, "key": self._key, "boot": boot_id()} | asdict(heading)
        self._heading = _record(values)
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | BINARY, PRIVATE)
        except FileExistsError:
            raise OutputError(f"journal {path} exists already: each print has one of its own, choose another name") from None
        except OSError as error:
            raise OutputError(f"journal {path} cannot be written: {reason(error)}") from None
        lock(self._file)  # before the heading: readers of that see the lock
        try:
            write_at(self._file, 0, self._heading + SLOTS * _slot(0, self.last))
            os.fsync(self._file)
        except OSError as error:
            os.close(self._file)
            with suppress(OSError):
                path.unlink()
            raise OutputError(f"journal {path} cannot be written: {reason(error)}") from None
        self._sync_thread = threading.Thread(target=self._sync, name="journal", daemon=True)
        self._sync_thread.start()

    @property
    def warning(self) -> str:
        """The trouble as a sentence for the user, "" for none."""
        return f"this print can no longer be resumed: {self.trouble}" if self.trouble else ""

    def update(self, checkpoint: Checkpoint, now_s: float) -> None:
        """Write a checkpoint if the newest record is old."""
        if now_s - self._noted_s >= EVERY_S and checkpoint != self.last:
            self._noted_s = now_s
            self.write(checkpoint)

    def record_due(self, line: int) -> bool:
        """Whether a record is due before this line is sent, so that the newest one is less than EVERY_LINES lines behind."""
        return line - self.last.sent >= EVERY_LINES

    def write(self, checkpoint: Checkpoint, hurry: bool = False) -> None:
        """Write a checkpoint at once; hurry: also to the disk, for a computer may lose its power with its printer."""
        self.last = checkpoint
        with self._writing:
            if self.trouble or self._end.is_set():
                return
            self._records += 1
            self._unsynced = True
            try:
                record = _slot(self._records, checkpoint)
                write_at(self._file, len(self._heading) + self._slot * BLOCK_BYTES, record)
            except OSError as error:
                self._fail(f"cannot be written: {reason(error)}")
        self._dirty.set()
        if hurry:
            self._hurry.set()

    def settle(self) -> str:
        """Sync everything to the disk now; returns the trouble, "" for none."""
        self._to_disk()
        return self.trouble

    def abandon(self) -> None:
        """Close and delete the journal of a print that has not begun; if it cannot be deleted, it is marked as incomplete."""
        self.close()
        try:
            self.path.unlink(missing_ok=True)
        except OSError:
            self._end_promise("was abandoned")
            self._distrust(None)

    def close(self) -> None:
        """Sync everything to the disk and close; afterwards `trouble` is final."""
        if self._end.is_set():
            return
        self._end.set()
        self._dirty.set()
        self._hurry.set()
        self._sync_thread.join()
        self._to_disk()
        try:
            os.close(self._file)
        except OSError as error:
            self._end_promise(f"cannot be written: {reason(error)}")
            self._distrust(None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _sync(self) -> None:
        """Call fsync once a second, or on demand, in a thread: an SD card may take longer than a printer waits."""
        while not self._end.is_set():
            self._dirty.wait(SYNC_S)
            self._dirty.clear()
            self._hurry.clear()
            self._to_disk()
            if not self._end.is_set():
                self._hurry.wait(SYNC_S)

    def _to_disk(self) -> None:
        with self._syncing:
            if not self.trouble:
                with self._writing:
                    unsynced, self._unsynced = self._unsynced, False
                    if unsynced:  # neither the slot being synced nor the newest one on disk is written to
                        self._slot = (self._slot + 1) % SLOTS
                if why := self._sync_trouble(unsynced):
                    with self._writing:
                        self._fail(why)
            if self.trouble and not self._marked:
                self._distrust(self._file)

    def _sync_trouble(self, unsynced: bool) -> str:
        try:
            if unsynced:
                os.fsync(self._file)
        except OSError as error:
            return f"cannot be written: {reason(error)}"
        return "" if is_at(self.path, self._file) else "was deleted, moved or replaced"

    def _fail(self, why: str) -> None:
        """Record the first failure, which is final: after a failed fsync Linux drops the data and reports success again."""
        if self.trouble:
            return
        self._end_promise(why)
        try:  # before another line is sent; the thread syncs it
            write_at(self._file, 0, MARK)
        except OSError:
            note_incomplete(self._key)
        self._dirty.set()
        self._hurry.set()

    def _end_promise(self, why: str) -> None:
        self.trouble = self.trouble or f"journal {self.path} {why}"

    def _distrust(self, descriptor: int | None) -> None:
        """Mark the journal; repeated each second, for a stick may come back."""
        noted = note_incomplete(self._key)
        self._marked = mark_incomplete(self.path, descriptor, self._heading)
        warning = "; that could not be noted anywhere: delete it, and never resume from it"
        if not self._marked and not noted and not self.trouble.endswith(warning):
            self.trouble += warning


def boot_id() -> str:
    """Identifier of the time since the computer's start; "" if the system has none."""
    with suppress(OSError, ValueError):
        return BOOT_ID.read_text(encoding="ascii").strip()
    return ""


def is_being_printed(path: Path) -> bool:
    """Whether the print of a journal runs now; False if unknown, as on a disk without locks."""
    try:
        with path.open("rb") as file:
            return not lock(file.fileno(), shared=True)
    except OSError:
        return False


def mark_resumed(path: Path, contents: JournalContents, rest: Path) -> None:
    """Note in a journal which one continues its print. contents: as it was read. Raises JournalError, also when the journal has
    changed since."""
    if read_journal(path) != contents:
        raise JournalError(f"journal {path} has changed since it was read: its print was resumed elsewhere")
    resumed = replace(contents.last, continued_in=f"{rest}")
    try:
        record = _slot(contents.records + 1, resumed)
        if len(record) > BLOCK_BYTES:
            raise JournalError(f"journal {path} cannot note a path as long as that of {rest}")
        with path.open("r+b", buffering=0) as file:
            heading, blocks = _blocks(file)
            numbers = [-1 if (value := _value(block)) is None else value[0] for block in blocks]
            oldest = numbers.index(min(numbers))
            write_at(file.fileno(), len(heading) + oldest * BLOCK_BYTES, record)
            os.fsync(file.fileno())
    except OSError as error:
        raise JournalError(f"journal {path} cannot be written: {reason(error)}") from None


def _record(value: Any) -> bytes:
    """A line of whole blocks, padded with blanks."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False).encode("ascii")
    text = text.ljust(-(-(len(text) + 10) // BLOCK_BYTES) * BLOCK_BYTES - 10)
    return b"%08x %s\n" % (crc32(text), text)


def _slot(number: int, checkpoint: Checkpoint) -> bytes:
    """The record of a checkpoint."""
    lines = [checkpoint.sent, checkpoint.acknowledged, checkpoint.executed, checkpoint.number]
    state, rest = checkpoint.state, checkpoint.continued_in
    word = WORDS.get(state, state) if rest is None else f"{RESUMED}{rest}"
    # Earlier versions know no Z offset, and refuse such a record.
    offset = (checkpoint.z_offset_mm,) if checkpoint.z_offset_mm or not checkpoint.shifts_z else ()
    return _record([number, *lines, checkpoint.pose, word, *offset, *(() if checkpoint.shifts_z else (0,))])


def read_journal(path: Path) -> JournalContents:
    """The contents of a journal. Raises JournalError with one sentence when it is invalid, damaged or marked as incomplete."""
    first, slots = _read(path)
    if first.startswith(MARK) and first[8:10] == b" {":
        raise _incomplete(path)
    values = _value(first)
    if values is None:
        raise JournalError(f"{path} is not the journal of a print: its first line is not a journal's heading")
    heading, key, boot = _heading(path, values)
    if is_noted_incomplete(key):
        raise _incomplete(path)
    read = [_checkpoint(path, value, number) for number, value in enumerate(map(_value, slots), 1) if value is not None]
    torn, ran_on = SLOTS - len(read), boot != "" and boot == boot_id()
    if not read or (torn and ran_on):  # only a power cut of the computer damages a record that it was writing
        raise JournalError(f"journal {path} is damaged: {torn} of its {SLOTS} records cannot be read")
    records, last = max(read, key=lambda record: record[0])
    return JournalContents(heading, last, torn, records, ran_on)


def _incomplete(path: Path) -> JournalError:
    return JournalError(
        f"journal {path} is incomplete: its print continued after the journal could no longer be written: how far it came is "
        "unknown, and it cannot be resumed"
    )


def _read(path: Path) -> tuple[bytes, list[bytes]]:
    """The heading, and the blocks of the records."""
    if lexists(path) and not isfile(path) and not isdir(path):  # reading a pipe would block
        raise JournalError(f"journal {path} cannot be read: it is not a file")
    try:
        with path.open("rb") as file:
            first, slots = _blocks(file)
    except OSError as error:
        raise JournalError(f"journal {path} cannot be read: {reason(error)}") from None
    if not first:
        raise JournalError(f"journal {path} is empty")
    return first, slots


def _blocks(file: IO[bytes]) -> tuple[bytes, list[bytes]]:
    return file.readline(LONGEST_BYTES), [file.read(BLOCK_BYTES) for _ in range(SLOTS)]


def _value(line: bytes) -> Any:
    text = line[9:-1]
    if not line.endswith(b"\n") or line[:9] != b"%08x " % crc32(text):
        return None
    try:
        return json.loads(text)
    except (ValueError, RecursionError):  # not written by this program, although the checksum is right
        return None


def _heading(path: Path, value: Any) -> tuple[JournalHeading, str, str]:
    """The heading, the journal's key, and its computer's boot ID."""
    if not isinstance(value, dict) or value.get("format") != FORMAT:
        raise JournalError(f"journal {path} is of another version of this program: this one reads format {FORMAT}")
    match value:
        case {"key": str(key), "boot": str(boot), "program": str(program), "sha256": str(sha256), "name": str(name),
              "profile": dict(profile)} if key.isascii() and key.isalnum():  # fmt: skip
            return JournalHeading(program, sha256, name, profile), key, boot
    raise JournalError(f"journal {path} is damaged: its heading lacks the program or the profile")


def _checkpoint(path: Path, value: Any, slot: int) -> tuple[int, Checkpoint]:
    """Number and content of a record."""
    match value:
        case [int(number), int(sent), int(acknowledged), int(executed), int(wire), list(pose), str(word), *offset] if _is_pose(
            pose
        ) and _is_offset(offset):
            z_offset_mm = offset[0] if offset else 0.0
            at = Checkpoint(sent, acknowledged, executed, wire, tuple(pose), z_offset_mm=z_offset_mm, shifts_z=len(offset) < 2)
            if word.startswith(RESUMED):
                return number, replace(at, continued_in=word.removeprefix(RESUMED))
            if word in STATES:
                return number, replace(at, state=STATES[word])
    raise JournalError(f"journal {path} is damaged: record {slot} holds no state of a print")


def _is_pose(values: list[Any]) -> bool:
    return all(value is None or (isinstance(value, int | float) and abs(value) < BEYOND_MM) for value in values)


def _is_offset(values: list[Any]) -> bool:
    """Whether the end of a record is a Z offset, one with a 0 because the firmware cannot change it, or absent."""
    return len(values) <= 2 and None not in values and _is_pose(values) and values[1:] in ([], [0])


def write_at(descriptor: int, offset: int, data: bytes) -> None:
    """Write all bytes at an offset of an open file. Raises OSError, also when only some were written."""
    os.lseek(descriptor, offset, os.SEEK_SET)
    if os.write(descriptor, data) < len(data):
        raise OSError("not all of it was written")


def mark_incomplete(path: Path, descriptor: int | None, heading: bytes) -> bool:
    """Mark an open journal, and a different file at its path with the same heading (a stick plugged in again, a copy). Returns
    whether the mark is on the disk, with no such file left unmarked."""
    marked = descriptor is not None and _mark(descriptor)
    if descriptor is not None and is_at(path, descriptor):
        return marked
    if not isfile(path):
        return marked
    with suppress(OSError):
        there = os.open(path, os.O_RDWR | BINARY)
        try:
            return _mark(there) if os.read(there, len(heading))[1:] == heading[1:] else marked
        finally:
            os.close(there)
    return False


def _mark(descriptor: int) -> bool:
    try:
        write_at(descriptor, 0, MARK)
        os.fsync(descriptor)
    except OSError:
        return False
    return True


def is_at(path: Path, descriptor: int) -> bool:
    """Whether a path still leads to an open file, which was not deleted, moved or replaced."""
    if sys.platform == "win32":  # an open file cannot be deleted, moved or replaced there
        return True
    try:
        return samestat(os.stat(path), os.fstat(descriptor))
    except OSError:
        return False


def note_incomplete(key: str) -> bool:
    """Note in every writable folder that the journal with this key is incomplete; returns whether there was one."""
    return sum(map(_note, _notes(key))) > 0


def _note(file: Path) -> bool:
    try:
        if file.parent != MEMORY:
            file.parent.mkdir(0o700, parents=True, exist_ok=True)
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | BINARY, 0o600)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        _sync_folder(file.parent)
    except OSError:
        return False
    return True


def _sync_folder(folder: Path) -> None:
    """Sync the names of files to the disk, if the system can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def is_noted_incomplete(key: str) -> bool:
    """Whether any folder notes that the journal with this key is incomplete."""
    return any(map(lexists, _notes(key)))


def _notes(key: str) -> list[Path]:
    return [folder / f"tiltprint-{key}.incomplete" for folder in (*state_folders(), MEMORY)]
