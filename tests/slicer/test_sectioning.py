"""Sections as printed: surfaces on the plate belong to the lowest layers."""

import manifold3d as m3
import numpy as np
import pytest

from slicer.paths import Kind
from slicer.slice import slice_part
from tests.shapes import from_manifold
from tests.slicer.hand import BARE, SOLID, profile, whole


@pytest.mark.parametrize(("rise_mm", "share"), [(0.25, 1.0), (0.6, 0.5), (1.2, 0.25)])
def test_a_base_that_is_not_quite_level_is_flattened_onto_the_plate(rise_mm: float, share: float) -> None:
    """A plate of 30 x 30 mm whose underside rises to one side: up to 0.3 mm it rests on the plate, beyond that it overhangs."""

    def first_layer_mm3(rise_mm: float) -> float:
        corners = [(x, y, z) for x in (0, 30) for y in (0, 30) for z in (rise_mm * x / 30, 5)]
        layer = slice_part(whole(from_manifold(m3.Manifold.hull_points(corners))), profile(*SOLID)).layers[0]
        return float(layer.volumes_mm3.sum())

    assert first_layer_mm3(rise_mm) == pytest.approx(share * first_layer_mm3(0.0), rel=0.03)


def test_a_fillet_at_the_plate_keeps_its_form() -> None:
    rounded = m3.Manifold.sphere(3.0, 96).translate((0, 0, 3))
    plate = m3.Manifold.batch_hull([rounded.translate((x, y, 0)) for x in (0, 20) for y in (0, 20)])
    outline = slice_part(whole(from_manifold(plate)), profile(*BARE)).layers[0]
    points = np.concatenate([path.points for path in outline.paths if path.kind is Kind.OUTER_WALL])
    cut_mm = np.sqrt(3.0**2 - 2.9**2)  # the sphere's radius in the middle of the first layer
    assert np.ptp(points[:, 0]) == pytest.approx(20 + 2 * cut_mm - 0.45, abs=0.25)
