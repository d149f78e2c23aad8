"""Given plan: the file with planes to cut by or to start the search from, and the options that conflict with it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from machine.pipeline.project_record import RECORD
from machine.pipeline.requests import MOST_COPIES, ModelRequest
from machine.planning.stops import check_stop_parts, parts_in_words
from mdp.directions.orientation import motion_between
from mdp.mesh import Mesh
from mdp.model_file import plan_beside
from mdp.search.plan_file import PlanFile
from mdp.search.plan_reading import read_plan
from mdp.search.search import check_part_count
from mdp.zone import NO_ZONES, Modifier, Zones
from profiles.errors import PlanError, ProfileError
from profiles.messages import key_name, option
from profiles.part_settings import problems_of_place
from profiles.profile import Profile, with_part_settings


def request_of_each(request: ModelRequest) -> dict[str, ModelRequest]:
    """The request for each model of a plate, with the plan that names it. Raises PlanError."""
    models = list(dict.fromkeys((request.model, *request.beside)))
    alone = len(models) == 1 and not (request.copies > 1 and request.profile.process.complete_objects)
    stops = request.stops if alone else ()  # else they count the parts of all
    each = {name: replace(request, model=name, beside=(), plans=(), stops=stops) for name in models}
    names = [own.name for own in each.values()]
    if request.profile.parts and len(models) > 1:
        part = request.profile.parts[0]
        raise PlanError(
            f"{option('part', part.part)} goes with one model, and several are given, {', '.join(names)}: settings of a part "
            f"of one of them stand in its plan, as process = {{...}} of its [[part]], and {option('plan')} names that"
        )
    for file in request.plans:
        model = read_plan(file).model if len(models) > 1 else names[0]
        if names.count(model) != 1:
            raise PlanError(
                f'plan {file}: model is "{model}": beside other models it must be the name of one of these: {", ".join(names)}'
            )
        name = models[names.index(model)]
        if each[name].plans:
            raise PlanError(
                f"{option('plan', file)}: {option('plan', each[name].plan)} cuts {model} already, and one plan cuts a model"
            )
        each[name] = replace(each[name], plans=(file,))
    for name, own in each.items() if request.project is not None else ():
        if name != request.model:  # a project's plate is of its first model, and an old one has no plans of the others
            each[name] = replace(own, own_marks=own.own_marks or not own.plans, plate=None)
    return each


def with_file_marks(plan: PlanFile, zones: Zones, before: Mesh, after: Mesh, pedestal_mm: float) -> PlanFile:
    """The plan with the marks in the model's file, whose coordinates are those of the file. before, after: the model as read and
    in its orientation; pedestal_mm: height of the pedestal."""
    if zones == NO_ZONES:
        return plan
    rotation, shift_mm = (np.eye(3), np.zeros(3)) if after is before else motion_between(before, after)
    return replace(plan, zones=zones.transform(rotation, shift_mm + np.array([0.0, 0.0, pedestal_mm])).beside(plan.zones))


def check_number(request: ModelRequest) -> None:
    """Raise PlanError for more models than a plate may have."""
    count = request.copies * (1 + len(request.beside))
    if count > MOST_COPIES:
        of_each = f" with {option('copies', request.copies)}" if request.copies > 1 else ""
        raise PlanError(f"{count} models are to stand on the plate{of_each}: {MOST_COPIES} at most are allowed")


def read_given_plan(request: ModelRequest) -> PlanFile | None:
    """The plan to cut by or start from; None: search freely. Raises PlanError, also for conflicting options."""
    plan, planes, record = request.plan, request.planes, request.outputs.record
    if request.parts is not None:
        check_part_count(request.parts)
    turned = key_name("process.rotate_deg")
    unsearched = f"{option('plan', plan)} exists, so nothing is searched"
    clashes = (
        (plan and planes, f"{option('planes', planes)}: {unsearched}; one of them is allowed"),
        (plan and record, f"{option('record', record)}: {unsearched} that could be recorded"),
        (
            planes and request.orient,
            f"{option('orient')}: the planes of {planes} belong to the model as it lies; {turned} turns it",
        ),
        (plan and request.orient, f"{option('orient')}: the plan {plan} says how the model lies; leave one of them out"),
    )
    for given_both, sentence in clashes:
        if given_both:
            raise PlanError(sentence)
    file = plan or planes
    given = None if file is None else read_plan(file)
    if file is not None and given is not None and request.project is not None and (file.parent / RECORD).is_file():
        given = replace(given, name=request.project.name)  # the user has no other file of it
    if given is not None and given.orientation is not None and request.orient is False:
        raise PlanError(f"{option('as-is')}: the plan {file} gives the model's orientation: leave one of them out")
    return given


def with_plan_of_demo(request: ModelRequest) -> ModelRequest:
    """The request with the plan shipped with a demo, which cuts it whatever the search settings are, unless the user names a
    plan or wants other parts, another orientation or a record of a search."""
    otherwise = request.plans or request.planes or request.parts is not None or request.orient or request.outputs.record
    plan = None if otherwise else plan_beside(request.model)
    return request if plan is None else replace(request, plans=(plan,))


def with_plan_settings(profile: Profile, given: PlanFile | None) -> Profile:
    """The profile with a plan's settings for single parts, overridden by those of --part. Raises PlanError, also for settings
    that a modifier may not have."""
    if given is None:
        return profile
    check_modifiers(profile, given.zones.modifiers, given.label)
    if not given.settings:
        return profile
    try:
        with_part_settings(profile.of_all_parts, given.settings)
    except ProfileError as error:
        raise PlanError(f"{given.label}{error}") from None
    return with_part_settings(profile, given.settings)


def check_modifiers(profile: Profile, modifiers: Sequence[Modifier], where: str) -> None:
    """Raise PlanError for settings that a modifier may not have with a profile. where: beginning of the sentence."""
    for number, modifier in enumerate(modifiers, start=1):
        problems = list(problems_of_place(profile.process, modifier.process, profile.machine.head.nozzle_mm))
        if problems:
            raise PlanError(where + "; ".join(f"modifier {number}: {problem}" for problem in problems))


def check_parts_possible(request: ModelRequest, given: PlanFile | None, profile: Profile) -> None:
    """Raise ProfileError or SliceError before the search for settings or stops of parts that it cannot make."""
    planes = () if given is None else given.row(request.parts) if request.plan and request.parts else given.parts
    most = len(planes) + 1 if request.plan else max(len(planes) + 1, request.parts or profile.search.most_parts)
    check_parts_named(profile, most, at_most=True)
    check_stop_parts(request.stops, most, at_most=True)


def check_parts_named(profile: Profile, parts: int, at_most: bool = False) -> None:
    """Raise ProfileError for settings of parts that do not exist. at_most: `parts` is the most there can be."""
    for settings in profile.parts:
        if settings.part > parts:
            there = parts_in_words(parts, at_most)
            raise ProfileError(f"{option('part', settings.part)}: there is no part {settings.part}, {there}")
