"""Resume: go on with a print that was cut off by a power cut, a crash or a pulled plug, as its journal tells."""

import sys
from pathlib import Path

from machine.app.printer.resumption import print_rest, read_resumption
from machine.app.requests import PrintRequest
from machine.app.terminal.interrupts import interrupting
from machine.app.terminal.progress import say, say_lines
from profiles.errors import JournalError
from profiles.profile import Profile


def resume(journal: Path, printing: PrintRequest, named: Profile | None = None, yes: bool = False) -> int:
    """Tell where a print goes on, ask, and print the rest; 0 when it was printed, 1 when the answer was no.

    named: the profile whose machine the user has named. yes: go on without asking. The journal of the request is a new one.
    """
    cut_off = read_resumption(journal, printing, named)
    for sentence in cut_off.told():
        say(sentence)

    def agrees(question: str) -> bool:
        say_lines(question)
        return yes or _agreed()

    return print_rest(cut_off, printing, agrees)


def _agreed() -> bool:
    """Ask; raises JournalError where nobody can answer."""
    if not sys.stdin.isatty():
        raise JournalError("whether to go on is asked first: give --yes where there is no terminal to ask at")
    sys.stderr.write("go on? [y/N] ")
    sys.stderr.flush()
    with interrupting():
        return sys.stdin.readline().strip().lower() in ("y", "yes")
