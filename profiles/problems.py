"""Problems of profiles, each one sentence: within one table, and between tables.

A wrong value is replaced by a valid one, so that later checks also run.
"""

from collections.abc import Iterable, Mapping
from copy import deepcopy
from typing import Any

from pydantic import BaseModel, ValidationError

from profiles.frozen import KEY_BY_KEY
from profiles.machine import Machine
from profiles.material import Material
from profiles.messages import key_name, terminal_words
from profiles.process import WIDTHS, Process
from profiles.search import Search
from profiles.wording import sentences

NOZZLE_TEMPERATURES = ("nozzle_c", "first_layer_nozzle_c", "homing_nozzle_c", "standby_c")
LEAST_WIDTH, MOST_WIDTH = 0.6, 2.5  # widths of printable lines in nozzle diameters
MOST_INTERFACE_WIDTH = 2.0  # thin beads on plastic: beyond the flat of the nozzle nothing presses them down


def table_problems(
    model: type[BaseModel], prefix: str, table: Any, sound: Mapping[str, Any]
) -> tuple[list[str], Any, frozenset[str]]:
    """All problems of a table whose keys are dotted after the prefix; the table validated key by key, None if it is not a table;
    and the dotted keys whose wrong values were replaced.

    sound: the values of a valid profile.
    """
    given = deepcopy(table)
    wrong, replaced, value = _rounds(model, prefix, given, sound, KEY_BY_KEY)
    if value is not None:
        together, _, _ = _rounds(model, prefix, given, sound, None)
        wrong += without_replaced(together, replaced)
    return wrong, value, replaced


def without_replaced(problems: Iterable[str], replaced: frozenset[str]) -> list[str]:
    """The problems that do not name a replaced value. replaced: the keys whose values were replaced."""
    return [sentence for sentence in problems if not _names_any(sentence, replaced)]


def _names_any(sentence: str, replaced: frozenset[str]) -> bool:
    named = [f".{word}." for word in terminal_words(sentence).replace(":", " ").split()]
    return any(f".{key}." in word or word == f".{key.rpartition('.')[2]}." for word in named for key in replaced)


def _rounds(
    model: type[BaseModel], prefix: str, given: Any, sound: Mapping[str, Any], context: str | None
) -> tuple[list[str], frozenset[str], Any]:
    """The problems, the keys replaced in the given table, and its valid model; None if it cannot be repaired."""
    problems: dict[str, None] = {}
    replaced: set[tuple[str, ...]] = set()
    value = None
    while value is None:
        try:
            value = model.model_validate(given, context=context)
        except ValidationError as error:
            problems |= dict.fromkeys(sentences(error.errors(), model, prefix))
            key_paths = {_key_path(problem) for problem in error.errors()}
            if not isinstance(given, dict) or () in key_paths or key_paths <= replaced:
                break
            for key_path in key_paths:
                _replace_value(given, key_path, sound)
            replaced |= key_paths
    return list(problems), frozenset(prefix + ".".join(key_path) for key_path in replaced), value


def _key_path(problem: Any) -> tuple[str, ...]:
    """The key to replace for a problem: lists are replaced as a whole."""
    path: list[str] = []
    for step in problem["loc"]:
        if isinstance(step, int):
            break
        path.append(step)
    return tuple(path)


def _replace_value(given: dict[str, Any], key_path: tuple[str, ...], sound: Mapping[str, Any]) -> None:
    """Replace a wrong value by the valid one, or remove it if there is none."""
    inner, value = given, sound
    for step in key_path[:-1]:
        if not isinstance(inner.get(step), dict):
            return
        inner, value = inner[step], value.get(step, {})
    if key_path[-1] in value:
        inner[key_path[-1]] = deepcopy(value[key_path[-1]])
    else:
        inner.pop(key_path[-1], None)


def too_hot(material: Material, machine: Machine) -> Iterable[str]:
    """Temperatures of the material that the machine does not allow."""
    for key in NOZZLE_TEMPERATURES:
        temperature_c = getattr(material, key)
        if temperature_c is not None and temperature_c > machine.nozzle_limit_c:
            yield (
                f"{key_name(f'material.{key}')} is {temperature_c:g}: {machine.name} allows at most {machine.nozzle_limit_c:g} °C"
            )
    if material.bed_c > machine.bed_limit_c > 0:
        yield f"{key_name('material.bed_c')} is {material.bed_c:g}: {machine.name} allows at most {machine.bed_limit_c:g} °C"


def lifted_twice(process: Process, search: Search) -> Iterable[str]:
    """A raft under a model that a pedestal already lifts."""
    if process.raft_layers and search.pedestal_mm > 0.0:
        yield (
            f"{key_name('process.raft_layers')} is {process.raft_layers}: 0 is allowed with a pedestal "
            f"({key_name('search.pedestal_mm')} is "
            f"{search.pedestal_mm:g}), which is printed like a raft"
        )


def unfit_for_nozzle(process: Process, nozzle_mm: float) -> Iterable[str]:
    """Lines and layers of the process that the nozzle cannot print; nozzle_mm: its diameter."""
    for key in WIDTHS:
        width_mm = getattr(process, key)
        least_mm = LEAST_WIDTH * nozzle_mm
        most_mm = (MOST_INTERFACE_WIDTH if key == "interface_line_width_mm" else MOST_WIDTH) * nozzle_mm
        if width_mm is not None and not least_mm <= width_mm <= most_mm:
            yield (
                f"{key_name(f'process.{key}')} is {width_mm:g}: a {nozzle_mm:g} mm nozzle prints lines of "
                f"{least_mm:g} to {most_mm:g} mm"
            )
    apart_mm = process.pin_width_nozzles * nozzle_mm + 2.0 * process.line_width_mm
    if process.interlock == "pins" and process.pin_spacing_mm < apart_mm - 1e-9:
        yield (
            f"{key_name('process.pin_spacing_mm')} is {process.pin_spacing_mm:g}: pins of {process.pin_width_nozzles:g} "
            "nozzles of "
            f"{nozzle_mm:g} mm with a wall round each are at least {apart_mm:g} mm apart"
        )
    for key in process.heights:
        height_mm = getattr(process, key)
        if height_mm > nozzle_mm:
            yield (
                f"{key_name(f'process.{key}')} is {height_mm:g}: a {nozzle_mm:g} mm nozzle prints layers of at most "
                f"{nozzle_mm:g} mm"
            )
