"""Macros: Klipper's commands of a name and KEY=VALUE words in a simulated printer."""

import re
from collections.abc import Callable, Iterator
from math import hypot

from machine.link.body import Body, Work, drained
from machine.link.heating import heat, heat_and_wait
from machine.link.moving import homed
from machine.placeholders import stepper

NAME = re.compile(r"[A-Za-z][A-Za-z_]{2,}[A-Za-z0-9_]*(?= |$)")
VALUE = re.compile(r"([A-Za-z_]+)=(\S*)")
Values = dict[str, str]


def command_of(name: str) -> Callable[[Body, Values], Work] | None:
    """What a macro does; None when it is not known. HOME_AB and the like are a machine's own: they home the named axes."""
    if re.fullmatch(r"HOME_[A-CU-Z]+", name):
        return lambda body, values: _home(body, name.removeprefix("HOME_"))
    return MACROS.get(name)


def _home(body: Body, letters: str) -> Iterator[float]:
    yield from homed(body, [axis for axis, letter in enumerate(body.motion.letters[:5]) if letter in letters])


def _turn(body: Body, values: Values) -> Work:
    """MANUAL_STEPPER: SYNC=0 begins a turn that goes on together with the next one."""
    machine = body.machine
    axes = {stepper(machine.tilt): machine.tilt, stepper(machine.turn): machine.turn}
    axis = axes.get(values.get("STEPPER", ""))
    if axis is None:
        body.unknown += 1
        body.say(f"!! The value '{values.get('STEPPER', '')}' is not valid for STEPPER")
        return None
    if "SET_POSITION" in values:
        body.motion.call_it({axis.letter: _number(values, "SET_POSITION")})
    if values.get("STOP_ON_ENDSTOP", "0") != "0":
        return _home(body, axis.letter)
    if "MOVE" in values:
        body.turning[axis.letter] = (_number(values, "MOVE"), max(_number(values, "SPEED", axis.speed_deg_s), 1e-3))
    return _turned(body) if body.turning and values.get("SYNC", "1") != "0" else None


def _turned(body: Body) -> Iterator[float]:
    motion = body.motion
    while not motion.planner.free(body.now_s):
        yield motion.planner.next_s()
    places = dict(zip(motion.letters, motion.coordinates(), strict=True))
    far = {letter: abs(value - places[letter]) for letter, (value, _) in body.turning.items()}
    seconds = max(far[letter] / speed for letter, (_, speed) in body.turning.items())
    words = {letter: value for letter, (value, _) in body.turning.items()}
    body.turning.clear()
    feed, relative = motion.feed, motion.relative
    motion.relative = False
    target = motion.target(words)
    if seconds > 0:
        motion.feed = hypot(*far.values()) / seconds / motion.feed_share
    motion.reach(target, body.now_s)
    motion.feed, motion.relative = feed, relative
    yield from drained(body)


def _heat(body: Body, values: Values) -> Work:
    code = {"extruder": "M104", "heater_bed": "M140"}.get(values.get("HEATER", ""))
    return heat(body, {"S": _number(values, "TARGET")}, code) if code else None


def _wait(body: Body, values: Values) -> Work:
    code, heater = ("M190", body.bed) if values.get("SENSOR") == "heater_bed" else ("M109", body.nozzle)
    return heat_and_wait(body, {"S": heater.target_c}, code)


def _off(body: Body, values: Values) -> Work:
    heat(body, {"S": 0.0}, "M104")
    return heat(body, {"S": 0.0}, "M140")


def _nothing(body: Body, values: Values) -> Work:
    return None


def _number(values: Values, key: str, default: float = 0.0) -> float:
    try:
        return float(values.get(key, default))
    except ValueError:
        return default


MACROS: dict[str, Callable[[Body, Values], Work]] = {
    "MANUAL_STEPPER": _turn,
    "SET_HEATER_TEMPERATURE": _heat,
    "TEMPERATURE_WAIT": _wait,
    "TURN_OFF_HEATERS": _off,
    "SET_VELOCITY_LIMIT": _nothing,
    "SET_PRINT_STATS_INFO": _nothing,
    "SET_DISPLAY_TEXT": _nothing,
    "EXCLUDE_OBJECT": _nothing,
    "EXCLUDE_OBJECT_DEFINE": _nothing,
    "EXCLUDE_OBJECT_START": _nothing,
    "EXCLUDE_OBJECT_END": _nothing,
}
