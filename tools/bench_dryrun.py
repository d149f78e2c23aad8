"""Time the dry run of a long program, stage by stage, with its peak memory.

    python tools/bench_dryrun.py [FILE.gcode] [--machine NAME] [--scale S] [--layer MM] [--keep FILE.gcode]

Without a file the program is made first: a demo model, scaled, solid and in fine layers, planned and written as `tiltprint
export` does; --keep saves it for the next time. Then the stages of the dry run, each with processor and wall seconds, and
what `dry_run` needs altogether in a process of its own, reading the file included.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time
from typing import TypeVar

import numpy as np

from machine.dryrun import clearance, dry_run, extrusion, heat, layering, motion, own_comments, placement, sequence
from machine.dryrun.replay import replay
from machine.dryrun.strokes import beads_of
from machine.gcode.lines import GcodeFile
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind
from machine.gcode.writer import write_gcode
from machine.pipeline.pipeline import decompose_model
from machine.pipeline.requests import ModelRequest
from machine.planning.plan import plan
from profiles.profile import Profile, load
from slicer.slice import slice_parts

T = TypeVar("T")


def main() -> None:
    """Read the options, make the program where none is given, print the tables."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("file", type=Path, nargs="?")
    options.add_argument("--machine", default="generic_ac")
    options.add_argument("--model", default="demo:figure")
    options.add_argument("--scale", default="2")
    options.add_argument("--layer", default="0.1")
    options.add_argument("--keep", type=Path)
    options.add_argument("--whole", action="store_true", help=argparse.SUPPRESS)
    given = options.parse_args()
    profile = load(machine=given.machine)
    if given.whole:
        whole(given.file, profile)
        return
    with tempfile.TemporaryDirectory() as folder:
        file = given.file or given.keep or Path(folder) / "long.gcode"
        if given.file is None:
            make(given.model, given.machine, given.scale, given.layer, file)
        stages(file, profile)
        command = [sys.executable, __file__, str(file), "--machine", given.machine, "--whole"]
        print(subprocess.run(command, check=True, capture_output=True, text=True).stdout, end="")


def make(model: str, machine: str, scale: str, layer: str, file: Path) -> None:
    """Write the long program."""
    fine = [f"process.scale={scale}", f"process.layer_height_mm={layer}", "process.infill_density=1"]
    profile = load(machine=machine, settings=fine)
    decomposition = decompose_model(ModelRequest(model, profile, orient=False)).decomposition
    sliced = slice_parts(decomposition.parts, profile)
    file.write_text("\n".join(write_gcode(plan(decomposition, sliced, profile), profile)) + "\n")


def stages(file: Path, profile: Profile) -> None:
    """Each stage by itself, warm: the kernels have run on a short program before."""
    machine = profile.machine
    lines = file.read_text().splitlines()
    dry_run(lines[:20000], profile)
    print(f"{file.name}: {len(lines)} lines on {machine.name}\n")
    print("| stage | processor s | wall s |\n|---|---|---|")
    program = timed("parse", lambda: parse_gcode(lines, machine))
    deposited = beads_of(program, np.flatnonzero(program.kind == MoveKind.EXTRUDE), profile)
    timed("kinematics", deposited.segments)
    timed("timeline", lambda: motion.times_s(program, machine))
    contacts = timed("plastic under every move", lambda: replay(program, deposited, profile))
    timed("head against table and cradle", lambda: clearance.findings(program, deposited, machine))
    timed(
        "other findings",
        lambda: [
            *placement.findings(program, deposited, contacts), *sequence.findings(program, profile),
            *layering.findings(program, deposited, contacts), *extrusion.findings(program, deposited, profile),
            *own_comments.findings(lines, program, profile), *motion.findings(program, machine),
            *placement.off_plate(program, deposited, profile), *heat.findings(program, profile, True),
        ],
    )  # fmt: skip


def timed(name: str, stage: Callable[[], T]) -> T:
    """Run a stage and print its row."""
    cpu, wall = process_time(), perf_counter()
    result = stage()
    print(f"| {name} | {process_time() - cpu:.1f} | {perf_counter() - wall:.1f} |", flush=True)
    return result


def whole(file: Path, profile: Profile) -> None:
    """One dry run as a user's: seconds and peak memory of the process."""
    cpu, wall = process_time(), perf_counter()
    run = dry_run(GcodeFile(file).lines(), profile)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    errors = len(run.errors)
    summary = f"{len(run.program.line)} moves, {run.time_s / 3600:.1f} h, {errors} errors"
    print(f"\nwhole: {process_time() - cpu:.1f} s processor, {perf_counter() - wall:.1f} s wall, peak {peak:.2f} GB ({summary})")


if __name__ == "__main__":
    main()
