"""Exports three shapes of which hydra5x says that planes cannot print them, an elbow, a Y and a block with a channel, each in one
piece and in parts: `python tools/limb_shapes.py FOLDER`. Prints a table: support, time, filament, and what the head meets.

The shapes are our own, made after its descriptions (maker-fab/hydra5x, docs/decisions.md).
"""

import json
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import manifold3d as m3
import numpy as np
from bench_export import OURS

from mdp.cut import mesh_of
from mdp.save import stl

SIDES = 64


def tube(points: np.ndarray, radius_mm: float) -> m3.Manifold:
    """Round rods between consecutive (n, 3) points."""
    pieces = []
    for a, b in pairwise(points):
        length = float(np.linalg.norm(b - a))
        x, y, z = (b - a) / length
        rod = m3.Manifold.cylinder(length, radius_mm, radius_mm, SIDES)
        turned = rod.rotate((0.0, float(np.degrees(np.arccos(z))), float(np.degrees(np.arctan2(y, x)))))
        pieces.append(turned.translate(tuple(map(float, a))))
    return m3.Manifold.batch_boolean(pieces, m3.OpType.Add)


def elbow() -> m3.Manifold:
    """A pipe, 24 mm wide outside and 18 inside, that turns by 90 degrees about a radius of 40 mm."""
    ring = m3.CrossSection.circle(12.0, SIDES) - m3.CrossSection.circle(9.0, SIDES)
    quarter = m3.Manifold.revolve(ring.translate((40.0, 0.0)), 128, 90.0).rotate((90.0, 0.0, 0.0))
    foot = m3.Manifold.extrude(ring, 20.0).translate((40.0, 0.0, -20.0))
    return foot + quarter


def wye(lean_deg: float) -> m3.Manifold:
    """A stem of 20 mm with two arms, 16 mm wide and 60 mm long, that lean to both sides."""
    arms = [m3.Manifold.cylinder(60.0, 8.0, 8.0, SIDES).rotate((0.0, side * lean_deg, 0.0)) for side in (-1.0, 1.0)]
    stem = m3.Manifold.cylinder(40.0, 10.0, 10.0, SIDES)
    return stem + (arms[0] + arms[1]).translate((0.0, 0.0, 36.0))


def channel_block() -> m3.Manifold:
    """A block of 60 x 40 x 50 mm with a channel of 14 mm that goes in at a side and out at the other, level in the middle."""
    block = m3.Manifold.cube((60.0, 40.0, 50.0)).translate((-30.0, -20.0, 0.0))
    way = np.array([[-40.0, 0.0, 12.0], [-12.0, 0.0, 12.0], [-12.0, 0.0, 36.0], [40.0, 0.0, 36.0]])
    return block - tube(way, 7.0)


SHAPES: dict[str, Callable[[], m3.Manifold]] = {
    "elbow": elbow,
    "Y, arms at 30 degrees": lambda: wye(30.0),
    "Y, arms at 60 degrees": lambda: wye(60.0),
    "channel": channel_block,
}


def exported(model: Path, *options: str) -> dict[str, Any]:
    """What `export --json` reports of a model. Ends the program with the export's own message where it writes no report."""
    report = model.with_suffix(".json")
    report.unlink(missing_ok=True)
    written = ["-o", str(model.with_suffix(".gcode")), "--force", "--json", str(report)]
    command = [*OURS, "export", str(model), *written, "--as-is", *options]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if not report.exists():
        sys.exit(f"{model.name}: {done.stderr.strip()}")
    values: dict[str, Any] = json.loads(report.read_text())
    return values


def row(name: str, model: Path, *options: str) -> str:
    values = exported(model, *options)
    met = sum(finding["code"] in ("contact", "collision") for finding in values["findings"])
    return f"| {name} | {values['parts']} | {values['time_s'] / 60:.0f} min | {values['filament_mm'] / 1000:.2f} m | {met} |"


def run(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    print("| shape | parts | time | filament | contacts |\n|---|---|---|---|---|")
    for name, make in SHAPES.items():
        model = folder / f"{name.split(',')[0].lower()}{''.join(filter(str.isdigit, name))}.stl"
        solid = make()
        model.write_bytes(stl(mesh_of(solid.translate((0.0, 0.0, -solid.bounding_box()[2])))))
        print(row(name + ", one piece", model, "--parts", "1"), row(name, model), sep="\n", flush=True)


if __name__ == "__main__":
    run(Path(sys.argv[1]))
