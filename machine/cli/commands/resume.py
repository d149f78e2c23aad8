"""Resume: go on with a print that was cut off by a power cut, a crash or a pulled plug, as its journal tells."""

import sys
from datetime import datetime
from pathlib import Path

from machine.cli.terminal.interrupts import interrupting
from machine.notices import plain_line, say, say_lines, show
from machine.pipeline.requests import PrintRequest
from machine.printing.journal_folder import resumable_journals
from machine.printing.resumption import print_rest, read_resumption
from profiles.errors import JournalError
from profiles.profile import Profile


def list_resumable() -> int:
    """The prints that can be gone on with, the newest first, on stdout; 0 also when there is none."""
    journals = resumable_journals()
    if not journals:
        say("no print of this computer was cut off or cancelled")
    for journal in journals:
        what = plain_line(f"{journal.name} on {journal.machine}, up to line {journal.line}")
        show(f"{plain_line(str(journal.path))}\n    {what}, {datetime.fromtimestamp(journal.written_s):%Y-%m-%d %H:%M}\n")
    return 0


def resume(journal: Path, printing: PrintRequest, named: Profile | None = None, yes: bool = False) -> int:
    """Tell where a print goes on, ask, and print the rest; 0 when it was printed, 1 when the answer was no.

    named: the profile whose machine the user has named. yes: go on without asking, unless the height of the tip is in doubt or
    the newest records may be missing. The journal of the request is a new one. Raises JournalError and other UserErrors.
    """
    cut_off = read_resumption(journal, printing, named)
    for sentence in cut_off.sentences():
        say(sentence)
    if yes and not cut_off.story.computer_ran_on:
        raise JournalError(f"journal {journal}: a person must answer that question: resume at a terminal, without --yes")

    def agrees(question: str) -> bool:
        say_lines(question)
        return yes or _agreed()

    def which(question: str, heights: tuple[float, ...]) -> float | None:
        say_lines(question)
        return _height(heights, yes)

    return print_rest(cut_off, printing, agrees, which)


def _agreed() -> bool:
    """Ask; raises JournalError where nobody can answer."""
    if not sys.stdin.isatty():
        raise JournalError("whether to go on is asked first: give --yes where there is no terminal to ask at")
    return _answer("go on? [y/N] ") in ("y", "yes")


def _height(heights: tuple[float, ...], yes: bool) -> float | None:
    """Ask for the number of one; None for any other answer. Raises JournalError where nobody can look."""
    listed = ", ".join(f"{number}: Z {z:.2f}" for number, z in enumerate(heights, 1))
    if yes or not sys.stdin.isatty():
        raise JournalError(f"a person must see at which height the tip stands ({listed}): resume at a terminal, without --yes")
    chosen = _answer(f"which? [{listed}; anything else: none] ")
    return heights[int(chosen) - 1] if chosen in [str(number) for number in range(1, len(heights) + 1)] else None


def _answer(prompt: str) -> str:
    sys.stderr.write(prompt)
    sys.stderr.flush()
    with interrupting():
        return sys.stdin.readline().strip().lower()
