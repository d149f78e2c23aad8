"""Growth of cost with a model's size: `python tools/bench/scale.py DRAGON KITTEN [--faces 5000,20000,...]`.

Prints the tables of docs/scale.md, which tools/docs/draw_scale.py draws: `decompose --as-is` of the first model with its faces
subdivided by Loop's scheme and simplified; `export --as-is` of demo:tree in 1 to 6 parts by plans, and of the second model in a
single part with several layer heights. Every command is a warm process of its own; the least of several runs counts.
"""

import argparse
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from mdp.cut import simplify
from mdp.mesh import Mesh
from mdp.read import read_mesh
from mdp.save import stl
from tools.bench.harness import OURS, command, heading, in_turns, options_of, row, run

PARTS = range(1, 7)
HEIGHTS_MM = (0.1, 0.15, 0.2, 0.3)
ENOUGH = 1.25  # times the requested faces


def bench(given: argparse.Namespace) -> None:
    """Print the tables."""
    dragon, kitten = given.models
    with TemporaryDirectory() as name:
        folder = Path(name)
        for words in (["decompose", "demo:tree", "-o", folder / "parts"], ["export", "demo:tree", "-o", folder / "out.gcode"]):
            command([*OURS, *words])  # compiles
        faces_table(Path(dragon), [int(count) for count in given.faces.split(",")], folder, given.runs)
        export_table("parts", ((count, "demo:tree", count, []) for count in PARTS), folder, given.runs)
        heights = ((height_mm, kitten, 1, ["--set", f"process.layer_height_mm={height_mm}"]) for height_mm in HEIGHTS_MM)
        export_table("layer mm", heights, folder, given.runs)


def faces_table(model: Path, counts: Sequence[int], folder: Path, runs: int) -> None:
    """Print one row per number of faces: reading and searching."""
    heading("faces", "core s", "memory MB", "parts")
    whole, _ = read_mesh(model)
    file, figures = folder / "model.stl", folder / "figures.json"
    for count in counts:
        mesh = with_faces(whole, count)
        file.write_bytes(stl(mesh))
        (used,) = in_turns([[*OURS, "decompose", file, "--as-is", "--json", figures]], runs)
        parts = len(json.loads(figures.read_text())["parts"])
        row(len(mesh.faces), f"{used.core_s:.1f}", round(used.memory_mb), parts)


def with_faces(mesh: Mesh, count: int) -> Mesh:
    """The shape with about `count` faces: subdivided until there are more, then simplified with the least tolerance."""
    while ENOUGH * len(mesh.faces) < count:
        mesh = Mesh.from_trimesh(mesh.to_trimesh().subdivide_loop(1))
    tolerance_mm = 1e-3
    while len(mesh.faces) > ENOUGH * count:
        mesh, tolerance_mm = simplify(mesh, tolerance_mm), 1.2 * tolerance_mm
    return mesh


def export_table(first: str, exports: Iterable[tuple[object, str | Path, int, list[str]]], folder: Path, runs: int) -> None:
    """Print one row per export by a plan: slicing, planning, dry run, without a search. exports: first cell, model, parts,
    options."""
    heading(first, "core s", "memory MB", "layers", "lines")
    plan, gcode, figures = folder / "plan.toml", folder / "out.gcode", folder / "figures.json"
    for cell, model, parts, options in exports:
        command([*OURS, "decompose", model, "--as-is", "--parts", str(parts), "--plan", plan])
        (used,) = in_turns([[*OURS, "export", model, "--plan", plan, *options, "-o", gcode, "--json", figures]], runs)
        layers, lines = json.loads(figures.read_text())["layers"], gcode.read_bytes().count(b"\n")
        row(f"{cell}", f"{used.core_s:.1f}", round(used.memory_mb), layers, lines)


if __name__ == "__main__":
    parser = options_of(__doc__)
    parser.add_argument("--faces", default="5000,20000,80000,200000,800000", metavar="N,...")
    run(parser, bench)
