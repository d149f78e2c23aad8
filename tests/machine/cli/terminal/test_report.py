from dataclasses import replace

import numpy as np
import pytest

from machine.cli.terminal.report import front_table, interfaces_line, joints_table, parts_table, pins_line, run_table, table
from machine.dryrun.dryrun import dry_run
from mdp.cut import cut, mesh_of, solid_of
from mdp.decomposition import Decomposition, FrontRow, Part
from mdp.directions.orientation import best_orientation, in_words
from mdp.joint import Joint
from mdp.mesh import Mesh
from mdp.plane import PLATFORM, Plane
from mdp.pose import Pose, about
from profiles.profile import load, load_one
from slicer.paths import SlicedPart
from tests.shapes import box, hollow, tee


def part(index: int, mesh: Mesh, base: Plane, pose: Pose, risky_mm2: float = 0.0) -> Part:
    return Part(index, mesh, base, pose, np.eye(3), mesh.volume_mm3, risky_mm2)


def tee_in_parts() -> Decomposition:
    """A tee whose arms are cut off sideways: 300 mm² overhang when printed straight up, 30 mm² of them stay risky."""
    right, left = Plane(np.array([1.0, 0.0, 0.0]), 5.0), Plane(np.array([-1.0, 0.0, 0.0]), 5.0)
    left_arm, rest = cut(solid_of(tee()), left)
    right_arm, stem = cut(rest, right)
    parts = (
        part(1, mesh_of(stem), PLATFORM, Pose(0.0, 0.0)),
        part(2, mesh_of(right_arm), right, Pose(90.0, 90.0), 30.0),
        part(3, mesh_of(left_arm), left, Pose(90.0, -90.0)),
    )
    return Decomposition("tee.stl", tee(), parts, 2, "classic", 300.0, 30.0, 1234, 2, 0.25)


def test_the_parts_of_a_tee_are_listed_in_print_order_with_their_savings() -> None:
    lines = parts_table(tee_in_parts()).splitlines()
    assert lines == [
        "part  tilt deg  turn deg  base mm  volume mm³   share  needs support mm²  uncut",
        "1          0.0       0.0      0.0        4000  57.1 %                0.0    0.0",
        "2         90.0      90.0      5.0        1500  21.4 %               30.0    150",
        "3         90.0     -90.0      5.0        1500  21.4 %                0.0    150",
        "",
    ]
    assert "1234 candidates in 0.2 s" in parts_table(tee_in_parts(), verbose=True)


def test_the_front_is_listed_below_the_parts_with_the_chosen_row_and_the_reason() -> None:
    planes = (Plane(np.array([1.0, 0.0, 0.0]), 5.0), Plane(np.array([-1.0, 0.0, 0.0]), 5.0))
    rows = (
        FrontRow((), 300.0, 0.0, 312.0, stairs_mm2=12.4, time_s=3723.0, filament_mm=4040.0),
        FrontRow(planes[:1], 150.0, 40.0, 174.0),
        FrontRow(planes, 30.0, 80.0, 78.0, chosen=True, reason="for the lowest cost"),
    )
    assert front_table(rows).splitlines() == [
        "in parts  needs support mm²  seams mm  stair-stepping mm²  cost mm²   time  filament m",
        "1                       300         0                  12       312  1h 2m         4.0",
        "2                       150        40                   0       174      -           -",
        "3                      30.0        80                   0      78.0      -           -  chosen for the lowest cost",
    ]
    assert front_table(rows) in parts_table(replace(tee_in_parts(), front=rows))


def test_the_front_shows_the_totals_if_they_decided() -> None:
    whole = FrontRow((), 300.0, 0.0, 312.0, chosen=True, reason="for its total", total_mm2=512.3)
    rows = (whole, FrontRow((Plane(np.array([1.0, 0.0, 0.0]), 5.0),), 150.0, 40.0, 174.0))
    assert front_table(rows).splitlines() == [
        "in parts  needs support mm²  seams mm  stair-stepping mm²  cost mm²  time  filament m  total mm²",
        "1                       300         0                   0       312     -           -        512  chosen for its total",
        "2                       150        40                   0       174     -           -          -",
    ]


def test_the_joints_are_listed_in_print_order_and_the_weakest_is_named() -> None:
    joints = (Joint(2, 70.18, 21.16, 36.585, 842.19, 31.2), Joint(3, 111.33, 29.13, 19.529, 12605.3, 40.0))
    assert joints_table(joints).splitlines() == [
        "joint of part  area mm²  seam mm  arm mm  breaks at N  pulled off at N",
        "2                  70.2       31    21.2           37              840",
        "3                   111       40    29.1           20            13000",
        "weakest: part 3 breaks off at about 20 N sideways at its tip",
        "",
    ]
    assert joints_table(()) == ""


def test_a_joint_that_is_sliced_has_its_contact_and_its_plastic_one_that_is_not_a_dash() -> None:
    sliced = Joint(2, 70.18, 21.16, 36.585, 842.19, 31.2, contact_share=0.9712, plastic_over_room=1.024)
    lines = joints_table((sliced, Joint(3, 111.33, 29.13, 19.529, 12605.3, 40.0))).splitlines()
    assert lines[:3] == [
        "joint of part  area mm²  contact %  plastic / room %  seam mm  arm mm  breaks at N  pulled off at N",
        "2                  70.2       97.1               102       31    21.2           37              840",
        "3                   111          -                 -       40    29.1           20            13000",
    ]


def test_pins_are_counted_per_part_and_omitted_if_none() -> None:
    sliced = [SlicedPart(index, (), pins=pins) for index, pins in ((1, 0), (2, 8), (3, 0), (4, 5))]
    assert pins_line(sliced) == "pins: part 2 8, part 4 5\n"
    assert pins_line(sliced[:1]) == ""


def test_the_table_fits_a_terminal_of_80_columns() -> None:
    assert max(len(line) for line in parts_table(tee_in_parts()).splitlines()) <= 80


def alone(mesh: Mesh, risky_mm2: float) -> Decomposition:
    whole = (part(1, mesh, PLATFORM, Pose(0.0, 0.0), risky_mm2),)
    return Decomposition("m.stl", mesh, whole, 2, "classic", risky_mm2, risky_mm2, 0, 0, 0.0)


def test_the_areas_follow_the_self_supporting_angle() -> None:
    leaning = box(10, 10, 40).transform(about(np.array([0.0, 1.0, 0.0]), np.radians(30)), (0, 0, 5))
    before = [float(parts_table(alone(leaning, 400.0), angle).splitlines()[1].split()[-1]) for angle in (25.0, 35.0)]
    assert before == [pytest.approx(400 + 100, abs=0.2), pytest.approx(100, abs=0.2)]


def test_the_paper_s_metric_counts_faces_on_the_build_plate() -> None:
    lines = parts_table(tee_in_parts(), count_platform_faces=True).splitlines()
    assert lines[1].split()[-1] == "100"


def test_a_rotation_is_reported_in_the_form_of_its_setting() -> None:
    upside_down = tee().transform(np.diag([1.0, -1.0, -1.0]))
    assert in_words(best_orientation(upside_down, 45.0)) == "as it stands"
    oblique = tee().transform(about(np.array([0.0, 1.0, 0.0]), np.radians(30)))
    assert in_words(best_orientation(oblique, 45.0)) == "turned 90 about x"
    assert "rests nowhere" in in_words(best_orientation(hollow(), 45.0, resting=False))


def run_lines(moves: str) -> list[str]:
    lines = ["G28", "G92 A0 C0", "M109 S210", "M83", *moves.split("\n"), "M104 S0"] if moves else ["M105"]
    profile = load()
    machine = profile.machine.model_copy(update={"uncalibrated": []})
    return run_table(dry_run(lines, profile.model_copy(update={"machine": machine}))).splitlines()


def test_a_run_is_reported_in_four_lines_and_its_findings() -> None:
    assert run_lines(";PART:1 of 1\n;LAYER_CHANGE\nG0 Z10 F600\nG1 X30 E1\nG1 E-1\nM777") == [
        "time 4s, filament 0.00 m, 0.00 cm³",
        "1 part, 1 layer, 0 reorientations, 1 retraction, 0.01 m travel",
        "plastic from 0.0, 0.0, 10.0 to 30.0, 0.0, 10.0 mm (workpiece)",
        "axes X 0.0..30.0, Y 0.0..0.0, Z 10.0..10.0, A 0.0..0.0, C 0.0..0.0",
        "error: the part begins in air: 30.0 mm of its first layer have nothing under them (line 8)",
        "warning: M777 is not known to the dry run and was ignored (line 10)",
    ]


def test_a_long_finding_is_wrapped_without_splitting_a_key() -> None:
    machine = load_one("trident_5axis")["machine"]
    lines = run_table(dry_run(["M105"], load(machine="trident_5axis"))).splitlines()
    first = next(k for k, line in enumerate(lines) if "Voron Trident 5-axis is not calibrated: 8 values are guesses" in line)
    assert max(len(line) for line in lines) <= 100
    assert set(machine.uncalibrated) <= set(" ".join(lines[first:]).replace(",", "").split())


def test_a_program_without_a_move_is_reported() -> None:
    assert run_lines("")[2] == "nothing moves"


def test_a_table_aligns_words_left_and_numbers_right() -> None:
    assert table([["part", "mm"], ["1", "10.5"]]) == "part    mm\n1     10.5\n"


def test_the_plastic_of_every_interface_is_reported_and_omitted_for_one_piece() -> None:
    line = interfaces_line({2: 174.0, 3: 301.0})
    assert line == "interfaces take 0.47 cm³ that one piece would not: part 2 0.17, part 3 0.30\n"
    assert interfaces_line({}) == ""
