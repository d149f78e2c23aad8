"""Grooves between parts: their positions, that they are filled, and that the tip stays above them."""

import numpy as np
import pytest

from mdp.decomposition import Part
from profiles.errors import ProfileError
from slicer.geometry.polygons import Polygons
from slicer.interface.interface import cut_grooves, grooves
from slicer.paths import Kind
from slicer.slice import slice_part
from tests.shapes import box, branch
from tests.slicer.hand import SOLID, as_shapely, cut, profile

DEEP = "process.interlock_mm=0.2"
WIDTH = 0.45


def stacked() -> list[Part]:
    return cut(box(24, 24, 20), ((0, 0, 1), 10.0))


def test_grooves_are_half_of_the_inside_and_keep_clear_of_the_walls() -> None:
    area = as_shapely(grooves(stacked()[1], profile(DEEP).process))
    side = 24 - 2 * 4 * 4 / 3 * WIDTH
    assert area.area == pytest.approx(0.5 * side**2, rel=0.05)
    assert area.bounds[2] == pytest.approx(side / 2, abs=1e-6)
    assert all(part.bounds[3] - part.bounds[1] <= 2 * WIDTH + 1e-4 for part in area.geoms)


def test_grooves_of_one_part_are_filled_by_the_next() -> None:
    base, top = stacked()
    area = grooves(top, profile(DEEP).process).area()
    pairs = [(slice_part(base, p, later=[top]), slice_part(top, p, [base])) for p in (profile(*SOLID), profile(*SOLID, DEEP))]
    (plain, smooth), (carved, rich) = pairs
    assert plain.volume_mm3 - carved.volume_mm3 == pytest.approx(0.2 * area, rel=0.1)
    assert rich.volume_mm3 - smooth.volume_mm3 == pytest.approx(0.2 * area * 1.1, rel=0.1)


def test_the_tip_stays_at_its_height_and_only_the_first_layer_is_richer() -> None:
    base, top = stacked()
    plain, rich = (slice_part(top, profile(*s), [base]).layers for s in (SOLID, (*SOLID, DEEP)))
    assert [lay.z_mm for lay in rich] == [lay.z_mm for lay in plain]
    flows = [max(p.flow for p in layers[0].paths if p.kind is Kind.SKIN) for layers in (plain, rich)]
    assert flows[1] == pytest.approx((0.1 + 0.2) / 0.1 * flows[0], rel=0.05)
    assert rich[1].volumes_mm3.sum() == pytest.approx(plain[1].volumes_mm3.sum())


def test_grooves_under_a_tilted_part_are_just_below_its_base_plane() -> None:
    base, arm = cut(branch(), ((np.sin(np.pi / 3), 0, 0.5), 14.0))
    cuts = np.arange(0.1, 40, 0.2)
    whole = [Polygons.square((80, 80), True)] * len(cuts)
    own = profile(DEEP)
    for z, left in zip(cuts, cut_grooves(whole, base, [arm], cuts, own), strict=True):
        gone = whole[0] - left
        for x, _ in np.concatenate([*gone.to_polygons(), np.zeros((0, 2))]):
            assert abs(x * np.sin(np.pi / 3) + 0.5 * z - 14.0) < 0.2 + 1e-6
    assert sum((whole[0] - left).area() for left in cut_grooves(whole, base, [arm], cuts, own)) > 1.0


def test_a_bead_of_no_more_than_its_width_fills_a_groove() -> None:
    with pytest.raises(ProfileError, match=r"interlock_mm is 0.3 mm: at most line_width_mm less layer_height_mm \(0.25 mm\)"):
        profile("process.interlock_mm=0.3")
