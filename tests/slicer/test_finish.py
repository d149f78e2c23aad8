"""Sizes and tops: outsides and holes are compensated where they face air, tops that stay visible are ironed."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.decomposition import Part
from mdp.mesh import Mesh
from profiles.profile import load
from slicer.geometry.polygons import Polygons
from slicer.paths import Kind, SlicedPart
from slicer.sectioning import compensate_elephant_foot
from slicer.slice import slice_part
from tests.shapes import box, standing
from tests.slicer.hand import BARE, as_shapely, cut, of_kind, profile, whole

LEANING = (0.6, 0.0, 0.8)


def tube() -> Mesh:
    """A 20 mm square with a 10 mm square hole."""
    return standing(m3.Manifold.cube((20, 20, 2), True) - m3.Manifold.cube((10, 10, 9), True))


def outer_sizes_mm(sliced: SlicedPart) -> list[float]:
    """Sizes along x of the outer walls of the second layer, to the edge of the plastic."""
    paths = [path for path in sliced.layers[1].paths if path.kind is Kind.OUTER_WALL]
    outside, hole = sorted((float(np.ptp(path.points[:, 0])) for path in paths), reverse=True)
    return [outside + 0.45, hole - 0.45]


@pytest.mark.parametrize(("outline_mm", "hole_mm", "sizes"), [(0, 0, (20, 10)), (0.1, 0, (20.2, 10)), (-0.15, 0.2, (19.7, 10.4))])
def test_outsides_and_holes_are_offset_as_set(outline_mm: float, hole_mm: float, sizes: tuple[float, float]) -> None:
    asked = (f"process.outline_compensation_mm={outline_mm}", f"process.hole_compensation_mm={hole_mm}")
    sliced = slice_part(whole(tube()), profile(*BARE, *asked))
    assert outer_sizes_mm(sliced) == pytest.approx(sizes, abs=0.01)


@pytest.mark.parametrize("asked_mm", [-0.2, 0.2])
def test_a_cut_face_stays_where_it_is(asked_mm: float) -> None:
    low, high = cut(box(), (LEANING, 8.0))
    settings = (*BARE, "process.infill_density=1")
    for_size = f"process.outline_compensation_mm={asked_mm}"
    usual, moved = (slice_part(low, profile(*settings, *more), later=[high]) for more in ((), (for_size,)))
    layer = next(k for k, layer in enumerate(usual.layers) if abs(layer.z_mm - 10.0) < 1e-6)
    ends = [_ends_along_x(sliced, layer) for sliced in (usual, moved)]
    assert ends[1][0] - ends[0][0] == pytest.approx(-asked_mm, abs=0.01)  # the outside
    assert ends[1][1] - ends[0][1] == pytest.approx(0.0, abs=0.02)  # the cut


def _ends_along_x(sliced: SlicedPart, layer: int) -> tuple[float, float]:
    points = np.concatenate([path.points for path in sliced.layers[layer].paths if path.kind is Kind.OUTER_WALL])
    middle = points[np.abs(points[:, 1]) < 12.0]
    return float(middle[:, 0].min()), float(middle[:, 0].max())


def test_a_top_is_ironed_with_dense_lines_across_its_lines() -> None:
    sliced = slice_part(whole(box(10, 10, 2)), profile(*BARE, "process.ironing=true"))
    assert {k for k, layer in enumerate(sliced.layers) if any(path.kind is Kind.IRONING for path in layer.paths)} == {9}
    last = sliced.layers[-1]
    ironed = [path for path in last.paths if path.kind is Kind.IRONING]
    assert last.is_of(Kind.IRONING)[-len(ironed) :].all()
    assert {path.speed_mm_s for path in ironed} == {15.0}
    inside_mm2 = (10.0 - 2 * 3 * 0.41) ** 2
    assert last.volumes_mm3[-len(ironed) :].sum() == pytest.approx(0.15 * 0.2 * inside_mm2, rel=0.1)
    assert sum(path.length_mm for path in ironed) == pytest.approx(inside_mm2 / 0.1, rel=0.1)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.05, 0.0, 1.0)])
def test_nothing_is_ironed_under_another_part(normal: tuple[float, float, float]) -> None:
    low, high = cut(box(), (normal, 8.0))
    ironing = profile(*BARE, "process.ironing=true")
    alone, under = slice_part(low, ironing), slice_part(low, ironing, later=[high])
    assert sum(path.length_mm for path in of_kind(alone, Kind.IRONING)) > 1000.0
    assert of_kind(under, Kind.IRONING) == []


def overhanging(step_mm: float) -> Part:
    """Two plates of 2 mm, the upper one wider by step_mm all round."""
    lower = m3.Manifold.cube((20, 20, 2), True)
    return whole(standing(lower + m3.Manifold.cube((20 + 2 * step_mm, 20 + 2 * step_mm, 2), True).translate((0, 0, 2))))


@pytest.mark.parametrize(
    ("step_mm", "kind", "speed", "fan"),
    [
        (0.08, Kind.OUTER_WALL, 40.0, None),  # 82 % of the bead's width on the layer below
        (0.17, Kind.OUTER_WALL, 35.0, 0.7),  # 62 %
        (0.29, Kind.OVERHANG, 25.0, 1.0),  # 36 %
        (0.40, Kind.OVERHANG, 20.0, 1.0),  # 11 %
        (0.52, Kind.OVERHANG, 15.0, 1.0),
    ],
)
def test_walls_are_slower_and_cooler_the_less_plastic_is_below(
    step_mm: float, kind: Kind, speed: float, fan: float | None
) -> None:
    slow = ("process.least_layer_time_s=0", "process.inner_wall_speed_mm_s=80", "material.fan_layer_time_s=1")
    layer = slice_part(overhanging(step_mm), profile(*BARE, *slow)).layers[10]
    wall = max((path for path in layer.paths if path.kind in (Kind.OUTER_WALL, Kind.OVERHANG)), key=lambda path: path.length_mm)
    assert (wall.kind, wall.speed_mm_s) == (kind, speed)
    assert wall.fan == (None if fan is None else pytest.approx(fan, abs=0.03))


def test_layers_with_overhanging_walls_get_more_walls_when_set() -> None:
    sliced = slice_part(overhanging(0.4), profile(*BARE, "process.overhang_extra_walls=2"))
    counts = [sum(path.kind is Kind.INNER_WALL for path in sliced.layers[k].paths) for k in (5, 10, 15)]
    assert counts == [2, 4, 2]


def test_skin_of_the_first_layer_may_be_faster_than_its_walls() -> None:
    paths = slice_part(whole(box(10, 10, 1)), profile(*BARE, "process.first_layer_infill_speed_mm_s=35")).layers[0].paths
    speeds = {path.kind: path.speed_mm_s for path in paths}
    assert (speeds[Kind.OUTER_WALL], speeds[Kind.SKIN]) == (20.0, 35.0)


def test_only_the_first_layer_is_smaller_against_the_elephants_foot() -> None:
    layers = slice_part(whole(box(20, 20, 2)), profile(*BARE, "process.elephant_foot_mm=0.2")).layers
    edges = [max(np.abs(p.points).max() for p in layer.paths) for layer in layers[:3]]
    assert edges == pytest.approx([10 - 0.2 - 0.225, 10 - 0.225, 10 - 0.225])


@pytest.mark.parametrize(("process", "foot_mm"), [("standard", 0.2), ("draft", 0.2), ("fine", 0.1)])
def test_every_process_makes_up_for_the_elephant_s_foot_of_its_nozzle(process: str, foot_mm: float) -> None:
    chosen = load(process=process, settings=[key for key in BARE if "elephant" not in key])
    first = slice_part(whole(box(20, 20, 2)), chosen).layers[0]
    assert max(np.abs(p.points).max() for p in first.paths) == pytest.approx(10 - foot_mm - 0.5 * chosen.process.line_width_mm)


@pytest.mark.parametrize("side_mm", [0.5, 0.84])
def test_pins_and_thin_walls_keep_their_first_layer(side_mm: float) -> None:
    pins = m3.Manifold.cube((side_mm, side_mm, 3), True)
    fence = m3.Manifold.cube((side_mm, 20, 3), True).translate((6, 0, 0))
    kept, whole_foot = (
        slice_part(whole(standing(pins + fence)), profile(*BARE, f"process.elephant_foot_mm={foot_mm}"))
        .layers[0]
        .volumes_mm3.sum()
        for foot_mm in (0.2, 0.0)
    )
    assert kept == pytest.approx(whole_foot, rel=1e-3)


def test_the_second_layer_is_laid_on_the_squeezed_first_layer() -> None:
    shape = whole(standing(m3.Manifold.cylinder(6, 8, 10)))
    usual, less = (
        slice_part(shape, profile(*BARE, "process.overhang_share=0.7", f"process.elephant_foot_mm={foot_mm}")).layers[1]
        for foot_mm in (0.0, 0.2)
    )
    assert less.volumes_mm3.sum() == pytest.approx(usual.volumes_mm3.sum(), rel=1e-6)
    assert sorted(set(less.speed_mm_s.round(3))) == sorted(set(usual.speed_mm_s.round(3)))


def test_a_part_on_plastic_has_no_elephants_foot() -> None:
    base, top = cut(box(20, 20, 20), ((0, 0, 1), 10.0))
    first = slice_part(top, profile(*BARE, "process.elephant_foot_mm=0.2", "process.interface_seam_mm=0"), [base]).layers[0]
    assert max(np.abs(p.points).max() for p in first.paths) == pytest.approx(10 - 0.3)


def test_thin_places_keep_their_width() -> None:
    shape = Polygons.square((20, 20)) + Polygons.square((10, 0.6)).translate((20, 10))
    less = as_shapely(compensate_elephant_foot(shape, 0.2, 0.45))
    assert less.area == pytest.approx(19.6**2 + 10 * 0.6, abs=0.3)
    assert less.bounds == pytest.approx((0.2, 0.2, 30, 19.8), abs=1e-6)
    assert len(getattr(less, "geoms", [less])) == 1
