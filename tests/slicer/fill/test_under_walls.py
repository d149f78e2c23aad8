"""Walls that lean inward over sparse infill are printed on a line of infill along the walls below."""

import manifold3d as m3
import pytest
import shapely

from slicer.paths import Kind, Layer
from slicer.slice import slice_part
from tests.shapes import standing
from tests.slicer.hand import BARE, profile, whole

LINE, HEIGHT = 0.45, 0.2


def cone(inward: float, *keys: str) -> tuple[Layer, ...]:
    """The layers of a cone whose radius shrinks by `inward` line widths per layer."""
    height = 4.0
    shape = m3.Manifold.cylinder(height, 14.0, 14.0 - inward * LINE * height / HEIGHT, 96)
    return slice_part(whole(standing(shape)), profile(*BARE, "process.infill_density=0.1", *keys)).layers


def plastic(layer: Layer, *kinds: Kind) -> shapely.Geometry:
    paths = [path for path in layer.paths if not kinds or path.kind in kinds]
    return shapely.union_all([shapely.LineString(path.points).buffer(0.5 * LINE) for path in paths])


def walls_in_air_mm(layers: tuple[Layer, ...]) -> float:
    walls = [shapely.MultiLineString([path.points for path in layer.paths if path.kind is Kind.INNER_WALL]) for layer in layers]
    return sum(wall.difference(plastic(below)).length for below, wall in zip(layers, walls[1:], strict=False))


@pytest.mark.parametrize(("walls", "inward"), [(2, 0.45), (2, 0.55), (3, 0.55), (3, 0.65), (3, 0.74)])
def test_no_inner_wall_of_a_cone_has_its_middle_over_air(walls: int, inward: float) -> None:
    assert walls_in_air_mm(cone(inward, f"process.walls={walls}")[4:17]) < 1.0  # above the bottom, below the top


@pytest.mark.parametrize(("inward", "more"), [(0.3, False), (0.6, True)])
def test_a_wall_on_the_wall_below_needs_no_line(inward: float, more: bool) -> None:
    layers = cone(inward)[6:12]
    beside = [
        plastic(layer, Kind.INNER_WALL).buffer(0.6 * LINE).intersection(shapely.MultiLineString(infill)).length
        for layer in layers
        if (infill := [path.points for path in layer.paths if path.kind is Kind.INFILL])
    ]
    assert len(beside) == len(layers)
    assert (min(beside) > 40.0) is more  # most of the way round


def test_lines_of_infill_end_at_the_line_under_walls() -> None:
    for layer in cone(0.6)[6:12]:
        lines = [shapely.LineString(path.points) for path in layer.paths if path.kind is Kind.INFILL]
        ring = max(lines, key=lambda line: shapely.convex_hull(line).area)
        assert all(line.intersection(ring.buffer(0.1 * LINE)).length < LINE for line in lines if line is not ring)
