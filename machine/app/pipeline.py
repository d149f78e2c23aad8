"""Pipeline: joins the stages, from a model's name to parts, sliced parts, G-code lines and the dry run."""

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from machine.app.progress import Ticker, say
from machine.app.warmup import warm
from machine.dryrun.dryrun import DryRun, dry_run
from machine.gcode import write_gcode
from machine.plan import plan
from mdp.decomposition import Decomposition
from mdp.ranker import RANKERS
from mdp.read import locate, read_mesh
from mdp.search import Progress
from mdp.search import decompose as search_parts
from profiles.errors import ProfileError
from profiles.profile import Profile
from slicer.slice import slice_part


@dataclass(frozen=True, eq=False)
class Decomposed:
    """A decomposition and how long its steps took."""

    decomposition: Decomposition
    read_s: float
    total_s: float


@dataclass(frozen=True, eq=False)
class Program:
    """The G-code of a print, its dry run, and its parts where it was made from a model."""

    lines: tuple[str, ...]
    run: DryRun
    decomposition: Decomposition | None


def model_name(model: str) -> str:
    """The name that files and messages carry: the file's name without its folder."""
    return model if model.startswith("demo:") else Path(model).name


def decompose_model(model: str, profile: Profile, ranker: str) -> Decomposed:
    """Read a model and find its parts; repairs and notes go to stderr."""
    if ranker not in RANKERS:
        raise ProfileError(f"--ranker {ranker}: this version knows {', '.join(RANKERS)}")
    began = perf_counter()
    mesh, repairs = read_mesh(locate(model), profile.process.scale, profile.process.rotate_deg)
    read_s = perf_counter() - began
    for repair in repairs:
        say(f"{model_name(model)}: {repair}")
    warm(profile)
    ticker = Ticker()

    def show(progress: Progress) -> None:
        left = f"{100 * progress.best_share:.1f} % of the risky area left"
        ticker.tick(f"searching parts: stage {progress.stage}, {progress.beam} in the beam, {left}")

    found = search_parts(mesh, model_name(model), profile, ranker, show)
    ticker.close()
    for note in found.notes:
        say(f"{model_name(model)}: {note}")
    return Decomposed(found, read_s, perf_counter() - began)


def build(decomposition: Decomposition, profile: Profile) -> Program:
    """Slice, plan, write and dry-run a decomposition."""
    ticker = Ticker()
    parts = decomposition.parts
    sliced = []
    for position, part in enumerate(parts):
        ticker.tick(f"slicing part {part.index} of {len(parts)}", at_once=ticker.live)
        sliced.append(slice_part(part, profile, parts[:position], parts[position + 1 :]))
        if sliced[-1].unsupported_mm2 > 0:
            say(f"part {part.index}: {sliced[-1].unsupported_mm2:.0f} mm2 hang free: no support could be rooted below them")
    ticker.tick("planning moves", at_once=ticker.live)
    lines = tuple(write_gcode(plan(decomposition, sliced, profile), profile))
    ticker.tick("dry run", at_once=ticker.live)
    run = dry_run(lines, profile)
    ticker.close()
    return Program(lines, run, decomposition)
