"""Journal folder: journals of the newest prints, each with its program beside it."""

from collections.abc import Iterable
from dataclasses import dataclass
from os.path import isfile, lexists
from pathlib import Path
from time import time

from machine.gcode.lines import GcodeFile
from machine.link.journal import LONGEST_BYTES, Checkpoint, Journal, JournalHeading, is_being_printed, read_journal
from machine.pipeline.output import PROGRAM, program_beside, write_lines
from profiles.errors import JournalError, OutputError, reason
from profiles.files import dated_name, keep_newest, modified_s
from profiles.folders import state_folder
from profiles.profile import Profile

KEPT = 20
# a program younger than this may belong to a print that another process is starting: its journal is written later
BEGUN_S = 3600.0


def new_journal(
    lines: Iterable[str], profile: Profile, name: str, source: Path | None = None, file: Path | None = None
) -> Journal:
    """Begin the journal of a print. Raises OutputError, GcodeError. source: the G-code file that is printed; None: the lines are
    saved beside the journal. file: path of the journal, else a new one in the state folder, from which the oldest are deleted."""
    path = file if file is not None else _new_path(name)
    if source is None:
        source = program_beside(path)
        if file is not None:
            check_new_journal(file, source)
        write_lines(source, tuple(lines), private=True)
    return continue_journal(GcodeFile(source.resolve()), profile, name, path)


def check_new_journal(file: Path, program: Path | None = None) -> None:
    """Refuse to overwrite a journal or its program: they belong to another print, which may yet be resumed."""
    for there in (file, *([] if program is None else [program])):
        if lexists(there):
            raise OutputError(f"journal {file}: {there} exists already: each print has one of its own, choose another name")


def continue_journal(program: GcodeFile, profile: Profile, name: str, file: Path | None = None) -> Journal:
    """Begin another journal of a program that is already on disk."""
    heading = JournalHeading(str(program.path), program.sha256(), name, profile.model_dump(mode="json"))
    return Journal(file if file is not None else _new_path(name), heading)


@dataclass(frozen=True)
class ResumableJournal:
    """A journal of the state folder whose print did not finish.

    line: last line that the printer has certainly executed; written_s: time of the last record, seconds since 1970.
    """

    path: Path
    name: str
    machine: str
    line: int
    written_s: float


def resumable_journals() -> list[ResumableJournal]:
    """The resumable journals, newest first: readable, not being printed, not resumed yet and with their program."""
    return [journal for journal in map(_resumable, sorted(_journals(_folder()), reverse=True)) if journal is not None]


def _resumable(path: Path) -> ResumableJournal | None:
    try:
        story, written_s = read_journal(path), modified_s(path)
    except (JournalError, OSError):
        return None
    last, heading = story.last, story.heading
    if story.finished or last.continued_in is not None or last == Checkpoint() or not isfile(heading.program):
        return None
    if is_being_printed(path):
        return None
    machine = heading.profile.get("machine")
    name = machine.get("name", "") if isinstance(machine, dict) else ""
    return ResumableJournal(path, heading.name, str(name), last.executed, written_s)


def _folder() -> Path:
    return state_folder() / "journals"


def _journals(folder: Path) -> list[Path]:
    return [path for path in folder.glob("*.journal") if isfile(path)]


def _new_path(name: str) -> Path:
    """A new path named after the time and the model."""
    folder = _folder()
    try:
        folder.mkdir(0o700, exist_ok=True)
        _delete_oldest(folder)
    except OSError as error:
        raise OutputError(f"folder {folder} cannot be written: {reason(error)}") from None
    plain = "".join(c if c.isalnum() and c.isascii() else "-" for c in name)[:40].strip("-") or "print"
    return folder / f"{dated_name()}-{plain}.journal"


def _delete_oldest(folder: Path) -> None:
    """Make room for one more journal: delete all but the newest and those being printed. A program is deleted when no journal
    beside it still names it; a new program only with its journal."""
    journals = _journals(folder)
    before = b"".join(map(_first_line, journals))
    keep_newest(journals, KEPT - 1, _name, is_being_printed)
    after = b"".join(map(_first_line, _journals(folder)))  # read again: another process may have begun one
    for program in folder.glob(f"*{PROGRAM}"):
        name = program.name.encode()
        if name not in after and (name in before or not _is_new(program)):
            program.unlink(missing_ok=True)


def _name(journal: Path) -> str:
    return journal.name


def _is_new(program: Path) -> bool:
    try:
        return time() - modified_s(program) < BEGUN_S
    except FileNotFoundError:  # another process was faster
        return False


def _first_line(journal: Path) -> bytes:
    try:
        with journal.open("rb") as file:
            return file.readline(LONGEST_BYTES)
    except FileNotFoundError:
        return b""
