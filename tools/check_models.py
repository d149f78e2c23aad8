"""Print every model of a folder on the simulated printer and tell where its plastic went.

    python tools/check_models.py FOLDER [--machine NAME] [--set KEY=VALUE ...]

One row a model: parts, relative error of the parts' volumes, share of the extruded length that the simulated printer itself
recorded inside the model within one line width (support and skirt aside), recorded over planned volume, planned over
sliced volume, findings that are errors, seconds.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from time import perf_counter

from machine.app.pipeline import build, decompose_model
from machine.dryrun.deposit import inside_share
from machine.link.simulator import SimulatedPrinter
from machine.link.stream import print_lines
from profiles.profile import Profile, load

SUFFIXES = {".stl", ".obj", ".off", ".ply", ".3mf", ".glb"}


def main() -> None:
    """Read the options, print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--machine", default="generic_ac")
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    given = options.parse_args()
    profile = load(machine=given.machine, settings=given.set)
    print("| model | parts | volume error | reduction | inside | recorded / planned | errors | s |")
    print("|---|---|---|---|---|---|---|---|")
    for file in sorted(given.folder.iterdir()):
        if file.suffix.lower() in SUFFIXES:
            print(row(file, profile), flush=True)


def row(file: Path, profile: Profile) -> str:
    """One model's line of the table."""
    began = perf_counter()
    found = decompose_model(str(file), profile, "classic").decomposition
    program = build(found, profile)
    with SimulatedPrinter(profile.machine) as printer:
        print_lines(program.lines, printer.path)
        record = printer.record
    segments, volumes = record.deposited(profile.material.diameter_mm)
    share = inside_share(replace(program.run, segments_mm=segments), found.mesh, profile.process.line_width_mm).share
    error = abs(found.volume_mm3 / found.mesh.volume_mm3 - 1.0)
    errors = sum(finding.severity == "error" for finding in program.run.findings)
    laid = volumes.sum() / program.run.segment_mm3.sum()
    told = [file.name, len(found.parts), f"{error:.1e}", f"{found.reduction:.3f}", f"{share:.4f}", f"{laid:.5f}", errors]
    return "| " + " | ".join(str(cell) for cell in [*told, round(perf_counter() - began)]) + " |"


if __name__ == "__main__":
    main()
