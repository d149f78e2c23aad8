"""Process: one print from its checks to its end, by the code of `print`, commanded through a pipe by the workbench's server.

A print has a process of its own, not a thread of the server's: feeding a printer shares no lock and no event loop with pages,
however many there are and whatever they do; a server that hangs or crashes does not take the print with it; and the end of the
pipe tells for certain that nobody can command any more, whereupon the print ends as if it had been cancelled: heaters off, tip
lifted. It leads a session of its own, so that Ctrl-C at the terminal reaches the server alone, which ends it in that same way.
"""

import os
import pickle
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from threading import Thread
from typing import Any, BinaryIO

from machine.app.crash import log_bug
from machine.app.pipeline import compilers
from machine.app.printer.compatibility import check_machine, check_port, describe_answer
from machine.app.printer.ready import ready_program
from machine.app.printer.stream import PrintJob, print_program
from machine.app.requests import FORCE_GOES_ON, SIMULATED
from machine.app.workbench.printing.at_page import AtPage
from machine.app.workbench.printing.order import PrintOrder, State, first_state
from machine.app.workbench.printing.teller import Said, Teller
from machine.app.workbench.work.worker import LENGTH
from machine.dryrun.dryrun import dry_run, summary
from machine.dryrun.starvation import check_baud
from machine.link.identification import Answer
from machine.view.program import Program
from profiles.errors import UserError

MOST_FINDINGS = 50  # in the list; the page of the print has all


def main() -> None:
    """Print what the server orders, once."""
    asked, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    with open(os.devnull, "r+b") as nowhere:  # what libraries print must not reach the pipe
        os.dup2(nowhere.fileno(), 0)
        os.dup2(nowhere.fileno(), 1)
    order: PrintOrder = _read(asked)
    teller = Teller(answers, first_state(order))
    person = AtPage(teller)
    Thread(target=_listen, args=(asked, person), daemon=True).start()
    said = Said(teller)
    with redirect_stdout(said), redirect_stderr(said):
        end = carry_out(order, person, Checks(teller, said))
    teller.tell(phase="over", **end)
    teller.close()


class Checks:
    """What has been found in order, told as it is found; where --force goes past something, the words for that stand instead."""

    def __init__(self, teller: Teller, said: Said) -> None:
        self.teller = teller
        self._said = said
        self._passed: tuple[str, ...] = ()

    @contextmanager
    def that(self, text: str) -> Iterator[None]:
        """A check that raises where it is not passed. text: what it has shown."""
        before = self._said.count
        yield
        self._passed = (*self._passed, "; ".join(self._said.since(before)) or text)
        self.teller.tell(checks=self._passed)


def carry_out(order: PrintOrder, person: AtPage, checks: Checks) -> State:
    """Check, ask, print; how it ended."""
    begun = False
    try:
        job = _checked(order, checks)
        checks.teller.tell(phase="ready")
        if not person.agrees():
            return {"end": "left", "sentence": "nothing was printed"}
        begun = True
        stopped = print_program(job, order.printing, attendance=person)
    except UserError as error:
        return {"end": "failed" if begun else "refused", "sentence": str(error), "forcible": FORCE_GOES_ON in str(error)}
    except KeyboardInterrupt:
        return {"end": "failed", "sentence": "ended at once: whether the heaters are off is not known, look at the printer"}
    except Exception as error:  # noqa: BLE001 - a bug becomes a sentence and a log file; the stream has left the printer safe
        log = log_bug(error, sys.argv)
        return {"end": "failed", "sentence": f"a bug in tiltprint: {type(error).__name__}: {error}; the details are in {log}"}
    return (
        {"end": "stopped", "sentence": "the print was stopped"} if stopped else {"end": "done", "sentence": "the print is done"}
    )


def _checked(order: PrintOrder, checks: Checks) -> PrintJob:
    """The job, when nothing speaks against it: what `print` asks before anything moves, in the same order."""
    printing, profile, tell = order.printing, order.profile, checks.teller.tell
    check_baud(printing.baud)
    answer = check_port(printing.port, printing.baud, printing.sim_speed)
    with checks.that(_answers(answer, order)):
        check_machine(answer, profile.machine, order.force)
    compilers.wait_for(compilers.DRY_RUN)
    lines = tuple(order.gcode.decode().removesuffix("\n").split("\n"))
    program = Program(lines, dry_run(lines, profile), None)
    tell(figures=_figures(program))
    with checks.that("the dry run of these very lines finds no error: every move is inside the limits and clear of the head"):
        program = ready_program(answer, program, profile, order.name, printing, order.force)
    tell(figures=_figures(program))  # with what the line's rate adds
    return PrintJob(order.name, program, profile)


def _answers(answer: Answer | None, order: PrintOrder) -> str:
    printing = order.printing
    if answer is None:
        assert printing.port == SIMULATED
        speed = f"{printing.sim_speed:g} times as fast as a real one" if printing.sim_speed else "as fast as it can"
        return f"a simulated {order.profile.machine.name}, {speed}"
    return f"{describe_answer(answer, printing.baud)}, answers at {printing.port} and is one for {order.profile.machine.name}"


def _figures(program: Program) -> dict[str, Any]:
    values, found = summary(program.run), program.run.findings
    return {
        "time_s": values["time_s"],
        "filament_mm": values["filament_mm"],
        "lines": len(program.lines),
        "findings": [f"{each.severity}: {each.message}" for each in found[:MOST_FINDINGS]],
        "errors": len(program.run.errors),
    }


def _read(asked: BinaryIO) -> Any:
    """The next value of the pipe. Raises EOFError when there is none."""
    head = asked.read(LENGTH.size)
    if len(head) < LENGTH.size:
        raise EOFError
    return pickle.loads(asked.read(*LENGTH.unpack(head)))


def _listen(asked: BinaryIO, person: AtPage) -> None:
    """In a thread: what the server says; when it is gone, the print is left."""
    with suppress(EOFError, OSError):
        while True:
            person.hear(*_read(asked))
    person.leave()


if __name__ == "__main__":
    main()
