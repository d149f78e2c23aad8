"""No piece of support is too slender for its load, and thick trunks are hollow: checked from the printed areas alone."""

from collections.abc import Sequence
from math import pi, radians, sqrt, tan

import manifold3d as m3
import numpy as np
import pytest

from machine.dryrun.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.planning.plan import plan
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from slicer.bead import support_cell_mm
from slicer.geometry.polygons import Polygons, islands
from slicer.slice import slice_parts
from slicer.support.beads import support_beads
from slicer.support.sturdy import SLENDER, hollow_places, least_diameter_mm
from slicer.support.support import Supports
from tests.shapes import standing
from tests.slicer.hand import profile, whole
from tests.slicer.support.laws import assert_sound, supported
from tests.slicer.support.test_tree import bored_bracket

SHORT_MM = 2.0  # roots of support on the part may be thinner over no more than this


def gallows(arm_mm: float, height_mm: float, wall_mm: float = 0.0) -> Mesh:
    """A post with a narrow arm to one side, and a wall along one side of the arm, up to below it."""
    solid = m3.Manifold.cube((8, 8, height_mm)) + m3.Manifold.cube((8 + arm_mm, 3, 3)).translate((0, 0, height_mm))
    if wall_mm:
        solid += m3.Manifold.cube((30, 4, height_mm)).translate((0, 3 + wall_mm, 0)) + m3.Manifold.cube((8, 20, 2))
    return standing(solid)


def height_of_slender_support_mm(areas: Sequence[Polygons], layer_mm: float, most: float) -> float:
    """The greatest height of consecutive pieces that carry more height than `most` times their diameters."""
    above: list[tuple[Polygons, float, float]] = []
    highest = 0.0
    for m in range(len(areas) - 1, 0, -1):
        pieces = []
        for piece in islands(areas[m]):
            over = [(up_mm, slender_mm) for upper, up_mm, slender_mm in above if not (upper ^ piece).is_empty()]
            up_mm = max((mm for mm, _ in over), default=0.0) + layer_mm
            is_slender = up_mm > most * 2.0 * sqrt(piece.area() / pi)
            slender_mm = max((mm for _, mm in over), default=0.0) + layer_mm if is_slender else 0.0
            pieces.append((piece, up_mm, slender_mm))
            highest = max(highest, slender_mm)
        above = pieces
    return highest


def height_of_thin_support_mm(areas: Sequence[Polygons], layer_mm: float) -> float:
    """The greatest height of consecutive pieces of support below 2 mm2."""
    highest, below = 0.0, list[tuple[Polygons, float]]()
    for area in areas:
        thin = [piece for piece in islands(area) if piece.area() < 2.0]
        carried = [max((mm for under, mm in below if not (under ^ piece).is_empty()), default=0.0) for piece in thin]
        below = [(piece, mm + layer_mm) for piece, mm in zip(thin, carried, strict=True)]
        highest = max(highest, max((mm for _, mm in below), default=0.0))
    return highest


def sections_mm2(supports: Supports) -> np.ndarray:
    return np.array([area.area() for area in supports.areas])


@pytest.mark.parametrize(("seed", "style"), [(3, "grid"), (4, "tree"), (5, "tree"), (8, "grid")])
def test_no_piece_of_support_is_a_needle_over_more_than_a_millimetre_or_slender_over_more_than_a_root(
    seed: int, style: str
) -> None:
    areas = supported(whole(bored_bracket(seed)), f"process.support_style={style}")[1].areas
    assert sum(not area.is_empty() for area in areas) > 40
    assert height_of_thin_support_mm(areas, 0.2) <= 1.0
    assert height_of_slender_support_mm(areas, 0.2, 1.1 * SLENDER) <= SHORT_MM


@pytest.mark.parametrize("height_mm", [30.0, 50.0])
def test_a_free_trunk_has_its_diameter_at_every_height(height_mm: float) -> None:
    overhangs, supports = supported(whole(gallows(4.0, height_mm)))
    assert_sound(overhangs, supports)
    assert supports.unsupported_mm2 == 0.0
    down_mm = height_mm - 0.2 - supports.sections.heights.tip_mm
    for mm, mm2 in zip(down_mm[1:], sections_mm2(supports)[1:], strict=True):
        if mm > 6.0:
            assert mm2 >= 0.9 * 0.25 * pi * max(3.0, mm / SLENDER) ** 2


def test_branches_get_thicker_by_their_angle_up_to_a_trunk() -> None:
    widths = ("process.support_branch_mm=2", "process.support_trunk_mm=6", "process.support_branch_diameter_angle_deg=5")
    _, supports = supported(whole(gallows(4.0, 40.0)), *widths)
    down_mm = 39.8 - supports.sections.heights.tip_mm
    diameters_mm = 2.0 * np.sqrt(sections_mm2(supports) / pi)
    free = (down_mm > 8.0) & (down_mm < 20.0)
    tapered_mm = 2.0 + 2.0 * down_mm[free] * tan(radians(5.0))
    assert (diameters_mm[free] > 0.98 * tapered_mm).all()
    assert (diameters_mm[free] < 1.15 * tapered_mm).all()
    assert diameters_mm[(down_mm > 25.0) & (down_mm < 39.0)] == pytest.approx(6.0, rel=0.04)


@pytest.mark.parametrize(("above_mm", "diameter_mm"), [(0.0, 2.0), (5.0, 2.8749), (20.0, 3.0), (120.0, 10.0)])
def test_the_least_diameter_follows_the_angle_the_trunk_and_the_height(above_mm: float, diameter_mm: float) -> None:
    widths = ("process.support_branch_mm=2", "process.support_trunk_mm=3", "process.support_branch_diameter_angle_deg=5")
    assert least_diameter_mm(above_mm, profile(*widths).process) == pytest.approx(diameter_mm, abs=1e-3)


@pytest.mark.parametrize("wall_mm", [0.5, 1.2])
def test_a_trunk_near_the_part_is_thinner_but_supports_the_same(wall_mm: float) -> None:
    mesh = gallows(10.0, 40.0, wall_mm)
    for trunk_mm in (2, 12):
        overhangs, supports = supported(whole(mesh), f"process.support_trunk_mm={trunk_mm}")
        assert_sound(overhangs, supports)
        assert supports.unsupported_mm2 == 0.0


def test_a_trunk_under_a_narrow_tip_is_hollow_and_a_wide_column_is_not() -> None:
    process = profile().process
    tip, stem, slab = (Polygons.square((mm, mm), True) for mm in (2.0, 6.0, 12.0))
    aside = slab.translate((30.0, 0.0))
    nothing = Polygons()
    printed = [stem + aside, stem + aside, tip + aside]
    hollow = hollow_places([*printed, tip + aside], [nothing, nothing, nothing, tip + aside], process)
    assert [area.area() for area in hollow[:3]] == pytest.approx([36.0, 36.0, 4.0])
    beads = support_beads(printed[0], nothing, hollow[0], process, 0.2, False)
    inside = [bead for bead in beads if not np.array_equal(bead.points[0], bead.points[-1])]
    assert inside
    assert min(bead.points[:, 0].min() for bead in inside) > 20.0
    assert support_beads(stem, nothing, stem, process, 0.2, True)[1:], "the first layer is filled"


def test_a_short_ridge_as_narrow_as_the_cells_is_filled_only_right_under_its_dense_lines() -> None:
    process = profile().process
    ridge = Polygons.square((support_cell_mm(process), 2.0 * support_cell_mm(process)), True)
    nothing = Polygons()
    hollow = hollow_places([ridge] * 4, [nothing, nothing, nothing, ridge], process)
    assert [area.is_empty() for area in hollow] == [False, False, True, False]


def test_a_long_ridge_as_narrow_is_filled_down_to_the_ground() -> None:
    process = profile().process
    ridge = Polygons.square((support_cell_mm(process), 20.0), True)
    nothing = Polygons()
    hollow = hollow_places([ridge] * 4, [nothing, nothing, nothing, ridge], process)
    assert [area.is_empty() for area in hollow] == [True, True, True, False]


def test_lines_of_long_narrow_support_are_on_lines_and_not_in_the_air() -> None:
    wall, plate = m3.Manifold.cube((60, 2, 6), True), m3.Manifold.cube((60, 8.4, 1), True)
    part, settings = whole(standing(wall + plate.translate((0, 0, 3.5)))), profile("process.support_style=grid")
    decomposition = Decomposition("ledges", part.mesh, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    program = plan(decomposition, slice_parts([part], settings), settings)
    run = dry_run(tuple(write_gcode(program, settings)), settings)
    assert [finding.message for finding in run.findings if finding.code == "air"] == []


def test_support_without_walls_is_never_hollow() -> None:
    piece = Polygons.square((2.0, 2.0))
    assert hollow_places([piece], [Polygons()], profile("process.support_walls=0").process)[0].is_empty()
