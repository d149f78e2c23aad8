"""Pipeline: joins the stages from a model's name to parts, sliced parts, G-code lines and the dry run."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from machine.dryrun.dryrun import DryRun, dry_run
from machine.firmware import dialect_of
from machine.gcode.blocks import check_blocks
from machine.gcode.writer import write_gcode
from machine.notices import Report, reporting, say
from machine.pipeline import compilers
from machine.pipeline.choice import as_turned, lays_down, orientation_in_words, pricing, standing_in_words
from machine.pipeline.given_plan import (
    check_modifiers,
    check_number,
    check_parts_named,
    check_parts_possible,
    read_given_plan,
    request_of_each,
    with_file_marks,
    with_plan_of_demo,
    with_plan_settings,
)
from machine.pipeline.output import write_bytes
from machine.pipeline.pictures import with_thumbnails
from machine.pipeline.plate import naming, naming_parts, on_one_plate
from machine.pipeline.requests import ModelRequest, check_copies
from machine.planning.fit import check_parts, check_standing, lifted, standing_at
from machine.planning.moves import MachineProgram
from machine.planning.plan import has_purge, plan
from machine.planning.stops import Stop, check_stop_heights
from machine.program import Program
from mdp.decomposition import Decomposition, FrontRow, Part
from mdp.directions.orientation import set_on_plate
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.ranking.ranker import ranker_named
from mdp.read import ReadModel, read_model
from mdp.search.front import Pricing, Weights
from mdp.search.orient import orient_and_decompose
from mdp.search.plan_file import NO_PLAN, PlanFile, plan_of
from mdp.search.search import SearchRequest, cut_by_plan, decompose
from mdp.zone import NO_ZONES
from profiles.messages import key_name, option
from profiles.profile import Profile
from slicer.interface.interface import pin_width_mm, room_around_mm
from slicer.paths import SlicedPart
from slicer.slice import SlicingProgress, slice_parts

Record = tuple[Decomposition, list[bytes]]  # result and record of a search; the record only on request


@dataclass(frozen=True, eq=False)
class Decomposed:
    """A decomposition, the plan that repeats its cuts, and the times of its steps.

    profile: for its print, with the plan's settings of single parts and the orientation.
    """

    decomposition: Decomposition
    profile: Profile
    plan: PlanFile
    read_s: float
    total_s: float


def decompose_model(request: ModelRequest, to_build: bool = False) -> Decomposed:
    """Read and decompose a model, or each model of a plate; repairs and notes go to stderr.

    to_build: `build` follows: its kernels are compiled meanwhile, and rows of the front without a choice get no time. Raises
    PlanError for models that do not fit on a plate, and for options of a single model.
    """
    began = perf_counter()
    each = decompose_each(request, to_build)
    models = [name for name in (request.model, *request.beside) for _ in range(request.copies)]
    first = each[request.model]
    profile = first.profile if len(each) == 1 else request.profile  # each has an orientation of its own
    settings = {own.decomposition: own.profile.parts for own in each.values()}
    decomposition, profile = on_one_plate([each[name].decomposition for name in models], profile, settings)
    return replace(first, decomposition=decomposition, profile=profile, total_s=perf_counter() - began)


def decompose_each(request: ModelRequest, to_build: bool) -> dict[str, Decomposed]:
    """Decompose each model of a plate by itself, the first one first. Raises PlanError for options of a single model."""
    compilers.keep_modules()
    ranker_named(request.ranker)  # report a wrong ranker before any other work
    check_copies(request.copies, option("copies"))
    check_number(request)
    each = {}
    for name, own in request_of_each(request).items():
        with naming(Path(name).name if request.beside else ""):
            each[name] = _decompose_alone(own, to_build)
    return each


def _decompose_alone(request: ModelRequest, to_build: bool) -> Decomposed:
    """Decompose one of the models by itself."""
    request = with_plan_of_demo(request)
    record_file, given = request.outputs.record, read_given_plan(request)
    profile = with_plan_settings(request.profile, given)
    check_parts_possible(request, given, profile)
    if to_build:
        check_blocks(profile)
    began = perf_counter()
    model = read_model(locate(request.model), profile.process.scale, profile.process.rotate_deg, request.plate)
    mesh, read_s = model.mesh, perf_counter() - began
    for note in (*model.notes, *_part_notes(request, profile)):
        say(f"{request.name}: {note}")
    check_modifiers(profile, model.zones.modifiers, f"{request.name}: ")
    compilers.begin((*compilers.JUDGE, *compilers.SEARCH, *(compilers.bundles_to_build(profile) if to_build else ())))
    compilers.wait_for(compilers.JUDGE)
    orientation = None if given is None or given.orientation is None else np.array(given.orientation)
    if orientation is not None:
        mesh = set_on_plate(mesh, orientation)
    laying = lays_down(request, given, profile)
    if to_build and not laying:
        check_standing(mesh, profile)  # before a search, which may take minutes
    with reporting() as report:
        price, records = _price(request, to_build and not laying), list[Record]()

        def search(mesh: Mesh) -> Decomposition:
            plan = _plan_with_marks(request, given, model, mesh)
            return _search(request, plan, price, report, records, mesh, needs_front=not to_build)

        if laying:
            oriented = orient_and_decompose(mesh, profile, pricing, search)
            decomposition = oriented.decomposition
            notes = orientation_in_words(oriented, f"{option('as-is')} keeps it as it stands")
            orientation = None if oriented.orientation is None else oriented.orientation.rotation
        else:
            decomposition, notes = search(mesh), standing_in_words(mesh, profile)
    if record_file is not None:
        write_bytes(record_file, next(record[0] for searched, record in records if searched is decomposition))
    check_parts_named(profile, len(decomposition.parts))
    for note in (*decomposition.notes, *(decomposition.rejected if request.verbose else ()), *notes):
        say(f"{request.name}: {note}")
    plan = plan_of(decomposition, NO_ZONES if given is None else given.zones, orientation, profile.parts)
    return Decomposed(decomposition, as_turned(profile, orientation), plan, read_s, perf_counter() - began)


def _part_notes(request: ModelRequest, profile: Profile) -> Iterator[str]:
    """Notes before a search that may find fewer parts than have settings, because it may take minutes until that is refused."""
    most = max((own.part for own in profile.parts), default=1)
    if most > 1 and request.plan is None and request.parts is None:
        yield (
            f"{option('part', most)} is refused after the search if that finds fewer parts: {option('plan')} with the plan of an "
            "earlier search fixes them"
        )


def _price(request: ModelRequest, unused: bool) -> Pricing | None:
    """Prices of parts for the search, None for none. unused: only prices needed to choose a row matter."""
    profile = request.profile.of_all_parts
    free = request.plan is not None or request.parts is not None or not Weights.of(profile)
    return None if unused and free else pricing(profile)


def _search(
    request: ModelRequest,
    given: PlanFile | None,
    price: Pricing | None,
    report: Report,
    records: list[Record],
    mesh: Mesh,
    *,
    needs_front: bool,
) -> Decomposition:
    """The parts of a mesh in its orientation, searched or cut by a plan. records: receives the search's record."""
    asked = SearchRequest(given or NO_PLAN, request.parts, request.ranker, price, needs_front=needs_front)
    if request.plan is not None:
        return cut_by_plan(mesh, request.name, request.profile, asked)

    def show(stage: int, beam: int, best_share: float, measure: Callable[[], FrontRow]) -> None:
        if stage == 0:
            compilers.wait_for(compilers.SEARCH, report)
            return
        report(f"searching parts: stage {stage}, cost down to {100 * best_share:.0f} %")

    record: list[bytes] = []
    on_record = None if request.outputs.record is None else record.append
    asked = replace(asked, on_stage=show, on_phase=report, on_record=on_record)
    decomposition = decompose(mesh, request.name, request.profile, asked)
    records.append((decomposition, record))
    return decomposition


def _plan_with_marks(request: ModelRequest, given: PlanFile | None, model: ReadModel, mesh: Mesh) -> PlanFile | None:
    """The plan with the marks of the model's file, in the model's orientation; None: neither exists."""
    zones = model.zones if request.own_marks else model.zones.shapes
    if zones == NO_ZONES:
        return given
    plan = PlanFile(request.name) if given is None else given
    return with_file_marks(plan, zones, model.mesh, mesh, request.profile.search.pedestal_mm)


def build(
    decomposition: Decomposition,
    profile: Profile,
    *,
    pictures: bool = False,
    stops: Sequence[Stop] = (),
    report: Report | None = None,
    on_slices: Callable[[SlicingProgress], None] | None = None,
) -> Program:
    """Slice, plan, write and dry-run a decomposition at its place on the plate.

    Raises MoveError before slicing for a part that does not fit the machine, ProfileError for a G-code block that the firmware
    refuses. pictures: the G-code becomes a file, with thumbnails for the machine's pages. stops: where the print waits for the
    user. report: shows progress; None: on the terminal. on_slices: receives the parts during slicing.
    """
    parts = decomposition.parts
    check_blocks(profile)
    check_stop_heights(stops, [float(np.ptp(part.mesh.vertices @ part.direction)) for part in parts], profile)
    with naming_parts(parts):
        check_parts(parts, profile)
    decomposition = standing_at(decomposition, profile.process.place_mm)
    parts = decomposition.parts
    compilers.wait_for(compilers.PROGRAM, report)
    compilers.return_unused()  # memory of the search
    with naming_parts(parts), reporting() if report is None else nullcontext(report) as tell:

        def show(slicing: SlicingProgress) -> None:
            if on_slices is not None:
                on_slices(slicing)
            begun, share = max(slicing.begun, 1), slicing.share
            tell(f"slicing part {begun} of {len(parts)}: {int(100 * share)} % of all layers", share)

        decomposition, sliced = lifted(decomposition, slice_parts(parts, profile, show), profile)
        tell("planning moves")
        program = plan(decomposition, sliced, profile, stops)
        for note in (*_too_thin(sliced, profile), *_without_pins(parts, sliced, profile), *_left_out(program, profile)):
            say(f"{decomposition.name}: {note}")
        lines = write_gcode(program, profile)
        if pictures and profile.machine.thumbnails_px:
            compilers.wait_for(compilers.PICTURES, tell)
            lines = with_thumbnails(lines, decomposition, profile)
        del program  # as large as its text, which contains all of it
        compilers.return_unused()
        tell("dry run")
        run = dry_run(lines, profile)
    return Program(lines, run, _with_own_figures(decomposition, run), tuple(sliced))


def _with_own_figures(decomposition: Decomposition, run: DryRun) -> Decomposition:
    """The decomposition, whose chosen row gets the print's time and filament if it has no estimate."""
    chosen = decomposition.chosen
    if chosen is None or chosen.time_s is not None or chosen.parts != len(decomposition.parts):
        return decomposition
    printed = replace(chosen, time_s=run.time_s, filament_mm=float(np.max(run.program.filament_mm, initial=0.0)))
    return replace(decomposition, front=tuple(printed if row is chosen else row for row in decomposition.front))


def _too_thin(sliced: Sequence[SlicedPart], profile: Profile) -> Iterator[str]:
    """Warnings of layers too thin for any line, and of the height at which a vase stops."""
    for part in sliced:
        if part.too_thin and profile.process.spiral_vase and part.layers[-1].z_mm <= part.too_thin_mm + 1e-6:
            yield f"the vase stops at {part.too_thin_mm:.2f} mm: above that the model is too narrow for a spiral wall"
        elif part.too_thin:
            where = f"of part {part.index} {part.too_thin} layer(s), the first at {part.too_thin_mm:.2f} mm"
            nozzle = f"a line of a {profile.machine.head.nozzle_mm:g} mm nozzle"
            wanted = f"a larger {key_name('process.scale')} or a finer nozzle prints them"
            yield f"{where}, hold nothing wide enough for {nozzle}, so what is above them hangs: {wanted}"


def _without_pins(parts: Sequence[Part], sliced: Sequence[SlicedPart], profile: Profile) -> Iterator[str]:
    """Warnings of parts without room for pins."""
    for part, piece in zip(parts, sliced, strict=True):
        own = profile.of_part(part.index)
        if not part.on_plate and own.process.interlock == "pins" and not piece.pins:
            room_mm = pin_width_mm(own) + 2.0 * room_around_mm(own.process)
            deep = f"{own.process.pin_depth_mm:g} mm deep into the part below"
            yield f"no pins under part {part.index}: a pin needs an area {room_mm:.1f} mm wide, {deep}"


def _left_out(program: MachineProgram, profile: Profile) -> Iterator[str]:
    """Warnings of settings without effect in the program."""
    if profile.process.raft_layers and profile.process.brim_mm > 0.0:
        yield (
            f"{key_name('process.brim_mm')} has no effect with a raft: "
            f"{key_name('process.raft_first_layer_expansion_mm')} makes that wider"
        )
    if profile.machine.purge_mm > 0.0 and not has_purge(program):
        yield f"{key_name('machine.purge_mm')} has no effect: no place on the plate is clear of the print for a purge line"
    dialect = dialect_of(profile.machine)
    if profile.material.pressure_advance is not None and not dialect.pressure_advance:
        yield f"{key_name('material.pressure_advance')} is left out: {dialect.firmware} has no command for it"
