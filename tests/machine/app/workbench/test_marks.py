"""Marks as values: what of them stays when the model is turned, and which faces they name."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from machine.app.workbench.bench.bench import Bench, Model, with_rotation
from machine.app.workbench.bench.marks import named_faces, standing_mesh
from mdp.grown import Grown
from mdp.pose import about, unit
from mdp.zone import Zone, Zones
from profiles.profile import load
from tests.shapes import tee

ARM = Grown((-12.0, 1.0, 30.0), 1.0)
BENCH = replace(
    Bench(load(), Model("tee.stl", Path("tee.stl"), tee())),
    zones=Zones(keep=(Zone((0.0, 0.0, 0.0), (9.0, 9.0, 9.0)),), no_support=(ARM,)),
)


@pytest.mark.parametrize("angle_deg", [90.0, 180.0, 37.0])
def test_marked_faces_stay_marked_however_often_the_model_is_turned_and_boxes_go(angle_deg: float) -> None:
    turned = with_rotation(BENCH, about(unit([1.0, 2.0, 0.5]), np.radians(angle_deg)).tolist())
    again = with_rotation(turned, about(unit([0.0, 1.0, -0.5]), np.radians(angle_deg)).tolist())
    for bench in (turned, again):
        assert bench.zones.keep == ()
        assert (named_faces(bench) == named_faces(BENCH)).all()
        (zone,) = bench.zones.no_support
        assert isinstance(zone, Grown)
        assert zone.away_mm(standing_mesh(bench)) < 0.002
    back = with_rotation(again, BENCH.rotation).zones.no_support[0]
    assert isinstance(back, Grown)
    assert back.point_mm == pytest.approx(ARM.point_mm, abs=0.003)


def test_faces_of_several_kinds_are_told_of_each() -> None:
    both = replace(BENCH, zones=Zones(no_seam=(Grown((0.0, 5.0, 10.0), 1.0),), no_support=(ARM,)))
    assert named_faces(both).sum(axis=1).tolist() == [0, 6, 2]
