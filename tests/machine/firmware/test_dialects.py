"""One program in the words of every firmware, each text read back to the same print."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path as File

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.firmware import dialects
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from machine.gcode.writer import write_gcode
from machine.kinematics.table import axis_positions, followed_places, workpiece_path
from machine.planning.moves import BeginLayer, BeginPart, MachineProgram, Reorient, straight_moves
from machine.planning.plan import plan
from machine.planning.stops import parse_stops
from mdp.pose import Pose, level
from profiles.errors import ProfileError
from profiles.machine import Machine
from profiles.profile import Profile, load
from slicer.paths import Kind, Layer, Path
from tests.machine.hand import post_and_arm, printed, squares
from tests.machine.moves import Retract, Stroke, Travel, moves_of, program_of

MODES = [(name, "table") for name in dialects()] + [
    (name, "workpiece") for name, dialect in dialects().items() if dialect.follow_on
]
EACH = pytest.mark.parametrize(("dialect", "coordinates"), MODES)
STARTS = {
    "linuxcnc": "M140 P{bed_c}\nM109 P{first_layer_nozzle_c}\nG92 {tilt}0 {turn}0",
    "grblhal": "M140 S{bed_c}\nM109 S{first_layer_nozzle_c}\nG92 {tilt}0 {turn}0",
    "klipper": load().machine.gcode.start.replace("M17\n", ""),  # Klipper does not know this command
    "klipper_steppers": "M140 S{bed_c}\nG28 X Y Z\nMANUAL_STEPPER STEPPER={tilt_stepper} SET_POSITION=0",
}
GOLDEN = File(__file__).parents[1] / "programs"
ENDS = {"linuxcnc": "M104 P0\nM107"}


def profile(dialect: str, coordinates: str = "table", machine: str = "generic_ac", settings: tuple[str, ...] = ()) -> Profile:
    """A profile with a firmware's dialect, whose tilt axis lies beside the plate and whose turn axis is off the zero."""
    loaded = load(machine=machine, settings=[f"machine.dialect={dialect}", f"machine.coordinates={coordinates}", *settings])
    axes = {
        "tilt": loaded.machine.tilt.model_copy(update={"point_mm": (0.0, 3.5, -12.0)}),
        "turn": loaded.machine.turn.model_copy(update={"point_mm": (2.25, -1.5, 0.75)}),
    }
    usual = loaded.machine.gcode
    blocks = {"start": STARTS.get(dialect, usual.start), "end": ENDS.get(dialect, usual.end)}
    axes |= {"gcode": usual.model_copy(update=blocks)}  # type: ignore[dict-item]
    return loaded.model_copy(update={"machine": loaded.machine.model_copy(update=axes)})


@cache
def both(dialect: str, coordinates: str) -> tuple[Profile, tuple[str, ...], ParsedProgram]:
    """The post and the arm as G-code, and as parsed again."""
    chosen = profile(dialect, coordinates)
    lines = tuple(write_gcode(printed()[3], chosen))
    return chosen, lines, parse_gcode(lines, chosen.machine)


def golden(dialect: str, coordinates: str) -> list[str]:
    """The commands of a print that uses every word of a firmware: arcs, heat, fans, accelerations, a pause, a filament change."""
    wanted = ("material.pressure_advance=0.04", "process.acceleration_mm_s2=900", "machine.purge_mm=20", "machine.arcs=true")
    chosen = profile(dialect, coordinates, settings=wanted)
    decomposition = post_and_arm(chosen.machine)
    sliced = [squares(piece, chosen, layers=2) for piece in decomposition.parts]
    around = np.linspace(0.0, 1.5 * np.pi, 60)
    ring = np.column_stack([3.0 * np.cos(around), 3.0 * np.sin(around)])
    hole = Path(Kind.OVERHANG, ring, 0.45, 25.0, 1.05, ring[:1], False, fan=0.6)
    first, *others = [Layer.of(layer.z_mm, layer.height_mm, (*layer.paths, hole), layer.fan) for layer in sliced[0].layers]
    first = replace(first, nozzle_add_c=chosen.material.first_layer_nozzle_c - chosen.material.nozzle_c)
    sliced[0] = replace(sliced[0], layers=(first, *others), unsupported=())
    program = plan(decomposition, sliced, chosen, parse_stops(["1:2"], ["2:2"]))
    return [line for line in write_gcode(program, chosen) if not line.startswith(";")]


@EACH
def test_every_command_of_a_firmware_matches_the_golden_file(dialect: str, coordinates: str) -> None:
    file = GOLDEN / f"every_word_{dialect}_{coordinates}.gcode"
    assert golden(dialect, coordinates) == file.read_text(encoding="ascii").splitlines()


def laid(machine: Machine, parsed: ParsedProgram) -> np.ndarray:
    """(n, 4) end of every stroke on the workpiece, with the filament so far, from the parsed text."""
    strokes = parsed.kind == MoveKind.EXTRUDE
    return np.column_stack([workpiece_path(machine, parsed.end[strokes]), parsed.filament_mm[strokes]])


def wanted(machine: Machine, program: MachineProgram) -> np.ndarray:
    """(n, 4) end of every stroke on the workpiece, with the filament so far, from the program itself."""
    start, end, _ = straight_moves(program, level(machine))
    moved = np.linalg.norm(end[:, :3] - start[:, :3], axis=1) > 1e-9
    strokes = moved & (end[:, 5] > start[:, 5])
    return np.column_stack([workpiece_path(machine, end[strokes, :5]), end[strokes, 5]])


@EACH
def test_read_back_tip_and_filament_are_the_program_s(dialect: str, coordinates: str) -> None:
    chosen, _, parsed = both(dialect, coordinates)
    assert laid(chosen.machine, parsed) == pytest.approx(wanted(chosen.machine, printed()[3]), abs=1e-3)


@EACH
def test_every_turn_is_one_row_at_the_planned_speed_and_the_head_does_not_move(dialect: str, coordinates: str) -> None:
    _, _, parsed = both(dialect, coordinates)
    turns = np.flatnonzero(parsed.kind == MoveKind.ROTATE)
    change = parsed.end[turns] - parsed.start[turns]
    planned = [move for move in moves_of(printed()[3]) if isinstance(move, Reorient)]
    assert parsed.end[turns, 3:] == pytest.approx(np.array([[m.pose.tilt_deg, m.pose.turn_deg] for m in planned[1:]]), abs=1e-4)
    assert np.abs(change[:, :3]).max() < 1e-9
    assert parsed.feed[turns] / 60 == pytest.approx(np.array([m.speed_deg_s for m in planned[1:]]), rel=1e-3)


@EACH
def test_heat_comes_before_plastic_and_ends_with_the_file(dialect: str, coordinates: str) -> None:
    heats = [e for e in both(dialect, coordinates)[2].events if e.code in ("M104", "M109")]
    first = int(np.flatnonzero(both(dialect, coordinates)[2].kind == MoveKind.EXTRUDE)[0])
    assert any(e.code == "M109" and e.value == 215 and e.row <= first for e in heats)
    assert 210 in [e.value for e in heats]


@EACH
def test_generated_gcode_contains_nothing_unknown(dialect: str, coordinates: str) -> None:
    assert both(dialect, coordinates)[2].ignored == {}


@EACH
def test_lines_are_no_longer_than_the_firmware_keeps(dialect: str, coordinates: str) -> None:
    commands = [line.partition(";")[0] for line in both(dialect, coordinates)[1]]
    assert max(len(command) for command in commands) + 12 <= dialects()[dialect].longest_line


@EACH
def test_speeds_are_read_back(dialect: str, coordinates: str) -> None:
    _, _, parsed = both(dialect, coordinates)
    strokes = parsed.kind == MoveKind.EXTRUDE
    assert set(np.unique(parsed.feed[strokes].round(6))) == {2400.0}


class TestWords:
    """The particular words of each firmware."""

    def lines(self, dialect: str, coordinates: str = "table") -> list[str]:
        return [line for line in both(dialect, coordinates)[1] if not line.startswith(";")]

    def test_marlin_labels_parts_with_m486(self) -> None:
        assert [line for line in self.lines("marlin") if "M486" in line] == [
            "M486 T2", "M486 S0", "M486 S-1", "M486 S1", "M486 S-1",
        ]  # fmt: skip

    def test_marlin_follows_between_g43_4_and_g49(self) -> None:
        lines = self.lines("marlin", "workpiece")
        assert lines.index("G43.4") < next(k for k, line in enumerate(lines) if line.startswith("G0 Z")) < lines.index("G49")

    def test_reprapfirmware_counts_fans_to_1_and_names_its_objects(self) -> None:
        lines = self.lines("reprapfirmware")
        assert {"M106 P0 S1", "M568 P0 S210", 'M486 S0 A"part 1"', "M486 S-1"} <= set(lines)

    def test_klipper_registers_its_steppers_after_the_start_block_and_lets_go_of_them(self) -> None:
        lines = self.lines("klipper")
        registered = "MANUAL_STEPPER STEPPER=stepper_a GCODE_AXIS=A LIMIT_VELOCITY=30 LIMIT_ACCEL=200"
        freed = [k for k, line in enumerate(lines) if line == "MANUAL_STEPPER STEPPER=stepper_a GCODE_AXIS="]
        assert freed[0] < lines.index("G28 X Y Z") < lines.index(registered) < freed[1] < len(lines)

    def test_klipper_s_steppers_turn_together_and_only_the_longer_turn_is_waited_for(self) -> None:
        turns = [line for line in self.lines("klipper_steppers") if " MOVE=" in line]
        assert [line[-6:] for line in turns] == ["SYNC=0", "SYNC=1"] * 3
        assert re.fullmatch(r"MANUAL_STEPPER STEPPER=stepper_\w MOVE=[-0-9.]+ SPEED=[0-9.]+ ACCEL=[0-9.]+ SYNC=0", turns[2])

    def test_klipper_labels_its_objects_and_counts_layers(self) -> None:
        lines = self.lines("klipper")
        begun = [lines.index(f"EXCLUDE_OBJECT_{word} NAME=part_2") for word in ("DEFINE", "START", "END")]
        assert begun == sorted(begun)
        assert {"SET_PRINT_STATS_INFO TOTAL_LAYER=6", "SET_PRINT_STATS_INFO CURRENT_LAYER=6"} <= set(lines)

    def test_linuxcnc_pushes_filament_by_an_axis_heats_by_p_words_and_ends_with_m2(self) -> None:
        lines = self.lines("linuxcnc")
        assert lines[-1] == "M2"
        assert "M109 P215" in lines
        assert not [line for line in lines if re.search(r" E-?[0-9]|^M10[0-9] S", line)]

    def test_linuxcnc_turns_a_followed_table_in_inverse_time(self) -> None:
        lines = self.lines("linuxcnc", "workpiece")
        begin, end = lines.index("G93"), lines.index("G94", lines.index("G93"))
        assert end - begin > 90
        assert all(" F" in line for line in lines[begin + 1 : end])

    def test_grblhal_counts_followed_places_from_the_turn_axis(self) -> None:
        ours, theirs = both("marlin", "workpiece")[2], both("grblhal", "workpiece")[2]
        assert ours.end[-1] == pytest.approx(theirs.end[-1], abs=2e-3)
        assert [line for line in self.lines("grblhal", "workpiece") if " Z-0.550" in line]  # 0.2 less the 0.75 of the axis


def test_a_firmware_that_cannot_follow_the_table_is_refused_for_workpiece_coordinates() -> None:
    with pytest.raises(ProfileError, match="coordinates is workpiece: klipper does not follow the table"):
        load(settings=["machine.dialect=klipper", "machine.coordinates=workpiece"])


ANGLE = st.floats(-90, 90).map(lambda v: round(v, 3))
PLACE = st.tuples(*[st.floats(-60, 60).map(lambda v: round(v, 3))] * 2, st.floats(30, 90).map(lambda v: round(v, 3)))


@EACH
@settings(deadline=None, max_examples=15)
@given(st.lists(st.tuples(ANGLE, ANGLE, st.lists(PLACE, min_size=2, max_size=5, unique=True)), min_size=1, max_size=3))
def test_any_program_comes_back_in_any_dialect(dialect: str, coordinates: str, parts: list) -> None:
    chosen = profile(dialect, coordinates)
    program = turned_program(parts)
    parsed = parse_gcode(write_gcode(program, chosen), chosen.machine)
    assert laid(chosen.machine, parsed) == pytest.approx(wanted(chosen.machine, program), abs=1e-3)


def turned_program(parts: list) -> MachineProgram:
    """Parts from (tilt, turn, points): each is one stroke in its pose, with a retraction between them."""
    moves: list = []
    at = np.array([0.0, 0.0, 90.0])
    moves += [Travel(np.array([at, at]), 10.0), Travel(np.array([at, at]), 10.0)]
    for index, (tilt, turn, points) in enumerate(parts, start=1):
        pose, path = Pose(tilt, turn), np.array(points)
        moves += [Reorient(pose, 20.0), BeginPart(index, pose, 1), BeginLayer(index, 1, 0.2, 0.2, 1.0)]
        moves += [Travel(np.array([at, path[0]]), 50.0), Stroke(Kind.SKIN, path, np.full(len(path) - 1, 0.731), 33.0, 0.45)]
        moves += [Retract(0.8, 35.0), Retract(-0.8, 35.0)]
        at = path[-1]
    return program_of("random", tuple(moves))


@given(ANGLE, ANGLE, PLACE)
def test_followed_places_and_axis_positions_are_each_other_s_inverse(tilt: float, turn: float, point: tuple) -> None:
    machine = profile("linuxcnc", "workpiece").machine
    there = followed_places(machine, Pose(tilt, turn), np.array([point]))
    assert axis_positions(machine, np.array([[*there[0], tilt, turn]])) == pytest.approx(np.array([point]), abs=1e-9)


@given(PLACE)
def test_with_a_level_table_workpiece_coordinates_are_axis_positions(point: tuple) -> None:
    machine = profile("linuxcnc", "workpiece").machine
    assert followed_places(machine, Pose(0.0, 0.0), np.array([point])) == pytest.approx(np.array([point]), abs=1e-9)
