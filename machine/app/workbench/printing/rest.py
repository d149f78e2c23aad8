"""Rest: what is left of a print that was cut off, with what `resume` tells and asks."""

from machine.app.pipeline import compilers
from machine.app.printer.resumption import NOTHING, STOPPED, print_rest, read_resumption
from machine.app.terminal.options import machine_profile
from machine.app.workbench.printing import checks as ends
from machine.app.workbench.printing.at_page import AtPage
from machine.app.workbench.printing.checks import Checks
from machine.app.workbench.printing.order import ResumeOrder, State
from profiles.errors import JournalError


def go_on(order: ResumeOrder, person: AtPage, checks: Checks) -> State:
    """Tell, ask the printer, ask the person, print the rest; how it ended. Raises UserError."""
    named = machine_profile(order.machine) if order.machine else None
    cut_off = read_resumption(order.journal, order.printing, named)
    checks.reporter.tell(name=cut_off.name, machine=cut_off.profile.machine.name)
    for sentence in cut_off.told():
        checks.add(sentence)
    compilers.wait_for(compilers.DRY_RUN)

    def agrees(question: str) -> bool:
        checks.reporter.tell(phase="ready", question=question)
        return person.agrees()

    def which(question: str, heights: tuple[float, ...]) -> float | None:
        del heights
        raise JournalError(f"{question}; which one is asked at a terminal only: tiltprint resume {order.journal}")

    ended = print_rest(cut_off, order.printing, agrees, which, person)
    nothing = {"end": "left", "sentence": "nothing was moved or heated", "journal": ""}
    return {NOTHING: nothing, STOPPED: ends.STOPPED}.get(ended, ends.DONE)
