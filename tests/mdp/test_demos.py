"""The demo models: closed, printable, better in several directions or cut by their own plan, and reproduced byte for byte."""

from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from mdp.cut import solid_of
from mdp.mesh import Mesh
from mdp.model_file import locate, plan_beside
from mdp.overhang import risky_upright
from mdp.read import read_mesh
from mdp.search.search import decompose
from profiles.profile import load
from tests.checks import assert_closed
from tools.docs.make_demos import DEMOS, LEANS, bar, cone_distance, main, smooth_union

NAMES = sorted(DEMOS)
PIECES = sorted(LEANS)
MODELS = [name for name in NAMES if name not in PIECES]
# Euler's formula: the bracket has 4 bolt holes and a bore with 5 mouths, 4 + 5 - 1; the lattice has 22 struts between 11 nodes,
# 22 - 11 + 1; the organic ones have no hole.
GENUS = {"bracket": 8, "calibration": 0, "calibration30": 0, "figure": 0, "lattice": 12, "tree": 0}


def demo(name: str) -> Mesh:
    return read_mesh(locate(f"demo:{name}"))[0]


def test_every_demo_has_its_file_and_every_file_its_demo() -> None:
    files = [entry.name for entry in resources.files("mdp").joinpath("demos").iterdir() if entry.name.endswith(".ply")]
    assert sorted(files) == [f"{name}.ply" for name in NAMES]


def test_all_files_together_stay_below_one_megabyte() -> None:
    assert sum(locate(f"demo:{name}").stat().st_size for name in NAMES) < 1_000_000


@pytest.mark.parametrize("name", NAMES)
def test_a_demo_is_one_closed_solid_that_needs_no_repair(name: str) -> None:
    mesh, notes = read_mesh(locate(f"demo:{name}"))
    assert notes == ()
    assert_closed(mesh)
    solid = solid_of(mesh)
    assert len(solid.decompose()) == 1
    assert solid.genus() == GENUS[name]


@pytest.mark.parametrize("name", NAMES)
def test_a_demo_has_a_flat_base_around_the_turn_axis(name: str) -> None:
    mesh = demo(name)
    base = (mesh.normals[:, 2] < -0.9999) & (mesh.vertices[mesh.faces][:, :, 2] == 0.0).all(axis=1)
    assert mesh.areas_mm2[base].sum() > 400.0
    assert np.allclose(mesh.bounds_mm.mean(axis=0)[:2], 0.0, atol=1e-3)


@pytest.mark.parametrize("name", MODELS)
def test_a_demo_fits_on_a_table_of_100_mm_radius(name: str) -> None:
    mesh = demo(name)
    assert np.hypot(*mesh.vertices[:, :2].T).max() < 60.0
    assert 40.0 < np.ptp(mesh.vertices[:, 2]) < 80.0


@pytest.mark.parametrize("name", MODELS)
def test_the_overhangs_of_a_demo_are_high_above_the_build_plate(name: str) -> None:
    mesh = demo(name)
    risky = risky_upright(mesh, 45.0)
    low = mesh.vertices[mesh.faces][:, :, 2].min(axis=1) < 12.0
    assert mesh.areas_mm2[risky].sum() > 0.05 * mesh.areas_mm2.sum()
    assert mesh.areas_mm2[risky & low].sum() < 0.05 * mesh.areas_mm2[risky].sum()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "reduction"), [("bracket", 0.75), ("figure", 0.9), ("lattice", 0.5), ("tree", 0.8)])
def test_several_directions_make_most_of_a_demo_safe(name: str, reduction: float) -> None:
    decomposition = decompose(
        demo(name), name, load(settings=["search.seam_mm=0.8", "search.directions=100", "search.beam_width=1"])
    )
    assert len(decomposition.parts) >= 3
    assert decomposition.reduction > reduction


@pytest.mark.parametrize("name", ["bracket", "lattice", *PIECES])
def test_the_exact_demos_are_remade_byte_for_byte(name: str, tmp_path: Path) -> None:
    main(tmp_path, [name])
    assert (tmp_path / f"{name}.ply").read_bytes() == locate(f"demo:{name}").read_bytes()


@pytest.mark.parametrize("name", PIECES)
def test_a_calibration_piece_comes_with_its_plan_and_no_other_demo_has_one(name: str, tmp_path: Path) -> None:
    main(tmp_path, [name])
    plan = plan_beside(f"demo:{name}")
    assert plan is not None
    assert plan.read_bytes() == (tmp_path / f"{name}.toml").read_bytes()
    assert [plan_beside(f"demo:{other}") for other in MODELS] == [None] * len(MODELS)


@pytest.mark.parametrize(("name", "reach_mm"), [("calibration", 100.0), ("calibration30", 35.0)])
def test_a_calibration_piece_fits_on_the_tables_it_is_for(name: str, reach_mm: float) -> None:
    assert np.hypot(*demo(name).vertices[:, :2].T).max() < reach_mm


@pytest.mark.slow
@pytest.mark.parametrize("name", ["figure", "tree"])
def test_the_grown_demos_are_remade_byte_for_byte(name: str, tmp_path: Path) -> None:
    main(tmp_path, [name])
    assert (tmp_path / f"{name}.ply").read_bytes() == locate(f"demo:{name}").read_bytes()


def test_the_distance_to_a_cone_is_that_to_its_axis_less_the_radius_there() -> None:
    knots = np.array([(0, 0, 0, 2.0), (0, 0, 10, 4.0)])
    assert cone_distance(knots, 0, 9.0, 0.0, 5.0) == pytest.approx(6.0)
    assert cone_distance(knots, 0, 0.0, 0.0, 17.0) == pytest.approx(3.0)


def test_a_smooth_union_reaches_a_quarter_of_the_blend_beyond_two_equally_near_limbs() -> None:
    field = smooth_union([[(-5, 0, 0, 1), (-5, 0, 9, 1)], [(5, 0, 0, 1), (5, 0, 9, 1)]], 2.0)
    assert field(0.0, 0.0, 4.0) == pytest.approx(-(4.0 - 2.0 / 4.0))


def test_a_bar_reaches_a_radius_beyond_both_its_ends() -> None:
    box = bar((1, 2, 3), (11, 2, 3), 2.0).bounding_box()
    assert box == pytest.approx((-1, 0, 1, 13, 4, 5), abs=0.05)
