"""Reasons why a region gets no support, each with a part that has it."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.decomposition import Part
from slicer.slice import slice_part, slice_parts
from tests.shapes import standing, tee
from tests.slicer.hand import cut, profile, whole

LINE_MM = profile().process.line_width_mm

BLOCK = m3.Manifold.cube


def pit(width_mm: float, deep_mm: float) -> Part:
    """A block with a closed chamber whose ceiling is too wide for the longest allowed bridge."""
    chamber = BLOCK((width_mm, 16, deep_mm)).translate((10 - 0.5 * width_mm, 2, 15 - deep_mm))
    return whole(standing(BLOCK((20, 20, 20)) - chamber))


def crossed(height_mm: float, normal: tuple[float, float, float]) -> list[Part]:
    """A post with an arm that ends in a bar across it, cut beside the post."""
    arm = BLOCK((30, 8, 4)) + BLOCK((4, 20, 4)).translate((26, 0, 0))
    return cut(standing(BLOCK((8, 8, 30)) + arm.translate((0, 0, height_mm))), (normal, 4.0))


DEEP_GAP = "process.support_bottom_gap_mm=0.6"
NO_BRIDGES = ("process.bridge_longest_mm=1", "process.support_distance_mm=1")


@pytest.mark.parametrize(
    ("parts", "settings", "reason"),
    [
        ([whole(tee(height=14))], ("machine.table.radius_mm=8",), "the plate ends before"),
        (
            [pit(16, 0.7)],
            (*NO_BRIDGES, "process.support_bottom_gap_mm=0.6"),
            "there is no room for support between it and the plastic below",
        ),
        ([pit(2.4, 10.0)], NO_BRIDGES, "there is no room for support beside the walls"),
        (crossed(8, (1, 0, 0)), (), "the head would meet the table if support were printed there with part 2"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_place_without_support_has_the_reason_that_its_part_is_made_for(
    parts: list[Part], settings: tuple[str, ...], reason: str
) -> None:
    areas = [area for piece in slice_parts(parts, profile(*settings)) for area in piece.unsupported]
    assert {area.reason for area in areas} == {reason}
    assert [area.mm2 for area in areas] == sorted((area.mm2 for area in areas), reverse=True)


def test_an_arm_beyond_the_lean_of_support_has_that_as_the_reason() -> None:
    gallows = BLOCK((16, 8, 10)) + BLOCK((8, 8, 18)) + BLOCK((26, 8, 4)).translate((0, 0, 18))
    base, top = cut(standing(gallows), ((0, 0, 1), 10.0))
    (arm,) = slice_part(top, profile("process.support_branch_angle_deg=30"), [base]).unsupported
    assert arm.reason == "support would have to lean by more than 30 deg to find ground"


def test_a_slope_is_not_bare_but_a_shelf_over_it_is() -> None:
    rise, lean, shelf = 10.0, 1.3, 6.0  # a layer reaches 0.26 mm beyond the one below: past 45 degrees, but less than a line
    tip = np.array([(x, y, z) for x, y in ((0, 0), (0, 8)) for z in (0, rise)] + [(lean * rise, y, rise) for y in (0, 8)])
    over = BLOCK((8 + shelf, 8, 2)).translate((-8 + lean * rise, 0, rise))
    wedge = m3.Manifold.hull_points(tip) + BLOCK((8, 8, rise)).translate((-8, 0, 0)) + over
    base, top = cut(standing(wedge + BLOCK((8, 8, 10)).translate((-8, 0, -10))), ((0, 0, 1), 10.0))
    far_out = ("process.support_branch_angle_deg=1", *NO_BRIDGES)
    (bare,) = slice_part(top, profile(*far_out), [base]).unsupported
    assert bare.mm2 == pytest.approx((shelf - LINE_MM) * 8, rel=0.05)


def test_a_print_that_hangs_nowhere_has_no_reason_to_give() -> None:
    assert slice_part(whole(standing(BLOCK((10, 10, 5)))), profile()).unsupported == ()


def test_shelves_one_above_the_other_that_get_no_support_count_as_the_area_seen_from_above() -> None:
    shelves = [BLOCK((20, 8, 1)).translate((0, 0, 10 + 1.7 * k)) for k in range(4)]
    comb = sum(shelves, BLOCK((8, 8, 16.1)))
    settings = (*NO_BRIDGES, "process.support_bottom_gap_mm=0.6")
    (bare,) = slice_part(whole(standing(comb)), profile(*settings)).unsupported
    assert bare.mm2 == pytest.approx((20 - 8 - LINE_MM) * 8, rel=0.02)  # a line along the post lies beside it
    assert bare.reason == "there is no room for support between it and the plastic below"
