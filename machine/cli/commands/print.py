"""The print, send, follow and resume commands."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from functools import partial
from pathlib import Path
from time import monotonic

from machine.cli.terminal.at_terminal import AtTerminal, exit_code
from machine.cli.terminal.report import print_table, table
from machine.cli.terminal.requests import PrintOptions, ResumeOptions, WatchOptions
from machine.link.print_state import PrintState
from machine.notices import plain_line, say, show
from machine.pipeline.output import check_model_files, check_writable, printing_files, program_beside
from machine.pipeline.programs import LoadedProgram, load_program
from machine.pipeline.requests import ModelRequest
from machine.printing.destination import Destination, Server, parse_destination, parse_server_address
from machine.printing.job import Does, PrintJob
from machine.printing.journal_folder import check_new_journal, resumable_journals
from machine.printing.printers import check_print, open_printer, open_server_printer
from machine.printing.resumption import print_rest, read_resumption, rest_of
from machine.printing.server_print import file_name, running_print
from machine.quantities import duration
from machine.view.serving.watch_page import Watched, serve_watch_page
from profiles.errors import GcodeError, JournalError, ServerError
from profiles.profile import Profile


def print_model(request: ModelRequest, port: str, asked: PrintOptions) -> int:
    """Dry-run, then print a model or a G-code file; the printer is identified first. Returns 130 if the user ended or left the
    print."""
    began_s = monotonic()
    destination, journal = parse_destination(port, asked.baud, asked.speed), asked.journal
    if isinstance(destination, Server) and journal is not None:
        raise ServerError(f"--journal {journal}: {port} prints from a file of its own, which needs no journal here")
    job, person = _job(request, destination, asked.log, journal), AtTerminal()
    with open_printer(job, person) as printer:
        loaded = check_print(job, printer)
        show(print_table(loaded.program, loaded.profile))
        ready_s = monotonic()
        with _watched(loaded, asked.watching, person) as watched:
            end = printer.print(loaded)
            watched.end(end.state)
    if end.state is PrintState.DONE:
        prepared_s, printed_s = ready_s - began_s, monotonic() - ready_s
        total = duration(prepared_s + printed_s)
        show(f"done in {total}: {duration(prepared_s)} before the print, {duration(printed_s)} of printing\n")
    return exit_code(end)


def send(request: ModelRequest, address: str, *, start: bool, log: Path | None) -> int:
    """Send a G-code file to a print server. start: start printing at once."""
    if not request.is_gcode:
        raise GcodeError(f"{request.name} is not a G-code file: export makes one of a model, print --port {address} prints it")
    server, person = parse_server_address(address), AtTerminal()
    job = _job(request, server, log, starts=start)
    with open_server_printer(job, server, person) as printer:
        loaded = check_print(job, printer)
        show(print_table(loaded.program, loaded.profile))
        return exit_code(printer.send(loaded))


def follow(address: str, log: Path | None = None) -> int:
    """Show and control the print of a print server; returns 130 if the user ended or left it. Raises ServerError."""
    server, person = parse_server_address(address), AtTerminal()
    if log is not None:
        check_writable(log)
    with open_server_printer(PrintJob(server, Does.FOLLOW, log=log), server, person) as printer:
        printer.greet()
        now = running_print(printer.server)
        say(f"it is {now.state} {file_name(now)}")
        return exit_code(printer.follow(now))


def list_resumable() -> int:
    """List the prints that can be resumed on stdout, newest first; 0 even if there are none."""
    journals = resumable_journals()
    if not journals:
        say("there is no interrupted or cancelled print on this computer")
        return 0
    rows = [["print", "machine", "up to line", "interrupted"]]
    for journal in journals:
        when = f"{datetime.fromtimestamp(journal.written_s):%Y-%m-%d %H:%M}"
        rows.append([plain_line(journal.name), plain_line(journal.machine), str(journal.line), when])
    paths = ["journal", *(plain_line(str(journal.path)) for journal in journals)]
    show("".join(f"{line}  {path}\n" for line, path in zip(table(rows).splitlines(), paths, strict=True)))
    return 0


def resume(journal: Path, port: str, asked: ResumeOptions, named: Profile | None = None) -> int:
    """Show where a print continues, ask, and print the rest; returns 0 after printing, 1 if the answer was no.

    named: profile of the machine that the user named. asked.yes: do not ask, unless the height of the tip is in doubt or the
    newest records may be missing. Raises JournalError and other UserErrors.
    """
    destination = parse_destination(port, asked.baud)
    job = PrintJob(destination, Does.RESUME, profile=named, cut_off=journal, log=asked.log, journal=asked.further)
    cut_off, person = read_resumption(job), AtTerminal(asked.yes)
    for sentence in cut_off.sentences():
        say(sentence)
    if asked.yes and not cut_off.story.computer_ran_on:
        raise JournalError(f"journal {journal}: you must answer that question: resume at a terminal, without --yes")
    rest = rest_of(cut_off)
    with _watched(rest, asked.watching, person) as watched:
        end = print_rest(cut_off, rest, job, person)
        watched.end(end.state)
    return exit_code(end)


@contextmanager
def _watched(loaded: LoadedProgram, watching: WatchOptions, person: AtTerminal) -> Iterator[Watched]:
    """Serve the page that follows and controls the print, if requested."""
    with serve_watch_page(loaded, watching.port, person.commands, not watching.no_browser) as watched:
        person.follow = watched.follow
        yield watched


def _job(
    request: ModelRequest, destination: Destination, log: Path | None, journal: Path | None = None, starts: bool = True
) -> PrintJob:
    """The job. Raises UserError if its files cannot be written, or would overwrite an input or another print's journal."""
    for file in (log, journal):
        if file is not None:
            check_writable(file)
    check_model_files(request, printing_files(log, journal))
    if journal is not None:
        check_new_journal(journal, None if request.is_gcode else program_beside(journal))
    load: partial[LoadedProgram] = partial(load_program, request)
    profile = None if request.is_gcode else request.profile  # a G-code file names its machine
    return PrintJob(destination, Does.PRINT, request.name, load, profile, starts, request.force, log=log, journal=journal)
