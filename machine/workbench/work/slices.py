"""Slices: what lies on the bench sliced, written and dry-run, and the same model in one piece, as tasks of the workbench."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

from machine.dryrun.dryrun import summary
from machine.dryrun.findings import Finding, KnownFindings, known_findings
from machine.pipeline.comparison import in_one_part, in_parts
from machine.pipeline.given_plan import as_turned
from machine.pipeline.pipeline import build
from machine.pipeline.plate import on_one_plate
from machine.planning.fit import standing_at
from machine.program import Alternative
from machine.view.page import print_page, with_comparison
from machine.workbench.bench.bench import Bench, plan_of_bench
from machine.workbench.work.cutting import PLAN_NAME, cut_bench
from machine.workbench.work.walls import walls
from mdp.decomposition import Decomposition
from mdp.kernels.workers import Tell
from profiles.profile import Profile
from slicer.slice import SlicingProgress


@dataclass(frozen=True, eq=False)
class SlicesSoFar:
    """How far slicing is: a sentence, the share of each part that is sliced, 0 to 1, and what is seen of the parts that have
    become ready since the last word, by their numbers."""

    text: str
    shares: tuple[float, ...] = ()
    walls: Mapping[int, bytes] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Sliced:
    """A sliced bench: the files with the page of the print and its G-code, what tells these slices from others, what they take,
    what their dry run for a profile complains of, and what they cost."""

    page: Path
    gcode: Path
    key: str
    time_s: float
    filament_mm: float
    known: KnownFindings
    cost: Alternative

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the dry run complains of."""
        return self.known.findings

    @property
    def errors(self) -> tuple[Finding, ...]:
        """Those that are errors, with which the command line writes no file and prints nothing without --force."""
        return tuple(finding for finding in self.findings if finding.severity == "error")


def slice_bench(tell: Tell, bench: Bench, page: Path, gcode: Path) -> Sliced:
    """The parts on the bench sliced, planned, written to these files and dry-run, as `export --plan` does with its pauses and
    copies; uncut, the model in one piece."""
    decomposition, profile = _plated(bench)
    standing = standing_at(decomposition, profile.process.place_mm)
    shares: tuple[float, ...] = ()
    ready: set[int] = set()
    said = ""

    def follow(slicing: SlicingProgress) -> None:
        nonlocal shares
        fresh = {k + 1: piece for k, piece in enumerate(slicing.ready) if piece is not None and k + 1 not in ready}
        shares = tuple(
            1.0 if piece else min(0.99, done / max(of, 1))
            for piece, done, of in zip(slicing.ready, slicing.layers, slicing.expected, strict=True)
        )
        ready.update(fresh)
        if fresh:
            drawn = {number: walls(standing.parts[number - 1], piece) for number, piece in fresh.items()}
            tell(SlicesSoFar(said or "slicing", shares, drawn))

    def report(text: str, share: float | None = None) -> None:
        nonlocal said
        if text != said:
            said = text
            tell(SlicesSoFar(text, shares))

    program = build(decomposition, profile, pictures=True, stops=bench.stops, report=report, on_slices=follow)
    report("drawing the page")
    values = summary(program.run)
    contents = print_page(decomposition.name, program, profile), ("\n".join(program.lines) + "\n").encode()
    for file, content in zip((page, gcode), contents, strict=True):
        file.write_bytes(content)
    return Sliced(
        page,
        gcode,
        sha256(b"".join(contents)).hexdigest()[:16],
        values["time_s"],
        values["filament_mm"],
        known_findings(program.lines, profile, program.run.findings),
        in_parts(program, profile),
    )


def compare_bench(tell: Tell, bench: Bench) -> tuple[Alternative, ...]:
    """What the model on the bench costs in one piece, as it stands and laid down, as `export --compare` tells it."""
    decomposition, profile = _plated(bench)
    return in_one_part(decomposition, profile, lambda text, share=None: tell(text))


def share_page(tell: Tell, page: Path, alternatives: tuple[Alternative, ...], out: Path) -> None:
    """The page of slices with what else its model costs."""
    out.write_bytes(with_comparison(page.read_bytes(), alternatives))


def _plated(bench: Bench) -> tuple[Decomposition, Profile]:
    """The parts on the bench, in copies as `export --copies` has them, and what they are printed with."""
    cut = cut_bench(bench, plan_of_bench(bench, PLAN_NAME))
    return on_one_plate([cut] * bench.copies, as_turned(bench.profile, bench.turned))
