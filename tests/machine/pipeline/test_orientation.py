"""Messages about the chosen orientation: its advantage, and whether the model holds on the plate."""

from dataclasses import replace

import manifold3d as m3
import numpy as np

from machine.pipeline.choice import HARDLY_HELD, orientation_in_words, standing_in_words
from mdp.cut import mesh_of
from mdp.decomposition import FrontRow
from mdp.directions.orientation import best_orientation, facet_orientations
from mdp.plane import Plane
from mdp.search.orient import Oriented
from profiles.messages import terminal_words
from profiles.profile import load
from tests.machine.cli.terminal.test_report import alone
from tests.shapes import tee

PLANES = (Plane(np.array([1.0, 0.0, 0.0]), 5.0), Plane(np.array([-1.0, 0.0, 0.0]), 5.0))
WHOLE = FrontRow((), 300.0, 0.0, 425.4, stairs_mm2=125.4, time_s=3723.0, filament_mm=4040.0)
CUT = FrontRow(PLANES, 30.0, 80.0, 78.0, stairs_mm2=6.0, time_s=3600.0, filament_mm=3900.0)


def test_a_reoriented_model_is_reported_with_its_benefit() -> None:
    oriented = replace(alone(tee(), 0.0), front=(FrontRow((), 0.0, 0.0, 0.0, chosen=True, time_s=1800.0, filament_mm=3000.0),))
    side, upright = best_orientation(tee(), 45.0), facet_orientations(tee(), 45.0)[0]
    assert orientation_in_words(Oriented(side, oriented, 900.0, CUT, upright, True, True), "--as-is keeps it so") == (
        "oriented on its front (turned 90 about x): in one piece with 0 mm² of visible marks in 30m, standing as in its file"
        " in 3 parts with 78 mm² of visible marks in 1h 0m; --as-is keeps it so",
    )
    assert orientation_in_words(Oriented(side, oriented, 900.0, None, upright, True, True), "--as-is keeps it so") == (
        "oriented on its front (turned 90 about x): in one piece with 0 mm² of visible marks in 30m, standing as in its file"
        " 300 mm² would need support; --as-is keeps it so",
    )
    assert orientation_in_words(Oriented(None, oriented, 900.0, WHOLE, upright, True, True), "--as-is keeps it so") == ()


def test_a_model_left_on_too_small_a_base_is_reported() -> None:
    oriented = Oriented(None, alone(tee(), 300.0), 900.0, WHOLE, facet_orientations(tee(), 45.0)[0], False, False)
    warning = (
        "its base may be too small to hold it: consider a wide brim (process.brim_mm) or another orientation (process.rotate_deg)"
    )
    assert terminal_words(HARDLY_HELD) == warning
    assert orientation_in_words(oriented, "--as-is keeps it so") == (HARDLY_HELD,)
    turned = replace(oriented, orientation=best_orientation(tee(), 45.0))
    assert orientation_in_words(turned, "--as-is keeps it so")[1:] == (HARDLY_HELD,)


def test_a_model_turned_because_it_would_hardly_adhere_to_the_plate_is_reported() -> None:
    laid = replace(alone(tee(), 0.0), front=(FrontRow((), 0.0, 0.0, 0.0, chosen=True, time_s=1800.0, filament_mm=3000.0),))
    side, upright = best_orientation(tee(), 45.0), facet_orientations(tee(), 45.0)[0]
    (told,) = orientation_in_words(Oriented(side, laid, 900.0, None, upright, True, False), "--as-is keeps it so")
    assert "standing as in its file it would hardly hold on the plate; --as-is" in told


def test_a_model_that_is_not_turned_is_tested_on_the_plate() -> None:
    cone = m3.Manifold.cylinder(40.0, 0.01, 12.0, 64)
    assert len(standing_in_words(mesh_of(cone), load())) == 1
    assert standing_in_words(mesh_of(cone.rotate((180.0, 0.0, 0.0)).translate((0.0, 0.0, 40.0))), load()) == ()
    assert standing_in_words(mesh_of(cone), load(settings=["search.pedestal_mm=5"]))  # a pedestal holds no more than a plate
