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

import numpy as np

from machine.app.pipeline.comparison import alternatives_json, compare_with_one_part
from machine.app.pipeline.pipeline import build
from machine.app.pipeline.pricing import pricing
from mdp.mesh import Mesh
from mdp.read import read_mesh
from mdp.search.laying import lay_down
from mdp.search.search import decompose
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
        if given.log:
            with given.log.open("a") as log:
                log.write(text + "\n")


def files(models: list[Path], every: int) -> list[Path]:
    """The files that are named, and every Nth of the folders."""
    found = []
    for model in models:
        inside = sorted(file for file in model.iterdir() if file.suffix != ".csv") if model.is_dir() else [model]
        found += inside[::every]
    return found


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
        search = partial(decompose, name=file.name, profile=profile, price=pricing(profile))
        decomposition = lay_down(mesh, profile, pricing, search).decomposition if orient else search(mesh)
        ours, *single = alternatives_json(compare_with_one_part(build(decomposition, profile), profile))
    except UserError as error:
        return f"| {file.name} | | | | | | | | {error} |"
    other = single[1] if orient else single[0]
    if other["time_s"] is None:
        return f"| {file.name} | {ours['parts']} | | | | | | | one piece: {other['message']} |"
    cells = [
        file.name,
        str(ours["parts"]),
        f"{ours['time_s'] / other['time_s']:.3f}",
        f"{ours['filament_mm'] / other['filament_mm']:.3f}",
        f"{ours['support_mm3'] / 1000:.2f} / {other['support_mm3'] / 1000:.2f}",
        f"{ours['support_area_mm2']:.0f} / {other['support_area_mm2']:.0f}",
        f"{ours['unsupported_area_mm2']:.0f} / {other['unsupported_area_mm2']:.0f}",
        f"{ours['seam_mm']:.0f}",
        ours["message"],
    ]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
