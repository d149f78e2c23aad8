"""Macros: Klipper's commands of a name and KEY=VALUE words in a simulated printer."""

import re
from collections.abc import Callable, Iterator
from math import hypot

from machine.firmware.klipper import COMMANDS, PROBING, stepper_name
from machine.gcode.words import read_number
from machine.simulator.board import Board, Work, wait_for_moves
from machine.simulator.commands import heat, heat_and_wait
from machine.simulator.motion_commands import seek_contact, seek_endstops

Values = dict[str, str]


def command_of(name: str) -> Callable[[Board, Values], Work] | None:
    """What a macro does; None when it is not known. HOME_AB and the like are a machine's own: they home the named axes."""
    if re.fullmatch(r"HOME_[A-CU-Z]+", name):
        return lambda board, values: _home(board, name.removeprefix("HOME_"))
    return MACROS.get(name)


def _home(board: Board, letters: str) -> Iterator[float]:
    yield from seek_endstops(board, [axis for axis, letter in enumerate(board.motion.letters[:5]) if letter in letters])


def _turn(board: Board, values: Values) -> Work:
    """MANUAL_STEPPER: SYNC=0 begins a turn that goes on together with the next one."""
    machine = board.machine
    axes = {stepper_name(machine.tilt): (3, machine.tilt), stepper_name(machine.turn): (4, machine.turn)}
    index, axis = axes.get(values.get("STEPPER", ""), (0, None))
    if axis is None:
        board.unknown += 1
        board.say(f"!! The value '{values.get('STEPPER', '')}' is not valid for STEPPER")
        return None
    if "SET_POSITION" in values:
        board.motion.set_coordinate(index, _number(values, "SET_POSITION"))
    if values.get("STOP_ON_ENDSTOP", "0") != "0":
        return _home(board, axis.letter)
    if "MOVE" in values:
        board.turning[index] = (_number(values, "MOVE"), max(_number(values, "SPEED", axis.speed_deg_s), 1e-3))
    return _turn_together(board) if board.turning and values.get("SYNC", "1") != "0" else None


def _turn_together(board: Board) -> Iterator[float]:
    motion = board.motion
    while not motion.planner.free(board.now_s):
        yield motion.planner.next_s()
    here = motion.coordinates()
    far = {axis: abs(angle - here[axis]) for axis, (angle, _) in board.turning.items()}
    seconds = max(far[axis] / speed for axis, (_, speed) in board.turning.items())
    target = motion.turned({axis: angle for axis, (angle, _) in board.turning.items()})
    board.turning.clear()
    motion.reach(target, board.now_s, hypot(*far.values()) / seconds if seconds > 0 else None)
    yield from wait_for_moves(board)


def _heat(board: Board, values: Values) -> Work:
    code = {"extruder": "M104", "heater_bed": "M140"}.get(values.get("HEATER", ""))
    return heat(board, {"S": _number(values, "TARGET")}, code) if code else None


def _wait(board: Board, values: Values) -> Work:
    code, heater = ("M190", board.bed) if values.get("SENSOR") == "heater_bed" else ("M109", board.nozzle)
    return heat_and_wait(board, {"S": heater.target_c}, code)


def _off(board: Board, values: Values) -> Work:
    heat(board, {"S": 0.0}, "M104")
    return heat(board, {"S": 0.0}, "M140")


def _probe(board: Board, values: Values) -> Work:
    """PROBE, as klippy/extras/probe.py and homing.py word it; the probe's own offset in the configuration is 0."""
    if board.table is None:
        board.unknown += 1
        board.say(board.rules.unknown.format("PROBE"))
        return None
    return _probe_down(board, _number(values, "PROBE_SPEED", 5.0))


def _probe_down(board: Board, speed_mm_s: float) -> Iterator[float]:
    yield from wait_for_moves(board)
    motion = board.motion
    if 2 not in motion.homed:
        board.say("!! Must home before probe")
        return
    began = motion.position[2]
    met = yield from seek_contact(board, [*motion.position[:2], motion.limits[2][0], *motion.position[3:]], speed_mm_s)
    x, y, z = motion.coordinates()[:3]
    if not met:
        board.say(f"!! {PROBING.silent}")
    elif motion.position[2] == began:
        board.say(f"!! {PROBING.early}")
    else:
        board.say(f"// probe: at {x:.3f},{y:.3f} bed will contact at z={z:.6f}")
        board.say(f"// Result: at {x:.3f},{y:.3f} estimate contact at z={z:.6f}")


def _number(values: Values, key: str, default: float = 0.0) -> float:
    number = read_number(values.get(key, ""))
    return default if number is None else number


MACROS: dict[str, Callable[[Board, Values], Work]] = {
    "MANUAL_STEPPER": _turn,
    "PROBE": _probe,
    "SET_HEATER_TEMPERATURE": _heat,
    "TEMPERATURE_WAIT": _wait,
    "TURN_OFF_HEATERS": _off,
    **{name: lambda board, values: None for name, command in COMMANDS.items() if command.shows or command.tunes},
}
