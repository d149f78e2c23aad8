"""Blind judging of decompositions: pictures for judges who know neither the code nor the cost, and their verdicts.

`python tools/campaigns/judge_parts.py sheets FOLDER MODEL... [--size MM] [--set KEY=VALUE]` decomposes models at default
settings, scaled to a longest side, and draws a sheet of each: the chosen parts, below the model in its original orientation if
that differs. `read FILE.csv ...` counts verdicts: lines of sheet, verdict (`person`: like an expert; `doubtful`; `wrong`) and a
reason. For several files on the same sheets it reports how many verdicts agree, and which sheets are never accepted.
"""

import argparse
import csv
import json
import subprocess
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from mdp.mesh import Mesh
from mdp.read import read_mesh
from mdp.save import stl
from tools.bench.harness import OURS

WIDTH, HEIGHT, LINE = 1200, 600, 16  # of a picture on a sheet, and of the text above it, pixels
VERDICTS = ("person", "doubtful", "wrong")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    sheets = commands.add_parser("sheets")
    sheets.add_argument("folder", type=Path)
    sheets.add_argument("models", type=Path, nargs="+")
    sheets.add_argument("--size", type=float, help="longest side, mm; left out: as the file has it")
    sheets.add_argument("--set", action="append", default=[])
    read = commands.add_parser("read")
    read.add_argument("files", type=Path, nargs="+")
    options = parser.parse_args()
    if options.command == "read":
        print(summary([verdicts_of(file) for file in options.files]))
        return
    options.folder.mkdir(parents=True, exist_ok=True)
    for model in options.models:
        with tempfile.TemporaryDirectory() as folder:
            name = model.stem if options.size is None else f"{model.stem}_{options.size:g}"
            file = Path(folder) / f"{name}.stl"
            file.write_bytes(stl(scaled(read_mesh(model, 1.0, (0.0, 0.0, 0.0))[0], options.size)))
            print(sheet(file, options.folder / f"{name}.png", options.set), flush=True)


def scaled(mesh: Mesh, size_mm: float | None) -> Mesh:
    """A mesh with a longest side of size_mm."""
    factor = 1.0 if size_mm is None else size_mm / float(np.ptp(mesh.vertices, axis=0).max())
    return Mesh(mesh.vertices * factor, mesh.faces)


def sheet(model: Path, out: Path, settings: list[str]) -> str:
    """Draw a model's sheet; returns a line with its number of parts and their cost."""
    words = [word for setting in settings for word in ("--set", setting)]
    picture, report = model.with_suffix(".png"), model.with_suffix(".json")
    done = subprocess.run([*OURS, "decompose", model, "--png", picture, "--json", report, *words], capture_output=True, text=True)
    if done.returncode:
        return f"{model.stem}: {done.stderr.strip().splitlines()[-1]}"
    found = json.loads(report.read_text())
    pictures = [(f"CHOSEN, {len(found['parts'])} part(s)", picture)]
    if any(abs(turn_deg) > 1e-6 for turn_deg in found["rotate_deg"]):
        as_read = model.with_name("as_read.png")
        subprocess.run([*OURS, "decompose", model, "--as-is", "--parts", "1", "--png", as_read, *words], capture_output=True)
        pictures.insert(0, ("AS ITS FILE HAS IT, not chosen", as_read))
    whole = Image.new("RGB", (WIDTH, len(pictures) * (HEIGHT + LINE)), "white")
    for row, (text, file) in enumerate(pictures):
        ImageDraw.Draw(whole).text((8, row * (HEIGHT + LINE) + 2), f"{model.stem}: {text}", fill="black")
        whole.paste(Image.open(file).convert("RGB").resize((WIDTH, HEIGHT)), (0, row * (HEIGHT + LINE) + LINE))
    whole.save(out)
    return f"{model.stem}: {len(found['parts'])} parts, {found['cost_mm2']:.0f} mm2, turned {found['rotate_deg']}"


def verdicts_of(file: Path) -> dict[str, str]:
    """The verdicts of a file by sheet."""
    rows = [row for row in csv.reader(file.read_text().splitlines()) if len(row) > 1 and row[1].strip() in VERDICTS]
    if not rows:
        raise SystemExit(f"{file}: no line with one of the verdicts {', '.join(VERDICTS)}")
    return {row[0].strip().removesuffix(".png"): row[1].strip() for row in rows}


def summary(verdicts: list[dict[str, str]]) -> str:
    """Counts of each verdict, by file, and agreement of the files."""
    lines = []
    for of_file in verdicts:
        counts = Counter(of_file.values())
        shares = ", ".join(f"{name} {counts[name]}" for name in VERDICTS)
        lines.append(f"{shares}: {counts['person'] / len(of_file):.0%} of {len(of_file)}")
    common = sorted(set.intersection(*map(set, verdicts)))
    if len(verdicts) > 1 and common:
        agreed = sum(len({of_file[sheet] for of_file in verdicts}) == 1 for sheet in common)
        lines.append(f"agreement on {agreed} of {len(common)} sheets")
    rejected = [sheet for sheet in common if all(of_file[sheet] != "person" for of_file in verdicts)]
    return "\n".join([*lines, f"accepted by nobody: {', '.join(rejected) or 'none'}"])


if __name__ == "__main__":
    main()
