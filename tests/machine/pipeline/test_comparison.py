"""A print in parts compared with the same model in one part."""

from functools import cache

import numpy as np
import pytest
from manifold3d import Manifold

from machine.cli.terminal.report import compare_table
from machine.pipeline.comparison import (
    alternatives_json,
    compare_with_one_part,
    in_one_part,
    in_parts,
    straight_up,
)
from machine.pipeline.pipeline import build
from machine.pipeline.plate import on_one_plate
from machine.program import Alternative, Program, joints_of_print
from mdp.cut import mesh_of
from mdp.search.plan_file import PlanFile
from mdp.search.search import SearchRequest, decompose
from mdp.zone import Modifier, Zone, Zones
from profiles.profile import Profile, load
from tests.machine.cli.terminal.test_report import alone
from tests.shapes import standing, tee

COARSE = ("process.layer_height_mm=0.4", "process.first_layer_height_mm=0.4", "process.line_width_mm=0.8", "process.walls=1")
COARSE += ("search.directions=60", "search.beam_width=1", "process.infill_density=0", "process.support=none")


FILAMENT_MM2 = np.pi / 4.0 * 1.75**2


@cache
def compared() -> tuple[Profile, Program, tuple[Alternative, ...]]:
    profile = load(settings=[*COARSE, "search.stair_weight=0"])  # so that both arms are one part
    program = build(decompose(tee(), "tee", profile), profile)
    return profile, program, compare_with_one_part(program, profile)


def test_a_tee_straight_up_needs_support_in_parts_or_upside_down_it_does_not() -> None:
    ours, up, best = compared()[2]
    assert (up.name, up.parts, best.parts) == ("straight up", 1, 1)
    assert abs(up.risky_mm2 - 300.0) < 6.0
    assert max(ours.risky_mm2, best.risky_mm2) < 1.0
    assert best.support_mm3 < 0.1 * up.support_mm3


def test_the_alternatives_use_support_even_if_the_process_disables_it() -> None:
    ours, up, _ = compared()[2]
    assert ours.support_mm3 == 0.0
    assert up.support_mm3 > 100.0


def test_an_alternative_that_the_machine_cannot_print_stays_in_the_list_with_the_reason() -> None:
    _, up, _ = compare_with_one_part(compared()[1], load(settings=[*COARSE, "machine.z.limits_mm=[-80,20]"]))
    assert up.time_s is None
    assert "Z" in up.message
    assert up.message in compare_table((up,))


def test_marks_and_modifiers_apply_to_the_one_part_alternatives_in_each_orientation() -> None:
    profile, over_arm = load(settings=COARSE), Zone((5.5, -99.0, 24.0), (99.0, 99.0, 99.0))
    zones = Zones(no_support=(over_arm,), modifiers=(Modifier(Zone((-99.0, -99.0, -1.0), (99.0, 99.0, 99.0)), {"walls": 3}),))
    marked = decompose(tee(), "tee", profile, SearchRequest(plan=PlanFile("plan.toml", zones=zones), parts=1))
    ways = in_one_part(marked, profile)
    plain = in_one_part(decompose(tee(), "tee", profile, SearchRequest(parts=1)), profile)
    thick = in_one_part(decompose(tee(), "tee", profile, SearchRequest(parts=1)), load(settings=[*COARSE, "process.walls=3"]))
    own_mm = [[way.filament_mm - way.support_mm3 / FILAMENT_MM2 for way in each] for each in (ways, plain, thick)]
    assert own_mm[0] == pytest.approx(own_mm[2], rel=0.02)
    assert min(many / few for many, few in zip(own_mm[0], own_mm[1], strict=True)) > 1.2
    assert ways[0].support_mm3 == pytest.approx(0.5 * plain[0].support_mm3, rel=0.1)  # of one of its two arms


def test_copies_are_laid_down_each_for_itself() -> None:
    profile = load(settings=COARSE)
    cross = Manifold.cube((8, 8, 30), True) + Manifold.cube((30, 8, 8), True)  # no overhang when it lies on its side
    single = decompose(standing(cross), "cross", profile, SearchRequest(parts=1))
    many, plated = on_one_plate([single] * 2, profile)
    one, two = in_one_part(single, profile)[1], in_one_part(many, plated)[1]
    assert (two.message, two.orientation) == ("", one.orientation)
    assert (two.risky_mm2, two.support_mm3) == (0.0, 0.0)
    assert two.filament_mm == pytest.approx(2.0 * one.filament_mm, rel=0.05)


def test_stairs_of_a_model_in_one_piece_are_those_of_its_slanted_faces_searched_or_not() -> None:
    sides = np.array([(x, y, z) for x, y in ((0, 0), (0, 10), (10, 0), (10, 10)) for z in (0, 4 + 0.4 * x)])
    wedge, profile = mesh_of(Manifold.hull_points(sides)), load(settings=COARSE)
    searched = in_parts(build(decompose(wedge, "wedge", profile), profile), profile)
    up = straight_up(alone(wedge, 0.0), profile)
    # the slanted face covers 10 x 10 mm of the plate, times 0.1 for layers of 0.2 mm
    assert searched.stairs_mm2 == pytest.approx(20.0)
    assert [row["stairs_mm2"] for row in alternatives_json((searched, up, up))] == pytest.approx([20.0] * 3)


def test_a_joint_reports_the_same_first_layer_contact_as_the_dry_run() -> None:
    profile, program, (ours, _, _) = compared()
    (joint,), (face,) = ours.joints, program.run.interfaces
    assert joint == joints_of_print(program, profile)[0]
    assert (joint.part, joint.contact_share, joint.plastic_over_room) == (face.part, face.contact, face.over_room)
    assert joint.area_mm2 == pytest.approx(face.area_mm2, rel=0.05)
    assert joint.seam_mm == ours.seam_mm > 0.0


def test_table_and_json_hold_the_same_figures() -> None:
    alternatives = compared()[2]
    lines = compare_table(alternatives).splitlines()
    rows = alternatives_json(alternatives)
    assert [line.split("  ")[0] for line in lines[2:5]] == ["in 2 parts", "straight up", "best single orientation"]
    assert [(row["name"], row["parts"]) for row in rows] == [("parts", 2), ("upright", 1), ("oriented", 1)]
    assert f"{rows[1]['support_area_mm2']:.0f} mm²" in lines[3]
    assert [row["time_s"] for row in rows] == [alternative.time_s for alternative in alternatives]
    assert rows[0]["seam_mm"] > 0.0 == rows[1]["seam_mm"] == rows[2]["seam_mm"]
    assert [(alternative["part"], alternative["plastic_mm3"] > 0.0) for alternative in rows[0]["interfaces"]] == [(2, True)]
    assert [(joint["part"], joint["weakest"]) for joint in rows[0]["joints"]] == [(2, True)]
    assert rows[0]["joints"][0]["load_n"] > 0.0
    assert rows[1]["interfaces"] == rows[2]["interfaces"] == []
