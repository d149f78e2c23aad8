"""Changes: commands that change the bench at once, commands that change its cuts after a trial, and commands for its zones.

Each takes a bench with a model and the page's arguments, and raises PlanError if it is impossible. No I/O, no waiting.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import hypot, radians
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from machine.pipeline.requests import MOST_COPIES
from machine.planning.stops import check_stop_heights, parse_stops
from machine.workbench.bench.bench import Bench, laid_down, with_beside, with_cuts, with_other_in_work, with_rotation
from machine.workbench.bench.part_settings import with_part_setting, without_part_settings
from machine.workbench.bench.values import Direction, Mm, Point, Rotation, check_number, with_value
from mdp.directions.orientation import set_on_plate
from mdp.mesh import Floats, Mesh
from mdp.overhang import Mask
from mdp.pose import about
from mdp.search.plan_file import PlannedPart, planned_parts
from mdp.search.plan_reading import MOST_ZONES
from mdp.zone import FARTHEST_MM, MOST_GROWN_DEG, AnyZone, Brushed, Grown, Volume, Zone, Zones
from profiles.errors import PlanError
from profiles.messages import option
from profiles.part_settings import MOST_PARTS
from profiles.profile import Profile

SAME_NORMAL = 1e-9
TURN_DIGITS = 15  # makes quarter turns exact
MOST_STOPS = 1000
Cuts = tuple[PlannedPart, ...]
TurnDeg = Annotated[float, Field(ge=-360, le=360)]
Kind = Literal["keep", "no_seam", "no_support", "support"]
GrownDeg = Annotated[float, Field(ge=0, le=MOST_GROWN_DEG)]
OPPOSITES = {"support": "no_support", "no_support": "support"}
WORDS = {  # name of the history step that marks each kind
    "keep": "mark: no cut here",
    "no_seam": "mark: no seam here",
    "no_support": "mark: no support here",
    "support": "mark: support here",
}


def turn(bench: Bench, *, axis: Literal["x", "y", "z"], deg: TurnDeg) -> Bench:
    """Turn the model about an axis of the machine."""
    return with_rotation(bench, _rounded(about(np.eye(3)["xyz".index(axis)], radians(deg)) @ np.array(bench.rotation)))


def stand(bench: Bench, *, rotation: Rotation) -> Bench:
    """Turn the model to the rotation with these rows."""
    return with_rotation(bench, rotation)


def lay(bench: Bench, *, normal: Direction) -> Bench:
    """Lay the model on the face with this outward normal, in the model's own frame."""
    return with_rotation(bench, _rounded(laid_down(bench, np.array(normal))))


def take(bench: Bench, *, parts: int) -> Bench:
    """Choose the row of the front with this number of parts."""
    rows = {row.parts: row for row in bench.rows}
    if parts not in rows:
        expected = f"one of {', '.join(map(str, rows))} is expected" if rows else "no parts have been found yet"
        raise PlanError(f"parts is {parts}: {expected}")
    taken = with_cuts(bench, planned_parts(rows[parts]))
    return bench if taken.cuts == bench.cuts else taken


def lock(bench: Bench, *, part: int, locked: bool = False) -> Bench:
    plane = frozenset({planned_part(bench, part)})
    after = bench.locked | plane if locked else bench.locked - plane
    return bench if after == bench.locked else replace(bench, locked=after)


def set_part(bench: Bench, *, part: int, key: str, value: str | None = None) -> Bench:
    """Set a process key for one part; null: use the common value."""
    return _with_settings(bench, with_part_setting(bench.profile, _part(bench, part), key, value))


def reset_part(bench: Bench, *, part: int) -> Bench:
    """Clear the settings of one part."""
    return _with_settings(bench, without_part_settings(bench.profile, _part(bench, part)))


def add_stop(bench: Bench, *, kind: Literal["pause", "filament_change"], at: str) -> Bench:
    """Add a pause before a layer or height, written like the options of `export`; pauses precede filament changes, as there."""
    (stop,) = parse_stops([at], []) if kind == "pause" else parse_stops([], [at])
    if stop in bench.stops:
        return bench
    check_stop_heights([stop], max(bench.parts, 1) * [_most_height_mm(bench)], bench.profile)
    if len(bench.stops) >= MOST_STOPS:
        raise PlanError(f"there are {len(bench.stops)} pauses: {MOST_STOPS} are allowed")
    return replace(bench, stops=tuple(sorted((*bench.stops, stop), key=lambda stop: stop.change)))


def _most_height_mm(bench: Bench) -> float:
    """The most that a part may be high: the height of an uncut model as it is read, else the diagonal of its box."""
    assert bench.model is not None
    lying = bench.turned is not None or bench.cuts
    return (hypot(*bench.model.size_mm) if lying else bench.model.size_mm[2]) + bench.profile.search.pedestal_mm


def remove_stop(bench: Bench, *, number: int) -> Bench:
    """Remove a pause, numbered from 1."""
    check_number("number", number, 1, len(bench.stops))
    return replace(bench, stops=(*bench.stops[: number - 1], *bench.stops[number:]))


def copies(bench: Bench, *, count: int) -> Bench:
    """Set the number of copies on the plate."""
    check_number(option("copies"), count, 1, MOST_COPIES)  # same message as for the option
    return bench if count == bench.copies else with_beside(replace(bench, copies=count), bench.beside)


def beside(bench: Bench, *, number: int, count: int) -> Bench:
    """Set the number of copies of another model on the plate, numbered from 1; 0 removes it."""
    index = check_number("number", number, 1, len(bench.beside)) - 1
    other = bench.beside[index]
    check_number(option("copies"), count, 0, MOST_COPIES)
    if count == other.copies:
        return bench
    left = (replace(other, copies=count),) if count else ()
    changed = with_beside(bench, (*bench.beside[:index], *left, *bench.beside[index + 1 :]))
    return replace(changed, number=bench.number - (not count and index < bench.number))


def work_on(bench: Bench, *, number: int) -> Bench:
    """Choose another model on the plate, numbered from 1, to turn, cut and mark."""
    return with_other_in_work(bench, check_number("number", number, 1, len(bench.beside)) - 1)


def _part(bench: Bench, part: int) -> int:
    return check_number("part", part, 1, max(bench.parts, 1))  # an uncut model is part 1


def _with_settings(bench: Bench, profile: Profile) -> Bench:
    return bench if profile.parts == bench.profile.parts else replace(bench, profile=profile)


def _rounded(matrix: Floats) -> list[list[float]]:
    """Rows of a rotation, orthogonalised after many turns, without rounding noise."""
    left, _, right = np.linalg.svd(matrix)
    rows: list[list[float]] = (np.round(left @ right, TURN_DIGITS) + 0.0).tolist()
    return rows


@dataclass(frozen=True)
class Edit:
    """Other cuts, to be tried before they are applied.

    word: name of the history step. orders: the cuts in acceptable print orders, the wanted one first, each with the number of the
    part whose plane was placed, 0: none. near: shift that plane to the nearest position that can be cut. reason: beginning of the
    sentence that reports a failure, if the planes alone do not explain it.
    """

    word: str
    orders: list[tuple[Cuts, int]]
    near: bool = False
    reason: str = ""

    @property
    def cuts(self) -> Cuts:
        """The cuts in the wanted order."""
        return self.orders[0][0]

    @property
    def placed(self) -> PlannedPart | None:
        """The part whose plane was placed."""
        cuts, number = self.orders[0]
        return cuts[number - 2] if number else None


def add(bench: Bench, *, normal: Direction, offset_mm: Mm, after: int | None = None, near: bool = False) -> Edit:
    """Add a plane for a new part, printed after the part `after`, by default last."""
    cuts, plane = bench.cuts or (), PlannedPart(normal, offset_mm)
    most = len(cuts) + 1
    wanted = most + 1 if after is None else check_number("after", after, 1, most) + 1
    if most + 1 > MOST_PARTS:
        raise PlanError(f"there are {most} parts: {MOST_PARTS} are allowed")
    numbers = sorted(range(2, most + 2), key=lambda number: abs(number - wanted))
    return Edit("add a plane", [((*cuts[: number - 2], plane, *cuts[number - 2 :]), number) for number in numbers], near)


def move(bench: Bench, *, part: int, normal: Direction, offset_mm: Mm, near: bool = False) -> Edit:
    """Replace the plane of a part; its limbs stay."""
    before = planned_part(bench, part)
    plane = PlannedPart(normal, offset_mm, limbs_mm=before.limbs_mm)
    tilts = before.normal is not None and float(np.abs(np.subtract(before.normal, normal)).max()) > SAME_NORMAL
    return Edit("tilt a plane" if tilts else "move a plane", [(_replaced(bench, part, plane), part)], near)


def snap(bench: Bench, part: int, neck: PlannedPart) -> Edit:
    """Replace the plane of a part by the neck found near it."""
    reason = f"the narrowest section near the plane of part {part} is not a place for a cut: "
    return Edit("snap to the narrowest section", [(_replaced(bench, part, neck), part)], reason=reason)


def limb(bench: Bench, *, part: int, point_mm: Point | None = None) -> Edit:
    """Restrict a part to the piece above its plane at a point; without a point, to everything above."""
    limbs_mm = () if point_mm is None else (point_mm,)
    return Edit("choose a limb", [(_replaced(bench, part, replace(planned_part(bench, part), limbs_mm=limbs_mm)), 0)])


def remove(bench: Bench, *, part: int) -> Edit:
    return Edit("remove a plane", [(_replaced(bench, part), 0)])


def reorder(bench: Bench, *, part: int, to: int) -> Edit:
    """Print a part as number `to`."""
    moved = planned_part(bench, part)
    others = [cut for cut in bench.cuts or () if cut is not moved]
    others.insert(check_number("to", to, 2, bench.parts) - 2, moved)
    reason = f"part {part} cannot be printed as number {to}, for then "
    return Edit("print a part at another time", [(tuple(others), 0)], reason=reason)


def planned_part(bench: Bench, part: int) -> PlannedPart:
    """The part with this number, which has a plane. Raises PlanError."""
    return (bench.cuts or ())[check_number("part", part, 2, bench.parts) - 2]


def check_unlocked(bench: Bench, part: int) -> None:
    """Raise PlanError if the plane of a part is locked or does not exist."""
    if planned_part(bench, part) in bench.locked:
        raise PlanError(f"the plane of part {part} is locked: unlock it first")


def _replaced(bench: Bench, part: int, *instead: PlannedPart) -> Cuts:
    check_unlocked(bench, part)
    index, cuts = part - 2, bench.cuts or ()
    return *cuts[:index], *instead, *cuts[index + 1 :]


def mark(
    bench: Bench,
    *,
    kind: Kind,
    number: int | None = None,
    min_mm: Point | None = None,
    max_mm: Point | None = None,
    axes: Rotation | None = None,
    point_mm: Point | None = None,
    angle_deg: GrownDeg | None = None,
) -> Zones:
    """Add a zone, or replace the zone `number`: a box, along `axes` if tilted, or the faces around a point within an angle. Reads
    the model's mesh. Raises PlanError."""
    zone = _box(min_mm, max_mm, axes) if point_mm is None else _grown(bench, point_mm, angle_deg)
    zones: tuple[AnyZone, ...] = getattr(bench.zones, kind)
    index = len(zones) if number is None else check_number("number", number, 1, len(zones)) - 1
    if index >= MOST_ZONES:
        raise PlanError(f"there are {index} zones of {kind}: {MOST_ZONES} are allowed")
    return with_value(bench.zones, kind, (*zones[:index], zone, *zones[index + 1 :]))


def _box(min_mm: Point | None, max_mm: Point | None, axes: Rotation | None) -> Zone:
    if min_mm is None or max_mm is None:
        raise PlanError(f"{'min_mm' if min_mm is None else 'max_mm'} is missing")
    if not all(low < high for low, high in zip(min_mm, max_mm, strict=True)):
        raise PlanError(f"min_mm is {list(min_mm)} and max_mm {list(max_mm)}: each number of min_mm must be less")
    return Zone(min_mm, max_mm, axes)


def _grown(bench: Bench, point_mm: Point, angle_deg: float | None) -> Grown:
    if angle_deg is None:
        raise PlanError("angle_deg is missing")
    zone = Grown(point_mm, angle_deg)
    if (away_mm := zone.away_mm(workpiece_mesh(bench))) > FARTHEST_MM:
        raise PlanError(f"point_mm is {list(point_mm)}, {away_mm:.3g} mm from the model: up to {FARTHEST_MM:g} is allowed")
    return zone


def brush(bench: Bench, *, kind: Kind, faces: str, erase: bool = False) -> Zones:
    """With faces painted or erased by one stroke of a brush: they join the brushed zone of a kind, or leave all zones of that
    kind that are not volumes. Support and no support exclude each other, and the newest stroke counts. Raises PlanError."""
    try:
        mesh, stroke = workpiece_mesh(bench), Brushed(faces)
    except ValueError as error:
        raise PlanError(f'faces is "{faces:.20}": {error}') from None
    stroke.check_on(mesh)
    chosen = stroke.faces(mesh)
    if erase:
        return with_value(bench.zones, kind, _erased(getattr(bench.zones, kind), mesh, chosen))
    zones: tuple[AnyZone, ...] = getattr(bench.zones, kind)
    index = next((k for k, zone in enumerate(zones) if isinstance(zone, Brushed)), len(zones))
    if index >= MOST_ZONES:
        raise PlanError(f"there are {index} zones of {kind}: {MOST_ZONES} are allowed")
    painted = chosen | zones[index].faces(mesh) if index < len(zones) else chosen
    changed = with_value(bench.zones, kind, (*zones[:index], Brushed.of(painted), *zones[index + 1 :]))
    opposite = OPPOSITES.get(kind)
    return changed if opposite is None else with_value(changed, opposite, _erased(getattr(changed, opposite), mesh, chosen))


def _erased(zones: tuple[AnyZone, ...], mesh: Mesh, chosen: Mask) -> tuple[AnyZone, ...]:
    """The zones without some faces of the mesh; volumes stay as they are."""
    left: list[AnyZone] = []
    for zone in zones:
        faces = np.zeros_like(chosen) if isinstance(zone, Volume) else zone.faces(mesh)
        if not (faces & chosen).any():
            left.append(zone)
        elif (faces & ~chosen).any():
            left.append(Brushed.of(faces & ~chosen))
    return tuple(left)


def unmark(bench: Bench, *, kind: Kind, number: int) -> Zones:
    """Remove the zone `number` of a kind. Raises PlanError."""
    zones: tuple[AnyZone, ...] = getattr(bench.zones, kind)
    index = check_number("number", number, 1, len(zones)) - 1
    return with_value(bench.zones, kind, (*zones[:index], *zones[index + 1 :]))


def workpiece_mesh(bench: Bench) -> Mesh:
    """The model on the build plate or pedestal, in the workpiece frame."""
    assert bench.model is not None
    standing = set_on_plate(bench.model.mesh(), bench.turned)
    lift_mm = bench.profile.search.pedestal_mm
    return standing.transform(np.eye(3), (0.0, 0.0, lift_mm)) if lift_mm > 0.0 else standing


# Command -> its function, and the name of its history step.
CHANGES: dict[str, tuple[Callable[..., Bench], str]] = {
    "turn": (turn, "turn the model"),
    "stand": (stand, "lay the model down"),
    "lay": (lay, "lay a face down"),
    "take": (take, "take another number of parts"),
    "lock": (lock, "lock a plane"),
    "set_part": (set_part, "set a part"),
    "reset_part": (reset_part, "take a part's changes back"),
    "add_stop": (add_stop, "add a pause"),
    "remove_stop": (remove_stop, "take a pause away"),
    "copies": (copies, "print another number of copies"),
    "beside": (beside, "change the models on the plate"),
    "work_on": (work_on, "work on another model"),
}
# Commands that return other cuts.
EDITS: dict[str, Callable[..., Edit]] = {"add": add, "move": move, "limb": limb, "remove": remove, "reorder": reorder}
# Commands that return other zones; each runs in a worker process, because it may read the model's mesh.
MARKINGS: dict[str, Callable[..., Zones]] = {"mark": mark, "brush": brush, "unmark": unmark}
