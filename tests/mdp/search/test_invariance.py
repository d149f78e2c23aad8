"""The cost of a decomposition does not depend on a model's position, scale or handedness."""

import numpy as np
import pytest

from mdp.decomposition import Decomposition
from mdp.directions.orientation import set_on_plate
from mdp.mesh import Mesh
from mdp.overhang import UP
from mdp.pose import about
from mdp.search.search import SearchRequest, decompose
from profiles.profile import load
from tests import shapes
from tests.mdp.solids import random_solid

MODELS = [
    pytest.param(shapes.tee(), 2, id="tee"),
    pytest.param(shapes.branch(), 2, id="branch"),
    pytest.param(random_solid(3), 4, id="solid"),
]
ELSEWHERE = 0.02  # planes are sampled at other positions of a model that is moved, turned or mirrored


def cut(mesh: Mesh, parts: int, *keys: str) -> Decomposition:
    return decompose(mesh, "", load(settings=("search.directions=150", *keys)), SearchRequest(parts=parts))


@pytest.mark.parametrize(("mesh", "parts"), MODELS)
def test_a_model_costs_the_same_within_2_percent_however_it_is_turned_about_z(mesh: Mesh, parts: int) -> None:
    costs = [cut(set_on_plate(mesh, about(UP, np.radians(deg))), parts).cost_mm2 for deg in (0.0, 37.0, 211.0)]
    assert costs[1:] == pytest.approx([costs[0]] * 2, rel=ELSEWHERE)


@pytest.mark.parametrize(("mesh", "parts"), MODELS)
def test_a_model_costs_the_same_within_2_percent_as_its_mirror_image(mesh: Mesh, parts: int) -> None:
    mirrored = Mesh(mesh.vertices * (-1.0, 1.0, 1.0), mesh.faces[:, ::-1])
    assert cut(mirrored, parts).cost_mm2 == pytest.approx(cut(mesh, parts).cost_mm2, rel=ELSEWHERE)


@pytest.mark.parametrize(("mesh", "parts"), MODELS)
def test_the_cost_of_a_model_depends_on_its_place_on_the_plate_by_less_than_2_percent(mesh: Mesh, parts: int) -> None:
    there = cut(Mesh(mesh.vertices + np.array((7.5, -4.25, 0.0)), mesh.faces), parts)
    assert there.cost_mm2 == pytest.approx(cut(mesh, parts).cost_mm2, rel=ELSEWHERE)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("scale", [1.25, 1.5])
def test_published_costs_grow_with_the_square_of_all_lengths(seed: int, scale: float) -> None:
    """All lengths of the model, of the search and of the longest self-supporting spans; a chamfer that may still touch the
    build plate (0.3 mm) does not scale with them, so the factors are small."""
    mesh = random_solid(seed)
    lengths_mm = {
        "search.offset_step_mm": 0.5,
        "search.platform_radius_mm": 20.0,
        "search.seam_mm": 0.8,
        "machine.head.nozzle_mm": 0.4,
        "process.line_width_mm": 0.4,
        "process.layer_height_mm": 0.2,
        "process.first_layer_height_mm": 0.2,
        "process.bridge_longest_mm": 10.0,
        "process.arch_longest_mm": 4.0,
    }
    areas_mm2 = {"process.support_least_mm2": 1.0, "search.least_interface_mm2": 4.0}

    def published(factor: float) -> Decomposition:
        lengths = [f"{key}={length_mm * factor}" for key, length_mm in lengths_mm.items()]
        areas = [f"{key}={area_mm2 * factor**2}" for key, area_mm2 in areas_mm2.items()]
        return cut(
            Mesh(mesh.vertices * factor, mesh.faces), 3, "search.method=published", "search.clearance=false", *lengths, *areas
        )

    small, large = published(1.0), published(scale)
    assert len(small.parts) == 3
    assert large.cost_mm2 == pytest.approx(small.cost_mm2 * scale**2, rel=1e-6)
