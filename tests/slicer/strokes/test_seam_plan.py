"""The plan of seams: hidden positions are found, the line over the layers is the cheapest possible, joints stay free of seams."""

from itertools import product

import manifold3d as m3
import numpy as np
import pytest

from mdp.decomposition import Part
from mdp.mesh import Floats
from slicer.geometry.polygons import contours
from slicer.sectioning import Sections, section_part
from slicer.slice import slice_part
from slicer.strokes.seam_plan import JUMP, SHIFT, choose, light_at, light_samples, plan_seams, seam_limits
from tests.shapes import standing
from tests.slicer.hand import BARE, cut, profile, whole
from tests.slicer.strokes.test_seam import distance_mm, outer_seams

SETTINGS = profile(*BARE)
NO_EDGES = np.zeros((0, 6))
GROOVED = m3.Manifold.cube((20, 20, 16), True) - m3.Manifold.cube((6, 4, 16), True).translate((10, 0, 0))


def sections(part: Part, *others: Part) -> Sections:
    return section_part(part, SETTINGS, [p for p in others if p.index < part.index], [p for p in others if p.index > part.index])


def planned(part: Part, *others: Part) -> list[Floats]:
    of = sections(part, *others)
    return plan_seams(of, [seam_limits(NO_EDGES, NO_EDGES, z_mm, SETTINGS.process) for z_mm in of.heights.cut_mm])


def test_the_seam_of_a_box_with_a_groove_is_in_the_corner_of_the_groove() -> None:
    places = np.concatenate(planned(whole(standing(GROOVED))))
    assert np.abs(np.abs(places) - [7, 2]).max() < 0.05
    assert np.abs(np.diff(places, axis=0)).max() < 0.05  # in one of the two corners
    assert np.abs(np.abs(outer_seams(slice_part(whole(standing(GROOVED)), SETTINGS))) - [7, 2]).max() < 0.4


def test_a_box_without_a_groove_begins_at_a_corner_of_the_rear() -> None:
    places = np.concatenate(planned(whole(standing(m3.Manifold.cube((20, 20, 6), True)))))
    assert np.abs(places[:, 0]) == pytest.approx(10.0, abs=0.01)
    assert places[:, 1] == pytest.approx(10.0, abs=0.01)
    assert np.abs(np.diff(places, axis=0)).max() < 0.01


def test_the_seam_of_a_disc_is_below_the_groove_of_the_body_on_it() -> None:
    disc = m3.Manifold.cylinder(2, 11, 11, 90).translate((0, 0, -2))
    block = m3.Manifold.cube((16, 16, 8), True).translate((0, 0, 4))
    places = np.concatenate(planned(whole(standing(disc + block - m3.Manifold.cube((4, 6, 9), True).translate((0, -8, 4.5))))))
    assert len(places) == 50
    assert (places[:, 1] < -4.0).all()


def beside_a_wall(*more: m3.Manifold) -> Part:
    """A cylinder centred at x = -2, a wall centred at x = 9, and the solids that join them."""
    wall = m3.Manifold.cube((2, 60, 20), True).translate((11, 0, 0))
    return whole(standing(m3.Manifold.batch_boolean([m3.Manifold.cylinder(20, 8, 8, 90, True), wall, *more], m3.OpType.Add)))


def test_the_seam_of_a_cylinder_is_where_it_faces_a_wall_of_its_own_body() -> None:
    plate = m3.Manifold.cube((20, 60, 2), True).translate((2, 0, -9))
    for of_layer in planned(beside_a_wall(plate))[15:]:
        (of_cylinder,) = of_layer[of_layer[:, 0] < 7.0]
        assert of_cylinder[0] > 5.0


@pytest.mark.parametrize(("gap_mm", "x_mm", "y_mm"), [(1.0, 6.0, 0.0), (10.0, 0.0, 6.0)])
def test_a_sharp_outer_corner_in_sight_beats_a_face_that_a_wall_half_hides_but_not_one_in_a_narrow_gap(
    gap_mm: float, x_mm: float, y_mm: float
) -> None:
    """A half-round post with two square corners, its flat back away from a wall. Beside an endless wall of height h at a
    distance d, a face keeps about 1 - sin(atan(h / 2d)) of its light in the middle of its height: 0.43 of it, and 0.01 in the
    gap."""
    post = m3.Manifold.cylinder(14, 6, 6, 92) ^ m3.Manifold.cube((12, 12, 14)).translate((0, -6, 0))
    wall = m3.Manifold.cube((2, 80, 14)).translate((6 + gap_mm, -40, 0))
    foot = m3.Manifold.cube((16 + gap_mm, 4, 1)).translate((-8, -2, -1))
    of = whole(standing(m3.Manifold.batch_boolean([post, wall, foot], m3.OpType.Add)))
    middle = of.mesh.bounds_mm[0, 0] + 8.0  # of the post
    for of_layer in planned(of)[15:60]:
        x, y = of_layer[of_layer[:, 0].argmin()] - [middle, 0.0]
        assert [x, abs(y)] == pytest.approx([x_mm, y_mm], abs=1.0)


def test_another_body_on_the_plate_hides_no_seam() -> None:
    for of_layer in planned(beside_a_wall()):
        (of_cylinder,) = of_layer[of_layer[:, 0] < 7.0]
        assert of_cylinder[1] > 7.5  # at the rear


def test_cubes_in_a_row_have_their_seams_in_their_corners() -> None:
    row = m3.Manifold.batch_boolean([m3.Manifold.cube((10, 10, 4)).translate((13 * k, 0, 0)) for k in range(3)], m3.OpType.Add)
    for of_layer in planned(whole(standing(row))):
        assert np.abs(of_layer[:, 1]) == pytest.approx([5.0] * 3, abs=0.05)
        assert np.abs((of_layer[:, 0] + 18.0) % 13.0 - 5.0) == pytest.approx([5.0] * 3, abs=0.05)


def test_seams_near_a_joint_avoid_its_edge_and_are_in_the_groove_of_both_parts() -> None:
    base, top = cut(standing(GROOVED), ((0, 0, 1), 8.0))
    (loop,) = contours(sections(top, base).outlines[1])
    rim = np.insert(np.hstack([loop, np.roll(loop, -1, axis=0)]), [2, 4], 8.0, axis=1)
    of = sections(base, top)
    limits = [seam_limits(rim, NO_EDGES, z_mm, SETTINGS.process) for z_mm in of.heights.cut_mm]
    for z_mm, (seam,) in list(zip(of.heights.cut_mm, plan_seams(of, limits), strict=True))[:-6]:
        assert np.abs(seam) == pytest.approx([7, 2], abs=0.05)
        assert distance_mm(seam, z_mm, rim) > 1.0
    assert np.abs(np.abs(np.concatenate(planned(top, base))) - [7, 2]).max() < 0.05


def light(of: Sections, layer: int, asked: list[list[float]]) -> Floats:
    return light_at(layer, np.array(asked), of.heights.cut_mm, *light_samples(of, [contours(area) for area in of.outlines]))


def test_a_part_in_front_of_a_wall_occludes_it() -> None:
    post, shade = m3.Manifold.cube((10, 10, 30), True), m3.Manifold.cube((4, 60, 30), True).translate((9, 0, 0))
    joined = post + shade + m3.Manifold.cube((30, 60, 4), True).translate((3, 0, -17))
    base, top = cut(standing(joined), ((0, 0, 1), 20.0))
    last = len(sections(base).outlines) - 2
    [alone], [beside] = (light(of, last, [[5.0, 0.0, 1.0, 0.0]]) for of in (sections(base), sections(base, top)))
    assert beside < alone - 0.15


def test_a_flat_wall_gets_all_light_and_one_near_an_inner_corner_gets_half() -> None:
    """At the corner of an infinite wall perpendicular to another, half of the light is lost near the corner (its view factor)."""
    ell = m3.Manifold.cube((100, 100, 100)) - m3.Manifold.cube((50, 50, 100)).translate((50, 50, 0))
    of = sections(whole(standing(ell)))
    (loop,) = contours(of.outlines[250])
    corner = 0.5 * (loop.max(axis=0) + loop.min(axis=0))
    asked = [[corner[0] + 0.5, corner[1], 0.0, 1.0], [loop[:, 0].min(), corner[1], -1.0, 0.0]]
    assert light(of, 250, asked) == pytest.approx([0.5, 1.0], abs=0.06)


@pytest.mark.parametrize("seed", range(20))
def test_no_other_choice_of_places_costs_less(seed: int) -> None:
    random = np.random.default_rng(seed)
    layer, below, count = np.array([0, 1, 1, 2, 2]), [None, 0, 0, 1, 2], 4
    middles = np.array([[0, 0], [-2, 0], [2, 0], [-2.5, 0], [2.5, 0]], dtype=float)
    xy = (middles[:, None] + random.uniform(-0.8, 0.8, (5, count, 2))).reshape(-1, 2)
    cost = random.uniform(0.0, 0.5, 5 * count)

    def costs(choice: tuple[int, ...]) -> float:
        at = [count * k + place for k, place in enumerate(choice)]
        ways = [np.hypot(*(xy[at[k]] - xy[at[j]])) for k, j in enumerate(below) if j is not None]
        return float(cost[at].sum() + np.minimum(SHIFT * np.array(ways), JUMP).sum())

    chosen = choose(xy, cost, np.arange(0, 5 * count + 1, count), layer)
    taken = tuple(int(np.hypot(*(xy[count * k : count * (k + 1)] - place).T).argmin()) for k, place in enumerate(chosen))
    assert costs(taken) == pytest.approx(min(costs(choice) for choice in product(range(count), repeat=5)))
