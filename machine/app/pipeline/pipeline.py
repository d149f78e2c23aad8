"""Pipeline: joins the stages, from a model's name to parts, sliced parts, G-code lines and the dry run."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from machine.app.output import write_bytes
from machine.app.pictures.thumbnail import with_thumbnails
from machine.app.pipeline.given_plan import read_given_plan
from machine.app.pipeline.precompile import compile_pictures, compile_program, compile_search
from machine.app.pipeline.pricing import pricing
from machine.app.requests import ModelRequest
from machine.app.terminal.progress import reporting, say
from machine.dryrun.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.planning.limits import check_parts
from machine.planning.plan import plan
from machine.view.program import Program
from mdp.decomposition import Decomposition
from mdp.mesh import Floats, Mesh
from mdp.plan_file import PlanFile, plan_of
from mdp.read import locate, read_mesh
from mdp.search.front import price_of_second_mm2
from mdp.search.orientation import best_orientation, in_words, resting_orientations
from mdp.search.ranker import RANKERS
from mdp.search.search import Progress, cut_by_plan
from mdp.search.search import decompose as search_parts
from mdp.zone import NO_ZONES
from profiles.errors import ProfileError
from profiles.profile import Profile
from slicer.parts import slice_parts

ORIENTATIONS_TRIED = 4
WELL_REDUCED = 0.9


@dataclass(frozen=True, eq=False)
class Decomposed:
    """A decomposition, the plan that cuts it again, and how long its steps took."""

    decomposition: Decomposition
    plan: PlanFile
    read_s: float
    total_s: float


def decompose_model(request: ModelRequest, to_build: bool = False) -> Decomposed:
    """Read a model and find its parts; repairs and notes go to stderr.

    to_build: `build` comes next, the first run may compile what it needs meanwhile, and the rows of the front that need not be
    chosen from get no time.
    """
    if request.ranker not in RANKERS:
        raise ProfileError(f"--ranker {request.ranker}: this version knows {', '.join(RANKERS)}")
    profile, record_file = request.profile, request.outputs.record
    given = read_given_plan(request)
    began = perf_counter()
    mesh, repairs = read_mesh(locate(request.model), profile.process.scale, profile.process.rotate_deg)
    read_s = perf_counter() - began
    for repair in repairs:
        say(f"{request.name}: {repair}")
    compile_search(to_build)
    orientation = _orientation(mesh, request, given)
    if orientation is not None:
        mesh = standing_still(mesh, orientation)
    cuts, records = request.cuts, list[bytes]()
    free = cuts.plan is not None or cuts.parts is not None or price_of_second_mm2(profile) <= 0.0
    price = None if to_build and free else pricing(profile)
    on_record = None if record_file is None else records.append
    with reporting() as report:

        def show(progress: Progress) -> None:
            left = f"{100 * progress.best_share:.1f} % of the risky area left"
            report(f"searching parts: stage {progress.stage}, {progress.beam} in the beam, {left}")

        if given is not None and cuts.plan is not None:
            decomposition = cut_by_plan(mesh, request.name, profile, given, request.ranker, cuts.parts, price)
        else:
            decomposition = search_parts(mesh, request.name, profile, request.ranker, show, on_record, given, cuts.parts, price)
    if record_file is not None:
        write_bytes(record_file, records[0])
    for note in (*decomposition.notes, *_hints(decomposition, request)):
        say(f"{request.name}: {note}")
    zones = NO_ZONES if given is None else given.zones
    return Decomposed(decomposition, plan_of(decomposition, zones, orientation), read_s, perf_counter() - began)


def _orientation(mesh: Mesh, request: ModelRequest, given: PlanFile | None) -> Floats | None:
    """The rotation that lays the model down: a plan's own, else the best where that is asked for; None: as it stands."""
    if given is not None:
        return None if given.orientation is None else np.array(given.orientation)
    return best_way_down(mesh, request.profile) if request.orient else None


def best_way_down(mesh: Mesh, profile: Profile) -> Floats | None:
    """The rotation into the resting orientation where a quick search finds what costs least; None: as it stands."""
    quick = profile.model_copy(update={"search": profile.search.model_copy(update={"beam_width": 1})})
    resting = resting_orientations(mesh, profile.process.self_supporting_angle_deg, ORIENTATIONS_TRIED)
    choices = [mesh, *(standing_still(mesh, orientation.rotation) for orientation in resting)]
    price, second_mm2 = pricing(profile), price_of_second_mm2(profile)
    rows = [search_parts(choice, "oriented", quick, price=price).chosen for choice in choices]
    costs = [0.0 if row is None else row.cost_mm2 + second_mm2 * (row.time_s or 0.0) for row in rows]
    best = costs.index(min(costs))
    say("the model is best printed as it stands" if best == 0 else f"the model is {in_words(resting[best - 1])}")
    return None if best == 0 else resting[best - 1].rotation


def standing_still(mesh: Mesh, rotation: Floats) -> Mesh:
    """The mesh turned, then set on z = 0 and centred about the turn axis."""
    turned = mesh.transform(rotation)
    low, high = turned.bounds_mm
    middle = 0.5 * (low + high)
    return turned.transform(np.eye(3), (-middle[0], -middle[1], -low[2]))


def _hints(decomposition: Decomposition, request: ModelRequest) -> tuple[str, ...]:
    """What might do better than these parts."""
    asked = request.orient or request.cuts.plan is not None
    if asked or decomposition.reduction > WELL_REDUCED or decomposition.risky_area_mm2 <= 0:
        return ()
    single = best_orientation(decomposition.mesh, request.profile.process.self_supporting_angle_deg)
    if single.risky_mm2 >= decomposition.residual_area_mm2:
        return ()
    return (f"{in_words(single)} it would leave {single.risky_mm2:.0f} mm2 risky even in one part: try --orient",)


def build(decomposition: Decomposition, profile: Profile, pictures: bool = False) -> Program:
    """Slice, plan, write and dry-run a decomposition. Raises MoveError, before slicing, for a part outside the axes' ranges.

    pictures: the G-code becomes a file, with the pictures in its head that the machine's pages show.
    """
    parts = decomposition.parts
    check_parts(parts, profile)
    compile_program(profile)
    with reporting() as report:

        def show(begun: int, of: int, layers: int, all_layers: int) -> None:
            percent = min(100, 100 * layers // max(all_layers, 1))
            report(f"slicing part {max(begun, 1)} of {of}: {percent} % of all layers", percent / 100)

        sliced = slice_parts(parts, profile, show)
        report("planning moves")
        lines = tuple(write_gcode(plan(decomposition, sliced, profile), profile))
        if pictures and profile.machine.thumbnails_px:
            compile_pictures()
            lines = with_thumbnails(lines, decomposition, profile)
        report("dry run")
        run = dry_run(lines, profile)
    return Program(lines, run, decomposition, sliced)
