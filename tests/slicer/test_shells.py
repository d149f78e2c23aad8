"""Shells of some layers alone equal those of the whole part."""

import manifold3d as m3
import pytest

from slicer.overhangs import find_overhangs
from slicer.sectioning import section_part
from slicer.shells import build_shells
from slicer.support.support import own_supports
from tests.shapes import standing
from tests.slicer.hand import profile, whole


@pytest.mark.parametrize("layer", [20, 45, 47, 49, 60])
def test_a_single_requested_layer_is_solid_where_it_is_in_the_whole_part(layer: int) -> None:
    """A pocket's walls begin above layer 49 and also make the infill around its floor's skin solid."""
    block = m3.Manifold.cube((40.0, 40.0, 20.0)) - m3.Manifold.cube((12.0, 12.0, 20.0)).translate((14.0, 14.0, 10.0))
    sections = section_part(whole(standing(block)), profile())
    overhangs = find_overhangs(sections)
    supports = own_supports(sections, overhangs)
    alone = build_shells(supports, overhangs, [layer]).layers[layer].region
    among = build_shells(supports, overhangs).layers[layer].region
    assert among.sparse.area() > 0.0
    assert (alone.sparse + among.sparse).area() - (alone.sparse ^ among.sparse).area() == pytest.approx(0.0, abs=1e-6)
    assert alone.solid.area() == pytest.approx(among.solid.area(), abs=1e-6)
