"""Checks: what is found before a print, told as it is found."""

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from machine.dryrun.dryrun import dry_run, summary
from machine.notices import Notice
from machine.pipeline import compilers
from machine.program import Program
from machine.quantities import filament_g, price_in_words
from machine.workbench.printing.order import PrintOrder, State
from machine.workbench.printing.reporter import StateReporter
from profiles.errors import PlanError
from profiles.material import Material

LINES_KEPT = 100  # of what the program says
MOST_FINDINGS = 50  # in the list; the page of the print has all
CLEAN = "the dry run of these very lines finds no error: every move is inside the limits and clear of the head"
DONE: State = {"end": "done", "sentence": "the print is done"}
STOPPED: State = {"end": "stopped", "sentence": "the print was stopped"}
LEFT: State = {"end": "left", "sentence": "nothing was printed"}


@dataclass(frozen=True)
class Check:
    """What has been found; forced: what speaks against the print, which --force goes past."""

    text: str
    forced: bool = False


class Checks:
    """What has been found in order, and the last lines that the program has said, both told as they come."""

    def __init__(self, reporter: StateReporter) -> None:
        self.reporter = reporter
        self._done: tuple[Check, ...] = ()
        self._lines: deque[str] = deque(maxlen=LINES_KEPT)

    def hear(self, notice: Notice) -> None:
        """What the program says; what --force goes past is a check."""
        if notice.forced:
            self.add(notice.text.rstrip(), forced=True)
        self._lines.extend(line for line in notice.text.split("\n") if line.strip())
        self.reporter.tell(said=tuple(self._lines))

    @contextmanager
    def that(self, text: str) -> Iterator[None]:
        """A check that raises where it is not passed. text: what it has shown, unless --force goes past it."""
        before = self._done
        yield
        if self._done == before:
            self.add(text)

    def add(self, text: str, *, forced: bool = False) -> None:
        """What is so."""
        self._done = (*self._done, Check(text, forced))
        self.reporter.tell(checks=tuple(map(asdict, self._done)))


def program_of(order: PrintOrder) -> Program:
    """The order's very lines, dry-run; what the dry run of the very same has found for the very same profile is not looked for
    again. Raises PlanError where they are not there any more."""
    try:
        text = order.gcode.read_bytes().decode()
    except FileNotFoundError:
        raise PlanError("these slices are not there any more: slice what is to be printed again") from None
    compilers.wait_for(compilers.DRY_RUN)
    lines = tuple(text.removesuffix("\n").split("\n"))
    findings = None if order.known is None else order.known.of(lines, order.profile)
    return Program(lines, dry_run(lines, order.profile, findings), None)


def figures(program: Program, material: Material) -> dict[str, Any]:
    """What a person is told of a program that prints with a material."""
    values, findings = summary(program.run), program.run.findings
    return {
        "time_s": values["time_s"],
        "filament_mm": values["filament_mm"],
        "filament_g": filament_g(values["filament_mm"], material),
        "costs": price_in_words(values["filament_mm"], material),
        "lines": len(program.lines),
        "findings": [f"{finding.severity}: {finding.message}" for finding in findings[:MOST_FINDINGS]],
        "errors": len(program.run.errors),
    }
