"""Process: one print from its checks to its end, by the code of `print`, commanded through a pipe by the workbench's server.

A print has a process of its own, not a thread of the server's: feeding a printer shares no lock and no event loop with pages,
however many there are and whatever they do; a server that hangs or crashes does not take the print with it; and the end of the
pipe tells for certain that nobody can command any more, whereupon the print ends as if it had been cancelled: heaters off, tip
lifted; one on a print server goes on there. It leads a session of its own, so that Ctrl-C at the terminal reaches the server
alone, which ends it in that same way.
"""

import sys
from threading import Thread

from machine.crash import bug_in_words
from machine.notices import FrontEnd, notices_to
from machine.printing.servers.address import is_server_address
from machine.workbench.printing.at_hand import by_hand
from machine.workbench.printing.at_page import AtPage
from machine.workbench.printing.at_port import go_on, print_at_port
from machine.workbench.printing.at_server import follow_on_server, print_on_server
from machine.workbench.printing.checks import Checks
from machine.workbench.printing.order import FollowOrder, HandOrder, Order, ResumeOrder, State, first_state
from machine.workbench.printing.reporter import StateReporter
from mdp.kernels.workers import listen, read_frames, take_pipes
from profiles.errors import UserError


def main() -> None:
    """Print what the server orders, once."""
    asked, answers = take_pipes()
    order: Order | None = next(read_frames(asked), None)
    if order is None:  # the server has died before it had said what to print
        return
    reporter = StateReporter(answers, first_state(order))
    person, checks = AtPage(reporter), Checks(reporter)
    Thread(target=listen, args=(asked, lambda words: person.hear(*words), person.leave), daemon=True).start()
    with notices_to(FrontEnd(checks.hear)):
        end = carry_out(order, person, checks)
    reporter.tell(phase="over", stop_given=person.has_stopped(), **end)
    reporter.close()


def carry_out(order: Order, person: AtPage, checks: Checks) -> State:
    """Check, ask, print; how it ended."""
    try:
        if isinstance(order, ResumeOrder):
            return go_on(order, person, checks)
        if isinstance(order, FollowOrder):
            return follow_on_server(order, person, checks)
        if isinstance(order, HandOrder):
            return by_hand(order, person, checks)
        if is_server_address(order.printing.port):
            return print_on_server(order, person, checks)
        return print_at_port(order, person, checks)
    except UserError as error:
        end = "failed" if person.agreed else "refused"
        return {"end": end, "sentence": str(error), "forcible": error.forcible}
    except KeyboardInterrupt:
        return {"end": "failed", "sentence": "ended at once: whether the heaters are off is not known, look at the printer"}
    except Exception as error:  # noqa: BLE001 - a bug becomes a sentence and a log file; the stream has left the printer safe
        return {"end": "failed", "sentence": bug_in_words(error, sys.argv)}
