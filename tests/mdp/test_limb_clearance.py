import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.clearance import StandingColumns, passes_clear
from mdp.mesh import Floats
from mdp.pose import level
from profiles.profile import load
from tests import shapes

MACHINE = load().machine  # silhouette [[0.6, 0], [2.5, 2], [5, 3], [11.5, 4.5], [15, 16]], clearance 1 mm, carriage 40 mm up


def _box(x: float, width: float, height: float) -> Floats:
    """(12, 3, 3) the faces of a box 10 mm deep that begins at x."""
    mesh = shapes.box(width, 10.0, height)
    return mesh.vertices[mesh.faces] + np.array([x + 0.5 * width, 0.0, 0.0])


def _clear(gap: float, height: float) -> bool:
    """Whether a limb of 10 mm can be printed with this gap to a tower of that height."""
    return passes_clear(MACHINE, level(MACHINE), (_box(0.0, 10.0, 10.0), _box(10.0 + gap, 8.0, height)), 0.0)


@pytest.mark.parametrize(
    ("gap", "height", "clear"),
    [
        (6.0, 1.7, True),  # 5 mm beside the tip, less 1 mm clearance, the hot end is 3 mm up: 2 mm may remain
        (6.0, 2.3, False),
        (12.5, 3.2, True),  # 11.5 mm to the side it is 4.5 mm up
        (12.5, 3.8, False),
        (17.0, 38.0, True),  # beyond 16 mm there is only the carriage, 40 mm up
        (17.0, 40.0, False),
        (40.0, 90.0, True),
    ],
)
def test_bodies_beside_a_limb_are_limited_by_the_head_at_their_distance(gap: float, height: float, clear: bool) -> None:
    assert _clear(gap, height) is clear


def test_a_limb_entirely_above_its_neighbours_is_clear_at_any_distance() -> None:
    up = np.array([0.0, 0.0, 5.0])
    assert passes_clear(MACHINE, level(MACHINE), (_box(0.0, 10.0, 10.0) + up, _box(10.5, 8.0, 4.9)), 0.0)
    assert not passes_clear(MACHINE, level(MACHINE), (_box(0.0, 10.0, 10.0) + up, _box(10.5, 8.0, 5.5)), 0.0)


def _wide_box(x: float, height: float) -> Floats:
    """A box of 70 x 80 mm that begins at x, many cells wide in the coarsest grid."""
    mesh = shapes.box(70.0, 80.0, height)
    return mesh.vertices[mesh.faces] + np.array([x + 35.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("gap", "height", "clear"), [(70.0, 38.0, True), (25.0, 30.0, True), (16.5, 40.0, False), (3.0, 2.5, False)]
)
def test_large_limbs_are_compared_with_large_neighbours(gap: float, height: float, clear: bool) -> None:
    assert passes_clear(MACHINE, level(MACHINE), (_wide_box(0.0, 20.0), _wide_box(70.0 + gap, height)), 0.0) is clear


@given(st.floats(0.0, 40.0), st.floats(0.0, 40.0), st.floats(0.5, 60.0), st.lists(st.floats(-60.0, 60.0), min_size=2, max_size=2))
def test_the_required_tip_height_is_that_left_by_the_underside(x: float, y: float, top: float, place: list[float]) -> None:
    standing = StandingColumns.of(np.array([[x, y, top]]), 0.0, MACHINE)
    across, along = x - place[0], y - place[1]
    radius = max(np.hypot(across, along) - 1.0, 0.0)
    radii, heights = np.array(MACHINE.head.silhouette_mm).T
    under = np.interp(radius, radii, heights) if radius <= radii[-1] else np.inf
    for box in MACHINE.head.boxes:
        low, high = np.array(box.min_mm[:2]) - 1.0, np.array(box.max_mm[:2]) + 1.0
        if low[0] <= across <= high[0] and low[1] <= along <= high[1]:
            under = min(under, box.min_mm[2])
    asked = standing.least_tip_mm(np.array([place]))[0]
    assert asked == pytest.approx(top - max(under - 1.0, 0.0)) or (np.isinf(under) and asked < -1e8)
