"""Dry-run a folder of G-code files that are known to be good, and tell what is found: every error is a false alarm.

    python tools/check_dryrun.py FOLDER [--models MODELS] [--machine NAME ...] [--only WORD]

--models: first export every model of that folder for every machine into FOLDER, as MODEL.MACHINE.gcode, where that file is not
there yet; later every such file is held against its model too. A file that names no machine of ours (another slicer's) is
played on three axes. One row a file: moves, errors, warnings by code, seconds of the dry run and of the comparison.
"""

import argparse
from collections import Counter
from pathlib import Path
from time import process_time

from machine.cli.cli import main as tiltprint
from machine.dryrun import dry_run
from machine.dryrun.agreement import agreement
from machine.pipeline.embedded_profile import read_embedded_profile
from mdp.read import read_mesh
from profiles.profile import load

SUFFIXES = {".stl", ".obj", ".off", ".ply", ".3mf", ".glb"}


def main() -> None:
    """Read the options, export what is missing, print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--models", type=Path)
    options.add_argument("--machine", nargs="+", default=["generic_ac", "gen5x", "linuxcnc_xyzac"])
    options.add_argument("--only", default="")
    given = options.parse_args()
    models = {} if given.models is None else {m.stem: m for m in sorted(given.models.iterdir()) if m.suffix.lower() in SUFFIXES}
    export(models, given.machine, given.folder)
    print("| file | moves | errors | warnings | dry run s | comparison s |\n|---|---|---|---|---|---|")
    wrong = files = 0
    for file in sorted(file for file in given.folder.glob("*.gcode") if given.only in file.name):
        text, errors = row(file, models.get(file.name.split(".")[0]))
        print(text, flush=True)
        wrong, files = wrong + (errors > 0), files + 1
    print(f"\n{files} files, {wrong} with errors")


def export(models: dict[str, Path], machines: list[str], folder: Path) -> None:
    """Export what is not there yet; a refused model leaves no file."""
    for machine in machines:
        for name, model in models.items():
            file = folder / f"{name}.{machine}.gcode"
            if not file.exists():
                tiltprint(["export", str(model), "-o", str(file), "--machine", machine])


def row(file: Path, model: Path | None) -> tuple[str, int]:
    """A file's line of the table, and how many errors it has."""
    lines = tuple(file.read_text().split("\n"))
    profile, sections = read_embedded_profile(lines, load(), frozenset())
    ours = "machine" in sections
    profile = profile if ours else load(machine="three_axis")
    began = process_time()
    run = dry_run(lines, profile)
    played = process_time()
    if ours and model is not None:
        mesh, _ = read_mesh(model, profile.process.scale, profile.process.rotate_deg)
        _, run = agreement(run, mesh, profile)
    compared = process_time()
    errors = "; ".join(f"{f.code} (line {f.line}, part {f.part}, layer {f.layer}): {f.message}" for f in run.errors)
    warnings = Counter(f.code for f in run.findings if f.severity == "warning" and f.code != "uncalibrated")
    counts = " ".join(f"{code} {count}" for code, count in sorted(warnings.items()))
    seconds = f"{played - began:.1f} | {compared - played:.1f}"
    return f"| {file.stem} | {len(run.program.line)} | {errors or 0} | {counts} | {seconds} |", len(run.errors)


if __name__ == "__main__":
    main()
