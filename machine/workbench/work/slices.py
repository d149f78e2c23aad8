"""Slices: what lies on the bench sliced, written and dry-run, what is seen of it, and the same model in one piece, as tasks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import numpy as np

from machine.dryrun.dryrun import summary
from machine.dryrun.findings import Finding, KnownFindings, errors_of, known_findings
from machine.pipeline.choice import as_turned
from machine.pipeline.comparison import in_one_part, in_parts
from machine.pipeline.pipeline import build
from machine.pipeline.plate import on_one_plate
from machine.planning.fit import standing_at
from machine.program import Alternative
from machine.view.page import print_page, with_comparison
from machine.workbench.bench.bench import Bench, plan_of_bench
from machine.workbench.work.cutting import PLAN_NAME, cut_bench
from mdp.decomposition import Decomposition, Part
from mdp.kernels.workers import Tell
from mdp.mesh import Floats
from profiles.profile import Profile
from slicer.paths import Kind, Layer, SlicedPart
from slicer.slice import SlicingProgress

SEEN = (Kind.OUTER_WALL, Kind.OVERHANG, Kind.TOP_SKIN, Kind.BRIDGE, Kind.GAP, Kind.SUPPORT)
BEHIND = (*SEEN, Kind.INNER_WALL)  # on shallow slopes inner walls are free, too; drawn where all are few enough
MOST_PIECES = 60_000  # per part: with more, only every second layer is drawn, or every third, that many times as high


def walls(part: Part, sliced: SlicedPart, most: int = MOST_PIECES) -> bytes:
    """The straight pieces of its outer paths: 3 float32, the direction of printing, then 7 a piece: where it begins and ends, mm
    in the workpiece frame, in the middle of its height, and its height; all little-endian."""
    kinds = BEHIND if _count(sliced, BEHIND) < most else SEEN
    step = 1 + _count(sliced, kinds) // most
    own = [
        layer for layer in sliced.layers if layer.z_mm > 0.5 * layer.height_mm
    ]  # not the raft: the model stands on the plate there
    rows = [_pieces(layer, kinds, step) for layer in own[step - 1 :: step]]
    flat = np.concatenate([np.zeros((0, 7)), *rows])
    back = part.rotation
    for ends in (slice(0, 3), slice(3, 6)):
        flat[:, ends] = (flat[:, ends] + (0.0, 0.0, part.base.offset_mm)) @ back
    return np.asarray(part.direction, "<f4").tobytes() + flat.astype("<f4").tobytes()


def _count(sliced: SlicedPart, kinds: tuple[Kind, ...]) -> int:
    return sum(int((np.diff(layer.starts) - 1)[layer.is_of(*kinds)].sum()) for layer in sliced.layers)


def _pieces(layer: Layer, kinds: tuple[Kind, ...], step: int) -> Floats:
    """(n, 7) in the part frame: two ends and the height, which is that of `step` layers."""
    high = layer.height_mm * step
    points = layer.points_mm - (0.0, 0.0, high / 2.0)
    begins = np.repeat(layer.is_of(*kinds), np.diff(layer.starts))
    begins[layer.starts[1:] - 1] = False  # nothing leads from a stroke's last point to the next stroke
    at = np.flatnonzero(begins)
    return np.column_stack([points[at], points[at + 1], np.full(len(at), high)])


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
        return errors_of(self.findings)


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
