"""Models in one piece and in parts: `python tools/bench/benchmark.py FILE_OR_FOLDER ... [--longest MM] [--log FILE]`.

Each model is printed with support and dry-run in five ways, a row each: in one piece in its best orientation, the same piece by
PrusaSlicer, in our parts, and in the parts of the published search (2020), with its classic and with the learned ranking. The
searches begin with the best orientation of one piece; ours may turn it. All get the same layers, line widths, walls, infill and
speeds, and one reader measures all G-code. `--log` appends each row at once and skips the models that the file has.
"""

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from statistics import median

import trimesh

from machine.pipeline.choice import pricing
from machine.pipeline.comparison import best_lying
from machine.pipeline.pipeline import build
from machine.view.parts import residual_faces
from mdp.cost.cost import needing_upright
from mdp.decomposition import Decomposition
from mdp.directions.orientation import best_orientation, set_on_plate
from mdp.mesh import Mesh
from mdp.read import read_mesh
from mdp.search.orient import orient_and_decompose
from mdp.search.search import SearchRequest, decompose
from profiles.errors import UserError
from profiles.profile import Profile, load
from tools.bench import harness
from tools.bench.harness import heading, options_of, run
from tools.bench.slicing import minutes_and_metres, theirs
from tools.checks.harness import files

HEAD = ("model", "printed as", "parts", "needs support mm²", "seams mm", "min", "filament m", "message")
ONE_PIECE, PRUSA, PARTS = "one piece, best orientation", "the same by PrusaSlicer", "our parts"
PUBLISHED = (("published search, B = 10", "classic", 10), ("published search, learned, B = 2", "learned", 2))
Used = tuple[float, float] | None  # minutes and metres of filament
OWN = ("search.method=published", "search.objective=risky", "search.clearance=false", "search.count_platform_faces=true")


def bench(given: argparse.Namespace) -> None:
    """Print the table, then the medians of the models that were cut."""
    settings = [*harness.SAME, harness.OUR_SUPPORT, *given.set]
    done = given.log.read_text(encoding="utf-8") if given.log and given.log.exists() else ""
    heading(*HEAD)
    for file in files(given.models):
        if f"| {file.stem} |" in done:
            continue
        scale = given.longest / float(trimesh.load_mesh(file).extents.max()) if given.longest else 1.0
        mesh, _ = read_mesh(file, scale)
        for cells in rows(mesh, file.stem, settings):
            text = f"| {' | '.join([file.stem, *cells])} |"
            print(text, flush=True)
            done += text + "\n"
            if given.log:
                with given.log.open("a", encoding="utf-8") as log:
                    log.write(text + "\n")
    print(summary(done.splitlines()))


def summary(lines: list[str]) -> str:
    """Time and filament of the models that we cut, over those of one piece in its best orientation."""
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    whole = {row[0]: row for row in cells if row[1] == ONE_PIECE and row[5] != "-"}
    cut = [row for row in cells if row[1] == PARTS and row[2] != "1" and row[5] != "-" and row[0] in whole]
    time, filament = ([float(row[k]) / float(whole[row[0]][k]) for row in cut] for k in (5, 6))
    return (
        f"{len(cut)} cut: median time {median(time):.3f} (most {max(time):.3f}), filament {median(filament):.3f}" if cut else ""
    )


def rows(mesh: Mesh, name: str, settings: list[str]) -> Iterator[list[str]]:
    """The cells of each way to print a model, behind its name."""
    profile = load(settings=settings)
    mesh = set_on_plate(mesh, best_orientation(mesh, profile.process.self_supporting_angle_deg).rotation)
    needs_mm2 = float(mesh.areas_mm2[needing_upright(mesh, profile)].sum())
    whole = best_lying(decompose(mesh, name, profile, request=SearchRequest(parts=1)), profile)
    used = (whole.time_s / 60.0, whole.filament_mm / 1000.0) if whole.time_s is not None else None
    yield _cells(ONE_PIECE, 1, needs_mm2, 0.0, used, whole.message)
    if (made := theirs(mesh, profile, True, 1)) is not None:
        yield _cells(PRUSA, 1, needs_mm2, 0.0, minutes_and_metres(made.program, profile), "")

    def ours(turned: Mesh, turned_profile: Profile = profile) -> Decomposition:
        return decompose(turned, name, turned_profile, request=SearchRequest(price=pricing(turned_profile)))

    yield _in_parts(PARTS, orient_and_decompose(mesh, profile, pricing, ours).decomposition, profile)
    for label, ranker, width in PUBLISHED:
        terms = load(settings=[*settings, *OWN, f"search.beam_width={width}"])
        yield _in_parts(label, decompose(mesh, name, terms, request=SearchRequest(ranker=ranker)), profile)


def _in_parts(label: str, found: Decomposition, profile: Profile) -> list[str]:
    """The cells of a decomposition: printed, or why it cannot be."""
    needs_mm2 = sum(float(part.mesh.areas_mm2[residual_faces(part, profile)].sum()) for part in found.parts)
    cells = partial(_cells, label, len(found.parts), needs_mm2, found.seam_mm)
    try:
        program = build(found, profile)
    except UserError as error:
        return cells(None, str(error))
    return cells(minutes_and_metres(program.run.program, profile), "".join(error.message for error in program.run.errors[:1]))


def _cells(label: str, parts: int, needs_mm2: float, seam_mm: float, used: Used, message: str) -> list[str]:
    minutes, metres = ("-", "-") if used is None else (f"{used[0]:.0f}", f"{used[1]:.2f}")
    return [label, str(parts), f"{needs_mm2:.0f}", f"{seam_mm:.0f}", minutes, metres, message]


if __name__ == "__main__":
    parser = options_of(__doc__)
    parser.add_argument("--longest", type=float, default=0.0, metavar="MM", help="scale models to this extent; 0: as they are")
    parser.add_argument("--log", type=Path)
    run(parser, bench)
