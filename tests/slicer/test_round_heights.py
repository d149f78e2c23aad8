"""A surface exactly at the height of a section: rounding does not decide to which layer it belongs."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Floats, Mesh
from slicer.overhangs import find_overhangs
from slicer.sectioning import section_part
from slicer.shells import build_shells
from slicer.support.support import own_supports
from tests.shapes import standing
from tests.slicer.hand import profile, whole

CUBE = m3.Manifold.cube


def channel(wide_mm: float, ceiling_mm: float, rise_mm: float = 0.0) -> Mesh:
    """A block with a channel through it whose ceiling rises from one side to the other."""
    side = [(5, 0.7), (5 + wide_mm, 0.7), (5, ceiling_mm), (5 + wide_mm, ceiling_mm + rise_mm)]
    through = m3.Manifold.hull_points([(x, y, z) for y in (-1, 21) for x, z in side])
    return standing(CUBE((wide_mm + 10, 20, 4)) - through)


def round_channels() -> list[tuple[Mesh, float]]:
    """Channels of random widths with ceilings at random multiples of 0.05 mm, and heights of layers."""
    wide_mm, ceiling_mm = np.random.default_rng(1).uniform([[3.0], [1.2]], [[30.0], [3.4]], (2, 6))
    ceilings_mm = np.round(20.0 * ceiling_mm) / 20.0
    return list(zip(map(channel, wide_mm, ceilings_mm), [0.1, 0.15, 0.2, 0.25, 0.3, 0.1], strict=True))


def areas_mm2(mesh: Mesh, *settings: str) -> Floats:
    """(layers, 7) areas of each layer: bridges, overhangs, ledges, its three kinds of skin and its sparse infill."""
    sections = section_part(whole(mesh), profile(*settings))
    overhangs = find_overhangs(sections)
    shells = build_shells(own_supports(sections, overhangs), overhangs)
    return np.array(
        [
            [
                sum(bridge.hanging.area() for bridge in layer.bridges),
                *(area.area() for area in (over.hanging, over.ledges)),
                *(area.area() for area in (layer.region.bare, layer.region.top, layer.region.solid, layer.region.sparse)),
            ]
            for over, layer in zip(overhangs, shells.layers, strict=True)
        ]
    )


@pytest.mark.parametrize("support", ["auto", "none"])
@pytest.mark.parametrize(
    ("mesh", "layer_mm"),
    [
        (channel(12.0, 2.5), 0.2),
        (channel(14.0, 1.5), 0.2),
        (channel(14.0, 0.75), 0.1),
        (channel(14.0, 1.55), 0.1),
        (channel(12.0, 1.9, 0.6), 0.2),
        (standing(CUBE((6, 6, 2.1)).translate((9, 9, 0)) + CUBE((24, 24, 2)).translate((0, 0, 2.1))), 0.2),
        (standing(CUBE((20, 20, 4)) - CUBE((8, 8, 4)).translate((6, 6, 2.5))), 0.2),
        (standing(CUBE((20, 20, 2.3)) + CUBE((8, 20, 4))), 0.2),
        *round_channels(),
    ],
)
def test_a_model_that_is_lifted_by_rounding_has_the_same_kinds_of_area(mesh: Mesh, layer_mm: float, support: str) -> None:
    settings = f"process.layer_height_mm={layer_mm}", f"process.support={support}"
    as_read = mesh.vertices.astype(np.float32).astype(np.float64)
    lies, lifted = (areas_mm2(Mesh(as_read + np.array([0.0, 0.0, by_mm]), mesh.faces), *settings) for by_mm in (0.0, 1e-6))
    assert lifted == pytest.approx(lies, abs=0.1)


def test_the_ceiling_at_the_height_of_a_section_bridges_in_the_layer_that_covers_it() -> None:
    areas = areas_mm2(channel(12.0, 2.5), "process.support=none")
    assert areas[:, 0].nonzero()[0].tolist() == [13]
    assert areas[13, 0] == pytest.approx(12.0 * 20.0, rel=0.02)
