import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.dryrun import dry_run
from machine.dryrun.agreement import outside_mm, pieces_outside
from mdp.sweep.rays import triangle_tree
from profiles.profile import load
from tests import shapes
from tests.machine.hand import printed, text

POINT = st.tuples(st.floats(-25, 25), st.floats(-25, 25), st.floats(-10, 30))
BALL = shapes.ball(10.0, 96)


@settings(deadline=None)  # the first call compiles
@given(POINT)
def test_the_distance_outside_a_box_is_the_closed_formula(point: tuple[float, float, float]) -> None:
    beyond = np.maximum(np.maximum([-10, -10, 0] - np.array(point), np.array(point) - [10, 10, 20]), 0)
    surface = triangle_tree(shapes.box())
    assert outside_mm(np.array([point]), surface, 8.0)[0] == pytest.approx(min(np.linalg.norm(beyond), 8.0), abs=2e-6)


@settings(deadline=None)  # the first call compiles
@given(POINT)
def test_the_distance_outside_a_ball_is_radius_minus_ten(point: tuple[float, float, float]) -> None:
    wanted = max(0.0, np.linalg.norm(np.array(point) - [0, 0, 10]) - 10)
    assert outside_mm(np.array([point]), triangle_tree(BALL), 5.0)[0] == pytest.approx(min(wanted, 5.0), abs=0.02)


def test_a_void_is_outside() -> None:
    assert outside_mm(
        np.array([[0.0, 0.0, 10.0], [0.0, 0.0, 2.0]]), triangle_tree(shapes.hollow()), 6.0
    ).tolist() == pytest.approx([5.0, 0.0])


@pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])
def test_a_generated_print_is_inside_its_model(machine: str) -> None:
    profile, decomposition, _, _ = printed(machine)
    beyond_mm, length_mm, _ = pieces_outside(dry_run(text(machine), profile), triangle_tree(decomposition.mesh), 0.0)
    assert (beyond_mm == 0.0).all()
    assert length_mm.sum() == pytest.approx(2 * 3 * 4 * (9.55 + 8.65))


def test_a_line_half_outside_counts_half() -> None:
    program = "G28\nM83\nG0 Z10 F600\nG0 X-10\n;TYPE:Perimeter\nG1 X30 E1 F600\n;TYPE:Skirt/Brim\nG1 X60 E1"
    beyond_mm, length_mm, rows = pieces_outside(dry_run(program.splitlines(), load()), triangle_tree(shapes.box()), 0.0)
    assert (length_mm[beyond_mm > 0.0].sum(), length_mm.sum(), beyond_mm.max()) == (pytest.approx(20.0), 40.0, 1.0)
    assert set(rows.tolist()) == {2}


def test_a_program_without_extrusion_has_no_pieces() -> None:
    beyond_mm, length_mm, rows = pieces_outside(dry_run(["G28", "G0 X1 Y1 F600"], load()), triangle_tree(shapes.box()), 0.4)
    assert (len(beyond_mm), len(length_mm), len(rows)) == (0, 0, 0)
