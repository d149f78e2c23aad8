"""One print, stage by stage: `python tools/bench/stages.py MODEL ... [--machine NAME]`.

Reading, one evaluation of all candidates of the search (`gains` and `sweep` of every direction), the search (without a change of
orientation), slicing, planning, writing G-code, parsing it and the dry run each run in this process: core and wall seconds with
loaded kernels. `--gcode FILE` measures parsing and the parts of the dry run for an existing program.
"""

import argparse
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np

from machine.dryrun import clearance, dry_run, layering
from machine.dryrun.replay import replay
from machine.dryrun.strokes import beads_of
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind
from machine.gcode.writer import write_gcode
from machine.pipeline.choice import pricing
from machine.planning.plan import plan
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.overhang import risky_upright, threshold
from mdp.ranking.candidates import bounds_of, directions, plate_disc
from mdp.search.search import SearchRequest, decompose
from mdp.sweep.sweep import Remainder, gains, sweep
from profiles.profile import Profile, load
from slicer.slice import slice_parts
from tools.bench.harness import Result, heading, options_of, row, run, timed
from tools.checks.harness import mesh_of


def bench(given: argparse.Namespace) -> None:
    """Print a table per model or program."""
    profile = load(machine=given.machine, settings=given.set)
    quick = load(machine=given.machine, settings=["process.layer_height_mm=0.3", "process.scale=0.5"])
    with redirect_stdout(StringIO()):
        check_in_stages(print_in_stages("demo:bracket", quick), quick)  # loads the kernels
    for source in given.gcode or given.models:
        print(f"\n{source}")
        heading("stage", "core s", "wall s", "memory so far MB")
        lines = source.read_text().splitlines() if given.gcode else print_in_stages(source, profile)
        check_in_stages(lines, profile)


def stage(name: str, work: Callable[[], Result]) -> Result:
    """Run a stage and print its row."""
    result, used = timed(work)
    row(name, used.core_s, used.wall_s, round(used.memory_mb))
    return result


def print_in_stages(model: str, profile: Profile) -> list[str]:
    """Print a model in stages; returns its G-code."""
    mesh = stage("read", lambda: mesh_of(locate(model), profile))
    stage("evaluate all candidates", lambda: evaluate(mesh, profile))
    request = SearchRequest(price=pricing(profile))
    decomposition = stage("search", lambda: decompose(mesh, model, profile, request))
    sliced = stage("slice", lambda: slice_parts(decomposition.parts, profile))
    program = stage("plan moves", lambda: plan(decomposition, sliced, profile))
    return list(stage("write G-code", lambda: write_gcode(program, profile)))


def evaluate(mesh: Mesh, profile: Profile) -> None:
    """Evaluate every plane of every direction once, as at the beginning of a search."""
    limits = bounds_of(directions(profile.search), mesh, profile, plate_disc(mesh, profile.search))
    angle_deg, step_mm = profile.process.self_supporting_angle_deg, profile.search.offset_step_mm
    remainder = Remainder(mesh, risky_upright(mesh, angle_deg, profile.search.count_platform_faces))
    gains(remainder, limits.directions, step_mm, threshold(angle_deg))
    sweep(remainder, limits.directions, step_mm, limits.least_height_mm)


def check_in_stages(lines: list[str], profile: Profile) -> None:
    """Parse a program, run the most expensive checks of the dry run one by one, then the whole dry run."""
    program = stage("parse G-code", lambda: parse_gcode(lines, profile.machine))
    deposited = beads_of(program, np.flatnonzero(program.kind == MoveKind.EXTRUDE), profile)
    contacts = stage("dry run: plastic under every move", lambda: replay(program, deposited, profile))
    stage("dry run: head against table and cradle", lambda: clearance.findings(program, deposited, profile.machine))
    stage("dry run: layers", lambda: layering.findings(program, deposited, contacts))
    whole = stage("dry run, whole", lambda: dry_run(lines, profile))
    print(f"\n{len(lines)} lines, {len(program.line)} moves, {whole.time_s / 3600:.1f} h, {len(whole.errors)} errors")


if __name__ == "__main__":
    parser = options_of(__doc__)
    parser.add_argument("--machine", default="generic_ac")
    parser.add_argument("--gcode", nargs="+", type=Path, default=[], metavar="FILE")
    run(parser, bench)
