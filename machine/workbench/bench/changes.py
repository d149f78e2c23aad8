"""Changes: the commands that change the bench at once. Nothing here writes or waits.

Each takes a bench on which a model lies, and what the page sends by name; it returns the new bench, or the same one where it
changes nothing. They raise PlanError for what cannot be done.
"""

from collections.abc import Callable
from dataclasses import replace
from math import radians
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from machine.pipeline.requests import MOST_COPIES
from machine.planning.stops import parse_stops
from machine.workbench.bench.bench import Bench, laid_down, with_parts, with_rotation
from machine.workbench.bench.part_settings import with_part_setting, without_part_settings
from machine.workbench.bench.planes import planned_part
from machine.workbench.bench.values import Direction, Rotation, check_number
from mdp.mesh import Floats
from mdp.pose import about
from profiles.errors import PlanError
from profiles.profile import Profile

TURN_DIGITS = 15  # so that quarter turns are exact
MOST_STOPS = 1000
TurnDeg = Annotated[float, Field(ge=-360, le=360)]


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
    numbers = [row.parts for row in bench.rows]
    if parts not in numbers:
        allowed = ", ".join(map(str, numbers)) or "nothing, for no parts have been found,"
        raise PlanError(f"parts is {parts}: {allowed} is allowed")
    taken = with_parts(bench, parts)
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
    check_number("--copies", count, 1, MOST_COPIES)  # as the option is refused
    return bench if count == bench.copies else replace(bench, copies=count)


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


def _part(bench: Bench, part: int) -> int:
    return check_number("part", part, 1, max(bench.parts, 1))  # an uncut model is part 1


def _with_settings(bench: Bench, profile: Profile) -> Bench:
    return bench if profile.parts == bench.profile.parts else replace(bench, profile=profile)


def _rounded(matrix: Floats) -> list[list[float]]:
    """Rows of a rotation made orthogonal again after many turns, without the noise of the last digit."""
    left, _, right = np.linalg.svd(matrix)
    rows: list[list[float]] = (np.round(left @ right, TURN_DIGITS) + 0.0).tolist()
    return rows
