"""Changes: what a page may change of the bench at once, each a new bench. Nothing here writes or waits.

All take the bench, on which a model lies, and what is asked, and give the same bench where that changes nothing; they raise
PlanError with a sentence for what cannot be done.
"""

from dataclasses import replace
from math import radians

import numpy as np

from machine.workbench.bench.bench import Bench, laid_down, with_parts, with_rotation
from machine.workbench.bench.part_settings import with_part_setting, without_part_settings
from machine.workbench.bench.planes import planned_part
from machine.workbench.bench.values import Asked, number, rotation_rows, text_or_none, unit_vector, whole
from mdp.mesh import Floats
from mdp.pose import about
from profiles.errors import PlanError
from profiles.profile import Profile

AXES = {"x": 0, "y": 1, "z": 2}
TURN_DIGITS = 15  # so that quarter turns are exact


def turn(bench: Bench, asked: Asked) -> Bench:
    """Turn the model by `deg` about the axis `axis` of the machine."""
    axis, angle_deg = asked.get("axis"), number(asked, "deg", -360.0, 360.0)
    if not isinstance(axis, str) or axis not in AXES:
        raise PlanError(f"axis is {axis!r}: {', '.join(AXES)} are allowed")
    turned = about(np.eye(3)[AXES[axis]], radians(angle_deg)) @ np.array(bench.rotation)
    return with_rotation(bench, _rounded(turned))


def stand(bench: Bench, asked: Asked) -> Bench:
    """Turn the model as the rows of `rotation` say."""
    return with_rotation(bench, rotation_rows(asked, "rotation"))


def lay(bench: Bench, asked: Asked) -> Bench:
    """Lay the model down on a side of this outward `normal`, in its own frame."""
    return with_rotation(bench, _rounded(laid_down(bench, np.array(unit_vector(asked, "normal")))))


def take(bench: Bench, asked: Asked) -> Bench:
    """Take the row of the front with `parts` parts."""
    parts = asked.get("parts")
    known = [row.parts for row in bench.rows]
    if not isinstance(parts, int) or parts not in known:
        raise PlanError(
            f"parts is {parts!r}: {', '.join(map(str, known)) or 'nothing, for no parts have been found,'} is allowed"
        )
    taken = with_parts(bench, parts)
    return bench if taken.cuts == bench.cuts else taken


def lock(bench: Bench, asked: Asked) -> Bench:
    """Lock the plane of a part, or unlock it."""
    part = planned_part(bench, asked)
    locked = bench.locked | {part} if asked.get("locked") is True else bench.locked - {part}
    return bench if locked == bench.locked else replace(bench, locked=locked)


def set_part(bench: Bench, asked: Asked) -> Bench:
    """Give `part` alone another `value` of a `key` of the process; null: as all parts have it."""
    value = text_or_none(asked, "value")
    return _with_settings(bench, with_part_setting(bench.profile, _part(bench, asked), str(asked.get("key")), value))


def reset_part(bench: Bench, asked: Asked) -> Bench:
    """Have `part` as all parts are."""
    return _with_settings(bench, without_part_settings(bench.profile, _part(bench, asked)))


def _part(bench: Bench, asked: Asked) -> int:
    return whole(asked, "part", 1, max(bench.parts, 1))  # an uncut model is part 1


def _with_settings(bench: Bench, profile: Profile) -> Bench:
    return bench if profile.parts == bench.profile.parts else replace(bench, profile=profile)


def _rounded(matrix: Floats) -> list[list[float]]:
    """Rows of a rotation made orthogonal again after many turns, without the noise of the last digit."""
    left, _, right = np.linalg.svd(matrix)
    rows: list[list[float]] = (np.round(left @ right, TURN_DIGITS) + 0.0).tolist()
    return rows
