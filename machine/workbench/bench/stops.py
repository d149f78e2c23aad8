"""Stops and copies: where the print on the bench waits for a person, and how many of the model stand on the plate."""

from dataclasses import replace

from machine.pipeline.requests import MOST_COPIES
from machine.planning.stops import parse_stops
from machine.workbench.bench.bench import Bench
from machine.workbench.bench.values import Asked, whole
from profiles.errors import PlanError

KINDS = ("pause", "filament_change")
MOST_STOPS = 1000


def add_stop(bench: Bench, asked: Asked) -> Bench:
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
    return replace(bench, stops=tuple(sorted((*bench.stops, stop), key=lambda stop: stop.change)))


def remove_stop(bench: Bench, asked: Asked) -> Bench:
    """The bench without the stop `number`, from 1. Raises PlanError."""
    number = whole(asked, "number", 1, len(bench.stops))
    return replace(bench, stops=(*bench.stops[: number - 1], *bench.stops[number:]))


def set_copies(bench: Bench, asked: Asked) -> Bench:
    """Another number of copies (`count`) on the plate. Raises PlanError."""
    count = whole({"--copies": asked.get("count")}, "--copies", 1, MOST_COPIES)  # as the option is refused
    return bench if count == bench.copies else replace(bench, copies=count)
