"""Measures the whole command: `python tools/bench_export.py MODEL ... [--height MM] [--support] [--set KEY=VALUE]`.

`tiltprint export MODEL --parts 1` from a fresh process to the written file, its own dry run included, beside PrusaSlicer's whole
command on the same mesh with the same settings (those of tools/bench_travel.py). Kernels are compiled before. The commands run
three times in turn; the least core seconds and the least wall seconds count. MODEL `box` is a cuboid of 20 x 20 x 10 mm: what
is left is the start.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import manifold3d as m3
import numpy as np
from bench_slice import METER, SNUG, TREE
from bench_travel import PRUSA, SAME, standing

from mdp.cut import mesh_of
from mdp.mesh import Mesh
from mdp.save import stl

RUNS = 3
OURS = [sys.executable, "-c", "import sys; from machine.cli.start import main; sys.exit(main())"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print one row per model."""
    parser = argparse.ArgumentParser(description="export in core seconds, beside PrusaSlicer")
    parser.add_argument("models", nargs="+")
    parser.add_argument("--height", type=float, default=60.0, help="models are scaled to it; 0: as they are")
    parser.add_argument("--support", action="store_true", help="with each slicer's own support")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--rival", default="prusa-slicer", help="PrusaSlicer's command")
    options = parser.parse_args(arguments)
    settings = [*SAME, *([TREE] if options.support else []), *options.set]
    ours = [*OURS, "export", "--parts", "1", "--as-is", *(word for setting in settings for word in ("--set", setting)), "-o"]
    theirs = [options.rival, *PRUSA.split(), *(SNUG if options.support else ("--no-overhangs",)), "-o"]
    print("| model | ours, core s | wall s | lines | PrusaSlicer, core s | wall s | lines | ratio | wall ratio |")
    print("|---|---|---|---|---|---|---|---|---|")
    for model in options.models:
        print(row(model, _mesh(model, options.height), ours, theirs), flush=True)


def _mesh(model: str, height_mm: float) -> Mesh:
    return mesh_of(m3.Manifold.cube((20.0, 20.0, 10.0))) if model == "box" else standing(model, height_mm)


def row(name: str, mesh: Mesh, ours: Sequence[str], theirs: Sequence[str]) -> str:
    """Both commands on a mesh, in turn."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.stl"
        file.write_bytes(stl(mesh))
        outs = Path(folder) / "ours.gcode", Path(folder) / "theirs.gcode"
        seconds(ours, outs[0], file)  # compiles what is not compiled yet
        runs = np.array(
            [[seconds(command, out, file) for command, out in zip((ours, theirs), outs, strict=True)] for _ in range(RUNS)]
        )
        (ours_s, ours_wall_s), (theirs_s, theirs_wall_s) = runs.min(axis=0)
        lines = [len(out.read_bytes().splitlines()) for out in outs]
    return (
        f"| {name} | {ours_s:.2f} | {ours_wall_s:.2f} | {lines[0]} | {theirs_s:.2f} | {theirs_wall_s:.2f} | {lines[1]} "
        f"| {ours_s / theirs_s:.2f} | {ours_wall_s / theirs_wall_s:.2f} |"
    )


def seconds(command: Sequence[str], out: Path, model: Path) -> tuple[float, float]:
    """Seconds of the cores, user and system, and by the clock of a command that writes a file."""
    words, begun = [sys.executable, "-I", "-c", METER, *command, str(out), str(model)], perf_counter()
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode or not out.exists():
        raise SystemExit(f"{command[0]} failed: {(done.stderr or done.stdout).strip()[-300:]}")
    return float(done.stdout.split()[-2]), perf_counter() - begun


if __name__ == "__main__":
    main()
