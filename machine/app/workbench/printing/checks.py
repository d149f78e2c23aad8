"""Checks: what is found before a print, told as it is found."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from machine.app.pipeline import compilers
from machine.app.workbench.printing.order import PrintOrder, State
from machine.app.workbench.printing.reporter import Said, StateReporter
from machine.dryrun.dryrun import dry_run, summary
from machine.program import Program
from profiles.errors import PlanError

MOST_FINDINGS = 50  # in the list; the page of the print has all
CLEAN = "the dry run of these very lines finds no error: every move is inside the limits and clear of the head"
DONE: State = {"end": "done", "sentence": "the print is done"}
STOPPED: State = {"end": "stopped", "sentence": "the print was stopped"}
LEFT: State = {"end": "left", "sentence": "nothing was printed"}


class Checks:
    """What has been found in order, told as it is found; where --force goes past something, the words for that stand instead."""

    def __init__(self, teller: StateReporter, said: Said) -> None:
        self.teller = teller
        self._said = said
        self._passed: tuple[str, ...] = ()

    @contextmanager
    def that(self, text: str) -> Iterator[None]:
        """A check that raises where it is not passed. text: what it has shown."""
        before = self._said.count
        yield
        self.add("; ".join(self._said.since(before)) or text)

    def add(self, text: str) -> None:
        """What is so, whatever speaks for or against it."""
        self._passed = (*self._passed, text)
        self.teller.tell(checks=self._passed)


def program_of(order: PrintOrder) -> Program:
    """The order's very lines, dry-run; what the dry run of the very same has found for the very same profile is not looked for
    again. Raises PlanError where they are not there any more."""
    try:
        text = order.gcode.read_bytes().decode()
    except FileNotFoundError:
        raise PlanError("these slices are not there any more: slice what is to be printed again") from None
    compilers.wait_for(compilers.DRY_RUN)
    lines = tuple(text.removesuffix("\n").split("\n"))
    found = None if order.known is None else order.known.of(lines, order.profile)
    return Program(lines, dry_run(lines, order.profile, found), None)


def figures(program: Program) -> dict[str, Any]:
    """What a person is told of a program."""
    values, found = summary(program.run), program.run.findings
    return {
        "time_s": values["time_s"],
        "filament_mm": values["filament_mm"],
        "lines": len(program.lines),
        "findings": [f"{each.severity}: {each.message}" for each in found[:MOST_FINDINGS]],
        "errors": len(program.run.errors),
    }
