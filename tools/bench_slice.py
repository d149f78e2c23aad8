"""Measures slicing beside PrusaSlicer: `python tools/bench_slice.py [MODEL ...] [--height MM] [--support] [--set ...]`.

Every model is scaled to one height (default 60 mm: 300 layers of 0.2 mm; 0: as it is), stands as one part on the platform
and is sliced once to warm up and then three times; the least core seconds count, mesh to paths. Where PrusaSlicer is
installed its whole command runs three times on the same mesh with the same settings (those of tools/bench_travel.py),
and its G-code tells its lengths by kind. Memory is the largest resident set of each process; ours is the one so far.
"""

import argparse
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, pi
from pathlib import Path

import numpy as np
from bench_travel import PRUSA, SAME, standing

from mdp.decomposition import Part
from mdp.mesh import Mesh
from mdp.plane import PLATFORM
from mdp.pose import level
from mdp.save import stl
from mdp.topology.cross_section import cross_sections
from profiles.profile import Profile, load
from slicer.heights import layer_heights
from slicer.paths import Kind, SlicedPart
from slicer.slice import slice_part

RUNS = 3
SHIPPED = ("demo:figure", "demo:tree", "demo:bracket", "demo:lattice")
TREE, SNUG = "process.support=auto", ("--support-material", "--support-material-style", "snug")  # each slicer's own support
UNMARKED = ("process.overhang_share=0", "process.outer_bulge=0")  # walls keep their names, and both lay the same beads
KINDS = (Kind.OUTER_WALL, Kind.INNER_WALL, Kind.INFILL, Kind.SKIN, Kind.TOP_SKIN, Kind.BRIDGE, Kind.GAP)

METER = """import resource, subprocess, sys
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
sys.exit(code)"""  # in a small process of its own: a child begins with the resident set of what started it


@dataclass(frozen=True)
class Figures:
    """What one slicer makes of a model and what that costs; lengths_m by the names of PrusaSlicer's kinds."""

    core_s: float
    memory_mb: float
    plastic_mm3: float
    lengths_m: Mapping[str, float]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print one table per model."""
    parser = argparse.ArgumentParser(description="slicing in core seconds, beside PrusaSlicer")
    parser.add_argument("models", nargs="*", default=SHIPPED)
    parser.add_argument("--height", type=float, default=60.0)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--support", action="store_true", help="both slicers with support, each as it does that")
    parser.add_argument("--rival", default="prusa-slicer", help="PrusaSlicer's command")
    options = parser.parse_args(arguments)
    profile = load(settings=[*SAME, *UNMARKED, *((TREE,) if options.support else ()), *options.set])
    for model in options.models:
        mesh = standing(model, options.height)
        cuts = layer_heights(mesh, profile, True).cut_mm
        section_s = min(core_seconds(lambda: cross_sections(mesh, cuts)) for _ in range(RUNS + 1))  # noqa: B023
        print(f"\n{Path(model).name}: {len(mesh.faces)} faces, {len(cuts)} layers, sections {section_s:.3f} core s")
        words = (options.rival, *(SNUG if options.support else ()))
        print_table(ours(mesh, profile), rival(mesh, words) if shutil.which(options.rival) else None)


def print_table(own: Figures, peer: Figures | None) -> None:
    """Own figures, those of the rival and own / rival."""
    rows = [
        ("core s", own.core_s, peer and peer.core_s),
        ("memory MB", own.memory_mb, peer and peer.memory_mb),
        ("plastic cm3", own.plastic_mm3 / 1000, peer and peer.plastic_mm3 / 1000),
        *(
            (f"{kind.value} m", own.lengths_m.get(kind.value, 0.0), peer and peer.lengths_m.get(kind.value, 0.0))
            for kind in KINDS
        ),
    ]
    print("| | ours | PrusaSlicer | ratio |\n|---|---|---|---|")
    for name, mine, theirs in rows:
        ratio = f"{mine / theirs:.3f}" if theirs else ""
        print(f"| {name} | {mine:.2f} | {'' if theirs is None else f'{theirs:.2f}'} | {ratio} |")


def ours(mesh: Mesh, profile: Profile) -> Figures:
    """Slicing in this process, mesh to paths."""
    part = Part(1, mesh, PLATFORM, level(profile.machine), np.eye(3), mesh.volume_mm3, 0.0)
    sliced = slice_part(part, profile)
    seconds = min(core_seconds(lambda: slice_part(part, profile)) for _ in range(RUNS))
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Figures(seconds, memory_mb, sliced.volume_mm3, metres(sliced))


def core_seconds(work: Callable[[], object]) -> float:
    """Processor time of a call, all threads."""
    began = time.process_time()
    work()
    return time.process_time() - began


def metres(sliced: SlicedPart) -> dict[str, float]:
    """Length of every kind of path."""
    lengths: defaultdict[str, float] = defaultdict(float)
    for layer in sliced.layers:
        for path in layer.paths:
            lengths[path.kind.value] += path.length_mm / 1000
    return dict(lengths)


def rival(mesh: Mesh, command: Sequence[str]) -> Figures:
    """PrusaSlicer's whole command on the same mesh."""
    with tempfile.TemporaryDirectory() as folder:
        model, out = Path(folder) / "model.stl", Path(folder) / "model.gcode"
        model.write_bytes(stl(mesh))
        runs = []
        for _ in range(RUNS):
            words = [sys.executable, "-I", "-c", METER, *command, *PRUSA.split(), "--no-overhangs", "-o", out, model]
            done = subprocess.run(words, capture_output=True, text=True, check=False)
            if done.returncode or not out.exists():
                raise SystemExit(f"{command[0]} failed: {(done.stderr or done.stdout).strip()[-300:]}")
            runs.append([float(word) for word in done.stdout.split()[-2:]])
        lengths_m, filament_mm = laid(out.read_text(encoding="utf-8"))
    return Figures(min(run[0] for run in runs), max(run[1] for run in runs) / 1024, filament_mm * pi * 1.75**2 / 4.0, lengths_m)


def laid(text: str) -> tuple[dict[str, float], float]:
    """Length in m of every kind of extrusion in PrusaSlicer's G-code, and its filament in mm."""
    lengths: defaultdict[str, float] = defaultdict(float)
    x = y = filament = 0.0
    kind = ""
    for line in text.splitlines():
        if line.startswith(";TYPE:"):
            kind = line[6:]
        elif line.startswith("G1 "):
            words = {word[0]: float(word[1:]) for word in line.partition(";")[0].split()[1:]}
            step = hypot(words.get("X", x) - x, words.get("Y", y) - y)
            x, y = words.get("X", x), words.get("Y", y)
            filament += words.get("E", 0.0)
            if words.get("E", 0.0) > 0:
                lengths[kind] += step / 1000
    return dict(lengths), filament


if __name__ == "__main__":
    main()
