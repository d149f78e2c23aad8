"""Slicing compared with PrusaSlicer: `python tools/bench/slicing.py MODEL ... [--height 60] [--support] [--layers 12]`.

The model is a single part. Both programs get the same layers, line widths, walls, infill and speeds; PrusaSlicer prints with
Arachne walls. One reader measures both G-code texts. Columns: core seconds (tiltprint: mesh to G-code, warm; PrusaSlicer: the
whole command); minutes by one time estimate; filament; retractions; metres of travel, of outer and of inner walls; for some
layers the area of beads outside the true section and the area without a bead within 1.2 mm of the outline, both in percent of
that band; metres of beads narrower than 0.25 mm.
"""

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from machine.gcode.writer import write_gcode
from machine.kinematics.table import part_shift
from machine.planning.plan import plan
from mdp.mesh import Floats, Mesh
from mdp.pose import level
from mdp.save import stl
from mdp.topology.cross_section import cross_sections
from profiles.profile import Profile, load
from slicer.estimate.timing import move_times
from slicer.paths import Kind
from slicer.slice import slice_parts
from tools.bench import harness
from tools.bench.harness import heading, options_of, row
from tools.checks.harness import section_of, undivided

SPEEDS = (
    "--perimeter-generator arachne --center 100,100 --perimeter-speed 60 --external-perimeter-speed 40 --infill-speed 80 "
    "--small-perimeter-speed 25 --solid-infill-speed 60 --top-solid-infill-speed 40 --gap-fill-speed 30 --bridge-speed 30 "
    "--travel-speed 150 --first-layer-speed 20 --retract-speed 35 --gcode-resolution 0.0125 --default-acceleration 0 "
    "--perimeter-acceleration 0 --infill-acceleration 0 --bridge-acceleration 0 --first-layer-acceleration 0 "
    "--machine-limits-usage ignore"
)
BAND_MM, THIN_MM = 1.2, 0.25
COLUMNS = (
    "model", "slicer", "core s", "min", "filament m", "retractions", "travel m", "outer m", "inner m", "outside %", "unfilled %",
    "thin m",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Print:
    """A parsed G-code text, the position of the mesh's origin in it, and the core seconds to make it."""

    program: ParsedProgram
    origin_mm: Floats
    core_s: float


def bench(given: argparse.Namespace) -> None:
    """Print one row per model and slicer."""
    profile = load(settings=[*harness.SAME, *([harness.OUR_SUPPORT] if given.support else []), *given.set])
    heading(*COLUMNS)
    for model in given.models:
        mesh = harness.standing(model, given.height)
        row(Path(model).name, "ours", *figures(ours(mesh, profile, given.runs), mesh, profile, given.layers))
        if (laid := theirs(mesh, profile, given.support, given.runs)) is not None:
            row(Path(model).name, "PrusaSlicer", *figures(laid, mesh, profile, given.layers))


def ours(mesh: Mesh, profile: Profile, runs: int) -> Print:
    """tiltprint's program."""

    def made() -> list[str]:
        whole = undivided("bench", mesh, profile)
        return list(write_gcode(plan(whole, slice_parts(whole.parts, profile), profile), profile))

    used = harness.least(made, runs)
    origin = part_shift(profile.machine, level(profile.machine), 0.0)[:2]
    return Print(parse_gcode(made(), profile.machine), origin, used.core_s)


def theirs(mesh: Mesh, profile: Profile, support: bool, runs: int) -> Print | None:
    """PrusaSlicer's program for the same mesh; None if it is not installed."""
    with tempfile.TemporaryDirectory() as folder:
        model, out = Path(folder) / "model.stl", Path(folder) / "model.gcode"
        model.write_bytes(stl(mesh))
        words = harness.prusa_command(model, out, support, SPEEDS)
        if words is None:
            return None
        (used,) = harness.in_turns([words], runs)
        program = parse_gcode(out.read_text(encoding="utf-8").splitlines(), profile.machine)
    return Print(program, 100.0 - 0.5 * mesh.bounds_mm[:, :2].sum(axis=0), used.core_s)


def figures(laid: Print, mesh: Mesh, profile: Profile, layers: int) -> Sequence[object]:
    """The cells after the slicer's name."""
    program = laid.program
    length_mm = np.hypot(*(program.end - program.start)[:, :2].T)
    extrudes = program.kind == MoveKind.EXTRUDE
    pulls = program.e_mm < 0.0
    retractions = int((pulls & ~np.concatenate([[False], pulls[:-1]])).sum())
    walls = (extrudes & program.rows_of_types(kind.value) for kind in (Kind.OUTER_WALL, Kind.INNER_WALL))
    thin = extrudes & (program.width_mm > 0.0) & (program.width_mm < THIN_MM - 0.015)
    *metres, thin_m = (length_mm[rows].sum() / 1000.0 for rows in (~extrudes & (program.e_mm == 0.0), *walls, thin))
    shares = band_shares(laid, mesh, profile.process.layer_height_mm, layers)
    return (laid.core_s, *minutes_and_metres(program, profile), retractions, *metres, *shares, thin_m)


def minutes_and_metres(program: ParsedProgram, profile: Profile) -> tuple[float, float]:
    """Printing time and filament of a program by one estimate for all slicers."""
    acceleration = program.remarks.acceleration[program.remark]
    stops = np.zeros(len(program.line), dtype=np.bool_)
    times_s = move_times(program.changes(), program.feed / 60.0, stops, profile.machine, acceleration)
    return float(times_s.sum()) / 60.0, float(program.e_mm.sum()) / 1000.0


def band_shares(laid: Print, mesh: Mesh, height_mm: float, layers: int) -> tuple[float, float]:
    """Percent of the band along the outlines: area of beads outside the section, and area in the band without a bead."""
    program = laid.program
    own = [k for k, name in enumerate(program.types) if name not in ("Skirt/Brim", "Custom", "") and "Support" not in name]
    rows = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & np.isin(program.type, own) & (program.width_mm > 0))
    ends = np.stack([side[rows, :2] - laid.origin_mm for side in (program.start, program.end)], axis=1)
    number, width = np.round(program.end[rows, 2] / height_mm).astype(int), program.width_mm[rows]
    count = int(np.ceil(mesh.bounds_mm[1, 2] / height_mm - 1e-6))
    outside = unfilled = band_mm2 = 0.0
    for k in np.unique(np.linspace(2, count - 1, layers).astype(int)):
        loops = cross_sections(mesh, np.array([(k - 0.5) * height_mm]))[0]
        if not loops:
            continue
        section, here = section_of(loops), number == k
        plastic = shapely.union_all(shapely.buffer(shapely.linestrings(ends[here]), 0.5 * width[here]))
        band = section.difference(section.buffer(-BAND_MM))
        outside += plastic.difference(section).area
        unfilled += band.difference(plastic).area
        band_mm2 += band.area
    return 100.0 * outside / max(band_mm2, 1e-9), 100.0 * unfilled / max(band_mm2, 1e-9)


if __name__ == "__main__":
    parser = options_of(__doc__)
    parser.add_argument("--support", action="store_true", help="each slicer with its own support")
    parser.add_argument("--layers", type=int, default=12, help="layers whose beads are laid over the section")
    harness.run(parser, bench)
