"""Gcode: a machine program as text, line by line; the same program gives the same bytes."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil

import numpy as np

from machine import settings
from machine.acceleration import travel_mm_s2
from machine.arcs import FEWEST_CHORDS, fitted
from machine.blocks import filled
from machine.dialects import DIALECTS, Dialect
from machine.dryrun.timeline import move_times
from machine.moves import BeginLayer, BeginPart, MachineProgram, Reorient, Retract, Stroke, Travel, Wipe
from machine.rows import rows
from mdp.mesh import Floats
from mdp.pose import Pose, level
from profiles.profile import Profile
from slicer.paths import Kind

UNKNOWN = -(10**12)
ROUNDING_MM = 0.0015  # an arc's centre is written in thousandths


@dataclass
class Pen:
    """What the firmware knows after the lines written so far: positions in thousandths, filament in 1e-5 mm, words."""

    dialect: Dialect
    x: int = UNKNOWN
    y: int = UNKNOWN
    z: int = UNKNOWN
    feed: int = 0
    pushed: int = 0
    filament_mm: float = 0.0
    most_filament_mm: float = 0.0
    kind: Kind | None = None
    width_mm: float = 0.0
    height_mm: float = 0.0
    fan: int = 0
    layer_fan: float = 0.0
    acceleration: int | None = None
    nozzle_c: float = 0.0
    percent: int = -1
    rotary: Pose | None = None
    values: dict[str, object] = field(default_factory=dict)


def write_gcode(program: MachineProgram, profile: Profile) -> Iterator[str]:
    """The lines of a G-code file, without line ends.

    Raises ProfileError, before the first line, for a block of the profile that cannot be filled in.
    """
    pen = Pen(DIALECTS[profile.machine.dialect])
    parts = [move for move in program.moves if isinstance(move, BeginPart)]
    pen.values = _placeholders(profile, parts)
    blocks = profile.machine.gcode
    for name in ("start", "before_part", "after_part", "end"):
        filled(getattr(blocks, name), name, pen.values, pen.dialect.longest_line)
    return _lines(program, profile, parts, pen)


def _lines(program: MachineProgram, profile: Profile, parts: list[BeginPart], pen: Pen) -> Iterator[str]:
    elapsed = clock(program, profile)
    total = float(elapsed[-1]) if len(elapsed) else 0.0
    coming = iter(parts)
    following = next(coming, None)
    yield from settings.head(program.name, profile)
    yield ";TYPE:Custom"
    yield from _start(profile, pen)
    for place, move in enumerate(program.moves):
        if isinstance(move, Stroke):
            yield from _stroke(move, profile, pen)
        elif isinstance(move, Travel):
            yield from _travel(move, pen)
        elif isinstance(move, Wipe):
            yield from _wipe(move, pen)
        elif isinstance(move, Retract):
            yield from _retract(move, pen)
        elif isinstance(move, Reorient):
            yield from _reorient(move, following, profile, pen)
        elif isinstance(move, BeginPart):
            following = next(coming, None)
            yield from _begin_part(move, len(parts), pen)
        else:
            yield from _begin_layer(move, profile, pen)
            yield from _progress(float(elapsed[place]), total, pen)
    yield from _end(profile, pen)
    yield from _progress(total, total, pen)
    yield from settings.foot(profile, pen.most_filament_mm, total)


def clock(program: MachineProgram, profile: Profile) -> Floats:
    """(number of moves + 1,) seconds from the first move to the beginning of each, and to the end."""
    machine = profile.machine
    straight = rows(program, machine.tilt.zero_deg, machine.turn.zero_deg)
    stop = np.zeros(len(straight.speed), dtype=np.bool_)
    times = move_times(straight.end - straight.start, straight.speed, stop, machine, straight.acceleration)
    each = np.bincount(straight.move, weights=times, minlength=len(program.moves))
    elapsed: Floats = np.concatenate([[0.0], np.cumsum(each)])
    return elapsed


def _placeholders(profile: Profile, parts: list[BeginPart]) -> dict[str, object]:
    """What the blocks may name; the part's values change from part to part."""
    machine, material = profile.machine, profile.material
    home = level(machine)
    return {
        "tilt": machine.tilt.letter,
        "turn": machine.turn.letter,
        "nozzle_c": material.nozzle_c,
        "first_layer_nozzle_c": material.first_layer_nozzle_c,
        "bed_c": material.bed_c,
        "parts": len(parts),
        "part": parts[0].index if parts else 0,
        "tilt_deg": parts[0].pose.tilt_deg if parts else home.tilt_deg,
        "turn_deg": parts[0].pose.turn_deg if parts else home.turn_deg,
        "z_mm": 0.0,
        "material": material.name,
        "machine": machine.name,
    }


def _start(profile: Profile, pen: Pen) -> Iterator[str]:
    """The start block, then the first layer's temperature where the block has not waited for it."""
    lines = filled(profile.machine.gcode.start, "start", pen.values, pen.dialect.longest_line)
    yield from lines
    pen.nozzle_c = profile.material.first_layer_nozzle_c
    hot = pen.dialect.nozzle_wait.format(_number(profile.material.first_layer_nozzle_c))
    if hot not in lines:
        yield hot


def _end(profile: Profile, pen: Pen) -> Iterator[str]:
    yield ";TYPE:Custom"
    yield from filled(profile.machine.gcode.after_part, "after_part", pen.values, pen.dialect.longest_line)
    yield from filled(profile.machine.gcode.end, "end", pen.values, pen.dialect.longest_line)


def _begin_part(move: BeginPart, parts: int, pen: Pen) -> Iterator[str]:
    values = pen.values
    yield f";PART:{move.index} of {parts}"
    yield f";POSE:{values['tilt']}{_angle(move.pose.tilt_deg)} {values['turn']}{_angle(move.pose.turn_deg)}"
    if move.unsupported_mm2 > 0:
        yield f";UNSUPPORTED:{move.unsupported_mm2:.2f}"
    values |= {"part": move.index, "tilt_deg": move.pose.tilt_deg, "turn_deg": move.pose.turn_deg}
    pen.kind, pen.width_mm, pen.height_mm = None, 0.0, 0.0


def _begin_layer(move: BeginLayer, profile: Profile, pen: Pen) -> Iterator[str]:
    yield ";LAYER_CHANGE"
    yield f";Z:{_number(move.z_mm)}"
    yield f";HEIGHT:{_number(move.height_mm)}"
    pen.kind = None
    material = profile.material
    heated = min(material.nozzle_c + move.nozzle_add_c, profile.machine.nozzle_limit_c)
    wanted = material.first_layer_nozzle_c if move.part == 1 and move.index == 1 else heated
    if wanted != pen.nozzle_c:
        pen.nozzle_c = wanted
        yield pen.dialect.nozzle.format(_number(wanted))
    pen.layer_fan = move.fan
    yield from _blow(move.fan, pen)


def _blow(share: float, pen: Pen) -> Iterator[str]:
    fan = round(255 * share)
    if fan != pen.fan:
        pen.fan = fan
        yield pen.dialect.fan_on.format(fan) if fan else pen.dialect.fan_off


def _progress(seconds: float, total: float, pen: Pen) -> Iterator[str]:
    percent = int(100.0 * seconds / total + 1e-9) if total > 0 else 100
    if percent != pen.percent:
        pen.percent = percent
        yield pen.dialect.progress.format(percent, ceil((total - seconds) / 60.0 - 1e-9))


def _stroke(move: Stroke, profile: Profile, pen: Pen) -> Iterator[str]:
    """What changes before the stroke, then its lines."""
    yield from _blow(pen.layer_fan if move.fan is None else move.fan, pen)
    if move.acceleration_mm_s2 is not None and round(move.acceleration_mm_s2) != pen.acceleration:
        pen.acceleration = round(move.acceleration_mm_s2)
        yield pen.dialect.acceleration.format(pen.acceleration, round(travel_mm_s2(profile) or pen.acceleration))
    if move.kind is not pen.kind:
        pen.kind = move.kind
        yield f";TYPE:{move.kind.value}"
    if move.width_mm != pen.width_mm:
        pen.width_mm = move.width_mm
        yield f";WIDTH:{_number(move.width_mm)}"
    machine = profile.machine
    if machine.arcs and len(move.points_mm) > FEWEST_CHORDS and np.ptp(move.points_mm[:, 2]) == 0.0:
        yield from _curved(move, machine.arc_tolerance_mm, pen)
    else:
        yield from _pushed(move.points_mm, move.filament_mm, move.speed_mm_s, pen)


def _curved(move: Stroke, tolerance_mm: float, pen: Pen) -> Iterator[str]:
    """A stroke in one plane with arcs where they keep to it."""
    flat = np.rint(move.points_mm[:, :2] * 1000.0) / 1000.0
    runs, arcs = fitted(flat, move.filament_mm, tolerance_mm - ROUNDING_MM)
    done = 0
    for (first, last), (x, y, clockwise) in zip(runs.tolist(), arcs.tolist(), strict=True):
        if first > done:
            yield from _pushed(move.points_mm[done : first + 1], move.filament_mm[done:first], move.speed_mm_s, pen)
        yield from _arc(move, first, last, (x - flat[first, 0], y - flat[first, 1]), clockwise > 0, pen)
        done = last
    if done < len(flat) - 1:
        yield from _pushed(move.points_mm[done:], move.filament_mm[done:], move.speed_mm_s, pen)


def _arc(move: Stroke, first: int, last: int, centre: tuple[float, float], clockwise: bool, pen: Pen) -> Iterator[str]:
    pen.filament_mm += float(move.filament_mm[first:last].sum())
    pen.most_filament_mm = max(pen.most_filament_mm, pen.filament_mm)
    e = round(pen.filament_mm * 1e5)
    pen.x, pen.y = (round(float(value) * 1000.0) for value in move.points_mm[last, :2])
    word = pen.dialect.arc_right if clockwise else pen.dialect.arc_left
    place = f" X{pen.x / 1000:.3f} Y{pen.y / 1000:.3f} I{centre[0]:.3f} J{centre[1]:.3f}"
    yield f"{word}{place} E{(e - pen.pushed) / 1e5:.5f}{_feed(move.speed_mm_s, pen)}"
    pen.pushed = e


def _wipe(move: Wipe, pen: Pen) -> Iterator[str]:
    yield ";WIPE_START"
    yield from _pushed(move.points_mm, -move.filament_mm, move.speed_mm_s, pen)
    yield ";WIPE_END"


def _pushed(points_mm: Floats, filament_mm: Floats, speed_mm_s: float, pen: Pen) -> Iterator[str]:
    """One line a point; a point that rounds to where the tip is gives its filament to the next line."""
    points = np.rint(points_mm[1:] * 1000.0).astype(np.int64).tolist()
    filament = pen.filament_mm + np.cumsum(filament_mm)
    pen.filament_mm = float(filament[-1])
    pen.most_filament_mm = max(pen.most_filament_mm, pen.filament_mm)
    word = pen.dialect.stroke
    for (x, y, z), e in zip(points, np.rint(filament * 1e5).astype(np.int64).tolist(), strict=True):
        if x == pen.x and y == pen.y and z == pen.z:
            continue
        place = _place(x, y, z, pen)
        yield f"{word}{place} E{(e - pen.pushed) / 1e5:.5f}{_feed(speed_mm_s, pen)}"
        pen.pushed = e


def _place(x: int, y: int, z: int, pen: Pen) -> str:
    """The words of the coordinates that change."""
    text = ""
    if x != pen.x:
        text = f" X{x / 1000:.3f}"
        pen.x = x
    if y != pen.y:
        text += f" Y{y / 1000:.3f}"
        pen.y = y
    if z != pen.z:
        text += f" Z{z / 1000:.3f}"
        pen.z = z
    return text


def _feed(speed: float, pen: Pen) -> str:
    feed = max(1, round(60.0 * speed))
    if feed == pen.feed:
        return ""
    pen.feed = feed
    return f" F{feed}"


def _travel(move: Travel, pen: Pen) -> Iterator[str]:
    """One line a point; of the first travel after the start block only Z, so that the tip rises before it crosses."""
    points = np.rint(move.points_mm * 1000.0).astype(np.int64).tolist()
    if pen.z == UNKNOWN:
        pen.z = points[0][2]
        yield f"{pen.dialect.travel} Z{pen.z / 1000:.3f}{_feed(move.speed_mm_s, pen)}"
        return
    for x, y, z in points[1:]:
        place = _place(x, y, z, pen)
        if place:
            yield f"{pen.dialect.travel}{place}{_feed(move.speed_mm_s, pen)}"


def _retract(move: Retract, pen: Pen) -> Iterator[str]:
    pen.filament_mm -= move.filament_mm
    pen.most_filament_mm = max(pen.most_filament_mm, pen.filament_mm)
    e = round(pen.filament_mm * 1e5)
    yield f"{pen.dialect.stroke} E{(e - pen.pushed) / 1e5:.5f}{_feed(move.speed_mm_s, pen)}"
    pen.pushed = e


def _reorient(move: Reorient, following: BeginPart | None, profile: Profile, pen: Pen) -> Iterator[str]:
    """The blocks around a turn of the table, and the turn: both rotary words, F in deg/min."""
    blocks, longest = profile.machine.gcode, pen.dialect.longest_line
    yield ";TYPE:Custom"
    pen.kind = None
    if pen.rotary is not None and following is not None:
        yield from filled(blocks.after_part, "after_part", pen.values, longest)
    values = pen.values | {"tilt_deg": move.pose.tilt_deg, "turn_deg": move.pose.turn_deg, "z_mm": pen.z / 1000}
    if following is not None:
        values["part"] = following.index
    yield from filled(blocks.before_part, "before_part", values, longest)
    pen.rotary, pen.feed = move.pose, 0
    words = f"{values['tilt']}{_angle(move.pose.tilt_deg)} {values['turn']}{_angle(move.pose.turn_deg)}"
    yield f"{pen.dialect.travel} {words}{_feed(move.speed_deg_s, pen)}"


def _angle(degrees: float) -> str:
    return f"{round(degrees * 1e4) / 1e4:.4f}"


def _number(value: float) -> str:
    return f"{value:.5f}".rstrip("0").rstrip(".")
