"""Slices: tasks that slice, write and dry-run the bench, and compare it with the same model in one piece."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import numpy as np

from machine.dryrun.dryrun import summary
from machine.dryrun.findings import Finding, KnownFindings, errors_of, known_findings
from machine.pipeline.comparison import in_one_part, in_parts
from machine.pipeline.pipeline import build
from machine.pipeline.programs import load_program
from machine.pipeline.requests import ModelRequest
from machine.planning.fit import standing_at
from machine.program import Alternative
from machine.view.page import print_page, with_comparison
from machine.workbench.bench.bench import Bench
from machine.workbench.work.plate import plated
from mdp.decomposition import Part
from mdp.kernels.workers import Tell
from mdp.mesh import Floats
from profiles.errors import GcodeError
from slicer.paths import Kind, Layer, SlicedPart
from slicer.slice import SlicingProgress

SEEN = (Kind.OUTER_WALL, Kind.OVERHANG, Kind.TOP_SKIN, Kind.BRIDGE, Kind.GAP, Kind.SUPPORT)
BEHIND = (*SEEN, Kind.INNER_WALL)  # visible on shallow slopes; drawn if there are few enough
MOST_PIECES = 60_000  # per part; beyond it only every nth layer is drawn, n times as high


def walls(part: Part, sliced: SlicedPart, most: int = MOST_PIECES) -> bytes:
    """The straight pieces of a part's outer paths, float32, little-endian: the printing direction (3), then 7 per piece: start
    and end at mid-height, mm in the workpiece frame, and its height."""
    kinds = BEHIND if _count(sliced, BEHIND) < most else SEEN
    step = 1 + _count(sliced, kinds) // most
    own = [
        layer for layer in sliced.layers if layer.z_mm > 0.5 * layer.height_mm
    ]  # without the raft, because the model is drawn on the plate
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
    begins[layer.starts[1:] - 1] = False  # a stroke's last point is not connected to the next stroke
    at = np.flatnonzero(begins)
    return np.column_stack([points[at], points[at + 1], np.full(len(at), high)])


@dataclass(frozen=True, eq=False)
class SlicesSoFar:
    """Progress of slicing: a sentence, the sliced share of each part, 0 to 1, and the visible walls of parts that have been
    finished since the last report, by number."""

    text: str
    shares: tuple[float, ...] = ()
    walls: Mapping[int, bytes] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Sliced:
    """A sliced bench: files of the print's page and of the G-code, a key that identifies the slices, time, filament, findings of
    the dry run for a profile, and costs."""

    page: Path
    gcode: Path
    key: str
    time_s: float
    filament_mm: float
    known: KnownFindings
    cost: Alternative

    @property
    def findings(self) -> tuple[Finding, ...]:
        return self.known.findings

    @property
    def errors(self) -> tuple[Finding, ...]:
        """Findings of severity error, because of which the command line refuses to write or print without --force."""
        return errors_of(self.findings)


def slice_bench(tell: Tell, bench: Bench, page: Path, gcode: Path) -> Sliced:
    """Slice the bench, write page and G-code to these files and dry-run them, as `export --plan` does with pauses and copies; an
    uncut model in one piece."""
    decomposition, profile = plated(bench)
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


def open_gcode(tell: Tell, request: ModelRequest, page: Path, gcode: Path) -> Sliced:
    """Dry-run a G-code file as `view` and `print` do, and write these files. The machine is the file's own or else that of the
    request. Raises GcodeError."""
    loaded = load_program(request)
    program, profile = loaded.program, loaded.profile
    if not len(program.run.program.line):
        raise GcodeError(f"{request.name} holds no move: there is nothing to show")
    drawn = print_page(request.name, program, profile)  # tried for the workbench's machine, if the file names none
    content = ("\n".join(program.lines) + "\n").encode("utf-8", "replace")
    page.write_bytes(drawn)
    gcode.write_bytes(content)
    values, note = summary(program.run), "" if loaded.machine_known else "the file does not name its machine"
    return Sliced(
        page,
        gcode,
        sha256(drawn + content).hexdigest()[:16],  # the page, too: a file may be opened again for another machine
        values["time_s"],
        values["filament_mm"],
        known_findings(program.lines, profile, program.run.findings),
        Alternative(request.name, "", 1, message=note),
    )


def compare_bench(tell: Tell, bench: Bench) -> tuple[Alternative, ...]:
    """Costs of the models on the plate in one piece, as they stand and in their best orientations, as in `export --compare`."""
    decomposition, profile = plated(bench)
    return in_one_part(decomposition, profile, lambda text, share=None: tell(text))


def share_page(tell: Tell, page: Path, alternatives: tuple[Alternative, ...], out: Path) -> None:
    """Write the page of slices with the costs of alternatives."""
    out.write_bytes(with_comparison(page.read_bytes(), alternatives))
