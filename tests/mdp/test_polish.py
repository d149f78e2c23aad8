"""Polish: a sequence of cuts made shorter and better."""

import numpy as np
import pytest

from mdp.node import Node
from mdp.plane import Plane
from mdp.polish import polished
from mdp.rules import Rules
from profiles.profile import load
from tests import shapes

ALONG_X = np.array([np.cos(np.radians(15.0)), 0.0, np.sin(np.radians(15.0))])


def _rules(*settings: str) -> Rules:
    """A tee whose undersides are safe only along directions less than 20 degrees above the horizon: one cut a side."""
    steep = ("process.self_supporting_angle_deg=20", "search.clearance=false", "search.directions=200")
    return Rules(shapes.tee(), load(settings=(*steep, *settings)))


def _after(rules: Rules, *planes: Plane) -> Node:
    nodes = rules.replay(rules.root, planes)
    assert nodes is not None
    return nodes[-1]


def _through(height_mm: float, x_mm: float, normal: np.ndarray = ALONG_X) -> Plane:
    return Plane(normal, float(normal @ [x_mm, 0.0, height_mm]))


def test_a_plane_moves_to_where_less_stays_risky() -> None:
    rules = _rules("search.most_parts=2")
    far_out = _after(rules, _through(30.0, 9.0))
    better = polished(rules, far_out)
    assert far_out.cost_mm2 == pytest.approx(300.0 - 110.0, abs=1.0)
    assert better.cost_mm2 == pytest.approx(150.0, abs=3.0)
    assert len(better.cuts) == 1


def test_a_cut_that_saves_nothing_is_left_out() -> None:
    rules = _rules("search.most_parts=3")
    twice = _after(rules, _through(30.0, 12.0), _through(30.0, 5.2))
    once = polished(_rules("search.most_parts=2"), twice)
    assert len(twice.cuts) == 2
    assert len(once.cuts) == 1
    assert once.cost_mm2 <= twice.cost_mm2


def test_where_there_is_room_further_cuts_are_added() -> None:
    rules = _rules("search.most_parts=4")
    one_side = _after(rules, _through(30.0, 5.2))
    both = polished(rules, one_side)
    assert len(both.cuts) == 2
    assert both.cost_mm2 < 10.0


@pytest.mark.parametrize("x_mm", [5.2, 7.0, 12.0])
def test_every_plane_of_the_result_may_be_cut(x_mm: float) -> None:
    rules = _rules()
    found = polished(rules, _after(rules, _through(30.0, x_mm)))
    assert rules.replay(rules.root, [cut.base for cut in found.cuts]) is not None


def test_a_time_limit_of_nothing_leaves_all_as_it_is() -> None:
    rules = _rules("search.time_limit_s=0")
    node = _after(rules, _through(30.0, 9.0))
    assert polished(rules, node).cost_mm2 == node.cost_mm2


def test_a_plane_a_hairs_breadth_from_the_origin_is_refused_and_one_through_it_is_looked_at() -> None:
    rules = _rules()
    beside, through = Plane(ALONG_X, 1e-17), Plane(ALONG_X, 0.0)
    assert not rules.allowed(rules.root, beside)
    assert not rules.allowed(rules.root, through)  # it would cut the platform
    assert rules.allowed(rules.root, _through(30.0, 9.0))
