"""Forecast: what planes would leave risky, summed without cutting, against what is left after cutting."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cost.cost import CostTerms
from mdp.cost.forecast import Forecast
from mdp.cut import cut, mesh_of, solid_of
from mdp.mesh import Mesh
from mdp.overhang import Mask, facing_down, risky_upright
from mdp.plane import Plane
from mdp.sweep.sweep import Remainder
from tests import shapes

ANGLE_DEG = 45.0


def _surface(mesh: Mesh) -> Forecast:
    return Forecast.of(Remainder(mesh, risky_upright(mesh, ANGLE_DEG)), CostTerms(ANGLE_DEG, False))


def _cut_and_summed(mesh: Mesh, planes: list[Plane]) -> float:
    """Risky area of the parts after really cutting, the faces laid open by cuts left out."""
    total, below = 0.0, solid_of(mesh)
    for position, plane in enumerate(planes):
        above, below = cut(below, plane)
        part = mesh_of(above)
        total += part.areas_mm2[facing_down(part, plane.normal, ANGLE_DEG) & ~_in_planes(part, planes[: position + 1])].sum()
    rest = mesh_of(below)
    return float(total + rest.areas_mm2[risky_upright(rest, ANGLE_DEG) & ~_in_planes(rest, planes)].sum())


def _in_planes(mesh: Mesh, planes: list[Plane]) -> Mask:
    heights = [np.abs(plane.heights_mm(mesh.vertices)[mesh.faces]).max(axis=1) < 1e-7 for plane in planes]
    lying: Mask = np.any(heights, axis=0)
    return lying


def _leaning(angle_deg: float, turn_deg: float, offset_mm: float) -> Plane:
    angle, turn = np.radians(angle_deg), np.radians(turn_deg)
    return Plane(np.array([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)]), offset_mm)


@given(
    st.lists(st.tuples(st.floats(0.0, 79.0), st.floats(0.0, 360.0), st.floats(5.0, 35.0)), min_size=1, max_size=5),
    st.sampled_from([shapes.tee, shapes.branch, shapes.ball, shapes.bowl]),
)
@settings(max_examples=60, deadline=None)
def test_the_forecast_is_what_cutting_leaves(leans: list[tuple[float, float, float]], shape: type) -> None:
    planes = [_leaning(*lean) for lean in leans]
    assert _surface(shape()).left_mm2(planes) == pytest.approx(_cut_and_summed(shape(), planes), abs=1e-6)


def test_without_planes_it_is_the_risky_area_upright() -> None:
    assert _surface(shapes.tee()).left_mm2([]) == pytest.approx(300.0)  # the undersides of a 40 x 10 bar on a 10 x 10 stem


def test_a_plane_above_everything_changes_nothing() -> None:
    assert _surface(shapes.tee()).left_mm2([_leaning(20.0, 0.0, 100.0)]) == pytest.approx(300.0)


def test_one_leaning_plane_makes_one_side_of_a_tee_safe() -> None:
    beside_the_stem = _leaning(80.0, 0.0, 5.0 * np.sin(np.radians(80.0)) + 30.0 * np.cos(np.radians(80.0)))
    assert _surface(shapes.tee()).left_mm2([beside_the_stem]) == pytest.approx(150.0)
