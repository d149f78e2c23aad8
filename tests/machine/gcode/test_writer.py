import re
from dataclasses import replace
from math import pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.dryrun import dry_run
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind
from machine.gcode.writer import write_gcode
from machine.planning.moves import BeginLayer, straight_moves
from machine.quantities import duration
from mdp.pose import Pose
from profiles.errors import ProfileError
from profiles.profile import Profile, load
from slicer.estimate.timing import lengths
from slicer.paths import Kind
from tests.machine.hand import printed, text
from tests.machine.moves import Stroke, moves_of, program_of

GOLDEN = Path(__file__).parents[1] / "programs"
BOTH = pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])


def _commands(lines) -> list[str]:
    return [line.partition(";")[0].strip() for line in lines if line.partition(";")[0].strip()]


@BOTH
def test_the_text_is_the_golden_text(machine: str) -> None:
    wanted = (GOLDEN / f"post_and_arm_{machine}.gcode").read_text(encoding="ascii").splitlines()
    config = wanted.index("; tiltprint_config = begin")
    assert list(text(machine))[:config] == wanted[:config]


@BOTH
def test_writing_twice_gives_the_same_lines(machine: str) -> None:
    profile, _, _, program = printed(machine)
    assert tuple(write_gcode(program, profile)) == text(machine)


@BOTH
def test_read_back_every_move_is_where_the_program_had_it(machine: str) -> None:
    profile, _, _, program = printed(machine)
    parsed = parse_gcode(text(machine), profile.machine)
    start, end, _ = straight_moves(program, Pose(0.0, 0.0))
    moving = lengths(end - start)[0] > 0
    first = len(parsed.line) - moving.sum()
    assert parsed.end[first:] == pytest.approx(end[moving, :5], abs=5.1e-4)
    assert parsed.filament_mm[first:] == pytest.approx(end[moving, 5], abs=5.1e-6)


@settings(deadline=None)  # the first call compiles
@given(st.lists(st.floats(1e-7, 3.0), min_size=1, max_size=200))
def test_rounding_of_filament_never_drifts(filament: list[float]) -> None:
    profile = load()
    points = np.column_stack([np.arange(len(filament) + 1) * 0.01, np.zeros(len(filament) + 1), np.full(len(filament) + 1, 0.2)])
    stroke = Stroke(Kind.SKIN, points, np.array(filament), 20.0, 0.4)
    parsed = parse_gcode(write_gcode(program_of("p", (stroke,)), profile), profile.machine)
    assert parsed.filament_mm == pytest.approx(np.cumsum(filament), abs=5.1e-6)


@settings(deadline=None)
@given(st.lists(st.floats(1e-4, 0.3), min_size=1, max_size=20), st.floats(0.0, 360.0))
def test_no_step_is_written_denser_than_its_stroke(steps: list[float], heading_deg: float) -> None:
    along = np.concatenate([[0.0], np.cumsum(steps)])
    x, y = 7.0 + along * np.cos(np.radians(heading_deg)), 3.0 + along * np.sin(np.radians(heading_deg))
    stroke = Stroke(Kind.SKIN, np.column_stack([x, y, np.full(len(x), 0.2)]), 0.4 * np.array(steps), 100.0, 0.4)
    parsed = parse_gcode(write_gcode(program_of("p", (stroke,)), load()), load().machine)
    length = np.linalg.norm(parsed.end - parsed.start, axis=1)
    filament_mm_s = (parsed.e_mm - 1e-5)[1:] / length[1:] * parsed.feed[1:] / 60.0  # the first one starts where the text begins
    assert filament_mm_s.max(initial=0.0) <= 40.0 * 1.004 + 0.01


@BOTH
def test_no_command_outgrows_the_firmware_s_line(machine: str) -> None:
    assert all(len(f"N1234567 {command}*123") <= 95 for command in _commands(text(machine)))
    assert all(len(line) < 200 for line in text(machine))


def test_zero_has_no_sign() -> None:
    points = np.array([[1, 0, 0.2], [-0.0001, -0.0004, 0.2]])
    stroke = Stroke(Kind.SKIN, points, np.array([0.1]), 20.0, 0.4)
    lines = list(write_gcode(program_of("p", (stroke,)), load()))
    assert "G1 X0.000 Y0.000 Z0.200 E0.10000 F1200" in lines


@BOTH
def test_only_coordinates_that_change_are_written(machine: str) -> None:
    strokes = [line for line in text(machine) if line.startswith("G1 X") and "Y" in line and "E" in line]
    assert not strokes  # the squares' sides run along X or Y only


def test_rotary_words_carry_the_machine_s_letters() -> None:
    turns = [line for line in text("fractal5pro") if re.match(r"G0 B[-0-9.]+ A[-0-9.]+ F", line)]
    assert len(turns) == 3
    assert "home_ab" in text("fractal5pro")
    assert any(line.startswith(";POSE:B90.0000 A") for line in text("fractal5pro"))


@BOTH
def test_no_axis_exceeds_its_limits(machine: str) -> None:
    profile = printed(machine)[0]
    assert not [f for f in dry_run(text(machine), profile).findings if f.code in ("axis-speed", "axis-limit", "flow")]


def test_the_first_layer_s_temperature_is_waited_for_and_lowered_in_the_second() -> None:
    lines = text()
    assert lines.index("M109 S215") < lines.index(";LAYER_CHANGE")
    second = [k for k, line in enumerate(lines) if line == ";LAYER_CHANGE"][1]
    assert lines[second + 3] == "M104 S210"


def test_layers_that_ask_for_more_heat_get_it_up_to_the_machines_limit():
    profile, _, _, program = printed()
    moves = tuple(replace(m, nozzle_add_c=95.0) if isinstance(m, BeginLayer) and m.part == 2 else m for m in moves_of(program))
    heats = [line for line in write_gcode(program_of(program.name, moves), profile) if line.startswith("M104 S")]
    assert heats[-3:] == ["M104 S210", "M104 S300", "M104 S0"]


def test_the_temperature_of_a_hotter_layer_after_a_turn_is_set_before_the_turn() -> None:
    profile, _, _, program = printed()
    moves = tuple(replace(m, nozzle_add_c=5.0) if isinstance(m, BeginLayer) and m.part == 2 else m for m in moves_of(program))
    lines = list(write_gcode(program_of(program.name, moves), profile))
    turned = next(k for k, line in enumerate(lines) if line.startswith("G0 A90"))
    last_stroke = max(k for k, line in enumerate(lines[:turned]) if re.match(r"G1 X.* E[0-9]", line))
    assert [k for k, line in enumerate(lines) if line == "M104 S215" and last_stroke < k < turned]
    assert lines[turned:].count("M104 S215") == 0


def test_the_fan_follows_the_layers() -> None:
    assert [line for line in text() if line.startswith(("M106", "M107"))] == ["M106 S255", "M107", "M106 S255", "M107"]


def test_progress_rises_to_the_end_and_its_minutes_fall() -> None:
    marks = [re.fullmatch(r"M73 P(\d+) R(\d+)", line) for line in text("generic_ac", 60) if line.startswith("M73")]
    percent, minutes = ([int(mark[k]) for mark in marks] for k in (1, 2))
    assert percent == sorted(percent)
    assert minutes == sorted(minutes, reverse=True)
    assert (percent[-1], minutes[-1]) == (100, 0)


@BOTH
def test_the_footer_reports_the_same_filament_and_time_as_the_dry_run(machine: str) -> None:
    profile = printed(machine)[0]
    run = dry_run(text(machine), profile)
    mm, cm3, grams = (_foot(text(machine), f"filament used [{unit}]") for unit in ("mm", "cm3", "g"))
    assert float(mm) == pytest.approx(float(run.program.filament_mm.max()), abs=0.01)
    assert float(cm3) == pytest.approx(float(mm) * pi * 1.75**2 / 4 / 1000, abs=0.01)
    assert float(grams) == pytest.approx(float(cm3) * 1.24, abs=0.02)
    printing = float(run.times_s[run.program.part > 0].sum())
    time = _foot(text(machine), "estimated printing time (normal mode)")
    assert time in (duration(printing - 0.05), duration(printing + 0.05))  # the text has thousandths


def _foot(lines, key: str) -> str:
    return next(line.partition(" = ")[2] for line in lines if line.startswith(f"; {key} = "))


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.4, "0s"), (15.2, "15s"), (75, "1m 15s"), (3975, "1h 6m 15s"), (90061, "1d 1h 1m 1s")]
)
def test_times_are_written_as_prusaslicer_does(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_the_settings_can_be_read_from_the_file() -> None:
    lines = text()
    config = lines[lines.index("; tiltprint_config = begin") + 1 : lines.index("; tiltprint_config = end")]
    assert "; machine.name = generic A/C table" in config
    assert "; process.layer_height_mm = 0.2" in config
    assert "; machine.gcode.start[0] = G21" in config


def _with_block(name: str, block: str) -> Profile:
    profile = load()
    gcode = profile.machine.gcode.model_copy(update={name: block})
    return profile.model_copy(update={"machine": profile.machine.model_copy(update={"gcode": gcode})})


def test_the_before_part_block_precedes_a_turn_with_its_placeholders_filled() -> None:
    profile = _with_block("before_part", "M117 part {part} of {parts} at {tilt}{tilt_deg} {turn}{turn_deg} from Z{z_mm}")
    lines = list(write_gcode(printed()[3], profile))
    turn = next(k for k, line in enumerate(lines) if line.startswith("G0 A90"))
    assert re.fullmatch(r"M117 part 2 of 2 at A90 C-?90 from Z[0-9.]+", lines[turn - 1])


def test_the_after_part_block_follows_each_part_and_appears_nowhere_else() -> None:
    lines = list(write_gcode(printed()[3], _with_block("after_part", "M117 done")))
    places = [line for line in lines if line == "M117 done" or line.startswith((";PART:", ";PAUSE:"))]
    assert places == [";PART:1 of 2", "M117 done", ";PART:2 of 2", "M117 done"]


def test_the_before_layer_block_precedes_every_layer_with_its_number_and_height() -> None:
    sliced = [layer for part in printed()[2] for layer in part.layers]
    lines = list(write_gcode(printed()[3], _with_block("before_layer", "M117 {layer_num} at {layer_z} of {max_layer_z}")))
    shown = [line for line in lines if line.startswith("M117 ")]
    tops = [part.layers[-1].z_mm for part in printed()[2] for _ in part.layers]
    heights = zip([layer.z_mm for layer in sliced], tops, strict=True)
    assert shown == [f"M117 {k} at {round(z, 4):g} of {round(top, 4):g}" for k, (z, top) in enumerate(heights)]


@pytest.mark.parametrize("line", ["G1 Z10", "G28 X", "G91", "M82", "TIMELAPSE_TAKE_FRAME", "M84"])
def test_a_before_layer_block_that_may_move_an_axis_or_change_a_mode_is_refused(line: str) -> None:
    with pytest.raises(ProfileError, match=f"machine.gcode.before_layer: '{line}' may move an axis or change a mode"):
        write_gcode(printed()[3], _with_block("before_layer", f"M104 S210\n{line}"))


def test_an_unknown_placeholder_is_named_with_the_allowed_ones() -> None:
    with pytest.raises(ProfileError, match=r"machine.gcode.end: placeholder \{speed\} is not known: allowed are bed_c, .*z_mm"):
        write_gcode(printed()[3], _with_block("end", "M104 S0\nG1 F{speed}"))


def test_a_block_s_line_too_long_for_the_firmware_is_refused() -> None:
    with pytest.raises(ProfileError, match=r"machine.gcode.start: the line .* has 104 characters, at most 84 are allowed"):
        write_gcode(printed()[3], _with_block("start", "M117" + " long" * 20))


def test_parts_layers_and_types_are_read_back_from_the_comments() -> None:
    parsed = parse_gcode(text(), printed()[0].machine)
    strokes = parsed.kind == MoveKind.EXTRUDE
    assert parsed.parts == (1, 2)
    assert parsed.layers == 6
    assert sorted(set(zip(parsed.part[strokes], parsed.layer[strokes], strict=True))) == [
        (p, k) for p in (1, 2) for k in (1, 2, 3)
    ]
    assert {parsed.types[k] for k in parsed.type[strokes]} == {"External perimeter", "Perimeter"}
    assert set(parsed.width_mm[strokes]) == {0.45}
    assert set(parsed.height_mm[strokes]) == {0.2}


@pytest.mark.parametrize(("speed_mm_s", "written"), [(10.0, {600.0}), (12.5, {750.0, 714.0})])
def test_short_strokes_go_a_twentieth_slower_where_rounding_would_ask_too_much_of_the_extruder(
    speed_mm_s: float, written: set[float]
) -> None:
    speeds = set()
    for length in np.linspace(0.01, 0.03, 41):
        stroke = Stroke(
            Kind.GAP, np.array([[7.0, 3.0, 0.2], [7.0 + length, 3.0, 0.2]]), np.array([0.4 * length]), speed_mm_s, 0.4
        )
        line = next(line for line in write_gcode(program_of("p", (stroke,)), load()) if line.startswith("G1 X7"))
        speeds.add(float(line.partition(" F")[2]))
    assert speeds == written
