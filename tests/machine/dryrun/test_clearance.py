from math import cos, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.dryrun import dry_run
from machine.kinematics.collision import hull, refined_gap, sweep_gaps, swing_mm, table_reach
from machine.kinematics.table import machine_points
from mdp.directions.unit_vectors import spread
from mdp.head import Block, Ring, bodies, directions
from mdp.pose import UP, Pose, rotation
from profiles.machine import Box, Head, Machine, TableBox
from profiles.profile import Profile, load

GENERIC = load()
TILT = st.floats(-90, 90)


def _with(head: Head, radius_mm: float = 100.0) -> Profile:
    table = GENERIC.machine.table.model_copy(update={"radius_mm": radius_mm})
    machine = GENERIC.machine.model_copy(update={"head": head, "table": table, "uncalibrated": [], "clearance_mm": 0.0})
    return GENERIC.model_copy(update={"machine": machine})


def _plate(machine: Machine, pose: Pose) -> np.ndarray:
    """Sample points on the plate's top and bottom rims, in the machine frame."""
    around = np.linspace(0, 2 * pi, 181)
    rim = np.column_stack([np.cos(around), np.sin(around), np.zeros(181)]) * machine.table.radius_mm
    return machine_points(machine, pose, np.vstack([rim, rim - [0, 0, machine.table.thickness_mm]]))


@settings(deadline=None)  # the first call compiles
@given(TILT, st.floats(-180, 180))
def test_the_reach_of_the_table_is_that_of_its_rims(tilt: float, turn: float) -> None:
    machine, pose = GENERIC.machine, Pose(tilt, turn)
    tried = spread(40)
    assert table_reach(machine, pose)(tried) == pytest.approx((_plate(machine, pose) @ tried.T).max(axis=0), abs=0.02)


@settings(deadline=None)  # the first call compiles
@given(TILT, st.tuples(st.floats(-150, 150), st.floats(-150, 150), st.floats(-50, 150)))
def test_a_gap_never_exceeds_the_distance_of_sampled_points(tilt: float, tip: tuple[float, float, float]) -> None:
    machine, pose = GENERIC.machine, Pose(tilt, 0.0)
    box = next(body for body in bodies(machine) if isinstance(body, Block))
    corners = np.array(np.meshgrid(*zip(box.min_mm, box.max_mm, strict=True))).reshape(3, -1).T + tip
    distance = np.linalg.norm(corners[:, None] - _plate(machine, pose)[None], axis=2).min()
    tried = directions(rotation(machine, pose) @ UP)
    place = np.array([tip])
    assert sweep_gaps(box, place, place, tried, table_reach(machine, pose)(tried))[0] <= distance + 1e-9


@settings(deadline=None)  # the first call compiles
@given(st.floats(5, 85), st.floats(5, 60), st.floats(0, 50))
def test_over_a_wide_table_a_body_is_clear_exactly_above_the_known_height(tilt: float, reach: float, height: float) -> None:
    body = Box(name="duct", min_mm=(-1.0, -1.0, height), max_mm=(1.0, reach, height + 10.0))
    profile = _with(Head(nozzle_mm=0.4, silhouette_mm=[(0.01, 0.0)], boxes=[body]), 1000.0)
    origin = machine_points(profile.machine, Pose(tilt, 0.0), np.zeros((1, 3)))[0]
    least = reach * sin(radians(tilt)) / cos(radians(tilt)) - height  # relative to the tip's position on the plane, along z
    for above, clear in ((0.05, True), (-0.05, False)):
        z = origin[2] + max(least, 0.02) + above
        if least > 0.1:
            program = f"G28\nG92 A{tilt} C0 Z2000\nG0 X{origin[0]:.4f} Y{origin[1]:.4f} Z{z:.4f} F600"
            found = [f for f in dry_run(program.splitlines(), profile).findings if "duct" in f.message]
            assert (not found) == clear


def test_a_move_across_the_rim_of_a_tilted_table_is_not_missed() -> None:
    profile = _with(Head(nozzle_mm=0.4, silhouette_mm=[(1.0, 0.0)], boxes=[]), 50.0)
    rim = machine_points(profile.machine, Pose(90.0, 0.0), np.array([[0.0, 50.0, 0.0]]))[0]
    over = f"G28\nG92 A90 C0 Y{rim[1] - 30:.3f} Z200\nG0 Z{rim[2] + 3:.3f} F600\nG0 Y{rim[1] + 30:.3f}"
    through = over.replace(f"Z{rim[2] + 3:.3f}", f"Z{rim[2] - 3:.3f}")
    assert not dry_run(over.splitlines(), profile).findings
    assert [f.line for f in dry_run(through.splitlines(), profile).findings if f.code == "collision"] == [4]


def test_outside_the_table_s_edge_the_head_may_go_below_its_surface() -> None:
    profile = _with(Head(nozzle_mm=0.4, silhouette_mm=[(5.0, 0.0)], boxes=[]), 50.0)
    program = "G28\nG0 Z50 F600\nG0 X57\nG0 Z-20\nG0 X50"
    assert [(f.code, f.line) for f in dry_run(program.splitlines(), profile).findings] == [("collision", 5)]


def test_a_turn_under_a_low_head_meets_the_rim_and_what_is_printed() -> None:
    line = "G28\nG92 A0 C0\nM109 S210\nM83\n;WIDTH:0.4\nG0 Z40 F600\nG1 X40 E1 F600\nG1 X-40 E1\n"
    text = line + "G0 Z{z}\nG0 X0\nG0 A{a} F600\nM104 S0"
    profile = _with(Head(nozzle_mm=0.4, silhouette_mm=[(0.5, 0.0)], boxes=[]), 10.0)
    low = dry_run(text.format(z=40.1, a=5).splitlines(), profile).findings
    assert [f.message.split(" at ")[0] for f in low if f.code == "collision"] == [
        "nozzle tip runs into the print while the table turns,"
    ]
    assert not [f for f in dry_run(text.format(z=60, a=30).splitlines(), profile).findings if f.code == "collision"]


@pytest.mark.parametrize(("kind", "collides"), [("Custom", False), ("Perimeter", True)])
def test_a_purge_line_at_the_plate_s_edge_makes_no_mountain_of_the_print(kind: str, collides: bool) -> None:
    text = f"G28\nG92 A0 C0\nM109 S210\nM83\n;WIDTH:0.4\n;TYPE:{kind}\nG0 Z0.2 F600\nG0 X-15 Y-90\nG1 X15 E1 F600\n"
    text += ";TYPE:Perimeter\nG0 Z30\nG0 X0 Y0\nG1 X5 E1\nG0 Z32\nG0 X0 Y0\nG0 A{a} F600\nM104 S0"
    profile = _with(Head(nozzle_mm=0.4, silhouette_mm=[(0.5, 0.0)], boxes=[]))
    profile = profile.model_copy(update={"machine": profile.machine.model_copy(update={"clearance_mm": 1.0})})
    found = [f for a in (-48, 48) for f in dry_run(text.format(a=a).splitlines(), profile).findings]
    assert any("the print while the table turns" in finding.message for finding in found) == collides


@pytest.mark.parametrize("turn", ["C10000000", "A30 C10000000"])
def test_a_turn_of_ten_million_degrees_is_checked_up_to_the_axis_limit(turn: str) -> None:
    found = dry_run(["G28", "G92 A0 C0", "G1 Z5 F600", f"G1 {turn} F600"], GENERIC).findings
    assert {(f.code, f.line) for f in found} >= {("axis-limit", 4)}
    assert ("A30" in turn) == any(f.code == "collision" and "while the table turns" in f.message for f in found)


@settings(deadline=None)  # the first call compiles
@given(st.floats(0, 80), st.floats(5, 30), st.floats(0, 40))
def test_refining_never_loses_to_the_tried_directions(tilt: float, radius: float, height: float) -> None:
    machine, pose = GENERIC.machine, Pose(tilt, 0.0)
    body = Ring("hot end", ((radius, height), (radius + 2, height + 5)), 1.0)
    tip = np.array([30.0, -20.0, 60.0])
    tried = directions(rotation(machine, pose) @ UP)
    lower = sweep_gaps(body, tip[None], tip[None], tried, table_reach(machine, pose)(tried))[0]
    assert refined_gap(body, tip, tip, rotation(machine, pose) @ UP, table_reach(machine, pose)) >= lower - 1e-9


def test_the_hull_of_beads_reaches_as_far_as_their_points() -> None:
    points = np.random.default_rng(3).normal(size=(500, 3))
    tried = spread(50)
    level = hull(points, 0.25).reach(GENERIC.machine, Pose(0.0, 0.0), tried)
    assert level == pytest.approx((points @ tried.T).max(axis=0) + 0.25)


def test_a_tip_that_rises_from_where_it_was_homed_meets_no_plate_that_was_measured_higher() -> None:
    profile = load("generic_ac")
    turn = profile.machine.turn.model_copy(update={"point_mm": (0.0, 0.0, 0.4)})
    higher = profile.model_copy(update={"machine": profile.machine.model_copy(update={"turn": turn})})
    lines = ["G21", "G90", "M83", "G28 X Y Z", "G1 Z11 F600", "G1 X10 Y10 F6000"]
    assert [f for f in dry_run(lines, higher).findings if f.severity == "error"] == []
    low = [*lines, "G1 Z0.2 F600"]
    assert [f.code for f in dry_run(low, higher).findings if f.severity == "error"] == ["collision"]


@pytest.mark.parametrize(("turn", "is_met"), [(0, True), (180, False)])
def test_the_head_is_checked_against_a_clip_where_the_plate_has_turned_it(turn: int, is_met: bool) -> None:
    clip = TableBox(name="clip", min_mm=(30.0, -10.0, 0.0), max_mm=(40.0, 10.0, 8.0))
    table = GENERIC.machine.table.model_copy(update={"clips": [clip]})
    machine = GENERIC.machine.model_copy(update={"table": table, "uncalibrated": []})
    profile = GENERIC.model_copy(update={"machine": machine})
    lines = [
        "G21",
        "G90",
        "M83",
        "G28 X Y Z",
        "G92 A0 C0",
        "G1 Z40 F900",
        f"G1 C{turn} F900",
        "G1 X50 Y0 F3000",
        "G1 Z10 F900",
        "G1 Z3 F900",
    ]
    found = [finding.message for finding in dry_run(lines, profile).findings if finding.code == "collision"]
    assert [message.split(" at ")[0] for message in found] == ["hot end runs into the plate's clip"] * is_met


def test_the_bound_of_how_far_a_turn_swings_covers_a_clip() -> None:
    clip = TableBox(name="clip", min_mm=(60.0, -5.0, 0.0), max_mm=(80.0, 5.0, 90.0))
    table = GENERIC.machine.table.model_copy(update={"clips": [clip]})
    machine = GENERIC.machine.model_copy(update={"table": table, "cradle": []})
    top = machine_points(machine, Pose(0.0, 0.0), np.array([[80.0, 5.0, 90.0]]))[0]
    from_axis = top - np.array(machine.tilt.point_mm)
    assert swing_mm(machine, hull(np.zeros((0, 3)), 0.0)) >= np.hypot(from_axis[1], from_axis[2])
    assert swing_mm(machine, hull(np.zeros((0, 3)), 0.0)) >= np.linalg.norm([80.0, 5.0, 90.0])
