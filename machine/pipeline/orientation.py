"""Orientation: how a model was laid down, and whether the plate holds it, in words."""

import numpy as np

from machine.quantities import minutes
from mdp.cost.footing import BuildPlate
from mdp.decomposition import FrontRow
from mdp.directions.orientation import in_words, side_in_words
from mdp.mesh import Mesh
from mdp.search.orient import Oriented
from profiles.messages import key_name
from profiles.profile import Profile

HARDLY_HELD = (
    f"its base may be too small to hold it: think of a wide brim ({key_name('process.brim_mm')}) or another "
    f"side ({key_name('process.rotate_deg')})"
)


def orientation_in_words(oriented: Oriented, otherwise: str) -> tuple[str, ...]:
    """How a model was laid down, what that is better by, and how to change it; nothing where it stays. Then a warning where the
    plate hardly holds it."""
    orientation, standing, laid = oriented.orientation, oriented.standing, oriented.decomposition.chosen
    warning = () if oriented.held else (HARDLY_HELD,)
    if orientation is None:
        return warning
    side, turns = side_in_words(orientation), in_words(orientation, held=True)
    where, better = f"{side} ({turns})" if side else turns, ""
    if laid is not None:
        was = f"{oriented.upright.risky_mm2:.0f} mm² hang over" if standing is None else _with_scars(standing)
        better = f": {_with_scars(laid)}, as it stands {was if oriented.upright_held else 'the plate would hardly hold it'}"
    return (f"it is laid down {where}{better}; {otherwise}", *warning)


def standing_in_words(mesh: Mesh, profile: Profile) -> tuple[str, ...]:
    """A warning where the plate hardly holds a model as it stands."""
    return () if BuildPlate.under(mesh, profile).footing(np.eye(3)).held(of_file=True) else (HARDLY_HELD,)


def _with_scars(row: FrontRow) -> str:
    taking = "" if row.time_s is None else f" in {minutes(row.time_s)}"
    return f"{in_parts(row.parts)} with {row.cost_mm2:.0f} mm² of scars{taking}"


def in_parts(count: int) -> str:
    """A number of parts in words."""
    return "in one piece" if count == 1 else f"in {count} parts"
