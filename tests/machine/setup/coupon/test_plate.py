"""A coupon's plate on the shipped machines: bars that do not touch, and parts in an order that the head can print."""

import numpy as np
import pytest

from machine.setup.coupon.bars import BEND, TENSILE, Shape
from machine.setup.coupon.plate import coupon
from mdp.clearance import find_obstacle
from mdp.cut import solid_of
from profiles.errors import MoveError
from profiles.profile import load


@pytest.mark.parametrize("name", ["generic_ac", "fractal5pro", "linuxcnc_xyzac", "trident_5axis", "open5x_voron0"])
def test_every_part_is_clear_of_the_table_and_above_its_base(name: str) -> None:
    profile = load(name)
    made = coupon(BEND, profile)  # Decomposition itself checks volumes and order
    assert len(made.parts) == 9
    assert all(find_obstacle(profile.machine, part.pose, part.mesh.vertices) is None for part in made.parts)
    leans = {round(np.degrees(np.arccos(part.direction[2])), 6) for part in made.parts[1:]}
    assert len(leans) == 1
    assert leans.pop() >= 29.99


@pytest.mark.parametrize("shape", [BEND, TENSILE])
def test_there_are_twelve_bars_eight_of_them_in_two_parts(shape: Shape) -> None:
    made = coupon(shape, load())
    whole = solid_of(made.mesh)
    assert len(whole.decompose()) == 12
    assert len(solid_of(made.parts[0].mesh).decompose()) == 12
    assert whole.volume() == pytest.approx(sum(part.volume_mm3 for part in made.parts), rel=1e-9)


@pytest.mark.parametrize("shape", [BEND, TENSILE])
def test_a_joint_is_between_two_parts_and_as_large_as_the_section_of_the_bar(shape: Shape) -> None:
    parts = coupon(shape, load()).parts
    below = parts[0].mesh
    for part in parts[1:]:
        in_base = np.abs(part.base.heights_mm(part.mesh.vertices)) < 1e-6
        assert in_base.sum() == 4
        corners = part.mesh.vertices[in_base]
        area = float(np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])))
        assert area == pytest.approx(shape.depth_mm * shape.thickness_mm)
        gaps = np.linalg.norm(corners[:, None] - below.vertices, axis=2).min(axis=1)
        assert gaps.max() < 1e-6


@pytest.mark.parametrize(
    ("machine", "setting", "said"),
    [
        ("three_axis", "process.walls=3", "three axes has three axes: the joints of a coupon are made on a table that tilts"),
        ("generic_ac", "machine.tilt.limits_deg=[-15, 15]", "generic A/C table cannot tilt its table by 20 deg"),
        ("generic_ac", "machine.table.radius_mm=30", "its plate, 30 mm in radius, has no room for 12 bars side by side"),
        ("generic_ac", "machine.z.limits_mm=[-80, 40]", "Z would go"),
        ("generic_ac", "process.self_supporting_angle_deg=15", "process.self_supporting_angle_deg is 15: at least 20 deg"),
    ],
)
def test_a_machine_that_cannot_print_the_bars_is_refused_with_the_reason(machine: str, setting: str, said: str) -> None:
    with pytest.raises(MoveError) as refusal:
        coupon(BEND, load(machine, settings=[setting]))
    assert said in str(refusal.value)
