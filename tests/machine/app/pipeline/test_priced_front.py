"""Rows that cost no less than one with fewer parts get no estimate."""

from dataclasses import replace

from machine.app.pipeline.priced_front import price_front
from mdp.decomposition import Decomposition
from mdp.search.search import decompose
from profiles.profile import load
from tests import shapes

PROFILE = load(settings=["search.directions=200"])


def _with_costs(*costs_mm2: float) -> Decomposition:
    """A post with an arm, cut in two, whose rows are said to cost that much."""
    decomposition = decompose(shapes.branch(), "branch", PROFILE)
    rows = zip(decomposition.front, costs_mm2, strict=False)
    return replace(decomposition, front=tuple(replace(row, cost_mm2=cost) for row, cost in rows))


def test_every_row_that_costs_less_than_those_with_fewer_parts_has_an_estimate() -> None:
    rows = price_front(_with_costs(300.0, 100.0), PROFILE).front
    assert [row.parts for row in rows] == [1, 2]
    assert all(row.time_s is not None and row.time_s > 60.0 and row.filament_mm is not None for row in rows)


def test_a_row_that_costs_more_than_one_with_fewer_parts_has_none() -> None:
    decomposition = _with_costs(100.0, 300.0)
    front = tuple(replace(row, chosen=row.parts == 1) for row in decomposition.front)
    whole = replace(decomposition, front=front)
    assert [row.time_s is None for row in price_front(whole, PROFILE).front] == [False, True]
