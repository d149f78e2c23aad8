"""Measures travels beside PrusaSlicer: `python tools/bench_travel.py MODEL ... [--height MM] [--set KEY=VALUE]`.

Every model is scaled to one height and stands as one part on the platform; both slicers get 0.2 mm layers, 3 walls, 4 + 4
solid layers, 20 % grid, no skirt, brim or support, the same speeds of travel, and retract only where a travel longer than
1.5 mm leaves the section. Both G-code texts are read by the same few lines below: a retraction begins where filament is first
pulled back, travels are all moves in X and Y that push nothing (wiping while pulling back is no travel).
"""

import argparse
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import hypot
from pathlib import Path

import numpy as np

from machine.gcode.writer import write_gcode
from machine.planning.plan import plan
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.plane import PLATFORM
from mdp.pose import level
from mdp.read import read_mesh
from mdp.save import stl
from profiles.profile import Profile, load
from slicer.slice import slice_part

SAME = (
    "process.layer_height_mm=0.2",
    "process.first_layer_height_mm=0.2",
    "process.walls=3",
    "process.top_layers=4",
    "process.bottom_layers=4",
    "process.infill_density=0.2",
    "process.infill_pattern=grid",
    "process.support=none",
    "process.skirt_loops=0",
    "process.retract_travel_mm=1.5",
)
PRUSA = (
    "--gcode --nozzle-diameter 0.4 --filament-diameter 1.75 --layer-height 0.2 --first-layer-height 0.2 --perimeters 3 "
    "--top-solid-layers 4 --bottom-solid-layers 4 --fill-density 20% --fill-pattern grid --skirts 0 --brim-width 0 "
    "--perimeter-generator classic --extrusion-width 0.45 --external-perimeter-extrusion-width 0.45 "
    "--perimeter-extrusion-width 0.45 --infill-extrusion-width 0.45 --solid-infill-extrusion-width 0.45 "
    "--top-infill-extrusion-width 0.45 --first-layer-extrusion-width 0.45 --retract-before-travel 1.5 --retract-length 0.8 "
    "--only-retract-when-crossing-perimeters --use-relative-e-distances --layer-gcode G92E0 --seam-position aligned"
)


@dataclass(frozen=True)
class Figures:
    """What a G-code text does between its strokes; wiped_mm is moved while filament is pulled back."""

    retractions: int
    travel_mm: float
    wiped_mm: float
    laid_mm: float


def main(arguments: Sequence[str] | None = None) -> None:
    """Print one row per model."""
    parser = argparse.ArgumentParser(description="travels beside PrusaSlicer")
    parser.add_argument("models", nargs="+")
    parser.add_argument("--height", type=float, default=60.0)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--prusa", default="prusa-slicer", help="PrusaSlicer's command")
    options = parser.parse_args(arguments)
    profile = load(settings=[*SAME, *options.set])
    print("| model | retractions ours | Prusa | ratio | travel m ours | Prusa | ratio | laid m ours | Prusa |")
    print("|---|---|---|---|---|---|---|---|---|")
    for model in options.models:
        mesh = standing(model, options.height)
        ours, theirs = figures(own_gcode(mesh, profile)), figures(prusa_gcode(mesh, options.prusa))
        print(row(model, ours, theirs), flush=True)


def standing(model: str, height_mm: float) -> Mesh:
    """The model scaled to the height, as it is for 0."""
    mesh, _ = read_mesh(locate(model))
    return Mesh(mesh.vertices * (height_mm / mesh.bounds_mm[1, 2] if height_mm else 1.0), mesh.faces)


def row(model: str, ours: Figures, theirs: Figures) -> str:
    """One model's line of the table."""
    metres = [ours.travel_mm / 1000, theirs.travel_mm / 1000]
    cells = [
        Path(model).name,
        f"{ours.retractions} | {theirs.retractions} | {ours.retractions / max(theirs.retractions, 1):.2f}",
        f"{metres[0]:.2f} | {metres[1]:.2f} | {metres[0] / metres[1]:.2f}",
        f"{ours.laid_mm / 1000:.1f} | {theirs.laid_mm / 1000:.1f}",
    ]
    return f"| {' | '.join(cells)} |"


def own_gcode(mesh: Mesh, profile: Profile) -> list[str]:
    """Our text from the first layer on."""
    pose = level(profile.machine)
    part = Part(1, mesh, PLATFORM, pose, np.eye(3), mesh.volume_mm3, 0.0)
    decomposition = Decomposition("bench", mesh, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    return list(write_gcode(plan(decomposition, [slice_part(part, profile)], profile), profile))


def prusa_gcode(mesh: Mesh, command: str) -> list[str]:
    """PrusaSlicer's text for the same mesh."""
    with tempfile.TemporaryDirectory() as folder:
        model, out = Path(folder) / "model.stl", Path(folder) / "model.gcode"
        model.write_bytes(stl(mesh))
        done = subprocess.run([command, *PRUSA.split(), "-o", str(out), str(model)], capture_output=True, text=True, check=False)
        if done.returncode or not out.exists():
            raise SystemExit(f"{command} failed: {(done.stderr or done.stdout).strip()[-300:]}")
        return out.read_text(encoding="utf-8").splitlines()


def figures(lines: Iterable[str]) -> Figures:
    """Counts retractions and sums lengths of a text with relative filament, from the first layer change on."""
    x = y = depth = travel = wiped = laid = 0.0
    retractions, begun = 0, False
    for line in lines:
        begun = begun or line.startswith(";LAYER_CHANGE")
        words = {word[0]: float(word[1:]) for word in line.partition(";")[0].split()[1:] if word[1:]} if line[:1] == "G" else {}
        if line.split(" ", 1)[0] not in ("G0", "G1"):
            continue
        step = hypot(words.get("X", x) - x, words.get("Y", y) - y)
        x, y, pushed = words.get("X", x), words.get("Y", y), words.get("E", 0.0)
        if begun:
            retractions += pushed < 0 and depth == 0.0
            wiped += step if pushed < 0 else 0.0
            travel += step if pushed == 0 else 0.0
            laid += step if pushed > 0 else 0.0
        depth = round(max(0.0, depth - pushed), 4)
    return Figures(retractions, travel, wiped, laid)


if __name__ == "__main__":
    main()
