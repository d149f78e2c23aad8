"""Print every model of a folder and tell where its plastic goes.

    python tools/check_models.py FOLDER [--machine NAME ...] [--set KEY=VALUE ...] [--only NAME ...] [--stream] [--log FILE]

One row a model and machine: parts, relative error of the parts' volumes, reduction; share of the model that its beads fill (at
100 % infill unless --set says otherwise) and plastic over the model's volume; share of the extruded length that lies more
than half a line outside the model (support and skirt aside) and the farthest; unsupported length beyond what the slicer itself
reported, and what it reported, over the extruded length; errors of the dry run; seconds of search and of slicing to dry run.
--stream also sends the program to the simulated printer and judges by what that recorded. --log appends each row at once
and skips the rows that the file already has.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from time import process_time

from machine.dryrun.agreement import agreement
from machine.link.stream import print_lines
from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.requests import ModelRequest
from machine.program import Program
from machine.simulator.planner import EXTRUDES_MM
from machine.simulator.simulator import SimulatedPrinter
from mdp.decomposition import Decomposition
from profiles.errors import UserError
from profiles.profile import Profile, load

SUFFIXES = {".stl", ".obj", ".off", ".ply", ".3mf", ".glb"}
HEAD = (
    "model", "machine", "parts", "volume error", "reduction", "filled", "plastic / model", "outside", "farthest mm",
    "unsupported", "reported", "errors", "search s", "print s",
)  # fmt: skip


def main() -> None:
    """Read the options, print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--machine", nargs="+", default=["generic_ac"])
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options.add_argument("--only", nargs="+", default=[], metavar="NAME")
    options.add_argument("--stream", action="store_true")
    options.add_argument("--log", type=Path)
    given = options.parse_args()
    done = given.log.read_text() if given.log and given.log.exists() else ""
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    for file in sorted(given.folder.iterdir()):
        if file.suffix.lower() not in SUFFIXES or (given.only and file.stem not in given.only):
            continue
        for machine in given.machine:
            if f"| {file.name} | {machine} |" in done:
                continue
            text = row(file, machine, given.set, given.stream)
            print(text, flush=True)
            if given.log:
                with given.log.open("a") as log:
                    log.write(text + "\n")


def row(file: Path, machine: str, settings: list[str], stream: bool) -> str:
    """One model's line of the table on one machine."""
    began = process_time()
    try:
        profile = load(machine=machine, settings=["process.infill_density=1", *settings])
        decomposition = decompose_model(ModelRequest(str(file), profile)).decomposition
        searched = process_time()
        program = build(decomposition, profile)
    except UserError as error:
        return f"| {file.name} | {machine} | refused: {error} |"
    if stream:
        program = streamed(program, profile)
    cells = [*figures(decomposition, program, profile), round(searched - began), round(process_time() - searched)]
    return "| " + " | ".join(str(cell) for cell in [file.name, machine, *cells]) + " |"


def figures(decomposition: Decomposition, program: Program, profile: Profile) -> list[object]:
    """The columns between the machine and the seconds."""
    agreed, run = agreement(program.run, decomposition.mesh, profile)
    mesh = decomposition.mesh
    codes = sorted({finding.code for finding in run.errors})
    error = abs(decomposition.volume_mm3 / mesh.volume_mm3 - 1.0)
    plastic = run.segment_mm3.sum() / mesh.volume_mm3
    return [
        len(decomposition.parts), f"{error:.1e}", f"{decomposition.reduction:.3f}", f"{agreed.filled:.4f}", f"{plastic:.3f}",
        f"{agreed.outside:.4f}", f"{agreed.farthest_mm:.2f}", f"{agreed.unsupported:.4f}", f"{agreed.reported:.4f}",
        " ".join(codes) or "0",
    ]  # fmt: skip


def streamed(program: Program, profile: Profile) -> Program:
    """The program with its beads where the simulated printer recorded them."""
    with SimulatedPrinter(profile.machine) as printer:
        print_lines(program.lines, printer.path)
        record = printer.record
    strokes = (record.end[:, 5] - record.start[:, 5] > EXTRUDES_MM) & (record.start[:, :5] != record.end[:, :5]).any(axis=1)
    beads, start, end = program.run.deposited, program.run.program.start.copy(), program.run.program.end.copy()
    start[beads.rows], end[beads.rows] = record.start[strokes, :5], record.end[strokes, :5]
    laid = replace(beads, program=replace(beads.program, start=start, end=end))
    return replace(program, run=replace(program.run, deposited=laid))


if __name__ == "__main__":
    main()
