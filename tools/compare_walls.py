"""Walls beside PrusaSlicer's Arachne: `python tools/compare_walls.py MODEL ... [--layers N] [--set KEY=VALUE ...]`.

Every model stands as one part on the platform. Both slicers get 0.2 mm layers, lines of 0.45 mm, 3 walls, 4 + 4 solid layers, 20
% grid and the same speeds, no skirt, support, elephant's foot and bulge. Both G-code texts are read, timed and measured by the
same lines: in N layers (12 unless told) every move that extrudes is a strip as wide as ;WIDTH: says with round ends. Without
prusa-slicer ours stand alone. One row a model and slicer: what strips cover outside the true section, and what within 1.2 mm of
the outline none covers, both in percent of that band; estimated time; length of strips narrower than 0.25 mm; moves shorter than
0.1 mm; core seconds from mesh to G-code.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from time import process_time

import numpy as np
import shapely
from bench_slice import METER
from bench_travel import PRUSA, SAME, own_gcode
from check_layers import section_of

from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from machine.kinematics.table import part_shift
from mdp.mesh import Floats, Mesh
from mdp.model_file import locate
from mdp.pose import level
from mdp.read import read_mesh
from mdp.save import stl
from mdp.topology.cross_section import cross_sections
from profiles.profile import Profile, load
from slicer.estimate.timing import move_times

BARE = (
    *SAME,
    "process.elephant_foot_mm=0",
    "process.small_base_brim_mm=0",
    "process.outer_bulge=0",
    "process.least_layer_time_s=0",
)
THEIRS = (
    "--perimeter-generator arachne --elefant-foot-compensation 0 --center 100,100 --no-cooling --perimeter-speed 60 "
    "--external-perimeter-speed 40 --small-perimeter-speed 25 --infill-speed 80 --solid-infill-speed 60 "
    "--top-solid-infill-speed 40 --gap-fill-speed 30 --bridge-speed 30 --travel-speed 150 "
    "--first-layer-speed 20 --retract-speed 35 --gcode-resolution 0.0125 "
    "--default-acceleration 0 --perimeter-acceleration 0 --infill-acceleration 0 --bridge-acceleration 0 "
    "--first-layer-acceleration 0 --machine-limits-usage ignore"
)
BAND_MM, THIN_MM, SPECK_MM = 1.2, 0.25, 0.1
HEAD = ("model", "walls", "outside %", "unfilled %", "time min", "below 0.25 mm m", "specks", "core s")


@dataclass(frozen=True, eq=False)
class Print:
    """A G-code text read again, where it puts the origin of the mesh, and what it took to make."""

    program: ParsedProgram
    origin_mm: Floats
    core_s: float


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+")
    options.add_argument("--layers", type=int, default=12)
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    given = options.parse_args()
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    for model in given.models:
        mesh = read_mesh(locate(model))[0]
        profile = load(settings=[*BARE, *given.set])
        for walls, printed in (("ours", ours), ("Arachne", arachne))[: 2 if which("prusa-slicer") else 1]:
            cells = [Path(model).stem, walls, *figures(printed(mesh, profile), mesh, profile, given.layers)]
            print(f"| {' | '.join(cells)} |", flush=True)


def ours(mesh: Mesh, profile: Profile) -> Print:
    """Our text; compiled before it is timed."""
    own_gcode(mesh, profile)
    began = process_time()
    lines = own_gcode(mesh, profile)
    core_s = process_time() - began
    return Print(parse_gcode(lines, profile.machine), part_shift(profile.machine, level(profile.machine), 0.0)[:2], core_s)


def arachne(mesh: Mesh, profile: Profile) -> Print:
    """PrusaSlicer's text."""
    with tempfile.TemporaryDirectory() as folder:
        model, out = Path(folder) / "model.stl", Path(folder) / "model.gcode"
        model.write_bytes(stl(mesh))
        words = [sys.executable, "-I", "-c", METER, "prusa-slicer", *PRUSA.split(), *THEIRS.split(), "-o", out, model]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode or not out.exists():
            raise SystemExit(f"prusa-slicer failed: {(done.stderr or done.stdout).strip()[-300:]}")
        middle = 0.5 * mesh.bounds_mm[:, :2].sum(axis=0)
        program = parse_gcode(out.read_text(encoding="utf-8").splitlines(), profile.machine)
    return Print(program, 100.0 - middle, float(done.stdout.split()[-2]))


def figures(laid: Print, mesh: Mesh, profile: Profile, layers: int) -> Sequence[str]:
    """The cells of a row."""
    program, height = laid.program, profile.process.layer_height_mm
    own = [k for k, name in enumerate(program.types) if name not in ("Skirt/Brim", "Custom", "")]
    rows = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & np.isin(program.type, own) & (program.width_mm > 0))
    ends = np.stack([side[rows, :2] - laid.origin_mm for side in (program.start, program.end)], axis=1)
    number, width = np.round(program.end[rows, 2] / height).astype(int), program.width_mm[rows]
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    count = int(np.ceil(mesh.bounds_mm[1, 2] / height - 1e-6))
    outside = unfilled = band_mm2 = 0.0
    for k in np.unique(np.linspace(2, count - 1, layers).astype(int)):
        loops = cross_sections(mesh, np.array([(k - 0.5) * height]))[0]
        if not loops:
            continue
        section, here = section_of(loops), number == k
        plastic = shapely.union_all(shapely.buffer(shapely.linestrings(ends[here]), 0.5 * width[here]))
        band = section.difference(section.buffer(-BAND_MM))
        outside += plastic.difference(section).area
        unfilled += band.difference(plastic).area
        band_mm2 += band.area
    stop = np.zeros(len(program.line), dtype=np.bool_)
    acceleration = program.remarks.acceleration[program.remark]
    times = move_times(program.changes(), program.feed / 60.0, stop, profile.machine, acceleration)
    return (
        f"{100 * outside / band_mm2:.2f}",
        f"{100 * unfilled / band_mm2:.2f}",
        f"{times.sum() / 60:.1f}",
        f"{length[width < THIN_MM - 0.015].sum() / 1000:.2f}",
        f"{100 * (length < SPECK_MM).mean():.1f} %",
        f"{laid.core_s:.1f}",
    )


if __name__ == "__main__":
    main()
