"""Cutting: tasks that find parts, cut by planes, try planes, and write files and pictures of the parts.

The process that tries planes caches the preparation of its last bench under the bench's number, which is unique in a run of the
program and passed to every task, because the process may have served another bench meanwhile.
"""

import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product, takewhile
from pathlib import Path
from typing import Any

import numpy as np

from machine.pipeline import compilers
from machine.pipeline.choice import lies_freely, orientation_in_words, pricing, standing_in_words
from machine.pipeline.given_plan import with_file_marks
from machine.pipeline.pictures import PLAIN, contact_sheet, front_picture, parts_picture, parts_together, png_bytes, small_picture
from machine.pipeline.project import PICTURE_PX, STANDING, project_bytes, read_folder, with_meshes_beside
from machine.planning.fit import check_parts
from machine.planning.stops import check_stop_parts
from machine.quantities import amount, newtons, percent
from machine.view.encoding import pack
from machine.view.parts import page_colours, part_colours
from machine.view.scene import solids, surfaces
from machine.workbench.bench.bench import Bench, locked_in_words, locked_plan, plan_of_bench
from machine.workbench.bench.changes import Cuts
from machine.workbench.bench.page_words import page_words
from machine.workbench.work.folders import work_of
from mdp.cut import convex_hull
from mdp.decomposition import Decomposition, FrontRow, Part
from mdp.directions.orientation import set_on_plate
from mdp.joint import flaw_of, joints_of
from mdp.kernels.workers import Tell
from mdp.mesh import Floats, Mesh
from mdp.model_file import locate
from mdp.pedestal import on_pedestal
from mdp.plane import Plane
from mdp.ranking.ranker import CLASSIC, ranker_named
from mdp.read import read_model
from mdp.save import FOLDER_FILES, glb, part_file, stl, threemf
from mdp.search.orient import orient_and_decompose
from mdp.search.parts import one_piece
from mdp.search.plan_file import PlanFile, PlannedPart, mesh_sha256, plan_of, planned_parts
from mdp.search.plan_reading import read_plan
from mdp.search.plan_writing import plan_text
from mdp.search.search import SearchRequest, cut_by_plan, decompose
from mdp.search.trial import Trial, Trials
from mdp.zone import NO_ZONES
from profiles.errors import CutError, MoveError, PlanError
from profiles.files import write_whole
from profiles.machine import Machine
from profiles.profile import Profile, load

AS_IT_STANDS = "to keep the file's: Undo, then clear “Also choose the best orientation” and find parts again"  # the page's label
ZIP_DATE = (1980, 1, 1, 0, 0, 0)  # makes the bytes reproducible
UNTILTED = 1.0 - 1e-9  # least cosine between normals that differ by rounding only
_ready: tuple[int, Trials] | None = None  # cache of the bench that this process served last


@dataclass(frozen=True, eq=False)
class Searched:
    """Progress of a search: a sentence, and the best row of the front so far; None: nothing is cut yet."""

    text: str
    best: FrontRow | None = None


@dataclass(frozen=True, eq=False)
class Found:
    """The front of a search and its notes; turn: (3, 3) further rotation of the model on the bench."""

    front: tuple[FrontRow, ...]
    notes: tuple[str, ...]
    turn: Floats | None = None


def find_parts(tell: Tell, bench: Bench, orient: bool = True, ranker: str = CLASSIC) -> Found:
    """Search for parts as `decompose` does. Raises UserError.

    orient: choose the cheapest orientation together with the parts, unless the user has turned the model, locked planes or marked
    zones; ranker: a name for `ranker_named`.
    """
    ranker_named(ranker)
    assert bench.model is not None
    tell(Searched(f"reading {bench.model.faces:,} faces"))
    mesh, name, profile, locked = turned_mesh(bench), bench.model.name, bench.profile, locked_plan(bench)
    compilers.wait_for(compilers.JUDGE, lambda text, share=None: tell(Searched(text)))
    price, best = pricing(profile.of_all_parts), None

    def search(candidate: Mesh) -> Decomposition:
        otherwise = "" if candidate is mesh else "in another orientation: "

        def say(phase: str) -> None:
            tell(Searched(f"{otherwise}{phase}", best))

        def show(stage: int, beam: int, best_share: float, measure: Callable[[], FrontRow]) -> None:
            nonlocal best
            if stage == 0:
                compilers.wait_for(compilers.SEARCH, lambda text, share=None: tell(Searched(text, best)))
                tell(Searched(f"{otherwise}looking for the first cut along {profile.search.directions:,} directions", best))
                return
            left = f"{percent(best_share, 1)} % of the overhangs left"
            if candidate is mesh:
                best = measure()  # planes of another orientation do not fit the model in the picture
            tell(Searched(f"{otherwise}trying cut {stage}, {left}", best))

        by_hand = with_shapes(bench, locked, candidate)
        request = SearchRequest(ranker=ranker, on_stage=show, on_phase=say, plan=by_hand, price=price)
        try:
            return decompose(candidate, name, profile, request)
        except CutError as error:  # its number is that among the locked planes
            part = (bench.cuts or ()).index(locked.parts[error.part - 2]) + 2
            raise PlanError(locked_in_words(part, error.reason)) from None

    untouched = bench.turned is None and not locked.parts and locked.zones == NO_ZONES
    if orient and untouched and lies_freely(profile):
        tell(Searched(f"comparing orientations of the model ({len(mesh.faces):,} faces)"))
        oriented = orient_and_decompose(mesh, profile, pricing, search)
        turn = None if oriented.orientation is None else oriented.orientation.rotation
        decomposition = oriented.decomposition
        return Found(decomposition.front, (*decomposition.notes, *orientation_in_words(oriented, AS_IT_STANDS)), turn)
    decomposition = search(mesh)
    return Found(decomposition.front, (*decomposition.notes, *standing_in_words(mesh, profile)))


def measure_plan(tell: Tell, bench: Bench, plan: PlanFile, recommended: int = 0) -> tuple[FrontRow, ...]:
    """The measured front of a plan for the model on the bench. recommended: number of parts that the search preferred.

    The front of a search stays as it is if the plan's parts have been changed by hand since. Raises PlanError if they cannot be
    cut.
    """
    found = {row.parts: planned_parts(row) for row in plan.front}
    if found and plan.parts not in found.values():
        cut_bench(bench, replace(plan, front=()))
        plan = replace(plan, parts=found.get(recommended, next(iter(found.values()))))
        with suppress(CutError):  # a row of a coarse copy may not cut the model itself
            return cut_bench(bench, plan, prices=True).front
        plan = replace(plan, parts=next(iter(found.values())))
    return cut_bench(bench, plan, prices=True).front


def price_row(tell: Tell, bench: Bench, number: int) -> FrontRow:
    """A row of the front with its time and filament; without them if it cannot be cut, or has a flaw."""
    row = bench.rows[number]
    with suppress(PlanError):
        parts = planned_parts(row)
        cut = cut_bench(bench, replace(plan_of_bench(bench), parts=parts, front=()), prices=True)
        by_hand = sum(1 for _ in takewhile(bench.locked.__contains__, reversed(parts)))
        flaw = flaw_of(cut.mesh, cut.parts, bench.profile, by_hand)
        return replace(row, flaw=flaw) if flaw else cut.front[0]
    return row


def price_cuts(tell: Tell, bench: Bench) -> FrontRow:
    """The row of the planes on the bench with its time and plastic. Raises PlanError where they cannot be cut."""
    cut = cut_bench(bench, replace(plan_of_bench(bench), front=()), prices=True)
    return next(row for row in cut.front if row.chosen)


def make_plan(tell: Tell, bench: Bench) -> str:
    """The plan of the bench, as text; also if it cannot be cut."""
    plan, _ = with_meshes_beside(_saved_plan(bench)[0])
    return plan_text(plan)


def make_project(tell: Tell, bench: Bench, out: Path) -> None:
    """Write the project of the bench. Its picture shows the parts, or the whole model if they cannot be cut."""
    if not bench.beside:
        check_stop_parts(bench.stops, max(bench.parts, 1))
    plans, models = zip(*map(_saved_plan, bench.plate), strict=True)
    compilers.wait_for(compilers.PICTURES)
    picture = png_bytes(parts_together(models[0], bench.profile, PICTURE_PX))
    out.write_bytes(project_bytes(work_of(bench), plans, models[0].mesh, picture))


def _saved_plan(bench: Bench) -> tuple[PlanFile, Decomposition]:
    """The plan of the bench for a file, and its parts, one piece if they cannot be cut. A front that was found stays as it is."""
    plan = plan_of_bench(bench)
    try:
        cut = cut_bench(bench, plan)
    except CutError:
        mesh = on_pedestal(turned_mesh(bench), bench.profile.search.pedestal_mm)
        return replace(plan, sha256=mesh_sha256(mesh)), in_one_piece(plan.model, mesh, bench.profile.machine)
    measured = plan_of(cut)
    parts = tuple(replace(part, remark=own.remark) for part, own in zip(plan.parts, measured.parts, strict=True))
    return replace(plan, sha256=measured.sha256, parts=parts, front=plan.front or measured.front), cut


def in_one_piece(name: str, mesh: Mesh, machine: Machine) -> Decomposition:
    """A mesh as one part."""
    return Decomposition(name, mesh, (one_piece(mesh, machine),), 1, CLASSIC, 0.0, 0.0, 0, 0, 0.0)


def make_folder(tell: Tell, bench: Bench, out: Path) -> None:
    """Write the folder of `decompose -o` as a zip file."""
    decomposition = cut_bench(bench, plan_of_bench(bench))
    parts = [(part_file(part.index), stl(part.mesh)) for part in decomposition.parts]
    model, _, plan, scene = FOLDER_FILES
    with_files, meshes = with_meshes_beside(plan_of(decomposition, bench.zones, bench.turned, bench.profile.parts))
    beside = [(name, file.read_bytes()) for name, file in meshes.items()]
    own = (model, threemf(decomposition)), (plan, plan_text(with_files).encode()), (scene, glb(decomposition))
    write_zip(out, [*parts, *beside, *own])


def write_zip(out: Path, files: Sequence[tuple[str, bytes]]) -> None:
    """Write files as a zip file with reproducible bytes."""
    with zipfile.ZipFile(out, "w") as archive:
        for name, text in files:
            entry = zipfile.ZipInfo(name, ZIP_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text)


def cut_bench(bench: Bench, plan: PlanFile, prices: bool = False) -> Decomposition:
    """Cut the model on the bench by a plan; prices: also measure the rows of its front."""
    assert bench.model is not None
    mesh, name = turned_mesh(bench, plan), bench.model.name
    compilers.wait_for(compilers.JUDGE)
    marked = with_shapes(bench, plan, mesh)
    return cut_by_plan(
        mesh, name, bench.profile, SearchRequest(plan=marked, price=pricing(bench.profile.of_all_parts) if prices else None)
    )


def with_shapes(bench: Bench, plan: PlanFile, mesh: Mesh) -> PlanFile:
    """The plan with the marks of the model's file that are not boxes, moved to the model's current orientation."""
    assert bench.model is not None
    shapes = bench.model.shapes()
    return (
        plan if shapes == NO_ZONES else with_file_marks(plan, shapes, bench.model.mesh(), mesh, bench.profile.search.pedestal_mm)
    )


def turned_mesh(bench: Bench, plan: PlanFile | None = None) -> Mesh:
    """The mesh in the plan's orientation, or else in the bench's."""
    assert bench.model is not None
    turned = bench.turned if plan is None else None if plan.orientation is None else np.array(plan.orientation)
    return set_on_plate(bench.model.mesh(), turned)


def draw_pieces(tell: Tell, bench: Bench, out: Path) -> None:
    """Write the parts of the bench, for the page to draw separately."""
    out.write_bytes(pieces_block(cut_bench(bench, plan_of_bench(bench)), bench.profile))


def pieces_block(decomposition: Decomposition, profile: Profile) -> bytes:
    """Surfaces and figures of all parts in print order; under the key `fit`, why the machine cannot reach them, in the words of
    `export`."""
    colours = page_colours(len(decomposition.parts))
    records = solids(decomposition, profile, joints_of(decomposition.parts, profile))
    parts = [record | _joint_words(record) | {"colour": colour} for record, colour in zip(records, colours, strict=True)]
    return pack({"parts": parts, "fit": page_words(out_of_reach(decomposition.parts, profile))}, surfaces(decomposition, profile))


def _joint_words(record: dict[str, Any]) -> dict[str, str]:
    """Area and load of a part's joint, if it has one, in words."""
    if (joint := record["joint"]) is None:
        return {}
    weakest = ": the weakest" if joint["weakest"] else ""
    return {
        "holds": f"{amount(joint['area_mm2'], 1)} mm², breaks at about {newtons(joint['load_n'])} N sideways at the tip{weakest}"
    }


def out_of_reach(parts: Sequence[Part], profile: Profile) -> str:
    """Why the machine cannot reach parts in their poses; "" if it can."""
    try:
        check_parts(parts, profile)
    except MoveError as error:
        return f"{error}"
    return ""


def draw_kept(tell: Tell, folder: Path, out: Path) -> None:
    """Write the small picture of autosaved work: its parts, or its model if that is not or cannot be cut. Raises UserError."""
    project = read_folder(folder)
    given, name = project.given, project.name
    profile = load(given.machine, given.material, given.process, given.settings)
    file, process = locate(name) if project.model is None else project.model, profile.process
    turned = None if project.rotation == STANDING else np.array(project.rotation)
    mesh = set_on_plate(read_model(file, process.scale, process.rotate_deg, project.plate).mesh, turned)
    meshes, colours = [mesh], [PLAIN]
    if project.plan is not None and project.parts > 1:
        compilers.wait_for(compilers.JUDGE)
        plan = replace(read_plan(project.plan), front=())
        with suppress(CutError):  # then the model is shown whole
            meshes = [part.mesh for part in cut_by_plan(mesh, name, profile, SearchRequest(plan=plan)).parts]
            colours = [(r, g, b) for r, g, b in part_colours(len(meshes)).tolist()]
    compilers.wait_for(compilers.PICTURES)
    with suppress(OSError):  # another page removes the work meanwhile
        write_whole(out, small_picture(meshes, colours))


def make_pictures(tell: Tell, bench: Bench, out: Path) -> None:
    """Write the pictures of `--png`, `--sheet` and `--front` for the bench's parts as a zip file."""
    decomposition = cut_bench(bench, plan_of_bench(bench), prices=True)
    compilers.wait_for(compilers.PICTURES)
    images = {
        "parts.png": parts_picture(decomposition, bench.profile),
        "order.png": contact_sheet(decomposition, bench.profile.machine),
        "front.png": front_picture(decomposition, bench.profile),
    }
    write_zip(out, [(name, png_bytes(image)) for name, image in images.items()])


def make_ready(tell: Tell, number: int, bench: Bench) -> None:
    _trials(number, bench)


def load_kernels(tell: Tell) -> None:
    """Load or compile the kernels for planes before there is a model, by means of a box. Drops the cached bench."""
    global _ready
    _ready = None
    compilers.wait_for((*compilers.JUDGE, *compilers.SEARCH))
    corners = np.array(list(product((0.0, 10.0), repeat=3)))
    Trials(convex_hull(corners), load()).warm()


def try_cuts(tell: Tell, number: int, bench: Bench, cuts: Cuts, most_cuts: float, aside: Cuts = ()) -> Trial:
    """Try planes; most_cuts: see mdp.search.trial; aside: those that are cut without a check."""
    return _trials(number, bench, aside).attempt(_planes(cuts), most_cuts)


def support_uncut(tell: Tell, number: int, bench: Bench) -> float:
    """The area of the model in one piece that needs support, mm2."""
    return _trials(number, bench).uncut_support_mm2


def near_neck(tell: Tell, number: int, bench: Bench, cuts: Cuts, part: int, reach_mm: float, aside: Cuts = ()) -> Plane | None:
    """The neck near the plane of a part, from `Trials.neck`; aside: see try_cuts."""
    return _trials(number, bench, aside).neck(_planes(cuts), part, reach_mm)


def nearest(tell: Tell, number: int, bench: Bench, orders: list[tuple[Cuts, int]], aside: Cuts = ()) -> Cuts | None:
    """Among several print orders the planes that can be cut with the least shift of one part's plane, from `Trials.nearest`; None
    if there are none. orders: planes, each with the number of that part; aside: see try_cuts."""
    trials, best = _trials(number, bench, aside), None
    for cuts, part in orders:
        wanted, plane = cuts[part - 2].plane, trials.nearest(_planes(cuts), part)
        if plane is None or wanted is None:
            continue
        leans, far_mm = float(plane.normal @ wanted.normal) < UNTILTED, abs(plane.offset_mm - wanted.offset_mm)
        if best is None or (leans, far_mm) < best[0]:
            put = PlannedPart.of(plane)
            best = (leans, far_mm), (*cuts[: part - 2], put, *cuts[part - 1 :])
    return None if best is None else best[1]


def _trials(number: int, bench: Bench, aside: Cuts = ()) -> Trials:
    global _ready
    if _ready is None or _ready[0] != number:
        _ready = None  # two at once would need too much memory
        compilers.wait_for((*compilers.JUDGE, *compilers.SEARCH))
        mesh = turned_mesh(bench)
        zones = with_shapes(bench, plan_of_bench(bench), mesh).zones
        trials = Trials(mesh, bench.profile, zones)
        trials.warm()
        _ready = number, trials
    _ready[1].set_aside(_planes(aside))
    return _ready[1]


def _planes(cuts: tuple[PlannedPart, ...]) -> list[Plane]:
    return [plane for part in cuts if (plane := part.plane) is not None]
