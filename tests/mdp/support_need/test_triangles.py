"""Support need depends on the shape only: it is equal for every triangulation of a surface."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cost.cost import excess_mm2, needing_upright
from mdp.mesh import Floats, Mesh
from mdp.overhang import facing_down, risky_upright, threshold
from mdp.plane import Plane
from mdp.support_need.need import ModelPieces, SupportNeed, needs_support
from mdp.support_need.patches import CARRIES_ITSELF, UNSUPPORTABLE
from mdp.sweep.sweep import Remainder, gains
from profiles.profile import load
from slicer.overhangs import find_overhangs
from tests.retriangulated import edited, refined
from tests.shapes import standing
from tests.slicer.hand import sections_at

PROFILE = load()
UP_DEG = PROFILE.process.self_supporting_angle_deg
LEANING = np.array([(0, 0, 1), (1, 0, 0), (0, -1, 0), (0, 0.1, 1), (0.6, 0, 1), (-0.3, 0.4, 0.8), (0.005, 0.003, 1)], np.float64)
DIRECTIONS = LEANING / np.linalg.norm(LEANING, axis=1)[:, None]

half_mm = st.integers(1, 12).map(lambda n: n / 2)
depths_mm = st.sampled_from((0.3, 0.5, 0.9, 1.0, 1.5, 3.0))
seeds = st.integers(0, 10_000)


def box(x: float, y: float, z: float, size: tuple[float, float, float]) -> m3.Manifold:
    return m3.Manifold.cube(size).translate((x, y, z))


@st.composite
def heaps(draw: st.DrawFn) -> m3.Manifold:
    """The largest connected piece of some boxes."""
    heap = m3.Manifold()
    for _ in range(draw(st.integers(2, 5))):
        heap += box(draw(half_mm), draw(half_mm), draw(half_mm), (2 * draw(half_mm), 2 * draw(half_mm), draw(half_mm)))
    return max(heap.decompose(), key=lambda piece: piece.volume())


@st.composite
def decks(draw: st.DrawFn) -> m3.Manifold:
    """A deck on two pillars, with ledges at its ends and ridges under its middle."""
    length, width, height = draw(st.integers(3, 34)), 1.0 + draw(half_mm), 4.0 + draw(half_mm)
    deck = box(-3, 0, 0, (3, width, height)) + box(length, 0, 0, (3, width, height)) + box(-3, 0, height, (length + 6, width, 2))
    for _ in range(draw(st.integers(0, 3))):
        reach, depth = min(draw(half_mm), length), draw(depths_mm)
        x, wide = draw(st.sampled_from((0.0, length - reach, (length - reach) / 2))), min(draw(half_mm), width)
        deck += box(x, 0, height - depth, (reach, wide, depth + 1))
    return deck


@st.composite
def tables(draw: st.DrawFn) -> m3.Manifold:
    """A table with some legs, and pins that hang from it."""
    length, width, height = 4.0 + 2 * draw(half_mm), 4.0 + 2 * draw(half_mm), 4.0 + draw(half_mm)
    table = box(0, 0, height, (length, width, 2)) + box(length / 2 - 1, width / 2 - 1, 0, (2, 2, height))
    for x, y in draw(st.sets(st.sampled_from(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0))))):
        table += box(x * (length - 1.5), y * (width - 1.5), 0, (1.5, 1.5, height))
    for _ in range(draw(st.integers(0, 3))):
        table += box(draw(half_mm) / 2, draw(half_mm) / 2, height - draw(depths_mm), (draw(half_mm) / 4, 1.0, 4.0))
    return table


@st.composite
def tees(draw: st.DrawFn) -> m3.Manifold:
    """A T with a step beneath one of its arms."""
    stem, arm, height = draw(half_mm), 1.0 + 2 * draw(half_mm), 6.0 + draw(half_mm)
    tee = box(0, 0, 0, (stem, stem, height)) + box(-arm, 0, height, (arm + stem + draw(half_mm), stem, 2))
    step, depth = min(draw(half_mm), arm), draw(depths_mm)
    return tee + box(-step, 0, height - depth, (step, min(draw(half_mm), stem), depth + 1))


shapes = st.one_of(heaps(), decks(), tables(), tees()).map(standing)


def cut_otherwise(mesh: Mesh, seed: int) -> list[Mesh]:
    split = edited(mesh, seed, 30)
    return [refined(mesh, 1.0), refined(mesh, 2.0), split, refined(split, 2.0)]


def areas_mm2(mesh: Mesh) -> Floats:
    """Area that needs support upright, and along every direction the area that needs it and the part that no support can
    reach."""
    need = SupportNeed.of(mesh, PROFILE.process, 5.0)
    risky = risky_upright(mesh, UP_DEG)
    chosen = [risky & needs_support(mesh, PROFILE.process, True), risky & need.upright, needing_upright(mesh, PROFILE)]
    for direction, classes in zip(DIRECTIONS, need.along(DIRECTIONS), strict=True):
        down = facing_down(mesh, direction, UP_DEG)
        chosen += [down & (classes != CARRIES_ITSELF), down & (classes == UNSUPPORTABLE)]
    return np.array([mesh.areas_mm2[faces].sum() for faces in chosen])


@settings(max_examples=60)
@given(shapes, seeds)
def test_the_same_area_needs_support_however_a_shape_is_cut_into_triangles(mesh: Mesh, seed: int) -> None:
    needed = areas_mm2(mesh)
    for same in cut_otherwise(mesh, seed):
        assert areas_mm2(same) == pytest.approx(needed, rel=1e-6, abs=1e-6)


def costs_mm2(mesh: Mesh) -> Floats:
    """Costs in a search of a whole model above every offset, and the excess that a cut misses."""
    pieces = ModelPieces(SupportNeed.of(mesh, PROFILE.process, 5.0), np.arange(len(mesh.faces), dtype=np.int32))
    remainder = Remainder(mesh, risky_upright(mesh, UP_DEG) & pieces.upright, pieces=pieces)
    swept = gains(remainder, DIRECTIONS, 0.73, threshold(UP_DEG))
    sums = [np.concatenate((swept.up_mm2[k, :n], swept.residual_mm2[k, :n])) for k, n in enumerate(swept.columns)]
    every = np.ones(len(mesh.faces), np.bool_)
    return np.concatenate([*sums, [excess_mm2(mesh, pieces, Plane(direction, 2.3), every) for direction in DIRECTIONS]])


@settings(max_examples=15)
@given(shapes, seeds)
def test_a_search_counts_the_same_however_a_shape_is_cut_into_triangles(mesh: Mesh, seed: int) -> None:
    counted = costs_mm2(mesh)
    for same in cut_otherwise(mesh, seed):
        assert costs_mm2(same) == pytest.approx(counted, rel=1e-6, abs=1e-5)


def hanging_mm2(mesh: Mesh) -> list[float]:
    """Area of each layer that the slicer supports."""
    sections = sections_at(mesh, np.arange(0.13, float(mesh.bounds_mm[1, 2]), 0.2))
    return [overhang.hanging.area() for overhang in find_overhangs(sections)]


@settings(max_examples=10)
@given(shapes, seeds)
def test_a_slicer_supports_the_same_however_a_shape_is_cut_into_triangles(mesh: Mesh, seed: int) -> None:
    hanging = hanging_mm2(mesh)
    for same in cut_otherwise(mesh, seed)[1:3]:
        assert hanging_mm2(same) == pytest.approx(hanging, abs=0.05)


@pytest.mark.parametrize(("reach", "area"), [(0.8, 0.0), (2.0, 16.0)])
def test_a_ledge_half_a_millimetre_below_one_end_of_a_deck_needs_support_but_the_deck_does_not(reach: float, area: float) -> None:
    deck = box(-5, 0, 0, (5, 8, 12)) + box(10, 0, 0, (5, 8, 12)) + box(-5, 0, 10, (20, 8, 3))
    mesh = standing(deck + box(10 - reach, 0, 9.5, (reach, 8, 1)))
    for same in (mesh, refined(mesh, 1.0), refined(mesh, 2.0)):
        assert areas_mm2(same)[0] == pytest.approx(area)


def test_a_ceiling_close_above_a_closed_floor_bridges() -> None:
    slot = box(0, 0, 0, (20, 20, 10)) - box(5, 5, 5, (10, 10, 0.5))
    assert areas_mm2(standing(slot))[0] == 0.0


@pytest.mark.parametrize("diameter", [2.0, 8.0, 12.0])
def test_a_round_hole_and_a_leaning_one_need_the_same_in_other_triangles(diameter: float) -> None:
    drill = m3.Manifold.cylinder(60, diameter / 2, -1, 48, True)
    mesh = standing(m3.Manifold.cube((20, 20, 20), True) - drill.rotate((90, 0, 0)) - drill.rotate((60, 30, 0)))
    needed = areas_mm2(mesh)
    for same in cut_otherwise(mesh, 1):
        assert areas_mm2(same) == pytest.approx(needed, rel=1e-6, abs=1e-6)
