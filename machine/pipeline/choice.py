"""Choice of orientation and parts: its criteria, and its description in words."""

from collections.abc import Sequence

import numpy as np

from machine.pipeline.requests import ModelRequest
from machine.planning.fit import check_parts
from machine.quantities import amount, minutes
from mdp.cost.footing import BuildPlate
from mdp.decomposition import FrontRow, Part
from mdp.directions.orientation import in_words, side_in_words
from mdp.mesh import Floats, Mesh
from mdp.pose import turned_further
from mdp.search.front import Price, Pricing
from mdp.search.orient import Oriented
from mdp.search.plan_file import PlanFile
from profiles.errors import UserError
from profiles.messages import key_name
from profiles.profile import Profile
from slicer.estimate.estimate import estimate

HARDLY_HELD = (
    f"its base may be too small to hold it: consider a wide brim ({key_name('process.brim_mm')}) or another "
    f"orientation ({key_name('process.rotate_deg')})"
)


def pricing(profile: Profile) -> Pricing:
    """Function for the time and filament of parts; it returns None for parts that cannot be sliced or do not fit the machine."""

    def price(parts: Sequence[Part]) -> Price | None:
        try:
            check_parts(parts, profile)
            guess = estimate(parts, profile)
        except UserError:
            return None
        return guess.time_s, guess.filament_mm

    return price


def lays_down(request: ModelRequest, given: PlanFile | None, profile: Profile) -> bool:
    """Whether to search for the orientation: if the user requests it, or if neither options nor a plan give one."""
    if request.orient is not None or given is not None:
        return bool(request.orient) and given is None
    return lies_freely(profile)


def lies_freely(profile: Profile) -> bool:
    """Whether a profile leaves the orientation open; rotations and the paper's terms fix it."""
    return profile.search.effective.seam_mm > 0.0 and not any(profile.process.rotate_deg)


def as_turned(profile: Profile, orientation: Floats | None) -> Profile:
    """The profile whose rotate_deg includes a further (3, 3) rotation, or None, so that its G-code records the orientation."""
    if orientation is None:
        return profile
    rotate_deg = turned_further(profile.process.rotate_deg, orientation)
    return profile.model_copy(update={"process": profile.process.model_copy(update={"rotate_deg": rotate_deg})})


def orientation_in_words(oriented: Oriented, otherwise: str) -> tuple[str, ...]:
    """The chosen orientation, its advantage and how to change it; then a warning when the plate hardly holds the model."""
    orientation, standing, laid = oriented.orientation, oriented.standing, oriented.decomposition.chosen
    warning = () if oriented.held else (HARDLY_HELD,)
    if orientation is None:
        return warning
    side, turns = side_in_words(orientation), in_words(orientation, held=True)
    where, better = f"{side} ({turns})" if side else turns, ""
    if laid is not None:
        was = f"{amount(oriented.upright.risky_mm2, 0)} mm² would need support" if standing is None else _with_marks(standing)
        upright = was if oriented.upright_held else "it would hardly hold on the plate"
        better = f": {_with_marks(laid)}, standing as in its file {upright}"
    return (f"oriented {where}{better}; {otherwise}", *warning)


def standing_in_words(mesh: Mesh, profile: Profile) -> tuple[str, ...]:
    """A warning when the plate hardly holds a model as it stands."""
    return () if BuildPlate.under(mesh, profile).footing(np.eye(3)).held(of_file=True) else (HARDLY_HELD,)


def _with_marks(row: FrontRow) -> str:
    taking = "" if row.time_s is None else f" in {minutes(row.time_s)}"
    return f"{in_parts(row.parts)} with {amount(row.cost_mm2, 0)} mm² of visible marks{taking}"


def in_parts(count: int) -> str:
    """A number of parts in words."""
    return "in one piece" if count == 1 else f"in {count} parts"
