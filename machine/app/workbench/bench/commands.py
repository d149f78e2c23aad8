"""Commands: what a page asks for, checked and turned into a new bench. Nothing here reads, writes or waits."""

from collections.abc import Callable
from dataclasses import replace
from math import radians
from typing import Any

import numpy as np

from machine.app.workbench.bench.bench import Bench, History, laid_down, with_parts, with_rotation
from machine.app.workbench.bench.model import Model
from machine.app.workbench.bench.part_settings import check_part, with_part_setting, without_part_settings
from machine.app.workbench.bench.planes import is_number, planned_part, rotation_rows
from machine.app.workbench.bench.stops import add_stop, remove_stop, set_copies
from mdp.mesh import Floats, Mesh
from mdp.pose import about
from profiles.errors import PlanError
from profiles.profile import Profile

AXES = {"x": 0, "y": 1, "z": 2}
TURN_DIGITS = 15  # so that quarter turns are exact


def obey(history: History, asked: dict[str, Any]) -> History:
    """The history after a command `{"do": NAME, ...}` of a page. Raises PlanError with a sentence for what cannot be done."""
    name = asked.get("do")
    if name == "undo":
        return history.undo()
    if name == "redo":
        return history.redo()
    if not isinstance(name, str) or name not in COMMANDS:
        raise PlanError(f"{name!r} is no command of the workbench: docs/workbench.md lists them")
    bench = history.now.bench
    if bench.model is None:
        raise PlanError("there is no model on the workbench yet: choose a file first")
    word, command = COMMANDS[name]
    after = command(bench, bench.model, asked)
    return history if after is bench else history.do(word, after)


def _turn(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """Turn the model by `deg` about the axis `axis` of the machine."""
    axis, angle_deg = asked.get("axis"), asked.get("deg")
    if not isinstance(axis, str) or axis not in AXES:
        raise PlanError(f"axis is {axis!r}: {', '.join(AXES)} are allowed")
    if not is_number(angle_deg) or abs(angle_deg) > 360.0:
        raise PlanError(f"deg is {angle_deg!r}: a number from -360 to 360 is allowed")
    turned = about(np.eye(3)[AXES[axis]], radians(angle_deg)) @ np.array(bench.rotation)
    return with_rotation(bench, _rounded(turned))


def _stand(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """Turn the model as the rows of `rotation` say."""
    return with_rotation(bench, rotation_rows(asked.get("rotation"), "rotation"))


def _lay(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """Lay the face of a number down on the platform."""
    face = asked.get("face")
    if not isinstance(face, int) or isinstance(face, bool) or not 0 <= face < model.faces:
        raise PlanError(f"face is {face!r}: 0 to {model.faces - 1} is allowed")
    mesh = model.mesh()
    (normal,) = Mesh(mesh.vertices[mesh.faces[face]], np.array([[0, 1, 2]])).normals
    if not normal.any():
        raise PlanError(f"face {face} has no area, so nothing can be laid on it")
    return with_rotation(bench, _rounded(laid_down(bench, normal)))


def _take(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """Take the row of the front with `parts` parts."""
    parts = asked.get("parts")
    known = [row.parts for row in bench.rows]
    if not isinstance(parts, int) or parts not in known:
        raise PlanError(
            f"parts is {parts!r}: {', '.join(map(str, known)) or 'nothing, for no parts have been found,'} is allowed"
        )
    taken = with_parts(bench, parts)
    return bench if taken.cuts == bench.cuts else taken


def _lock(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """Lock the plane of a part, or unlock it."""
    part = planned_part(bench, asked.get("part"))
    locked = bench.locked | {part} if asked.get("locked") is True else bench.locked - {part}
    return bench if locked == bench.locked else replace(bench, locked=locked)


def _set_part(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """Give `part` alone another `value` of a `key` of the process; null: as all parts have it."""
    part, value = check_part(asked.get("part"), bench.parts), asked.get("value")
    text = None if value is None else str(value)
    return _with_settings(bench, with_part_setting(bench.profile, part, str(asked.get("key")), text))


def _reset_part(bench: Bench, model: Model, asked: dict[str, Any]) -> Bench:
    """Have `part` as all parts are."""
    return _with_settings(bench, without_part_settings(bench.profile, check_part(asked.get("part"), bench.parts)))


def _with_settings(bench: Bench, profile: Profile) -> Bench:
    return bench if profile.parts == bench.profile.parts else replace(bench, profile=profile)


COMMANDS: dict[str, tuple[str, Callable[[Bench, Model, dict[str, Any]], Bench]]] = {
    "turn": ("turn the model", _turn),
    "stand": ("lay the model down", _stand),
    "lay": ("lay a face down", _lay),
    "take": ("take another number of parts", _take),
    "set_part": ("set a part", _set_part),
    "reset_part": ("take a part's changes back", _reset_part),
    "lock": ("lock a plane", _lock),
    "add_stop": ("add a pause", add_stop),
    "remove_stop": ("take a pause away", remove_stop),
    "copies": ("print another number of copies", set_copies),
}


def _rounded(matrix: Floats) -> list[list[float]]:
    """Rows of a rotation made orthogonal again after many turns, without the noise of the last digit."""
    left, _, right = np.linalg.svd(matrix)
    rows: list[list[float]] = (np.round(left @ right, TURN_DIGITS) + 0.0).tolist()
    return rows
