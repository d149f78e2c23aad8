"""Selection of the alternatives that are offered to a judge."""

import numpy as np
import pytest

from mdp.mesh import Floats
from mdp.plane import Plane
from mdp.pose import turned_by
from profiles.profile import load
from tests.shapes import branch
from tools.campaigns import offer_parts

UPRIGHT = np.eye(3)


def plane(offset_mm: float, lean_deg: float = 0.0) -> Plane:
    return Plane(np.array([np.sin(np.radians(lean_deg)), 0.0, np.cos(np.radians(lean_deg))]), offset_mm)


@pytest.mark.parametrize(
    ("rotation", "planes", "like"),
    [
        (UPRIGHT, (plane(20.0),), True),
        (UPRIGHT, (plane(22.0, 10.0),), True),
        (UPRIGHT, (plane(23.0),), False),  # more than 4 % of 60 mm
        (UPRIGHT, (plane(20.0, 16.0),), False),
        (UPRIGHT, (), False),
        (UPRIGHT, (plane(20.0), plane(40.0)), False),
        (turned_by((0.0, 0.0, 50.0)), (plane(20.0),), True),  # about the vertical
        (turned_by((20.0, 0.0, 0.0)), (plane(20.0),), False),
    ],
)
def test_visually_equal_alternatives_are_duplicates(rotation: Floats, planes: tuple[Plane, ...], like: bool) -> None:
    assert offer_parts.Offer(UPRIGHT, (plane(20.0),)).is_like(offer_parts.Offer(rotation, planes), 60.0) is like


def test_a_branch_is_offered_whole_and_cut_without_duplicates() -> None:
    offers = offer_parts.offers_of(branch(), load(settings=["search.directions=60"]))
    assert {bool(offer.planes) for offer in offers} == {False, True}
    assert [offer.today for offer in offers] == [True] + [False] * (len(offers) - 1)
    assert len(offer_parts.distinct([], offers, 50.0, 99)) == len(offers) >= offer_parts.LEAST
