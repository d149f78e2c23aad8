"""Pipeline: joins the stages, from a model's name to parts, sliced parts, G-code lines and the dry run."""

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from machine.app.output import write_bytes
from machine.app.progress import Ticker, say
from machine.app.thumbnail import with_thumbnails
from machine.app.warmup import warm_program, warm_search
from machine.dryrun.dryrun import DryRun, dry_run
from machine.gcode import write_gcode
from machine.limits import check_parts
from machine.plan import plan
from mdp.decomposition import Decomposition
from mdp.mesh import Floats, Mesh
from mdp.orientation import best_orientation, in_words, resting_orientations
from mdp.ranker import RANKERS
from mdp.read import locate, read_mesh
from mdp.search import Progress
from mdp.search import decompose as search_parts
from profiles.errors import ProfileError
from profiles.profile import Profile
from slicer.parts import slice_parts
from slicer.paths import SlicedPart

ORIENTATIONS_TRIED = 4
WELL_REDUCED = 0.9


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
    sliced: tuple[SlicedPart, ...] = ()


def model_name(model: str) -> str:
    """The name that files and messages carry: the file's name without its folder."""
    return model if model.startswith("demo:") else Path(model).name


def decompose_model(
    model: str, profile: Profile, ranker: str, orient: bool = False, record: Path | None = None, to_build: bool = False
) -> Decomposed:
    """Read a model and find its parts; repairs and notes go to stderr. orient: lay the model down in the best way first.

    to_build: `build` comes next, the first run may compile what it needs meanwhile.
    """
    if ranker not in RANKERS:
        raise ProfileError(f"--ranker {ranker}: this version knows {', '.join(RANKERS)}")
    began = perf_counter()
    mesh, repairs = read_mesh(locate(model), profile.process.scale, profile.process.rotate_deg)
    read_s = perf_counter() - began
    for repair in repairs:
        say(f"{model_name(model)}: {repair}")
    warm_search(to_build)
    if orient:
        mesh = _laid_down(mesh, profile)
    ticker = Ticker()

    def show(progress: Progress) -> None:
        left = f"{100 * progress.best_share:.1f} % of the risky area left"
        ticker.tick(f"searching parts: stage {progress.stage}, {progress.beam} in the beam, {left}")

    kept: list[bytes] = []
    found = search_parts(mesh, model_name(model), profile, ranker, show, kept.append if record is not None else None)
    if record is not None:
        write_bytes(record, kept[0])
    ticker.close()
    for note in (*found.notes, *_hints(found, profile, orient)):
        say(f"{model_name(model)}: {note}")
    return Decomposed(found, read_s, perf_counter() - began)


def _laid_down(mesh: Mesh, profile: Profile) -> Mesh:
    """The model as it stands or in one of its resting orientations: where a quick search leaves the least risky area."""
    quick = profile.model_copy(update={"search": profile.search.model_copy(update={"beam_width": 1})})
    found = resting_orientations(mesh, profile.process.self_supporting_angle_deg, ORIENTATIONS_TRIED)
    choices = [mesh, *(standing_still(mesh, orientation.rotation) for orientation in found)]
    left = [search_parts(choice, "oriented", quick).residual_area_mm2 for choice in choices]
    best = left.index(min(left))
    say("the model is best printed as it stands" if best == 0 else f"the model is {in_words(found[best - 1])}")
    return choices[best]


def standing_still(mesh: Mesh, rotation: Floats) -> Mesh:
    """The mesh turned, then set on z = 0 and centred about the turn axis."""
    turned = mesh.moved(rotation)
    low, high = turned.bounds_mm
    middle = 0.5 * (low + high)
    return turned.moved(np.eye(3), (-middle[0], -middle[1], -low[2]))


def _hints(found: Decomposition, profile: Profile, orient: bool) -> tuple[str, ...]:
    """What might do better than the parts found."""
    if orient or found.reduction > WELL_REDUCED or found.risky_area_mm2 <= 0:
        return ()
    single = best_orientation(found.mesh, profile.process.self_supporting_angle_deg)
    if single.risky_mm2 >= found.residual_area_mm2:
        return ()
    return (f"{in_words(single)} it would leave {single.risky_mm2:.0f} mm2 risky even in one part: try --orient",)


def build(decomposition: Decomposition, profile: Profile, pictures: bool = False) -> Program:
    """Slice, plan, write and dry-run a decomposition. Raises MoveError, before slicing, for a part outside the axes' ranges.

    pictures: the G-code becomes a file, with the pictures in its head that the machine's pages show.
    """
    ticker = Ticker()
    parts = decomposition.parts

    def show(begun: int, of: int, layers: int, all_layers: int) -> None:
        share = min(100, 100 * layers // max(all_layers, 1))
        ticker.tick(f"slicing part {max(begun, 1)} of {of}: {share} % of all layers")

    check_parts(parts, profile)
    warm_program(profile)
    sliced = slice_parts(parts, profile, show)
    ticker.tick("planning moves", at_once=ticker.live)
    lines = tuple(write_gcode(plan(decomposition, sliced, profile), profile))
    if pictures:
        lines = with_thumbnails(lines, decomposition, profile)
    ticker.tick("dry run", at_once=ticker.live)
    run = dry_run(lines, profile)
    ticker.close()
    return Program(lines, run, decomposition, sliced)
