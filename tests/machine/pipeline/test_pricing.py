"""Parts that can be sliced have a price, and the search chooses by it."""

from dataclasses import replace

from machine.pipeline.choice import pricing
from mdp.mesh import Mesh
from mdp.search.search import SearchRequest, decompose
from profiles.profile import load
from tests import shapes

COARSE = ("search.directions=200", "process.layer_height_mm=0.3")


def test_every_row_that_costs_less_than_those_with_fewer_parts_has_a_price() -> None:
    profile = load(settings=COARSE)
    front = decompose(shapes.branch(), "branch", profile, SearchRequest(price=pricing(profile))).front
    assert [row.parts for row in front] == [1, 2]
    assert all(row.time_s is not None and row.time_s > 60.0 and row.filament_mm is not None for row in front)


def test_unsliceable_parts_have_no_price() -> None:
    profile = load(settings=COARSE)
    part = decompose(shapes.branch(), "branch", profile).parts[0]
    open_mesh = Mesh(part.mesh.vertices, part.mesh.faces[1:])
    assert pricing(profile)([replace(part, mesh=open_mesh)]) is None


def test_the_dearer_a_second_the_quicker_the_print() -> None:
    times_s = []
    for second_mm2 in (0.0, 1.0, 100.0):
        own = ["search.metre_mm2=0", f"search.second_mm2={second_mm2}"]
        profile = load(settings=[*COARSE, *own])
        chosen = decompose(shapes.branch(), "branch", profile, SearchRequest(price=pricing(profile))).chosen
        times_s.append(0.0 if chosen is None or chosen.time_s is None else chosen.time_s)
    assert times_s == sorted(times_s, reverse=True)
    assert times_s[0] > times_s[-1]
