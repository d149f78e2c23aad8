"""Slices: what lies on the bench sliced, written and dry-run, as a task of the workbench."""

from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256

from machine.app.pipeline.pipeline import build
from machine.app.workbench.bench.bench import Bench, plan_of_bench
from machine.app.workbench.work.cutting import PLAN_NAME, cut_bench
from machine.app.workbench.work.worker import Tell
from machine.dryrun.dryrun import summary
from machine.view.page import print_page


@dataclass(frozen=True, eq=False)
class Sliced:
    """A sliced bench: the page of the print and its G-code, what it takes, and what its dry run complains of. errors: how many of
    the findings are errors, with which the command line writes no file without --force."""

    page: bytes
    gcode: bytes
    time_s: float
    filament_mm: float
    findings: tuple[str, ...]
    errors: int

    @cached_property
    def key(self) -> str:
        """What tells these slices from others."""
        return sha256(self.page + self.gcode).hexdigest()[:16]


def slice_bench(tell: Tell, bench: Bench) -> Sliced:
    """The parts on the bench sliced, planned, written and dry-run, as `export --plan` does; uncut, the model in one piece."""
    profile = bench.profile
    made = cut_bench(bench, plan_of_bench(bench, PLAN_NAME))
    program = build(made, profile, pictures=True, report=lambda text, share=None: tell(text))
    tell("drawing the page")
    found, values = program.run.findings, summary(program.run)
    return Sliced(
        print_page(made.name, program, profile),
        ("\n".join(program.lines) + "\n").encode(),
        values["time_s"],
        values["filament_mm"],
        tuple(f"{each.severity}: {each.message}" for each in found),
        sum(each.severity == "error" for each in found),
    )
