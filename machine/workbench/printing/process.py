"""Process of one print from its checks to its end, with the code of `print`, controlled by the workbench's server through a pipe.

A print has its own process, not a thread of the server: feeding a printer shares no lock and no event loop with pages; a server
that hangs or crashes does not end the print with it; and the end of the pipe reliably shows that no one can control the print,
which is then cancelled: heaters off, tip raised (one on a print server continues). It leads its own session, so that Ctrl-C
at the terminal only reaches the server, which cancels it in the same way.
"""

import sys
from threading import Thread
from typing import Any

from machine.crash import bug_in_words
from machine.dryrun.dryrun import summary
from machine.link.print_state import PrintState
from machine.notices import FrontEnd, notices_to
from machine.pipeline import compilers
from machine.pipeline.programs import LoadedProgram
from machine.printing.destination import Server
from machine.printing.job import NOT_BEGUN, Does, End, PrintJob
from machine.printing.printers import check_print, open_printer, open_server_printer
from machine.printing.resumption import print_rest, read_resumption, rest_of
from machine.printing.server_print import ServerPrinter, file_name, running_print
from machine.quantities import amount, duration, filament_g, price_in_words
from machine.workbench.printing.at_hand import by_hand
from machine.workbench.printing.at_page import AtPage, StateReporter, first_state
from mdp.kernels.workers import listen, read_frames, redirect_stdio
from profiles.errors import ServerError, UserError

MOST_FINDINGS = 50  # in the list; the page of the print has all


def main() -> None:
    """Execute one job from the server."""
    asked, answers = redirect_stdio()
    job: PrintJob | None = next(read_frames(asked), None)
    if job is None:  # the server died before it sent a job
        return
    reporter = StateReporter(answers, first_state(job))
    person = AtPage(reporter, job.cut_off)
    Thread(target=listen, args=(asked, lambda words: person.hear(*words), person.leave), daemon=True).start()
    with notices_to(FrontEnd(person.hear_notice, person.progress)):
        end, forcible = carry_out(job, person)
    reporter.tell(state=end.state, sentence=end.sentence, forcible=forcible, stop_given=person.has_stopped())
    reporter.close()


def carry_out(job: PrintJob, person: AtPage) -> tuple[End, bool]:
    """Check, ask and print; returns how it ended, and whether force overrides the refusal."""
    try:
        return _carried_out(job, person), False
    except UserError as error:
        return End(PrintState.FAILED if person.agreed else PrintState.REFUSED, f"{error}"), error.forcible
    except KeyboardInterrupt:
        sentence = "ended at once: whether the heaters are off is not known, look at the printer"
    except Exception as error:  # noqa: BLE001 - a bug becomes a sentence and a log file; the stream has made the printer safe
        sentence = bug_in_words(error, sys.argv)
    return End(PrintState.FAILED, sentence), False


def _carried_out(job: PrintJob, person: AtPage) -> End:
    if job.does is Does.RESUME:
        return _print_rest(job, person)
    if job.does is Does.HAND:
        return by_hand(job, person)
    if job.does is Does.FOLLOW:
        return _follow(job, person)
    with open_printer(job, person) as printer:
        loaded = check_print(job, printer, lambda loaded: person.tell(figures=figures(loaded)))
        if isinstance(printer, ServerPrinter):
            person.tell(webcam=_webcam(printer))
        if person.ask("") is None:
            return NOT_BEGUN
        return printer.print(loaded)


def _print_rest(job: PrintJob, person: AtPage) -> End:
    """Report what was interrupted, query the printer, ask the user, and print the rest."""
    cut_off = read_resumption(job)
    person.tell(name=cut_off.name, machine=cut_off.profile.machine.name)
    for sentence in cut_off.sentences():
        person.passed(sentence)
    compilers.wait_for(compilers.DRY_RUN)
    end = print_rest(cut_off, rest_of(cut_off), job, person)
    if end.state is PrintState.DECLINED:
        person.tell(journal="")
    return end


def _follow(job: PrintJob, person: AtPage) -> End:
    assert isinstance(job.destination, Server)
    with open_server_printer(job, job.destination, person) as printer:
        printer.greet()
        now = running_print(printer.server)
        person.agreed = True  # it may now be stopped
        person.tell(name=file_name(now), webcam=_webcam(printer))
        return printer.follow(now)


def _webcam(printer: ServerPrinter) -> str:
    """URL of the camera's picture, or "": a print must not fail without a camera."""
    try:
        return printer.server.webcam()
    except ServerError:
        return ""


def figures(loaded: LoadedProgram) -> dict[str, Any]:
    """A program's figures in words, and its findings."""
    program, material = loaded.program, loaded.profile.material
    values, findings, errors = summary(program.run), program.run.findings, len(program.run.errors)
    mm = values["filament_mm"]
    weight = ", ".join(filter(None, (f"{amount(filament_g(mm, material), 1)} g", price_in_words(mm, material))))
    text = f"{len(program.lines)} lines, {duration(values['time_s'])}, {amount(mm / 1000.0)} m ({weight}) of filament"
    if errors:
        text += f", {errors} error{'s' * (errors > 1)} in the dry run"
    return {"text": text, "findings": [f"{finding.severity}: {finding.message}" for finding in findings[:MOST_FINDINGS]]}
