"""Plate: several models or copies on one plate, their places and the order of their parts.

Layer by layer: the first parts of all models form one part of the print; the others follow in turn, as limbs printed beside
standing parts. One model after the other (process.complete_objects): the first parts are limbs, too.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from machine.planning.fit import Misfit, Place, Plate, check_parts, standing_at
from machine.quantities import amount
from mdp.cost.footing import tips_over
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Mesh, together
from mdp.overhang import Mask
from mdp.plane import Plane
from mdp.pose import Pose, rotation
from mdp.topology.cross_section import cross_sections
from mdp.zone import Marked, Modifier, Zone, in_room
from profiles.errors import MoveError, PlanError, UserError
from profiles.machine import Machine
from profiles.messages import key_name, phrase
from profiles.part_settings import OF_A_PLACE, SPEEDS_OF_A_PLACE, PartSettings
from profiles.process import Process
from profiles.profile import Profile
from slicer.geometry.polygons import clean
from slicer.raft import reach_mm as raft_reach_mm

GAP_MM = 5.0  # between models or their brims
NUMBERED = re.compile(r"\bpart (\d{1,9})\b")


def on_one_plate(
    models: Sequence[Decomposition], profile: Profile, settings: Mapping[Decomposition, Sequence[PartSettings]] | None = None
) -> tuple[Decomposition, Profile]:
    """Models side by side around their place on the plate as one print, and its profile.

    Copies of a model are the same value. settings: of single parts of each model; None: the profile's apply to every model.
    Raises PlanError for models that do not fit on the plate, or the head beside the others, and for settings of a part that
    cannot apply when the first parts of all models are one.
    """
    if len(models) == 1:
        return models[0], profile
    places, plate = places_of(models, profile)
    x, y = profile.process.place_mm  # all are moved to that place together
    moved = [standing_at(model, (at_x - x, at_y - y)) for model, (at_x, at_y) in zip(plate.models, places, strict=True)]
    for model in dict.fromkeys(moved):
        with naming(model.name):
            check_parts(model.parts[:1], profile)
    own = [profile.parts if settings is None else settings[model] for model in models]
    confined = [[_within(_room(model.mesh), part) for part in model.parts] for model in moved]
    first = [given for given in own[0] if given.part == 1]
    if plate.together and any([given for given in each if given.part == 1] != first for each in own):
        first = []
        for model, each, of_model in zip(moved, own, confined, strict=True):
            of_model[0] = _with_place_settings(of_model[0], model, each)
    parts = [_first_of_all([confined[k][n] for k, n in plate.together])] if plate.together else []
    for (k, n), pose in zip(plate.alone, plate.poses(dict(enumerate(places))), strict=True):
        part = _beside(confined[k][n], len(parts) + 1, pose, profile.machine)
        parts.append(replace(part, of=f"part {n + 1} of {models[k].name}"))
    plated = first if plate.together else []
    for number, (k, n) in enumerate(plate.alone, start=1 + len(plate.together[:1])):
        plated += [given.model_copy(update={"part": number}) for given in own[k] if given.part == n + 1]
    process = profile.process
    if plate.together:
        # the brim of each model alone: together they have a wider base
        process = process.model_copy(update={"brim_mm": plate.brim_mm})
    return _one_print(moved, parts), profile.model_copy(update={"process": process, "parts": plated})


@contextmanager
def naming(model: str) -> Iterator[None]:
    """Add the model's name to a MoveError; "" for a single model."""
    try:
        yield
    except MoveError as error:
        if model:
            error.args = (f"{model}: {error}",)
        raise


@contextmanager
def naming_parts(parts: Sequence[Part]) -> Iterator[None]:
    """Add the model's name to errors about a part, for several models."""
    try:
        yield
    except UserError as error:
        sentence = f"{error}"
        named = NUMBERED.search(sentence)
        part = parts[int(named[1]) - 1] if named and 1 <= int(named[1]) <= len(parts) else None
        if named and part is not None and part.of:
            error.args = (f"{sentence[: named.end()]} ({part.of}){sentence[named.end() :]}",)
        raise


def places_of(models: Sequence[Decomposition], profile: Profile) -> tuple[list[Place], Plate]:
    """Centres of the models on the plate, and the order in which their parts are printed. Raises PlanError."""
    about_axis = {model: _about_axis(model) for model in dict.fromkeys(models)}
    lowest_first = sorted(range(len(models)), key=lambda k: (float(models[k].mesh.bounds_mm[1, 2]), k))
    together = [] if profile.process.complete_objects else [(k, 0) for k in range(len(models))]
    alone = [(k, n) for k in lowest_first for n in range(1 if together else 0, len(models[k].parts))]
    brim_mm, sizes = _brim_mm(models, profile), [_size_mm(model.mesh) for model in models]
    gap_mm = _gap_mm(profile.process, brim_mm)
    centred = [about_axis[model] for model in models]
    plate = Plate(centred, together, alone, profile, brim_mm, sizes, gap_mm)
    found = plate.arrange()
    if isinstance(found, Misfit):
        without_head = Plate(centred, together, [], profile, brim_mm, sizes, gap_mm).arrange()
        found = without_head if isinstance(without_head, Misfit) else found._replace(is_met=True)
        raise PlanError(_reason(found, models, sizes, gap_mm, profile))
    return found, plate


def _about_axis(model: Decomposition) -> Decomposition:
    """A model moved so that its bounding box is centred on the turn axis."""
    x, y = model.mesh.bounds_mm[:, :2].mean(axis=0).tolist()
    return standing_at(model, (-x, -y))


def _brim_mm(models: Sequence[Decomposition], profile: Profile) -> float:
    """Width of the brim around all models: that of a small base if one of them would tip over alone."""
    process = profile.process
    small = process.brim_mm == 0.0 and process.small_base_brim_mm > 0.0 and not process.raft_layers
    if small and any(_tips_over(model.mesh, profile) for model in dict.fromkeys(models)):
        return process.small_base_brim_mm
    return process.brim_mm


def _tips_over(mesh: Mesh, profile: Profile) -> bool:
    """Whether a model alone would tip off the plate."""
    base = cross_sections(mesh, np.array([0.5 * profile.process.first_layer_height_mm]))[0]
    return tips_over(clean(base), float(mesh.bounds_mm[1, 2]))


def _gap_mm(process: Process, brim_mm: float) -> float:
    """Distance between the bounding boxes of models, mm."""
    if process.raft_layers:
        brim_mm = raft_reach_mm(process)
    skirt_mm = process.skirt_distance_mm + (process.skirt_loops + 1) * process.line_width_mm
    if process.complete_objects and brim_mm == 0.0 and process.skirt_loops:  # around the first model only
        return max(GAP_MM, skirt_mm)
    return GAP_MM + 2.0 * brim_mm


def _reason(misfit: Misfit, models: Sequence[Decomposition], sizes_mm: Sequence[Place], gap_mm: float, profile: Profile) -> str:
    """Why the models do not fit on the plate together."""
    (width, depth), alike = sizes_mm[misfit.number], len(dict.fromkeys(models)) == 1
    size = f"{amount(width, 1)} x {amount(depth, 1)} mm"
    what = f"{models[misfit.number].name} measures {size}, the plate of {profile.machine.name} has"
    if alike:
        what = f"{len(models)} copies: {what}"
    if misfit.is_met:
        others = "another one" if misfit.standing == 1 else f"{misfit.standing} others"
        why = "parts are printed one after another, and the head needs room around those that stand"
        wanted = f"{phrase('one part', '--parts 1 prints each in one piece')}, all layer by layer"
        if profile.process.complete_objects:
            why = "models are printed one after another, and the head needs room around those that stand"
            wanted = f"{key_name('process.complete_objects')} = false prints them layer by layer"
        wanted += f"; or print fewer copies, or set a smaller {key_name('process.scale')}"
        beside = f" beside {others if misfit.standing else 'others'}"
        return f"{what} no place for it{beside} that the head reaches without hitting them: {why}; {wanted}"
    if alike:
        return f"{what} room for {misfit.standing} with {gap_mm:g} mm between them"
    if misfit.standing == 0:
        return f"{what} no room for it"
    beside = "another model" if misfit.standing == 1 else f"{misfit.standing} other models"
    return f"{what} no room for it {gap_mm:g} mm from {beside}"


def _size_mm(mesh: Mesh) -> Place:
    width, depth = np.ptp(mesh.vertices[:, :2], axis=0).tolist()
    return width, depth


def _first_of_all(parts: Sequence[Part]) -> Part:
    """The first parts of several models as one part."""
    mesh, counts = together([part.mesh for part in parts]), [len(part.mesh.faces) for part in parts]

    def joined(marks: Iterable[Marked]) -> Marked:
        return Marked.together([*zip(marks, counts, strict=True)])

    return replace(
        parts[0],
        mesh=mesh,
        volume_mm3=mesh.volume_mm3,
        risky_area_mm2=sum(part.risky_area_mm2 for part in parts),
        needing=_joined([part.needing for part in parts]),
        needing_upright=_joined([part.needing_upright for part in parts]),
        no_seam=joined(part.no_seam for part in parts),
        no_support=joined(part.no_support for part in parts),
        support=joined(part.support for part in parts),
        modifiers=tuple(modifier for part in parts for modifier in part.modifiers),
    )


def _room(mesh: Mesh) -> Zone:
    """The box around a model that extends half the gap to other models."""
    low, high = mesh.bounds_mm + 0.5 * GAP_MM * np.array([[-1.0], [1.0]])
    return Zone((low[0], low[1], low[2]), (high[0], high[1], high[2]))


def _within(room: Zone, part: Part) -> Part:
    """A model's part with its marks and modifiers confined to the model's room."""
    return part.with_marks(lambda mark: mark.within(room), lambda own: replace(own, volume=in_room(own.volume, room)))


def _with_place_settings(part: Part, model: Decomposition, given: Sequence[PartSettings]) -> Part:
    """A model's first part, printed as one with the others', with its settings as a modifier of its room. Raises PlanError."""
    process = {key: value for own in given if own.part == 1 for key, value in own.process.items()}
    for key in process:
        if key not in OF_A_PLACE + SPEEDS_OF_A_PLACE:
            raise PlanError(
                f"part 1 of {model.name}: {key_name(f'process.{key}')} holds for a whole part, and the first parts of all models "
                f"are one part of the plate: {phrase('for all', f'--set process.{key}=... sets it for all')}, "
                f"{key_name('process.complete_objects')} = true prints each model alone"
            )
    room = _room(model.mesh)
    return replace(part, modifiers=(Modifier(room, process), *part.modifiers)) if process else part


def _joined(masks: Sequence[Mask | None]) -> Mask | None:
    given = [mask for mask in masks if mask is not None]
    return np.concatenate(given) if len(given) == len(masks) else None


def _beside(part: Part, index: int, pose: Pose, machine: Machine) -> Part:
    """A part printed where others stand: a limb, except for the very first."""
    base = part.base
    if index > 1 and base.limbs_mm is None:
        base = Plane(base.normal, base.offset_mm, part.mesh.vertices[[int(np.argmax(base.heights_mm(part.mesh.vertices)))]])
    return replace(part, index=index, base=base, pose=pose, rotation=rotation(machine, pose))


def _one_print(models: Sequence[Decomposition], parts: Sequence[Part]) -> Decomposition:
    """The models of a plate as one."""
    return replace(
        models[0],
        name=", ".join(dict.fromkeys(model.name for model in models)),
        mesh=together([model.mesh for model in models]),
        parts=tuple(parts),
        risky_area_mm2=sum(model.risky_area_mm2 for model in models),
        residual_area_mm2=sum(model.residual_area_mm2 for model in models),
        folded_mm3=sum(model.folded_mm3 for model in models),
        front=(),
        uncut=tuple(part for model in models for part in model.uncut),
    )
