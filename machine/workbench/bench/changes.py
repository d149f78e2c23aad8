"""Changes: the commands of a page that change the bench: at once, its cuts when they have been tried, or its zones.

Each takes a bench on which a model lies, and what the page sends by name. They raise PlanError for what cannot be done. Nothing
here writes or waits.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import radians
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from machine.pipeline.requests import MOST_COPIES
from machine.planning.stops import parse_stops
from machine.workbench.bench.bench import Bench, laid_down, with_cuts, with_rotation
from machine.workbench.bench.part_settings import with_part_setting, without_part_settings
from machine.workbench.bench.values import Direction, Mm, Point, Rotation, check_number, with_value
from mdp.directions.orientation import set_on_plate
from mdp.mesh import Floats, Mesh
from mdp.pose import about
from mdp.search.plan_file import PlannedPart, planned_parts
from mdp.search.plan_reading import MOST_ZONES
from mdp.zone import FARTHEST_MM, MOST_GROWN_DEG, AnyZone, Grown, Zone, Zones
from profiles.errors import PlanError
from profiles.messages import option
from profiles.part_settings import MOST_PARTS
from profiles.profile import Profile

TURN_DIGITS = 15  # so that quarter turns are exact
MOST_STOPS = 1000
Cuts = tuple[PlannedPart, ...]
TurnDeg = Annotated[float, Field(ge=-360, le=360)]
Kind = Literal["keep", "no_seam", "no_support", "support"]
GrownDeg = Annotated[float, Field(ge=0, le=MOST_GROWN_DEG)]
WORDS = {  # for the step in the history of a mark of each kind
    "keep": "mark: no cut here",
    "no_seam": "mark: no seam here",
    "no_support": "mark: no support here",
    "support": "mark: support here",
}


def turn(bench: Bench, *, axis: Literal["x", "y", "z"], deg: TurnDeg) -> Bench:
    """Turn the model about an axis of the machine."""
    return with_rotation(bench, _rounded(about(np.eye(3)["xyz".index(axis)], radians(deg)) @ np.array(bench.rotation)))


def stand(bench: Bench, *, rotation: Rotation) -> Bench:
    """Turn the model as the rows of a rotation say."""
    return with_rotation(bench, rotation)


def lay(bench: Bench, *, normal: Direction) -> Bench:
    """Lay the model down on a side of this outward normal, in its own frame."""
    return with_rotation(bench, _rounded(laid_down(bench, np.array(normal))))


def take(bench: Bench, *, parts: int) -> Bench:
    """Take the row of the front that has this number of parts."""
    rows = {row.parts: row for row in bench.rows}
    if parts not in rows:
        expected = f"one of {', '.join(map(str, rows))} is expected" if rows else "no parts have been found yet"
        raise PlanError(f"parts is {parts}: {expected}")
    taken = with_cuts(bench, planned_parts(rows[parts]))
    return bench if taken.cuts == bench.cuts else taken


def lock(bench: Bench, *, part: int, locked: bool = False) -> Bench:
    """Lock the plane of a part, or unlock it."""
    plane = frozenset({planned_part(bench, part)})
    after = bench.locked | plane if locked else bench.locked - plane
    return bench if after == bench.locked else replace(bench, locked=after)


def set_part(bench: Bench, *, part: int, key: str, value: str | None = None) -> Bench:
    """Give a part alone another value of a key of the process; null: as all parts have it."""
    return _with_settings(bench, with_part_setting(bench.profile, _part(bench, part), key, value))


def reset_part(bench: Bench, *, part: int) -> Bench:
    """Clear what a part has of its own."""
    return _with_settings(bench, without_part_settings(bench.profile, _part(bench, part)))


def add_stop(bench: Bench, *, kind: Literal["pause", "filament_change"], at: str) -> Bench:
    """A pause before a layer or height, written as the options of `export` take it; pauses come first, as they do there."""
    (stop,) = parse_stops([at], []) if kind == "pause" else parse_stops([], [at])
    if stop in bench.stops:
        return bench
    if len(bench.stops) >= MOST_STOPS:
        raise PlanError(f"there are {len(bench.stops)} pauses: {MOST_STOPS} are allowed")
    return replace(bench, stops=tuple(sorted((*bench.stops, stop), key=lambda stop: stop.change)))


def remove_stop(bench: Bench, *, number: int) -> Bench:
    """Take a pause away, numbered from 1."""
    check_number("number", number, 1, len(bench.stops))
    return replace(bench, stops=(*bench.stops[: number - 1], *bench.stops[number:]))


def copies(bench: Bench, *, count: int) -> Bench:
    """Another number of copies on the plate."""
    check_number(option("copies"), count, 1, MOST_COPIES)  # as the option is refused
    return bench if count == bench.copies else replace(bench, copies=count)


def _part(bench: Bench, part: int) -> int:
    return check_number("part", part, 1, max(bench.parts, 1))  # an uncut model is part 1


def _with_settings(bench: Bench, profile: Profile) -> Bench:
    return bench if profile.parts == bench.profile.parts else replace(bench, profile=profile)


def _rounded(matrix: Floats) -> list[list[float]]:
    """Rows of a rotation made orthogonal again after many turns, without the noise of the last digit."""
    left, _, right = np.linalg.svd(matrix)
    rows: list[list[float]] = (np.round(left @ right, TURN_DIGITS) + 0.0).tolist()
    return rows


@dataclass(frozen=True)
class Edit:
    """Other cuts, which are tried before they are taken.

    word: for its step in the history. orders: the cuts in the print orders that will do, the wanted one first, each with the
    number of the part whose plane is put somewhere, 0: none is. near: the nearest place that can be cut will do for that plane.
    reason: how the sentence begins that tells why it cannot be done, where the planes alone do not say it.
    """

    word: str
    orders: list[tuple[Cuts, int]]
    near: bool = False
    reason: str = ""

    @property
    def cuts(self) -> Cuts:
        """The cuts that are wanted."""
        return self.orders[0][0]


def add(bench: Bench, *, normal: Direction, offset_mm: Mm, after: int | None = None, near: bool = False) -> Edit:
    """A plane for a new part printed after the part `after`, without that as the last one."""
    cuts, plane = bench.cuts or (), PlannedPart(normal, offset_mm)
    most = len(cuts) + 1
    wanted = most + 1 if after is None else check_number("after", after, 1, most) + 1
    if most + 1 > MOST_PARTS:
        raise PlanError(f"there are {most} parts: {MOST_PARTS} are allowed")
    numbers = sorted(range(2, most + 2), key=lambda number: abs(number - wanted))
    return Edit("add a plane", [((*cuts[: number - 2], plane, *cuts[number - 2 :]), number) for number in numbers], near)


def move(bench: Bench, *, part: int, normal: Direction, offset_mm: Mm, near: bool = False) -> Edit:
    """The plane of a part becomes another one; its limbs stay."""
    plane = PlannedPart(normal, offset_mm, limbs_mm=planned_part(bench, part).limbs_mm)
    return Edit("move a plane", [(_replaced(bench, part, plane), part)], near)


def snap(bench: Bench, part: int, neck: PlannedPart) -> Edit:
    """The plane of a part becomes the neck that was found near it."""
    reason = f"the neck near the plane of part {part} is no place for a cut: "
    return Edit("snap to the neck", [(_replaced(bench, part, neck), part)], reason=reason)


def limb(bench: Bench, *, part: int, point_mm: Point | None = None) -> Edit:
    """A part becomes the piece above its plane at a point alone, or without a point all that lies above."""
    limbs_mm = () if point_mm is None else (point_mm,)
    return Edit("choose a limb", [(_replaced(bench, part, replace(planned_part(bench, part), limbs_mm=limbs_mm)), 0)])


def remove(bench: Bench, *, part: int) -> Edit:
    """Without the plane of a part."""
    return Edit("remove a plane", [(_replaced(bench, part), 0)])


def reorder(bench: Bench, *, part: int, to: int) -> Edit:
    """A part is printed as number `to`."""
    moved = planned_part(bench, part)
    others = [cut for cut in bench.cuts or () if cut is not moved]
    others.insert(check_number("to", to, 2, bench.parts) - 2, moved)
    reason = f"part {part} cannot be printed as number {to}, for then "
    return Edit("print a part at another time", [(tuple(others), 0)], reason=reason)


def planned_part(bench: Bench, part: int) -> PlannedPart:
    """The part of a number, which has a plane. Raises PlanError."""
    return (bench.cuts or ())[check_number("part", part, 2, bench.parts) - 2]


def check_unlocked(bench: Bench, part: int) -> None:
    """Raises PlanError where the plane of a part is locked, or it has none."""
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
    """With a further zone: a box, along `axes` where it leans, or the faces around a point as far as an angle; in place of the
    zone `number`, if one is given. Reads the model's mesh. Raises PlanError."""
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


def unmark(bench: Bench, *, kind: Kind, number: int) -> Zones:
    """Without the zone `number` of a kind. Raises PlanError."""
    zones: tuple[AnyZone, ...] = getattr(bench.zones, kind)
    index = check_number("number", number, 1, len(zones)) - 1
    return with_value(bench.zones, kind, (*zones[:index], *zones[index + 1 :]))


def workpiece_mesh(bench: Bench) -> Mesh:
    """The model as it stands on the platform or a pedestal, in the workpiece frame."""
    assert bench.model is not None
    standing = set_on_plate(bench.model.mesh(), bench.turned)
    lift_mm = bench.profile.search.pedestal_mm
    return standing.transform(np.eye(3), (0.0, 0.0, lift_mm)) if lift_mm > 0.0 else standing


# The name of a command -> the function that does it, and the word for its step in the history.
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
}
# Those that give other cuts.
EDITS: dict[str, Callable[..., Edit]] = {"add": add, "move": move, "limb": limb, "remove": remove, "reorder": reorder}
# The commands that give other zones by their names; each runs in a process, for it may read the model's mesh.
MARKINGS: dict[str, Callable[..., Zones]] = {"mark": mark, "unmark": unmark}
