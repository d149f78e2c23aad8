"""The page's bytes, decoded by their specification, against the program, its dry run and its parts."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from machine.dryrun.dryrun import dry_run
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind
from machine.gcode.writer import write_gcode
from machine.kinematics.table import workpiece_path
from machine.program import Program
from machine.view.contents import of_parts, of_print
from machine.view.encoding import Column, pack
from machine.view.paths import layers_of, shown_rows
from mdp.decomposition import FrontRow
from mdp.plane import Plane
from profiles.profile import Profile, load
from tests.machine import hand
from tests.machine.pages import Arrays, on_the_work, text_of, unpacked

PLAIN = load(settings=["machine.uncalibrated=[]"])
WHOLE = st.integers(-(2**30), 2**30 - 1)  # so that differences fit into 32 bits


@cache
def example(machine: str = "generic_ac") -> tuple[Profile, Program]:
    """The post and the arm, written and dry-run."""
    profile, decomposition, sliced, program = hand.printed(machine)
    lines = tuple(write_gcode(program, profile))
    return profile, Program(lines, dry_run(lines, profile), decomposition, sliced)


@cache
def shown(machine: str = "generic_ac") -> tuple[dict[str, Any], Arrays]:
    profile, program = example(machine)
    return unpacked(of_print("post and arm", program, profile, True, (), False))


def read(text: str, profile: Profile = PLAIN) -> tuple[dict[str, Any], Arrays]:
    """The page of a G-code text."""
    lines = tuple(text.split("\n"))
    return unpacked(of_print("text", Program(lines, dry_run(lines, profile), None), profile, True, (), False))


@given(arrays.arrays(np.int64, st.tuples(st.integers(0, 40), st.integers(1, 5)), elements=WHOLE))
def test_differences_in_planes_give_the_whole_numbers_back(values: Any) -> None:
    _, columns = unpacked(pack({}, {"a": Column(values * 0.001, "i32", 0.001, delta=True), "b": Column(values, "i32")}))
    np.testing.assert_allclose(columns["a"], values * 0.001, atol=1e-9)
    np.testing.assert_array_equal(columns["b"], values)


def test_sums_may_grow_beyond_32_bits() -> None:
    pushed = np.arange(1, 50) * 1e4
    _, columns = unpacked(pack({}, {"filament": Column(pushed, "f64", 1e-5, delta=True)}))
    np.testing.assert_allclose(columns["filament"], pushed, atol=1e-5)


@pytest.mark.parametrize("machine", ["generic_ac", "trident_5axis", "linuxcnc_xyzac"])
def test_the_rows_are_the_programs_moves(machine: str) -> None:
    profile, program = example(machine)
    parsed = parse_gcode(program.lines, profile.machine)
    _, columns = shown(machine)
    assert np.abs(columns["end"] - parsed.end).max() <= 0.0005 + 1e-9
    for name in ("line", "part", "layer", "type"):
        np.testing.assert_array_equal(columns[name], getattr(parsed, name))
    np.testing.assert_allclose(columns["filament"], parsed.filament_mm, atol=1e-5)


@pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro", "trident_5axis"])
def test_the_described_chain_leads_to_the_places_on_the_work(machine: str) -> None:
    profile, program = example(machine)
    header, columns = shown(machine)
    own = np.array([on_the_work(header["machine"], row) for row in columns["end"]])
    assert np.abs(own - workpiece_path(profile.machine, program.run.program.end)).max() < 0.01


def test_times_are_the_dry_runs_and_end_with_it() -> None:
    _, program = example()
    header, columns = shown()
    np.testing.assert_allclose(columns["time"], np.cumsum(program.run.times_s), atol=0.00051)
    assert header["time_s"] == program.run.time_s


def test_waiting_counts_before_the_move_that_follows_it() -> None:
    header, columns = read("G28\nG1 X60 F3600\nG4 S5\nG1 X0\nG4 P2000")
    assert columns["time"][1] - columns["time"][0] == pytest.approx(5.0 + columns["time"][0], abs=0.01)
    assert header["time_s"] == pytest.approx(columns["time"][1] + 2.0, abs=0.001)


def test_a_row_has_its_kind_bead_temperatures_and_fan() -> None:
    _, columns = read(
        "G28\nM104 S200\nM140 S60\nM106 S51\nG0 X5\n;WIDTH:0.5\n;HEIGHT:0.25\nG1 X9 E1 F600\nG1 X8 E0\nM107\nG1 E-1\nG1 E0"
    )
    assert columns["kind"].tolist() == [0, 1, 4, 2, 5]
    np.testing.assert_allclose(columns["width"], [0, 0.5, 0, 0, 0])
    np.testing.assert_allclose(columns["height"], [0, 0.25, 0, 0, 0])
    np.testing.assert_allclose(columns["fan"], [0.2, 0.2, 0.2, 0, 0])
    assert columns["nozzle"].tolist() == [200.0] * 5
    assert columns["bed"].tolist() == [60.0] * 5
    assert columns["speed"][1] == 10.0


def test_beads_laid_while_the_table_turns_are_shown_on_the_work() -> None:
    header, columns = read("G28\nM83\nG0 X30 Y0 Z5 F600\nG1 C30 E0.8\nG1 X31 C60 E0.8\nG1 C0\nG1 X0 E1")
    assert columns["kind"].tolist() == [0, 1, 1, 3, 1]
    ways = np.diff([on_the_work(header["machine"], row) for row in columns["end"][:3]], axis=0)
    pushed = 0.8 * np.pi * 1.75**2 / 4.0
    for way, width, height in zip(ways, columns["width"][1:3], columns["height"][1:3], strict=True):
        assert pushed == pytest.approx(np.linalg.norm(way) * ((width - height) * height + np.pi * height**2 / 4), rel=0.01)
    assert columns["layer"].tolist() == [0, 1, 1, 1, 2]


def test_a_row_that_begins_elsewhere_is_a_jump() -> None:
    _, columns = read("G28\nG1 X5 F600\nG92 X0\nG1 X1\nG1 X2")
    assert columns["jump_row"].tolist() == [0, 1]
    assert columns["jump_start"][:, 0].tolist() == [0.0, 0.0]
    assert columns["end"][:, 0].tolist() == [5.0, 1.0, 2.0]


def test_a_fan_without_a_number_blows_fully_and_shares_may_go_to_one() -> None:
    rrf = load(machine="three_axis", settings=["machine.dialect=reprapfirmware"])
    for word, share in (("M106", 1.0), ("M106 S0.4", 0.4), ("M106 S102", 0.4)):
        assert read(f"{word}\nG1 X5 F600", rrf)[1]["fan"][0] == pytest.approx(share)


STEPS = "\n".join(f";LAYER_CHANGE\nG0 X0 Z{0.2 * k:.1f}\nG1 X20 E{k}\nG1 Y9\nG1 Y0 X0 E{k}.5" for k in range(1, 6))


def test_layers_without_comments_follow_from_the_heights() -> None:
    commented, silent = read(STEPS), read(STEPS.replace(";LAYER_CHANGE", ""))
    assert [header["layers_by"] for header, _ in (commented, silent)] == ["comments", "heights"]
    np.testing.assert_allclose(commented[1]["layer_z"], [0.2, 0.4, 0.6, 0.8, 1.0], atol=1e-6)
    for name in ("layer_number", "layer_z", "layer_part"):
        np.testing.assert_array_equal(commented[1][name], silent[1][name])


def test_layers_cover_their_rows_and_their_time() -> None:
    _, columns = shown()
    for first, rows, part, number, seconds in zip(
        *(columns[f"layer_{name}"].astype(float) for name in ("first", "rows", "part", "number", "time")), strict=True
    ):
        mine = slice(int(first), int(first + rows))
        assert set(columns["part"][mine]) == {part}
        assert set(columns["layer"][mine]) == {number}
        assert seconds == pytest.approx(columns["time"][mine][-1] - columns["time"][int(first) - 1], abs=0.0011)


def test_a_helix_has_a_layer_a_turn() -> None:
    turns = [(k / 8.0, 10 * np.cos(k * np.pi / 4), 10 * np.sin(k * np.pi / 4)) for k in range(1, 41)]
    text = "\n".join(["M83", *(f"G1 X{x:.3f} Y{y:.3f} Z{0.2 * turn:.4f} E0.1 F600" for turn, x, y in turns)])
    lines = text.split("\n")
    assert layers_of(parse_gcode(lines, PLAIN.machine), 0.2).rows.tolist() == [8, 8, 8, 8, 8]


def test_parts_have_their_pose_time_and_rows() -> None:
    _, program = example()
    header, columns = shown()
    assert [part["index"] for part in header["parts"]] == [1, 2]
    for part, solid in zip(header["parts"], program.decomposition.parts if program.decomposition else (), strict=True):
        mine = slice(part["first_row"], part["first_row"] + part["rows"])
        assert set(columns["part"][mine]) == {part["index"]}
        assert part["tilt_deg"] == solid.pose.tilt_deg
        assert part["layers"] == 3
    begin = columns["time"][header["parts"][0]["first_row"] - 1]
    assert sum(part["time_s"] for part in header["parts"]) == pytest.approx(header["time_s"] - begin, abs=0.001)


def test_surfaces_are_the_parts_meshes() -> None:
    profile, program = example()
    assert program.decomposition is not None
    header, columns = unpacked(of_parts(program.decomposition, profile))
    for entry, part in zip(header["parts"], program.decomposition.parts, strict=True):
        (v0, v1), (f0, f1) = entry["mesh"]["vertices"], entry["mesh"]["faces"]
        assert np.abs(columns["vertices"][v0:v1] - part.mesh.vertices).max() <= 0.0005 + 1e-9
        np.testing.assert_array_equal(columns["faces"][f0:f1] - v0, part.mesh.faces)
    assert len(columns["end"]) == 0


def test_faces_are_marked_risky_as_printed_and_straight_up() -> None:
    _, program = example()
    header, columns = shown()
    assert program.decomposition is not None
    f0, f1 = header["parts"][1]["mesh"]["faces"]
    marks, arm = columns["face_marks"][f0:f1].astype(int), program.decomposition.parts[1]
    assert arm.mesh.areas_mm2[marks & 1 > 0].sum() == 0.0  # printed sideways it supports itself
    assert arm.mesh.areas_mm2[marks & 2 > 0].sum() == pytest.approx(100.0)  # its underside, 10 x 10


def test_a_foot_is_covered_by_its_disc() -> None:
    header, _ = shown()
    base = header["parts"][1]["base"]
    np.testing.assert_allclose(base["centre_mm"], [5.0, 0.0, 55.0], atol=1e-6)
    assert base["radius_mm"] == pytest.approx(np.hypot(5, 5))


def test_the_front_is_complete_with_planes_in_print_order() -> None:
    side, top = (Plane(np.array(normal), 5.0) for normal in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    front = (
        FrontRow((), 100.0, 0.0, 100.0, time_s=60.0, filament_mm=1000.0),
        FrontRow((side,), 0.0, 40.0, 24.0, chosen=True, reason="the least cost"),
        FrontRow((top, side), 0.0, 40.0, 23.9, flaw="the nozzle could break off part 3"),
    )
    profile, decomposition, _, _ = hand.printed()
    header, _ = unpacked(of_parts(replace(decomposition, name="the arm.stl", front=front), profile))
    whole, taken, more = header["front"]
    assert (whole["planes"], whole["time_s"], whole["filament_mm"], whole["why"]) == ([], 60.0, 1000.0, "")
    assert (taken["chosen"], taken["why"]) == (True, "the least cost")
    assert (taken["time_s"], taken["filament_mm"]) == (None, None)
    assert more["why"] == "the nozzle could break off part 3"
    assert [plane["normal"] for plane in more["planes"]] == [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    assert more["command"] == "tiltprint decompose 'the arm.stl' --parts 3"


def test_a_finding_is_at_its_line() -> None:
    header, columns = read("G28\nG1 X10 F600\nG1 X9999\nG1 X10")
    mistake = next(finding for finding in header["findings"] if finding["severity"] == "error")
    assert (mistake["line"], mistake["row"]) == (3, 1)
    assert columns["line"][mistake["row"]] == 3
    assert mistake["machine_mm"] == [9999.0, 0.0, 0.0]


def test_a_finding_names_settings_by_their_labels_and_keeps_their_keys() -> None:
    profile, lines = load(settings=['machine.uncalibrated=["machine.table", "machine.tilt.point_mm"]']), ("G28", "G1 X1 F600")
    header, _ = unpacked(of_print("text", Program(lines, dry_run(lines, profile), None), profile, True, (), False))
    (guess,) = [finding for finding in header["findings"] if finding["code"] == "uncalibrated"]
    assert guess["message"].endswith(": Table, Tilt axis: Point on the axis")
    assert guess["keys"] == "machine.table, machine.tilt.point_mm"


def test_a_finding_about_another_layer_is_at_its_beginning() -> None:
    text = ";PART:1\n;UNSUPPORTED:3@2\n;LAYER_CHANGE\nG1 Z0.2 F600\nG1 X9 E1\n;LAYER_CHANGE\nG0 Z0.4\nG1 X0 E2"
    header, columns = read(text)
    (unsupported,) = [finding for finding in header["findings"] if finding["code"] == "unsupported"]
    assert (unsupported["line"], unsupported["layer"], columns["line"][unsupported["row"]]) == (2, 2, 8)


def test_a_guessed_machine_adds_no_findings() -> None:
    text = "G28\nG1 Z0.2 F600\nG1 X9999\nG1 X0 E1"
    lines = tuple(text.split("\n"))
    codes = [
        {finding["code"] for finding in unpacked(of_print("text", program, PLAIN, known, (), False))[0]["findings"]}
        for program, known in [(Program(lines, dry_run(lines, PLAIN), None), known) for known in (True, False)]
    ]
    assert codes[0] - codes[1] == {"axis-limit", "off-plate"}
    assert "cold-extrusion" in codes[1]


def test_the_same_print_gives_the_same_bytes() -> None:
    profile, program = example()
    again = Program(program.lines, dry_run(program.lines, profile), program.decomposition, program.sliced)
    assert of_print("a", program, profile, True, (), False) == of_print("a", again, profile, True, (), False)


@pytest.mark.parametrize(
    "text", ["G28\nG1 X5 F600", "G28\nG1 E5 F600", ";PART:3 of 3\n;LAYER_CHANGE\nG1 X5 F600", "T0\nG1 X1e5 F600"]
)
def test_texts_without_much_to_see_are_shown_too(text: str) -> None:
    header, columns = read(text)
    assert len(columns["end"]) == 1
    assert len(header["parts"]) == 1


WAVE = "\n".join(
    ["M83", *(f"G1 X{k % 200 * 0.1:.1f} Y{k // 200 + 0.003 * (k % 3):.3f} E0.01 F600" for k in range(2000)), "G0 Z9", "G1 Z0"]
)


def test_thinning_keeps_the_ends_of_strokes_and_every_other_move() -> None:
    program = parse_gcode(WAVE.split("\n"), PLAIN.machine)
    rows = shown_rows(program, most=500)
    assert len(rows) <= 500
    assert {0, *np.flatnonzero(program.kind != MoveKind.EXTRUDE).tolist()} <= set(rows.tolist()) | {0}
    corners = np.flatnonzero(np.abs(np.diff(program.end[:, 1])) > 0.5)  # last points of the rows of the wave
    assert set(corners.tolist()) <= set(rows.tolist())


def test_rows_that_are_kept_stay_exact(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.view.paths.shown_rows", lambda program: shown_rows(program, most=500))
    program = parse_gcode(WAVE.split("\n"), PLAIN.machine)
    header, columns = read(WAVE)
    rows = np.searchsorted(program.line, columns["line"])
    assert header["thinned"] == {"rows": len(program.line), "kept": len(rows)}
    assert header["summary"].endswith(f" m of filament · thinned: {len(rows):,} of {len(program.line):,} moves")
    np.testing.assert_allclose(columns["end"], program.end[rows], atol=0.00051)
    np.testing.assert_allclose(columns["filament"], program.filament_mm[rows], atol=1e-5)
    assert columns["time"][-1] == pytest.approx(header["time_s"], abs=0.001)


def test_a_print_that_fits_is_not_thinned() -> None:
    program = parse_gcode(WAVE.split("\n"), PLAIN.machine)
    assert len(shown_rows(program)) == len(program.line)


LINES = (
    *("G1 X10 E1 F600", "G1 X0", "G0 Z5", "G1 Z0.2 E0.1", "G92 E0", "G92 X3", "G1 E-1", "G28", "G4 S2", "G1 A30", "G1 X1e9"),
    *("G1 X4 A-10 C20 E3", "M106", "M109 S9", "M84", ";LAYER_CHANGE", ";PART:2 of 9", ";PART:1", ";TYPE:Perimeter"),
    *(";TYPE:<b>", ";WIDTH:0", ";HEIGHT:70", ";UNSUPPORTED:3@1"),
)


@settings(max_examples=50)
@given(st.lists(st.sampled_from(LINES), max_size=25))
def test_rows_layers_and_parts_agree_for_any_order_of_lines(lines: list[str]) -> None:
    header, columns = read("\n".join(lines))
    parsed = parse_gcode(lines, PLAIN.machine)
    rows = len(parsed.line)
    assert [len(columns[name]) for name in ("end", "time", "line", "kind", "width", "fan")] == [rows] * 6
    assert all(0 <= part["first_row"] <= part["first_row"] + part["rows"] <= rows for part in header["parts"])
    ends = columns["layer_first"] + columns["layer_rows"]
    assert (columns["layer_first"][1:] >= ends[:-1]).all()
    assert all(ends <= rows)
    assert all(-1 <= finding["row"] < max(rows, 1) for finding in header["findings"])
    assert text_of(header, columns) == "\n".join(lines).split("\n")
