"""Models in parts compared with one piece: `python tools/bench/parts.py FILE_OR_FOLDER ... [--every N] [--orient] [--log FILE]`.

Both are printed with support and dry-run: in parts as the program cuts the standing model, and in one piece upright. With
`--orient` the program also chooses the orientation, and the single piece has its best one. One row per model: parts, time and
filament relative to one piece, support of both, area that needs support and area without it, seams, and findings of the dry run.
`--log` appends each row at once and skips models already in the file.
"""

import argparse
from functools import partial
from pathlib import Path
from statistics import median

from machine.pipeline.choice import pricing
from machine.pipeline.comparison import best_lying, in_parts, straight_up
from machine.pipeline.pipeline import build
from mdp.search.orient import orient_and_decompose
from mdp.search.search import SearchRequest, decompose
from profiles.errors import UserError
from profiles.profile import Profile, load
from tools.bench.harness import heading, options_of, run
from tools.checks.harness import files, mesh_of

HEAD = ("model", "parts", "time", "filament", "support cm3", "needs support mm2", "gets none mm2", "seams mm", "message")


def bench(given: argparse.Namespace) -> None:
    """Print the table, then the medians of the models that were cut."""
    profile = load(settings=["process.support=auto", *given.set])
    done = given.log.read_text() if given.log and given.log.exists() else ""
    heading(*HEAD)
    for file in files(given.models, given.every):
        if f"| {file.name} |" in done:
            continue
        text = f"| {' | '.join([file.name, *cells(file, profile, given.orient)])} |"
        print(text, flush=True)
        done += text + "\n"
        if given.log:
            with given.log.open("a") as log:
                log.write(text + "\n")
    print(summary(done.splitlines()))


def summary(rows: list[str]) -> str:
    """Time and filament of the models that were cut, relative to one piece."""
    parsed = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    cut = [row for row in parsed if row[1].isdigit() and int(row[1]) > 1 and row[2]]
    if not cut:
        return f"{len(rows)} models, none cut"
    time, filament = ([float(row[column]) for row in cut] for column in (2, 3))
    medians = f"median time {median(time):.3f} (most {max(time):.3f}), filament {median(filament):.3f} (most {max(filament):.3f})"
    return f"{len(rows)} models, {len(cut)} cut: {medians}"


def cells(file: Path, profile: Profile, orient: bool) -> list[str]:
    """A model's cells after its name."""
    try:
        mesh = mesh_of(file, profile)
        search = partial(decompose, name=file.name, profile=profile, request=SearchRequest(price=pricing(profile)))
        decomposition = orient_and_decompose(mesh, profile, pricing, search).decomposition if orient else search(mesh)
        if len(decomposition.parts) == 1 and not orient:
            return ["1", "1", "1", "", f"{decomposition.risky_area_mm2:.0f}", "", "", "stays whole"]
        ours = in_parts(build(decomposition, profile), profile)
        uncut = best_lying(decomposition, profile) if orient else straight_up(decomposition, profile)
    except UserError as error:
        return ["", "", "", "", "", "", "", str(error)]
    if uncut.time_s is None:
        return [str(ours.parts), "", "", "", "", "", "", f"one piece: {uncut.message}"]
    over = [f"{ours.time_s / uncut.time_s:.3f}", f"{ours.filament_mm / uncut.filament_mm:.3f}"]
    support_cm3 = f"{ours.support_mm3 / 1000:.2f} / {uncut.support_mm3 / 1000:.2f}"
    areas = [f"{ours.risky_mm2:.0f} / {uncut.risky_mm2:.0f}", f"{ours.unsupported_mm2:.0f} / {uncut.unsupported_mm2:.0f}"]
    return [str(ours.parts), *over, support_cm3, *areas, f"{ours.seam_mm:.0f}", ours.message]


if __name__ == "__main__":
    parser = options_of(__doc__)
    parser.add_argument("--every", type=int, default=1, help="every N-th file of a folder")
    parser.add_argument("--orient", action="store_true")
    parser.add_argument("--log", type=Path)
    run(parser, bench)
