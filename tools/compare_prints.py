"""Print models in the parts that the program chooses and in one piece straight up, both with support, and hold them side by side.

    python tools/compare_prints.py FILE_OR_FOLDER ... [--every N] [--orient] [--set KEY=VALUE ...] [--log FILE]

Reads model files and the .npz meshes of a collection (vertices, faces); --every N takes every Nth of a folder. One row a model:
parts, time and filament of the parts over those of one piece, support of both, area that needs support and that can get none,
seams, and what the dry run complains of. --orient lets the program lay the model down first and compares with the best single
orientation. --log appends each row at once and skips the models that the file already has.
"""

import argparse
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np

from machine.pipeline.choice import pricing
from machine.pipeline.comparison import best_lying, in_parts, straight_up
from machine.pipeline.pipeline import build
from mdp.mesh import Mesh
from mdp.read import read_mesh
from mdp.search.orient import orient_and_decompose
from mdp.search.search import SearchRequest, decompose
from profiles.errors import UserError
from profiles.profile import Profile, load

HEAD = ("model", "parts", "time", "filament", "support cm3", "needs support mm2", "gets none mm2", "seams mm", "message")


def main() -> None:
    """Read the options, print the table and the medians of what was cut."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+", type=Path)
    options.add_argument("--every", type=int, default=1)
    options.add_argument("--orient", action="store_true")
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options.add_argument("--log", type=Path)
    given = options.parse_args()
    profile = load(settings=["process.support=auto", *given.set])
    done = given.log.read_text() if given.log and given.log.exists() else ""
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    for file in files(given.models, given.every):
        if f"| {file.name} |" in done:
            continue
        text = row(file, profile, given.orient)
        print(text, flush=True)
        done += text + "\n"
        if given.log:
            with given.log.open("a") as log:
                log.write(text + "\n")
    print(summary(done.splitlines()))


def summary(rows: list[str]) -> str:
    """Time and filament of what was cut, over those of one piece."""
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    cut = [row for row in cells if row[1].isdigit() and int(row[1]) > 1 and row[2]]
    if not cut:
        return f"{len(rows)} models, none cut"
    time, filament = ([float(row[column]) for row in cut] for column in (2, 3))
    dear = sum(max(pair) > 1.05 for pair in zip(time, filament, strict=True))
    medians = f"median time {median(time):.3f} (most {max(time):.3f}), filament {median(filament):.3f} (most {max(filament):.3f})"
    return f"{len(rows)} models, {len(cut)} cut: {medians}, {dear} above 1.05 of either"


def files(models: list[Path], every: int) -> list[Path]:
    """The files that are named, and every Nth of the folders."""
    chosen = []
    for model in models:
        inside = sorted(file for file in model.iterdir() if file.suffix != ".csv") if model.is_dir() else [model]
        chosen += inside[::every]
    return chosen


def mesh_of(file: Path, profile: Profile) -> Mesh:
    """A model file, or a mesh of a collection."""
    if file.suffix == ".npz":
        data = np.load(file)
        return Mesh(data["vertices"].astype(np.float64), data["faces"])
    return read_mesh(file, profile.process.scale, profile.process.rotate_deg)[0]


def row(file: Path, profile: Profile, orient: bool) -> str:
    """One model's line of the table."""
    try:
        mesh = mesh_of(file, profile)
        search = partial(decompose, name=file.name, profile=profile, request=SearchRequest(price=pricing(profile)))
        decomposition = orient_and_decompose(mesh, profile, pricing, search).decomposition if orient else search(mesh)
        if len(decomposition.parts) == 1 and not orient:
            return f"| {file.name} | 1 | 1 | 1 | | {decomposition.risky_area_mm2:.0f} | | | stays whole |"
        program = build(decomposition, profile)
        uncut = best_lying(decomposition, profile) if orient else straight_up(decomposition, profile)
        ours = in_parts(program, profile)
    except UserError as error:
        return f"| {file.name} | | | | | | | | {error} |"
    if uncut.time_s is None:
        return f"| {file.name} | {ours.parts} | | | | | | | one piece: {uncut.message} |"
    cells = [
        file.name,
        str(ours.parts),
        f"{ours.time_s / uncut.time_s:.3f}",
        f"{ours.filament_mm / uncut.filament_mm:.3f}",
        f"{ours.support_mm3 / 1000:.2f} / {uncut.support_mm3 / 1000:.2f}",
        f"{ours.risky_mm2:.0f} / {uncut.risky_mm2:.0f}",
        f"{ours.unsupported_mm2:.0f} / {uncut.unsupported_mm2:.0f}",
        f"{ours.seam_mm:.0f}",
        ours.message,
    ]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
