"""Whole commands: `python tools/bench/export.py MODEL ... [--height 60] [--support] [--do export|decompose|simulate|print]`.

Measures a fresh process from start to end with compiled kernels. `export` runs in turns with PrusaSlicer's command on the same
mesh with the same settings, if that is installed; tiltprint's command includes the dry run. The other commands run alone, so use
`--beside COMMIT`. The model `box` is a cuboid of 20 x 20 x 10 mm, which shows the start-up time.
"""

import argparse
import tempfile
from math import nan
from pathlib import Path

import manifold3d as m3

from mdp.cut import mesh_of
from mdp.save import stl
from tools.bench import harness
from tools.bench.harness import OURS, Used, heading, options_of, row


def bench(given: argparse.Namespace) -> None:
    """Print one row per model."""
    heading("model", "core s", "wall s", "memory MB", "lines", "PrusaSlicer core s", "wall s", "lines", "core ratio", "wall")
    for model in given.models:
        mesh = mesh_of(m3.Manifold.cube((20.0, 20.0, 10.0))) if model == "box" else harness.standing(model, given.height)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            file, ours, theirs = folder / "model.stl", folder / "ours.gcode", folder / "theirs.gcode"
            file.write_bytes(stl(mesh))
            same = [*harness.SAME, *([harness.OUR_SUPPORT] if given.support else [])] if given.do == "export" else []
            further = {"export": ["--parts", "1", "--as-is", "--force", "-o", ours], "print": ["--port", "sim"]}.get(given.do, [])
            commands = [[*OURS, given.do, file, *further, *(f"--set={setting}" for setting in (*same, *given.set))]]
            if given.do == "export" and (prusa := harness.prusa_command(file, theirs, given.support)) is not None:
                commands.append(prusa)
            harness.command(commands[0])  # compiles missing kernels
            own, *other = harness.in_turns(commands, given.runs)
            lines = [out.read_bytes().count(b"\n") if out.exists() else None for out in (ours, theirs)]
        theirs_used = other[0] if other else Used(nan, nan, nan)
        own_cells = (Path(model).name, own.core_s, own.wall_s, round(own.memory_mb), lines[0])
        ratios = own.core_s / theirs_used.core_s, own.wall_s / theirs_used.wall_s
        row(*own_cells, theirs_used.core_s, theirs_used.wall_s, lines[1], *ratios)


if __name__ == "__main__":
    parser = options_of(__doc__)
    parser.add_argument("--support", action="store_true", help="each slicer with its own support")
    parser.add_argument("--do", choices=("export", "decompose", "simulate", "print"), default="export")
    harness.run(parser, bench)
