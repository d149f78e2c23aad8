"""Pricing: about how long parts print, and how much filament they take, for the search to choose by."""

from collections.abc import Sequence

from machine.planning.fit import check_parts
from mdp.decomposition import Part
from mdp.search.front import Price, Pricing
from profiles.errors import UserError
from profiles.profile import Profile
from slicer.estimate.estimate import estimate


def pricing(profile: Profile) -> Pricing:
    """What parts take to print by this profile; None for parts that cannot be sliced or that the machine has no room for."""

    def price(parts: Sequence[Part]) -> Price | None:
        try:
            check_parts(parts, profile)
            guess = estimate(parts, profile)
        except UserError:
            return None
        return guess.time_s, guess.filament_mm

    return price
