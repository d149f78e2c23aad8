"""Gcode: a machine program as text in the firmware's dialect; the same program gives the same bytes."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice
from math import ceil

import numpy as np

from machine.firmware import dialect_of
from machine.gcode import settings
from machine.gcode.arcs import FEWEST_CHORDS, fit_arcs
from machine.gcode.blocks import check_blocks
from machine.gcode.lines import Lines
from machine.gcode.part_totals import totals_comment
from machine.gcode.pen import UNKNOWN, Pen, angle, number, thousandths, write_path
from machine.gcode.placeholders import fill_block, placeholders
from machine.gcode.turning import turn
from machine.gcode.words import PAUSE_REMARK
from machine.planning.moves import BeginLayer, BeginPart, MachineProgram, Pause, Reorient, Retract, Stroke, Travel, Wipe, rows
from machine.planning.timing import move_times
from mdp.mesh import Floats
from mdp.pose import level
from profiles.profile import Profile
from slicer.paths import Kind
from slicer.speed import travel_mm_s2

ROUNDING_MM = 0.0015  # an arc's centre is written in thousandths
BLOCKS = ("start", "before_part", "after_part", "end")


def write_gcode(program: MachineProgram, profile: Profile) -> Lines:
    """The lines of a G-code file in the dialect of profile.machine.

    Raises ProfileError for a block of the profile that cannot be filled in or that the firmware refuses.
    """
    check_blocks(profile)
    machine = profile.machine
    dialect = dialect_of(machine)
    letter = next(word for word in dialect.filament if word not in (machine.tilt.letter, machine.turn.letter))
    pen = Pen(dialect, machine, letter, level(machine))
    elapsed, filament_mm = elapsed_s(program, profile)
    pen.values = placeholders(program.name, profile, _parts(program), float(elapsed[-1]), filament_mm)
    for name in BLOCKS:
        _block(name, pen)
    return Lines.of_text(_text(program, profile, elapsed, filament_mm, pen))


def elapsed_s(program: MachineProgram, profile: Profile) -> tuple[Floats, float]:
    """(number of moves + 1,) seconds from the first move to the beginning of each, and to the end; filament in mm.

    Counted with the waits for hotter layers after turns of the table.
    """
    machine = profile.machine
    straight = rows(program, machine.tilt.zero_deg, machine.turn.zero_deg)
    stop = np.zeros(len(straight.speed), dtype=np.bool_)
    times = move_times(straight.end - straight.start, straight.speed, stop, machine, straight.acceleration)
    seconds = np.bincount(straight.move, weights=times, minlength=len(program.moves))
    heat_c = profile.material.first_layer_nozzle_c
    for index, move in enumerate(program.moves):
        if isinstance(move, Reorient):
            seconds[index] += machine.heating_s(_coming_c(program, index, profile) - heat_c, float(seconds[index]))
        elif isinstance(move, BeginLayer):
            heat_c = _nozzle_c(move, profile)
    elapsed: Floats = np.concatenate([[0.0], np.cumsum(seconds)])
    return elapsed, float(straight.end[:, 5].max(initial=0.0))


def _text(program: MachineProgram, profile: Profile, elapsed: Floats, filament_mm: float, pen: Pen) -> Iterator[str]:
    """The text in pieces, each of whole lines: strokes, which are most of it, as a kernel writes them."""
    total, parts = float(elapsed[-1]), _parts(program)
    coming = iter(parts)
    next_part = next(coming, None)
    last_strokes = _last_strokes(program)
    yield from _ended(settings.head(program.name, profile))
    yield from _ended(_start(profile, parts, pen))
    for index, move in enumerate(program.moves):
        if isinstance(move, Stroke):
            yield from _ended(_before_stroke(move, profile, pen))
            yield _stroke(move, profile, pen)
            if index in last_strokes:
                yield from _ended(_dialect_line(pen.dialect.part_end, pen, index=pen.part - 1, number=pen.values["part"]))
        elif isinstance(move, Travel):
            yield from _ended(_travel(move, pen))
        elif isinstance(move, Wipe):
            text = write_path(pen.file_coordinates(move.points_mm), -move.filament_mm, move.speed_mm_s, pen)
            yield f";WIPE_START\n{text};WIPE_END\n"
        elif isinstance(move, Retract):
            pen.filament_mm -= move.filament_mm
            yield f"G1{pen.filament()}{pen.speed(move.speed_mm_s)}\n"
        elif isinstance(move, Reorient):
            ahead = list(_heat_ahead(program, index, profile, pen))
            yield from _ended((*ahead, *_reorient(move, next_part, pen)))
            if ahead:
                yield f"{pen.dialect.nozzle_wait.format(number(pen.nozzle_c))}\n"
        elif isinstance(move, Pause):
            yield from _ended(_pause(move, pen))
        elif isinstance(move, BeginPart):
            next_part = next(coming, None)
            yield from _ended((*_begin_part(move, len(parts), pen), *_contents(program, index)))
        else:
            yield from _ended((*_begin_layer(move, profile, pen), *_progress(float(elapsed[index]), total, pen)))
    yield from _ended((*_end(pen), *_progress(total, total, pen), *_dialect_line(pen.dialect.last, pen)))
    yield from _ended(settings.foot(profile, filament_mm, total))


def _ended(lines: Iterable[str]) -> Iterator[str]:
    """Lines with their ends."""
    return (f"{line}\n" for line in lines)


def _parts(program: MachineProgram) -> list[BeginPart]:
    return [move for move in program.moves if isinstance(move, BeginPart)]


def _last_strokes(program: MachineProgram) -> set[int]:
    """Places of the last stroke of each part."""
    strokes, latest = set(), -1
    for index, move in enumerate(program.moves):
        if isinstance(move, Stroke) and move.kind is not Kind.PURGE:
            latest = index
        elif isinstance(move, BeginPart) and latest >= 0:
            strokes.add(latest)
    return strokes | {latest}


def _block(name: str, pen: Pen, **values: object) -> list[str]:
    """The lines of one of the profile's blocks."""
    return fill_block(getattr(pen.machine.gcode, name), f"machine.gcode.{name}", pen.values | values, pen.dialect)


def _dialect_line(word: str, pen: Pen, **values: object) -> list[str]:
    """A line of the dialect with its placeholders filled; nothing where the firmware has no such word."""
    return fill_block(word, "dialect", pen.values | values, pen.dialect)


def _start(profile: Profile, parts: list[BeginPart], pen: Pen) -> Iterator[str]:
    """What the firmware wants to know first, the start block, its modes, and the first layer's heat if that has not come yet."""
    dialect, heat = pen.dialect, profile.material.first_layer_nozzle_c
    yield ";TYPE:Custom"
    for word in (*dialect.before_start, dialect.parts):
        yield from _dialect_line(word, pen)
    for index, part in enumerate(parts):
        yield from _dialect_line(dialect.part, pen, index=index, number=part.index)
    lines = _block("start", pen)
    yield from lines
    pen.nozzle_c = heat
    hot = dialect.nozzle_wait.format(number(heat))
    if hot not in lines:
        yield hot
    yield from dialect.modes
    if profile.material.pressure_advance is not None and dialect.pressure_advance:
        yield dialect.pressure_advance.format(f"{profile.material.pressure_advance:g}")
    for word in dialect.after_start:
        yield from _dialect_line(word, pen)
    if pen.machine.coordinates == "workpiece":
        yield dialect.follow_on
    yield f"G92 {pen.filament_letter}0"


def _end(pen: Pen) -> Iterator[str]:
    yield ";TYPE:Custom"
    if pen.machine.coordinates == "workpiece":
        yield pen.dialect.follow_off
    yield from _block("after_part", pen)
    for word in pen.dialect.before_end:
        yield from _dialect_line(word, pen)
    yield from _block("end", pen)


def _begin_part(move: BeginPart, parts: int, pen: Pen) -> Iterator[str]:
    machine = pen.machine
    yield f";PART:{move.index} of {parts}"
    yield f";POSE:{machine.tilt.letter}{angle(move.pose.tilt_deg)} {machine.turn.letter}{angle(move.pose.turn_deg)}"
    for area in move.unsupported:
        yield f";UNSUPPORTED:{area.mm2:.2f}@{area.layer} {area.reason}"
    pen.values |= {"part": move.index, "tilt_deg": move.pose.tilt_deg, "turn_deg": move.pose.turn_deg, "part_layers": move.layers}
    pen.kind, pen.width_mm = None, 0.0
    pen.part += 1


def _contents(program: MachineProgram, index: int) -> Iterator[str]:
    """What the strokes of the part that begins with the move at `index` come to."""
    strokes: list[Stroke] = []
    layers: set[int] = set()
    layer = 0
    for move in program.moves[index + 1 :]:
        if isinstance(move, BeginPart):
            break
        if isinstance(move, BeginLayer):
            layer = move.index
        elif isinstance(move, Stroke):
            strokes.append(move)
            layers.add(layer)
    comment = totals_comment(strokes, len(layers))
    if comment:
        yield comment


def _begin_layer(move: BeginLayer, profile: Profile, pen: Pen) -> Iterator[str]:
    if pen.labelled != pen.part:
        pen.labelled = pen.part
        yield from _dialect_line(pen.dialect.part_begin, pen, index=pen.part - 1, number=move.part)
    yield ";LAYER_CHANGE"
    yield f";Z:{number(move.z_mm)}"
    yield f";HEIGHT:{number(move.height_mm)}"
    pen.kind = None
    pen.layers += 1
    if pen.dialect.layer:
        yield pen.dialect.layer.format(pen.layers)
    yield from _set_nozzle(_nozzle_c(move, profile), pen)
    pen.layer_fan = move.fan
    yield from _set_fan(move.fan, pen)


def _heat_ahead(program: MachineProgram, index: int, profile: Profile, pen: Pen) -> Iterator[str]:
    """Before the turn at `index`, the heat of the layer after it where that is to be hotter: some of it comes in the meantime."""
    wanted = _coming_c(program, index, profile)
    if wanted > pen.nozzle_c:
        yield from _set_nozzle(wanted, pen)


def _coming_c(program: MachineProgram, index: int, profile: Profile) -> float:
    """How hot the next layer after a move is printed; 0 where none is."""
    coming = next((move for move in islice(program.moves, index, None) if isinstance(move, BeginLayer)), None)
    return 0.0 if coming is None else _nozzle_c(coming, profile)


def _nozzle_c(layer: BeginLayer, profile: Profile) -> float:
    """How hot a layer is printed."""
    material = profile.material
    if layer.part == 1 and layer.index == 1:
        return material.first_layer_nozzle_c
    return min(material.nozzle_c + layer.nozzle_add_c, profile.machine.nozzle_limit_c)


def _set_nozzle(wanted_c: float, pen: Pen) -> Iterator[str]:
    if wanted_c != pen.nozzle_c:
        pen.nozzle_c = wanted_c
        yield pen.dialect.nozzle.format(number(wanted_c))


def _pause(move: Pause, pen: Pen) -> Iterator[str]:
    """The firmware's own word; a sender that pauses by itself goes by the remark."""
    word = pen.dialect.filament_change if move.change else pen.dialect.pause
    reason = "filament change" if move.change else "pause"
    yield f"{word} {PAUSE_REMARK}{reason} before layer {move.layer} of part {move.part}"


def _set_fan(share: float, pen: Pen) -> Iterator[str]:
    fan = round(255 * share)
    if fan != pen.fan:
        pen.fan = fan
        level = fan if pen.dialect.fan_full == 255 else round(pen.dialect.fan_full * fan / 255, 3)
        yield pen.dialect.fan_on.format(number(level)) if fan else pen.dialect.fan_off


def _progress(seconds: float, total: float, pen: Pen) -> Iterator[str]:
    percent = int(100.0 * seconds / total + 1e-9) if total > 0 else 100
    if percent != pen.percent and pen.dialect.progress:
        pen.percent = percent
        yield pen.dialect.progress.format(percent, ceil((total - seconds) / 60.0 - 1e-9))


def _before_stroke(move: Stroke, profile: Profile, pen: Pen) -> Iterator[str]:
    """The lines of what changes before a stroke."""
    yield from _set_fan(pen.layer_fan if move.fan is None else move.fan, pen)
    acceleration = move.acceleration_mm_s2
    if acceleration is not None and round(acceleration) != pen.acceleration and pen.dialect.acceleration:
        pen.acceleration = round(acceleration)
        yield pen.dialect.acceleration.format(pen.acceleration, round(travel_mm_s2(profile) or pen.acceleration))
    if move.kind is not pen.kind:
        pen.kind = move.kind
        yield f";TYPE:{move.kind.value}"
    if move.width_mm != pen.width_mm:
        pen.width_mm = move.width_mm
        yield f";WIDTH:{number(move.width_mm)}"


def _stroke(move: Stroke, profile: Profile, pen: Pen) -> str:
    """The text of a stroke."""
    machine, points = profile.machine, pen.file_coordinates(move.points_mm)
    if machine.arcs and len(points) > FEWEST_CHORDS and np.ptp(points[:, 2]) < 1e-9:
        return "".join(_with_arcs(replace(move, points_mm=points), machine.arc_tolerance_mm, pen))
    return write_path(points, move.filament_mm, move.speed_mm_s, pen)


def _with_arcs(move: Stroke, tolerance_mm: float, pen: Pen) -> Iterator[str]:
    """A stroke in one plane with arcs where they keep to it."""
    flat = np.rint(move.points_mm[:, :2] * 1000.0) / 1000.0
    runs, arcs = fit_arcs(flat, move.filament_mm, tolerance_mm - ROUNDING_MM)
    done = 0
    for (first, last), (x, y, clockwise) in zip(runs.tolist(), arcs.tolist(), strict=True):
        if first > done:
            yield write_path(move.points_mm[done : first + 1], move.filament_mm[done:first], move.speed_mm_s, pen)
        word = "G2" if clockwise > 0 else "G3"
        yield f"{word}{_arc(move, (first, last), (x - flat[first, 0], y - flat[first, 1]), pen)}\n"
        done = last
    if done < len(flat) - 1:
        yield write_path(move.points_mm[done:], move.filament_mm[done:], move.speed_mm_s, pen)


def _arc(move: Stroke, run: tuple[int, int], centre: tuple[float, float], pen: Pen) -> str:
    """The words of an arc. run: its first and last point; centre: seen from its beginning."""
    first, last = run
    pen.filament_mm += float(move.filament_mm[first:last].sum())
    ((pen.x, pen.y),) = thousandths(move.points_mm[last : last + 1, :2])
    words = f" X{pen.x / 1000:.3f} Y{pen.y / 1000:.3f} I{centre[0]:.3f} J{centre[1]:.3f}"
    return f"{words}{pen.filament()}{pen.speed(move.speed_mm_s)}"


def _travel(move: Travel, pen: Pen) -> Iterator[str]:
    """One line a point; of the first travel after the start block only Z, so that the tip rises before it crosses."""
    points = thousandths(pen.file_coordinates(move.points_mm))
    if pen.z == UNKNOWN:
        pen.z = points[0][2]
        yield f"{pen.dialect.travel} Z{pen.z / 1000:.3f}{pen.speed(move.speed_mm_s)}"
        return
    for x, y, z in points[1:]:
        words = pen.coordinates(x, y, z)
        if words:
            yield f"{pen.dialect.travel}{words}{pen.speed(move.speed_mm_s)}"


def _reorient(move: Reorient, next_part: BeginPart | None, pen: Pen) -> Iterator[str]:
    """The blocks around a turn of the table, and the turn."""
    yield ";TYPE:Custom"
    pen.kind = None
    if pen.turned and next_part is not None:
        yield from _block("after_part", pen)
    values: dict[str, object] = {"tilt_deg": move.pose.tilt_deg, "turn_deg": move.pose.turn_deg, "z_mm": pen.z / 1000}
    if next_part is not None:
        values |= {"part": next_part.index, "part_layers": next_part.layers}
    yield from _block("before_part", pen, **values)
    pen.turned = True
    yield from turn(move.pose, move.speed_deg_s, pen)
