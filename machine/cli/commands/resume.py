"""Resume: go on with a print that was cut off by a power cut, a crash or a pulled plug, as its journal tells."""

from datetime import datetime
from pathlib import Path

from machine.cli.terminal.at_terminal import AtTerminal, exit_code
from machine.notices import plain_line, say, show
from machine.pipeline.requests import PrintRequest
from machine.printing.destination import parse_destination
from machine.printing.job import Does, PrintJob
from machine.printing.journal_folder import resumable_journals
from machine.printing.resumption import print_rest, read_resumption, rest_of
from machine.view.serving.watch_page import serve_watch_page
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
    destination = parse_destination(printing.port, printing.baud, printing.sim_speed)
    job = PrintJob(destination, Does.RESUME, profile=named, cut_off=journal, log=printing.log, journal=printing.journal)
    cut_off, person = read_resumption(job), AtTerminal(yes)
    for sentence in cut_off.sentences():
        say(sentence)
    if yes and not cut_off.story.computer_ran_on:
        raise JournalError(f"journal {journal}: a person must answer that question: resume at a terminal, without --yes")
    rest = rest_of(cut_off)
    with serve_watch_page(rest, printing.watch_port, person.commands, printing.browser) as watched:
        person.follow = watched.follow
        end = print_rest(cut_off, rest, job, person)
        watched.end(end.state)
    return exit_code(end)
