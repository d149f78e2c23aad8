import json
from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.dryrun import DryRun, dry_run, summary
from machine.dryrun.strokes import turned_box
from machine.gcode.reader import parsed
from mdp.pose import Pose, rotation
from profiles.errors import GcodeError
from profiles.profile import load
from slicer.estimate.timing import move_times
from tests.machine.dryrun.bent import bent
from tests.machine.dryrun.planted import FAULTS
from tests.machine.hand import printed, text, whole

PROFILE = load()
MACHINE = PROFILE.machine.model_copy(update={"uncalibrated": []})
CLEAN = PROFILE.model_copy(update={"machine": MACHINE})
BEGIN = "G28\nG92 A0 C0\nM109 S210\nM83\nG0 Z20 F600\n"
END = "\nM104 S0\n"


def _times(deltas: list[list[float]], speed: float) -> np.ndarray:
    rows = np.zeros((len(deltas), 6))
    rows[:, : len(deltas[0])] = deltas
    return move_times(rows, np.full(len(rows), speed), np.zeros(len(rows), dtype=bool), MACHINE)


def test_a_long_move_is_a_trapezoid() -> None:
    assert _times([[100.0]], 100.0).sum() == pytest.approx(100 / 100 + 100 / 1500)  # v/a in the two ramps together


def test_a_short_move_is_a_triangle() -> None:
    assert _times([[1.0]], 100.0).sum() == pytest.approx(2 * sqrt(1.0 / 1500))


def test_the_slowest_axis_paces_a_slanted_move() -> None:
    # Z: 15 mm/s and 200 mm/s2 at a share of 0.8 allow 18.75 mm/s and 250 mm/s2 along the move
    assert _times([[3.0, 0.0, 4.0]], 100.0).sum() == pytest.approx(5 / 18.75 + 18.75 / 250)


def test_a_turn_takes_the_slower_rotary_axis_s_time() -> None:
    assert _times([[0, 0, 0, 60.0, 60.0]], 1000.0).sum() == pytest.approx(60 / 30 + 30 / 200)


@settings(deadline=None)  # the first call compiles
@given(st.lists(st.floats(0.01, 30.0), min_size=1, max_size=40), st.floats(5, 200))
def test_pieces_of_a_straight_line_take_as_long_as_the_line(pieces: list[float], speed: float) -> None:
    whole = _times([[sum(pieces) * 0.6, sum(pieces) * 0.8]], speed).sum()
    assert _times([[p * 0.6, p * 0.8] for p in pieces], speed).sum() == pytest.approx(whole, rel=1e-3)


def test_a_square_corner_is_passed_at_the_junction_speed() -> None:
    v, a, jerk, side = 50.0, 1500.0, 8.0, 50.0
    one = side / v + v / (2 * a) + (v - jerk) ** 2 / (2 * a * v)
    assert _times([[side, 0.0], [0.0, side]], v).sum() == pytest.approx(2 * one)


def test_a_reversal_is_passed_at_half_the_junction_speed() -> None:
    v, a, side = 50.0, 1500.0, 50.0
    one = side / v + v / (2 * a) + (v - 4.0) ** 2 / (2 * a * v)
    assert _times([[side], [-side]], v).sum() == pytest.approx(2 * one)


def test_a_short_piece_between_two_lines_is_ramped_through_without_stopping() -> None:
    # 1 mm at half the feed: down to 25 mm/s before it, up again after it, its own speed throughout
    rows, v, slow, a, side = np.zeros((3, 6)), 50.0, 25.0, 1500.0, 20.0
    rows[:, 0] = [side, 1.0, side]
    times = move_times(rows, np.array([v, slow, v]), np.zeros(3, dtype=bool), MACHINE)
    ramp_up, ramp_down = v * v / (2 * a), (v * v - slow * slow) / (2 * a)
    one = v / a + (v - slow) / a + (side - ramp_up - ramp_down) / v
    assert times == pytest.approx([one, 1.0 / slow, one], rel=1e-3)


def test_a_given_acceleration_lengthens_the_ramps() -> None:
    rows = np.zeros((1, 6))
    rows[0, 0] = 100.0
    times = move_times(rows, np.array([100.0]), np.zeros(1, dtype=bool), MACHINE, np.array([500.0]))
    assert times[0] == pytest.approx(100 / 100 + 100 / 500, rel=1e-3)


def test_a_wait_between_two_moves_stops_the_machine_and_counts() -> None:
    flowing, waiting = (
        dry_run((BEGIN + f"G0 X10 F6000\n{wait}G0 X20\n" + END).splitlines(), CLEAN) for wait in ("", "G4 P500\n")
    )
    assert waiting.time_s == pytest.approx(flowing.time_s + 0.5 + 100 / 1500, rel=1e-6)


def _codes(text: str) -> list[str]:
    return [finding.code for finding in dry_run(text.splitlines(), CLEAN).findings]


@pytest.mark.parametrize(
    ("moves", "code", "line"),
    [
        ("G0 X161", "axis-limit", 6),
        ("G0 Y-161", "axis-limit", 6),
        ("G0 Z261", "axis-limit", 6),
        ("G0 Z200\nG0 A96", "axis-limit", 7),
        ("G0 C-3601", "axis-limit", 6),
        ("G0 X100 F60000", "axis-speed", 6),
        ("G0 Z30 F3000", "axis-speed", 6),
        ("G0 C30 F60000", "axis-speed", 6),
        ("G1 X10 E10 F600", "flow", 6),
        ("M104 S0\nG1 X10 E0.1", "cold-extrusion", 7),
        ("G0 Z150\nG0 A30 F600\nG28 X Y", "homing-tilted", 8),
        ("G0 Z150\nG1 A30 E1 F600", "turning-stroke", 7),
        ("G0 Z-3", "collision", 6),
        ("G0 A60 F600", "collision", 6),
        ("M777", "ignored", 6),
        (";UNSUPPORTED:12.5", "unsupported", 6),
        ("G0 X101 F3000\nG0 Z0.2 F600\nG1 X110 E0.1", "off-plate", 8),
        ("G1 X5 E0.1 F600\nG28", "homing-over-print", 7),
    ],
)
def test_a_planted_fault_is_found_with_its_code_and_line(moves: str, code: str, line: int) -> None:
    found = dry_run((BEGIN + moves + END).splitlines(), CLEAN).findings
    assert {(finding.code, finding.line) for finding in found if finding.code != "air"} == {(code, line)}


@pytest.mark.parametrize("moves", ["G0 X90 F3000\nG0 Z0.2 F600\nG1 X99 E0.1", "G0 X101 F3000\nG0 Z5 F600\nG1 X110 E0.1"])
def test_plastic_on_the_plate_or_high_above_its_rim_is_no_fault(moves: str) -> None:
    assert _codes(BEGIN + moves + END) == []


def test_a_rectangular_plate_ends_at_its_sides_not_at_its_corners() -> None:
    oblong = load(settings=["machine.table.size_mm=[190, 100]", "machine.uncalibrated=[]"])
    strokes = [f"G0 X80 F3000\nG0 Z0.2 F600\nG1 X{x} E0.1" for x in (94, 96)]
    codes = [{f.code for f in dry_run((BEGIN + stroke + END).splitlines(), oblong).findings} for stroke in strokes]
    assert ["off-plate" in found for found in codes] == [False, True]


def test_a_purge_next_to_the_plate_is_not_a_fault() -> None:
    assert _codes(BEGIN + ";TYPE:Custom\nG0 X101 F3000\nG0 Z0.2 F600\nG1 X110 E0.1" + END) == []


@pytest.mark.parametrize(
    ("bead", "found"),
    [
        ("G0 X-20 Y0.55\nG1 X-3 E1", []),  # widths of 0.8 and 0.4 mm touch at 0.6 mm, less 0.02 mm of rounding
        ("G0 X-20 Y0.57\nG1 X0 E1", ["X0.0 Y0.0"]),
        ("G0 X-20 Y0.59\nG1 X20 E1", []),
        ("G0 X10.57 Y-20\nG1 X10.57 Y20 E2", ["X10.0 Y0.0"]),
        ("G0 X10.59 Y-20\nG1 X10.59 Y20 E2", []),
        ("G0 X4 Y-9\nG1 X4 Y9 E1", ["X4.0 Y0.0"]),
        ("G0 X4 Y-9 Z0.4\nG1 X4 Y9 E1", []),
    ],
)
def test_a_purge_may_touch_a_bead_of_the_first_layer_and_not_overlap_it(bead: str, found: list[str]) -> None:
    purge = ";HEIGHT:0.2\n;TYPE:Custom\n;WIDTH:0.8\nG0 Z0.2 F600\nG0 X0 Y0\nG1 X10 E1\n;TYPE:Perimeter\n;WIDTH:0.4\n"
    told = [finding.message for finding in dry_run((BEGIN + purge + bead + END).splitlines(), CLEAN).findings]
    assert [message[13 : message.index(" lies")] for message in told if "the purge" in message] == found


def test_homing_across_after_a_print_is_no_fault() -> None:
    assert _codes(BEGIN + "G1 X5 E0.1 F600\nG28 X Y" + END) == []


def test_the_same_fault_of_several_bodies_is_reported_once() -> None:
    messages = [finding.message for finding in dry_run((BEGIN + "G0 Z-50" + END).splitlines(), CLEAN).findings]
    assert len(messages) == len(set(messages)) > 1


def test_moves_before_homing_are_found() -> None:
    assert _codes("M109 S210\nG0 X1\nG28\nM104 S0") == ["not-homed"]
    assert _codes("G28 X Y\nG0 X1 Y1 F600\nG0 Z2") == ["not-homed"]
    assert _codes("G28 X Y\nG92 Z5\nG0 X1 Y1 F600\nG0 Z2") == []


def test_extruding_before_waiting_for_the_nozzle_is_found() -> None:
    assert _codes("G28\nM104 S210\nM83\nG1 Z5 F600\nG1 X5 E0.1\nM104 S0") == ["cold-extrusion"]


@pytest.mark.parametrize(("heat", "message"), [("M109 S210", "nozzle"), ("M140 S60", "bed")])
def test_a_heater_left_on_is_found(heat: str, message: str) -> None:
    found = dry_run(["G28", heat], CLEAN).findings
    assert [finding.code for finding in found] == ["heater-on"]
    assert message in found[0].message


def test_uncalibrated_numbers_are_named_as_a_warning() -> None:
    found = dry_run((BEGIN + END).splitlines(), PROFILE).findings
    assert [(finding.severity, finding.code) for finding in found] == [("warning", "uncalibrated")]
    assert "machine.tilt.point_mm" in found[0].message


@pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])
def test_a_generated_program_has_no_errors(machine: str) -> None:
    profile, lines = whole(machine)
    assert [finding.code for finding in dry_run(lines, profile).findings] == ["uncalibrated"]


@pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])
def test_the_plastic_is_where_the_slicer_put_it(machine: str) -> None:
    profile, decomposition, sliced, _ = printed(machine)
    run = dry_run(text(machine), profile)
    wanted = []
    for part, piece in zip(decomposition.parts, sliced, strict=True):
        for layer in piece.layers:
            for path in layer.paths:
                points = (
                    np.column_stack([path.points, np.full(len(path.points), layer.z_mm + part.base.offset_mm)]) @ part.rotation
                )
                wanted.append(np.stack([points[:-1], points[1:]], axis=1))
    assert run.deposited.segments() == pytest.approx(np.concatenate(wanted), abs=2e-3)
    oozed_mm3 = profile.material.prime_extra_mm * pi * 1.75**2 / 4
    assert run.segment_mm3.sum() == pytest.approx(sum(piece.volume_mm3 for piece in sliced) + oozed_mm3, rel=1e-5)


def _run() -> DryRun:
    return dry_run(text(), printed()[0])


def test_the_summary_has_the_agreed_keys_and_is_json() -> None:
    figures = summary(_run())
    assert list(figures) == [
        "time_s", "filament_mm", "extruded_mm3", "travel_mm", "layers", "parts", "reorientations",
        "retractions", "bounds_mm", "axes", "interfaces", "findings",
    ]  # fmt: skip
    assert set(figures["findings"][0]) == {"severity", "code", "line", "part", "layer", "message"}
    assert json.loads(json.dumps(figures)) == figures


def test_the_summary_s_figures_are_those_of_the_post_and_the_arm() -> None:
    figures = summary(_run())
    assert (figures["layers"], figures["parts"], figures["reorientations"], figures["retractions"]) == (6, 2, 2, 6)
    assert np.array(figures["bounds_mm"]) == pytest.approx(np.array([[-4.775, -4.775, 0.2], [5.6, 4.775, 59.775]]), abs=2e-3)
    assert figures["axes"]["A"] == [0.0, 90.0]
    assert figures["extruded_mm3"] == pytest.approx(figures["filament_mm"] * pi * 1.75**2 / 4)
    assert list(figures["axes"]) == ["X", "Y", "Z", "A", "C"]


def test_an_empty_text_makes_an_empty_run() -> None:
    figures = summary(dry_run([], CLEAN))
    assert (figures["time_s"], figures["bounds_mm"], figures["axes"]["X"], figures["findings"]) == (0.0, [], [], [])


@pytest.mark.parametrize("line", ["G1 X1 Y4294967296 E0.1", "G0 Z-100000", "G1 X20000 E1"])
def test_a_place_that_no_printer_reaches_is_refused_with_its_line(line: str) -> None:
    with pytest.raises(GcodeError, match=r"line 2: [XYZ] comes to .* mm: no printer reaches beyond 10000"):
        dry_run(["G1 X1 F600", line], load())


@pytest.mark.parametrize("rows_at_once", [7, 1000])
def test_rows_are_judged_the_same_in_batches_of_any_size(rows_at_once: int, monkeypatch: pytest.MonkeyPatch) -> None:
    profile, _, lines = bent("generic_ac")
    faults = [fault.edit(list(lines)) for fault in FAULTS if fault.name in ("a layer missing", "no fans")]
    programs = [lines, *faults, [line for line in lines if not line.startswith((";WIDTH", ";HEIGHT"))]]
    whole = [dry_run(program, profile) for program in programs]
    monkeypatch.setattr(parsed, "AT_ONCE", rows_at_once)
    for program, expected in zip(programs, whole, strict=True):
        run = dry_run(program, profile)
        assert (run.findings, summary(run)) == (expected.findings, summary(expected))
        assert np.array_equal(run.deposited.width_mm, expected.deposited.width_mm)
        assert all(np.array_equal(own, other) for own, other in zip(run.contacts, expected.contacts, strict=True))


def test_the_turned_bounding_box_of_a_piece_contains_all_its_beads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parsed, "AT_ONCE", 100)
    profile, _, lines = bent("generic_ac")
    deposited = dry_run(lines, profile).deposited
    turn = np.column_stack([rotation(profile.machine, Pose(30.0, 70.0)), [1.0, 2.0, 3.0]])
    for some, box in deposited.boxes(250):
        turned = deposited.segments(some).reshape(-1, 3) @ turn[:, :3].T + turn[:, 3]
        least, most = turned_box(box, turn)
        assert (turned >= least).all()
        assert (turned <= most).all()
    assert [some for some, _ in deposited.boxes(250)] == [slice(0, 100), slice(100, 200), slice(200, 250)]
