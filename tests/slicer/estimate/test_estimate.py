"""Estimates of time and filament: closed formulas, laws, and the dry run."""

from math import pi

import manifold3d as m3
import numpy as np
import pytest

from machine.pipeline.pipeline import build
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from profiles.process import Process
from slicer.estimate.estimate import Estimate, estimate
from slicer.paths import Kind
from slicer.slice import slice_part, slice_parts
from tests.shapes import box, standing, tee
from tests.slicer.hand import BARE, SOLID, cut, profile, volume_mm3, whole

FILAMENT_MM2 = pi * 1.75**2 / 4.0
STROKE_SPEEDS = [
    key for key in Process.model_fields if key.endswith("speed_mm_s") and not key.startswith(("lift", "travel", "least"))
]


def of(mesh: Mesh, *settings: str) -> Estimate:
    return estimate(whole(mesh), profile(*settings))


@pytest.mark.parametrize("mesh", [box(20, 20, 20), standing(m3.Manifold.cylinder(20, 12, 12, 96))], ids=["box", "cylinder"])
def test_a_solid_print_takes_as_much_filament_as_it_has_volume(mesh: Mesh) -> None:
    assert of(mesh, *SOLID).filament_mm * FILAMENT_MM2 == pytest.approx(mesh.volume_mm3, rel=0.015)


def test_sparse_infill_takes_its_share_of_the_inside() -> None:
    mesh = box(40, 40, 40)
    bare = (*BARE, "process.top_layers=0", "process.bottom_layers=0", "process.solid_below_mm2=0")
    empty, sparse = (of(mesh, *bare, f"process.infill_density={density}").filament_mm for density in (0.0, 0.25))
    inside = 40.0 - 0.45 - 5.0 * (0.45 - 0.2 * (1.0 - pi / 4.0))
    assert (sparse - empty) * FILAMENT_MM2 == pytest.approx(0.25 * inside**2 * 40.0, rel=0.02)


def test_a_tower_twice_as_high_takes_twice_as_long() -> None:
    low, high = (of(box(30, 30, z), *SOLID).time_s for z in (30, 60))
    assert high / low == pytest.approx(2.0, rel=0.02)


def test_slow_strokes_take_the_time_of_their_length() -> None:
    slow = (*SOLID, *(f"process.{key}=1" for key in STROKE_SPEEDS), "process.least_layer_time_s=0")
    mesh = box(10, 10, 4)
    bead_mm2 = 0.2 * (0.45 - 0.2 * (1.0 - pi / 4.0))
    assert of(mesh, *slow).time_s == pytest.approx(mesh.volume_mm3 / bead_mm2, rel=0.1)


@pytest.mark.parametrize(
    ("less", "more"),
    [
        ("process.infill_density=0.1", "process.infill_density=0.3"),
        ("process.walls=2", "process.walls=4"),
        ("process.layer_height_mm=0.3", "process.layer_height_mm=0.15"),
        ("process.infill_speed_mm_s=120", "process.infill_speed_mm_s=15"),
        ("process.travel_speed_mm_s=200", "process.travel_speed_mm_s=20"),
        ("process.least_layer_time_s=0", "process.least_layer_time_s=60"),
        ("material.volumetric_limit_mm3_s=12", "material.volumetric_limit_mm3_s=2"),
        ("process.acceleration_mm_s2=1500", "process.acceleration_mm_s2=300"),
        ("process.support=none", "process.support=auto"),
    ],
)
def test_more_demanding_settings_take_longer(less: str, more: str) -> None:
    small = tee(stem=6.0, arm=24.0, height=20.0)
    assert of(small, less).time_s < of(small, more).time_s


def test_support_is_estimated_separately_and_only_under_overhangs() -> None:
    assert of(box()).support_mm3 == 0.0
    bare = ("process.skirt_loops=0", "process.small_base_brim_mm=0", "process.layer_height_mm=0.3")
    supported, alone = of(tee(), *bare), of(tee(), *bare, "process.support=none")
    assert supported.support_mm3 == pytest.approx((supported.filament_mm - alone.filament_mm) * FILAMENT_MM2, rel=0.2)
    sliced = slice_part(whole(tee()), profile(*bare))
    assert supported.support_mm3 == pytest.approx(volume_mm3(sliced, Kind.SUPPORT, Kind.SUPPORT_INTERFACE), rel=0.2)
    assert supported.filament_mm * FILAMENT_MM2 == pytest.approx(sliced.volume_mm3, rel=0.04)


@pytest.mark.parametrize("thick_mm", [10.0, 0.8])
def test_the_support_right_under_a_high_flat_arm_is_estimated(thick_mm: float) -> None:
    """The arm's underside lies inside one of the estimate's thick layers."""
    post, arm = m3.Manifold.cube((12.0, 12.0, 110.0)), m3.Manifold.cube((60.0, 12.0, thick_mm)).translate((0.0, 0.0, 100.0))
    gallows, coarse = standing(post + arm), "process.layer_height_mm=0.4"
    printed_mm3 = volume_mm3(slice_part(whole(gallows), profile(coarse)), Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
    assert of(gallows, coarse).support_mm3 == pytest.approx(printed_mm3, rel=0.4)


def test_a_small_layer_lasts_as_long_as_it_has_to_cool() -> None:
    lasting = of(box(8, 8, 10), *SOLID, "process.least_layer_time_s=30", "process.least_speed_mm_s=0.1")
    assert lasting.time_s == pytest.approx(50 * 30.0, rel=0.05)


@pytest.mark.parametrize(("where", "setting"), [("platform", "first_layer_flow"), ("base", "interface_flow")])
def test_the_first_layer_has_the_flow_for_plate_or_plastic(where: str, setting: str) -> None:
    below, above = cut(box(20, 20, 20), ((0.0, 0.0, 1.0), 10.0))
    part = below if where == "platform" else above
    plain, more = (
        estimate(part, profile(*SOLID, "process.first_layer_flow=1", "process.interface_flow=1", f"process.{setting}={flow}"))
        for flow in (1.0, 1.2)
    )
    height_mm = 0.2 if where == "platform" else 0.1
    assert (more.filament_mm - plain.filament_mm) * FILAMENT_MM2 == pytest.approx(0.2 * 400.0 * height_mm, rel=0.05)


def test_parts_add_up_and_each_later_one_costs_a_turn_of_the_table() -> None:
    parts = cut(box(20, 20, 40), ((0.0, 0.0, 1.0), 20.0))
    settings = profile(*SOLID)
    both = estimate(parts, settings)
    assert both.time_s == pytest.approx(sum(estimate(part, settings).time_s for part in parts), rel=1e-3)
    assert both.time_s > of(box(20, 20, 40), *SOLID).time_s


def test_no_parts_take_no_time() -> None:
    assert estimate((), profile()) == Estimate(0.0, 0.0, 0.0)


def star() -> Mesh:
    """A twisted star that gets thinner, with a ring on its tip whose underside overhangs."""
    turns = np.linspace(0.0, 2.0 * pi, 10, endpoint=False)
    corners = np.column_stack([np.cos(turns), np.sin(turns)]) * np.where(np.arange(10) % 2, 6.0, 14.0)[:, None]
    body = m3.Manifold.extrude(m3.CrossSection([corners]), 30.0, 30, 70.0, (0.5, 0.5))
    ring = m3.Manifold.cylinder(4.0, 12.0, 12.0, 64) - m3.Manifold.cylinder(4.0, 9.0, 9.0, 64)
    spoke = m3.Manifold.cube((22.0, 3.0, 4.0), True).translate((0.0, 0.0, 2.0))
    return standing(body + (ring + spoke).translate((0.0, 0.0, 28.0)))


def vase() -> Mesh:
    """A bowl with a thick wall on a foot."""
    outside = m3.Manifold.cylinder(30.0, 6.0, 18.0, 80) + m3.Manifold.cylinder(2.0, 12.0, 12.0, 80)
    return standing(outside - m3.Manifold.cylinder(26.0, 4.0, 15.0, 80).translate((0.0, 0.0, 4.0)))


def comb() -> Mesh:
    """A plate with thin teeth of several heights."""
    teeth = [m3.Manifold.cube((1.3 + 0.4 * k, 12.0, 8.0 + 3.0 * k)).translate((5.0 * k, 2.0, 3.0)) for k in range(6)]
    return standing(m3.Manifold.batch_boolean([m3.Manifold.cube((32.0, 16.0, 4.0)), *teeth], m3.OpType.Add))


def tower() -> Mesh:
    """A column with a wide head whose underside, far above the plate, needs support."""
    head = m3.Manifold.cube((30.0, 26.0, 5.0), True).translate((6.0, 0.0, 42.0))
    return standing(m3.Manifold.cylinder(40.0, 6.0, 6.0, 48) + head)


def thin_box() -> Mesh:
    """A box without a lid, whose walls have hardly room for two lines."""
    return standing(m3.Manifold.cube((40.0, 30.0, 24.0)) - m3.Manifold.cube((38.2, 28.2, 24.0)).translate((0.9, 0.9, 1.0)))


LEANING = ((0.3, 0.1, 0.95), 9.0)


@pytest.mark.parametrize(
    ("mesh", "planes", "layer_mm", "share"),
    [
        (tower(), (), 0.3, 0.02),
        (thin_box(), (), 0.3, 0.02),
        (box(24, 20, 40), (((0.3, 0.1, 0.95), 18.0),), 0.3, 0.05),  # skins under its slanted top are bridged in bursts of layers
        (vase(), (LEANING,), 0.2, 0.03),
        (comb(), (LEANING,), 0.3, 0.03),
        (star(), (), 0.3, 0.05),  # its many small overhangs get less support in thick layers
    ],
    ids=["tower on support", "thin box", "cut box", "cut vase", "cut comb", "star"],
)
def test_an_estimate_is_near_the_dry_run(
    mesh: Mesh, planes: tuple[tuple[tuple[float, ...], float], ...], layer_mm: float, share: float
) -> None:
    parts = tuple(cut(mesh, *planes)) if planes else (whole(mesh),)
    decomposition = Decomposition("shape", mesh, parts, 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    settings = profile(f"process.layer_height_mm={layer_mm}")
    run, expected = build(decomposition, settings).run, estimate(parts, settings)
    assert expected.time_s == pytest.approx(run.time_s, rel=share)
    assert expected.filament_mm == pytest.approx(float(run.program.filament_mm.max()), rel=share)


@pytest.mark.parametrize("layers", [1, 8])
def test_a_raft_takes_as_long_as_in_the_dry_run(layers: int) -> None:
    part, settings = whole(box(50, 40, 0.6)), profile(f"process.raft_layers={layers}")
    decomposition = Decomposition("shape", part.mesh, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    assert estimate(part, settings).time_s == pytest.approx(build(decomposition, settings).run.time_s, rel=0.03)


def test_estimates_of_the_same_parts_are_deterministic() -> None:
    parts = cut(comb(), LEANING)
    assert estimate(parts, profile()) == estimate(parts, profile())


def test_an_estimate_knows_that_the_face_of_a_cut_needs_few_walls() -> None:
    parts, settings = cut(box(30, 30, 30), ((0.9, 0.1, 0.3), 5.0)), profile(*BARE)
    alone = sum(estimate(part, settings).filament_mm for part in parts)
    together = estimate(parts, settings).filament_mm
    sliced_mm3 = sum(piece.volume_mm3 for piece in slice_parts(parts, settings))
    assert together < 0.97 * alone
    assert together * FILAMENT_MM2 == pytest.approx(sliced_mm3, rel=0.02)
