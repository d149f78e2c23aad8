"""Measures how cost grows with a model: `python tools/bench_scale.py DRAGON KITTEN [--faces 5000,20000,...] [--runs 2]`.

Prints the tables of docs/scale.md, from which tools/draw_scale.py draws its picture: `decompose --as-is` of the first model with
its faces divided by Loop's scheme and simplified; `export --as-is` of demo:tree in 1 to 6 parts by plans, and of
the second model in one part in layers of several heights. Every command is a process of its own, warm; the least core seconds of
some runs, those of processes that it forks included, and the most memory of its own.
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
from tools.campaign_run import Ended, Limits, tiltprint

FACES = "5000,20000,80000,200000,800000"
PARTS = range(1, 7)
HEIGHTS_MM = (0.1, 0.15, 0.2, 0.3)
ENOUGH = 1.25  # times the faces that are wanted
LIMITS = Limits(core_s=3600)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dragon", type=Path)
    parser.add_argument("kitten", type=Path)
    parser.add_argument("--faces", default=FACES, metavar="N,...")
    parser.add_argument("--runs", type=int, default=2)
    given = parser.parse_args()
    with TemporaryDirectory() as name:
        folder = Path(name)
        for command in ("decompose", "export"):
            tiltprint([command, "demo:tree", "-o", str(folder / command)], folder, LIMITS)  # compiles
        faces_table(given.dragon, [int(count) for count in given.faces.split(",")], folder, given.runs)
        parts_table(folder, given.runs)
        heights_table(given.kitten.resolve(), folder, given.runs)


def faces_table(model: Path, counts: Iterable[int], folder: Path, runs: int) -> None:
    """One row a number of faces: reading and searching."""
    heading("faces", "core s", "memory MB", "parts")
    whole, _ = read_mesh(model)
    for count in counts:
        mesh = with_faces(whole, count)
        (folder / "model.stl").write_bytes(stl(mesh))
        figures = folder / "figures.json"
        least = least_of(runs, ["decompose", "model.stl", "--as-is", "--json", str(figures)], folder)
        parts = len(json.loads(figures.read_text())["parts"])
        row(len(mesh.faces), f"{least.core_s:.1f}", f"{least.memory_mb:.0f}", parts)


def with_faces(mesh: Mesh, count: int) -> Mesh:
    """The shape with about `count` faces: divided until there are more, then made coarser by as little as is needed."""
    while ENOUGH * len(mesh.faces) < count:
        mesh = Mesh.from_trimesh(mesh.to_trimesh().subdivide_loop(1))
    tolerance_mm = 1e-3
    while len(mesh.faces) > ENOUGH * count:
        mesh, tolerance_mm = simplify(mesh, tolerance_mm), 1.2 * tolerance_mm
    return mesh


def parts_table(folder: Path, runs: int) -> None:
    """One row a number of parts: slicing, planning, dry run, without a search."""
    heading("parts", "core s", "memory MB", "layers", "lines")
    for count in PARTS:
        plan = str(folder / f"{count}.toml")
        tiltprint(["decompose", "demo:tree", "--as-is", "--parts", str(count), "--plan", plan], folder, LIMITS)
        export_row(count, ["demo:tree", "--plan", plan], folder, runs)


def heights_table(model: Path, folder: Path, runs: int) -> None:
    """One row a layer height: the same without a search, which one part does not need."""
    plan = str(folder / "one.toml")
    tiltprint(["decompose", str(model), "--as-is", "--parts", "1", "--plan", plan], folder, LIMITS)
    heading("layer mm", "core s", "memory MB", "layers", "lines")
    for height_mm in HEIGHTS_MM:
        export_row(height_mm, [str(model), "--plan", plan, "--set", f"process.layer_height_mm={height_mm}"], folder, runs)


def export_row(first: float, words: Sequence[str], folder: Path, runs: int) -> None:
    """The row of an export."""
    gcode, figures = folder / "out.gcode", folder / "figures.json"
    least = least_of(runs, ["export", *words, "-o", str(gcode), "--json", str(figures)], folder)
    lines = gcode.read_bytes().count(b"\n")
    row(first, f"{least.core_s:.1f}", f"{least.memory_mb:.0f}", json.loads(figures.read_text())["layers"], lines)


def least_of(runs: int, command: Sequence[str], folder: Path) -> Ended:
    """The run that took least. Raises RuntimeError for a command that fails."""
    ends = [tiltprint(command, folder, LIMITS) for _ in range(runs)]
    if any(ended.code != 0 for ended in ends):
        raise RuntimeError(f"{' '.join(command)}: {ends[0].sentence}")
    return min(ends, key=lambda ended: ended.core_s)


def heading(*columns: str) -> None:
    """Begin a table."""
    print(f"\n| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)


def row(*cells: object) -> None:
    """A row of it."""
    print(f"| {' | '.join(str(cell) for cell in cells)} |", flush=True)


if __name__ == "__main__":
    main()
