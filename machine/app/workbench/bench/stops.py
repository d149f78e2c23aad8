"""Stops and copies: where the print on the bench waits for a person, and how many of the model stand on the plate."""

from dataclasses import replace
from typing import Any

from machine.app.pipeline.copies import MOST, check_copies
from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.bench.model import Model
from machine.planning.stops import parse_stops
from profiles.errors import PlanError

KINDS = ("pause", "filament_change")
MOST_STOPS = 1000


def add_stop(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """A stop of `kind` (one of KINDS) before the layer or height `at`, written as the options of `export` take it; pauses come
    first, as they do there. Raises PlanError and SliceError."""
    kind, at = asked.get("kind"), str(asked.get("at"))
    if kind not in KINDS:
        raise PlanError(f"kind is {kind!r}: {', '.join(KINDS)} are allowed")
    (stop,) = parse_stops([at], []) if kind == "pause" else parse_stops([], [at])
    if stop in bench.stops:
        return bench
    if len(bench.stops) >= MOST_STOPS:
        raise PlanError(f"there are {len(bench.stops)} pauses: {MOST_STOPS} are allowed")
    return replace(bench, stops=tuple(sorted((*bench.stops, stop), key=lambda each: each.change)))


def remove_stop(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """The bench without the stop `number`, from 1. Raises PlanError."""
    number, count = asked.get("number"), len(bench.stops)
    if not isinstance(number, int) or isinstance(number, bool) or not 1 <= number <= count:
        raise PlanError(f"number is {number!r}: {f'1 to {count} is allowed' if count else 'there is none yet'}")
    return replace(bench, stops=(*bench.stops[: number - 1], *bench.stops[number:]))


def set_copies(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """So many copies (`count`) on the plate. Raises PlanError."""
    count = asked.get("count")
    if not isinstance(count, int) or isinstance(count, bool):
        raise PlanError(f"--copies is {count!r}: a whole number from 1 to {MOST} is allowed")
    check_copies(count)
    return bench if count == bench.copies else replace(bench, copies=count)
