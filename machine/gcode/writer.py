"""Writer: formats a machine program as G-code of the firmware's dialect, deterministically."""

from collections.abc import Iterable, Iterator, Sequence
from math import ceil, isinf, isnan

import numpy as np

from machine.firmware import dialect_of
from machine.gcode import settings
from machine.gcode.arcs import FEWEST_CHORDS, fit_arcs
from machine.gcode.blocks import BEFORE_LAYER, check_blocks, fill_block, placeholders
from machine.gcode.lines import Lines, Texts
from machine.gcode.pen import PUSHING, STANDING, TRAVELLING, UNKNOWN, Paths, Pen, Z, angle, number, turn
from machine.gcode.settings import totals_comment
from machine.gcode.words import PAUSE_REMARK
from machine.planning.limits import stroke_filament_mm_s, wipe_filament_mm_s
from machine.planning.moves import TRAVEL, WIPE, BeginLayer, BeginPart, MachineProgram, Mark, Pause, Reorient, straight_moves
from mdp.mesh import Floats
from mdp.pose import level
from profiles.messages import key_name
from profiles.profile import Profile
from slicer.estimate.timing import move_times
from slicer.paths import KINDS, NUMBER, Kind
from slicer.strokes.speed import travel_mm_s2

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
    parts = [mark for mark in program.marks if isinstance(mark, BeginPart)]
    pen.values = placeholders(program.name, profile, parts, float(elapsed[-1]), filament_mm)
    for name in BLOCKS:
        _block(name, pen)
    return Lines.of_text(_text(program, parts, profile, elapsed, filament_mm, pen))


def elapsed_s(program: MachineProgram, profile: Profile) -> tuple[Floats, float]:
    """(number of moves + 1,) seconds from the first move to the beginning of each, and to the end; filament in mm.

    Includes the waits for hotter layers after turns of the table.
    """
    machine = profile.machine
    start, end, move = straight_moves(program, level(machine))
    stop = np.zeros(len(move), dtype=np.bool_)
    times = move_times(end - start, program.speed[move], stop, machine, program.acceleration_mm_s2[move])
    seconds = np.bincount(move, weights=times, minlength=len(program))
    heat_c = profile.material.first_layer_nozzle_c
    for k, (row, mark) in enumerate(program.marked()):
        if isinstance(mark, Reorient):
            seconds[row] += machine.heating_s(_coming_c(program.marks[k:], profile) - heat_c, float(seconds[row]))
        elif isinstance(mark, BeginLayer):
            heat_c = _nozzle_c(mark, profile)
    elapsed: Floats = np.concatenate([[0.0], np.cumsum(seconds)])
    return elapsed, float(end[:, 5].max(initial=0.0))


def _text(
    program: MachineProgram, parts: Sequence[BeginPart], profile: Profile, elapsed: Floats, filament_mm: float, pen: Pen
) -> Iterator[str]:
    """The text in pieces of whole lines; a kernel formats the moves between two marks, which are most of it."""
    total = float(elapsed[-1])
    part_rows = [*(row for row, mark in program.marked() if isinstance(mark, BeginPart)), len(program)]
    strokes = np.flatnonzero(program.is_stroke & (program.what != NUMBER[Kind.PURGE]))  # the purge line belongs to no part
    before = np.searchsorted(strokes, part_rows)
    last_strokes = set(strokes[before[before > 0] - 1].tolist())
    top_mm = {mark.part: mark.z_mm for mark in program.marks if isinstance(mark, BeginLayer)}
    yield _ended((*settings.head(program.name, profile), *_start(profile, parts, pen)))
    done = 0
    for k, (row, mark) in enumerate(program.marked()):
        yield from _moves(program, done, row, last_strokes, profile, pen)
        done = row + 1
        if isinstance(mark, Reorient):
            # the target of the layer after the turn if that is hotter: the nozzle warms up during the turn
            ahead = _set_nozzle(max(_coming_c(program.marks[k:], profile), pen.nozzle_c), pen)
            wait = [pen.dialect.nozzle_wait.format(number(pen.nozzle_c))] if ahead else []
            yield _ended((*ahead, *_reorient(mark, parts[pen.part] if pen.part < len(parts) else None, pen), *wait))
        elif isinstance(mark, Pause):  # the firmware's own command; a sender that pauses by itself uses the remark
            word, reason = (pen.dialect.filament_change, "filament change") if mark.change else (pen.dialect.pause, "pause")
            yield f"{word} {PAUSE_REMARK}{reason} before layer {mark.layer} of part {mark.part}\n"
        elif isinstance(mark, BeginPart):
            contents = _contents(program, row, part_rows[pen.part + 1])
            yield _ended((*_begin_part(mark, len(parts), pen), *([contents] if contents else [])))
        else:
            yield _ended((*_begin_layer(mark, profile, pen), *_progress(float(elapsed[row]), total, pen)))
            heights = {"layer_z": float(mark.z_mm), "max_layer_z": float(top_mm[mark.part])}
            yield _ended(_block(BEFORE_LAYER, pen, layer_num=pen.layers - 1, **heights))
    yield from _moves(program, done, len(program), last_strokes, profile, pen)
    yield _ended((*_end(pen), *_progress(total, total, pen), *_dialect_line(pen.dialect.last, pen)))
    yield _ended(settings.foot(profile, filament_mm, total))


def _ended(lines: Iterable[str]) -> str:
    """Lines with their ends."""
    return "".join(f"{line}\n" for line in lines)


def _block(name: str, pen: Pen, **values: object) -> list[str]:
    """The lines of one of the profile's blocks."""
    return fill_block(getattr(pen.machine.gcode, name), f"{key_name(f'machine.gcode.{name}')}", pen.values | values, pen.dialect)


def _dialect_line(word: str, pen: Pen, **values: object) -> list[str]:
    """A line of the dialect, filled in; [] if the firmware has no such command."""
    return fill_block(word, "dialect", pen.values | values, pen.dialect)


def _start(profile: Profile, parts: Sequence[BeginPart], pen: Pen) -> Iterator[str]:
    """The firmware's first lines, the start block, its modes, and the first layer's temperature unless the block sets it."""
    dialect, heat, advance = pen.dialect, profile.material.first_layer_nozzle_c, profile.material.pressure_advance
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
    if advance is not None and dialect.pressure_advance:
        yield dialect.pressure_advance.format(f"{advance:g}")
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
    pen.kind, pen.width_mm = -1, 0.0
    pen.part += 1


def _contents(program: MachineProgram, row: int, after: int) -> str:
    """The totals comment of a part, whose strokes are rows `row` to `after`."""
    begin, end = program.starts[row], program.starts[after]
    own = program.is_stroke[row:after] & (program.what[row:after] != NUMBER[Kind.PURGE])
    points = np.repeat(own, np.diff(program.starts[row : after + 1]))
    layers = np.unique(np.searchsorted(program.mark_rows, row + np.flatnonzero(own)))
    filament_mm = float(program.filament_mm[begin:end][points].sum())
    return totals_comment(program.points_mm[begin:end][points], filament_mm, len(layers))


def _begin_layer(move: BeginLayer, profile: Profile, pen: Pen) -> Iterator[str]:
    if pen.labelled != pen.part:
        pen.labelled = pen.part
        yield from _dialect_line(pen.dialect.part_begin, pen, index=pen.part - 1, number=move.part)
    yield from (";LAYER_CHANGE", f";Z:{number(move.z_mm)}", f";HEIGHT:{number(move.height_mm)}")
    pen.kind = -1
    pen.layers += 1
    if pen.dialect.layer:
        yield pen.dialect.layer.format(pen.layers)
    yield from _set_nozzle(_nozzle_c(move, profile), pen)
    pen.layer_fan = move.fan
    yield from _set_fan(move.fan, pen)


def _coming_c(marks: Sequence[Mark], profile: Profile) -> float:
    """Nozzle temperature of the first layer among marks, deg C; 0 without one."""
    return next((_nozzle_c(mark, profile) for mark in marks if isinstance(mark, BeginLayer)), 0.0)


def _nozzle_c(layer: BeginLayer, profile: Profile) -> float:
    """Nozzle temperature of a layer, deg C."""
    return min(profile.material.nozzle_c + layer.nozzle_add_c, profile.machine.nozzle_limit_c)


def _set_nozzle(wanted_c: float, pen: Pen) -> list[str]:
    if wanted_c == pen.nozzle_c:
        return []
    pen.nozzle_c = wanted_c
    return [pen.dialect.nozzle.format(number(wanted_c))]


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


def _moves(program: MachineProgram, first: int, end: int, last_strokes: set[int], profile: Profile, pen: Pen) -> Iterator[str]:
    """The text of the moves in rows first to end, which contain no mark."""
    if first == end:
        return
    points = pen.file_coordinates(program.points_mm[program.starts[first] : program.starts[end]])
    filament_mm = program.filament_mm[program.starts[first] : program.starts[end]]
    if pen.known[Z] == UNKNOWN and program.what[first] == TRAVEL:
        # plan() begins with travels; of the first only Z is written: after the start block the tip rises before it crosses
        pen.known[Z] = round(float(points[0, 2]) * 1000.0)
        yield f"{pen.dialect.travel} Z{pen.known[Z] / 1000:.3f}{pen.speed(float(program.speed[first]))}\n"
        points, filament_mm = (column[program.starts[first + 1] - program.starts[first] :] for column in (points, filament_mm))
        first += 1
    starts, what, speed = (
        program.starts[first : end + 1] - program.starts[first],
        program.what[first:end],
        program.speed[first:end],
    )
    does = np.select([what < TRAVEL, what == TRAVEL, what == WIPE], [PUSHING, TRAVELLING, PUSHING], STANDING).astype(np.int8)
    most = np.where(what == WIPE, wipe_filament_mm_s(profile.machine), stroke_filament_mm_s(profile))
    many = np.flatnonzero((what < TRAVEL) & (np.diff(starts) > FEWEST_CHORDS)).tolist() if profile.machine.arcs else []
    curved = {k for k in many if np.ptp(points[starts[k] : starts[k + 1], 2]) < 1e-9}  # strokes in one plane
    texts, done, after = list[str](), 0, ""

    def write(until: int) -> str:
        paths = Paths(points, filament_mm, starts[done : until + 1], does[done:until], speed[done:until], most[done:until])
        return pen.paths(paths, Texts.of([text.encode() for text in texts]))

    columns = (what, program.fan[first:end], program.acceleration_mm_s2[first:end], program.width_mm[first:end])
    for k, (kind, fan, acceleration, width_mm) in enumerate(zip(*(column.tolist() for column in columns), strict=True)):
        before, after = after, ""
        if kind < TRAVEL:
            before += _ended(_before_stroke(kind, fan, acceleration, width_mm, profile, pen))
            if first + k in last_strokes:
                after = _ended(_dialect_line(pen.dialect.part_end, pen, index=pen.part - 1, number=pen.values["part"]))
        elif kind == WIPE:
            before, after = before + ";WIPE_START\n", ";WIPE_END\n"
        texts.append(before)
        if k in curved:
            yield write(k)
            a, b = starts[k], starts[k + 1]
            yield from _with_arcs(points[a:b], filament_mm[a + 1 : b], float(speed[k]), profile, pen)
            texts, done = [], k + 1
    texts.append(after)
    yield write(end - first)


def _before_stroke(
    kind: int, fan: float, acceleration_mm_s2: float, width_mm: float, profile: Profile, pen: Pen
) -> Iterator[str]:
    """Lines for a change of fan, acceleration, kind or width before a stroke. fan: NaN for the layer's; acceleration: inf if the
    axes decide."""
    yield from _set_fan(pen.layer_fan if isnan(fan) else fan, pen)
    if not isinf(acceleration_mm_s2) and round(acceleration_mm_s2) != pen.acceleration and pen.dialect.acceleration:
        pen.acceleration = round(acceleration_mm_s2)
        yield pen.dialect.acceleration.format(pen.acceleration, round(travel_mm_s2(profile)))
    if kind != pen.kind:
        pen.kind = kind
        yield f";TYPE:{KINDS[kind].value}"
    if width_mm != pen.width_mm:
        pen.width_mm = width_mm
        yield f";WIDTH:{number(width_mm)}"


def _with_arcs(points_mm: Floats, filament_mm: Floats, speed_mm_s: float, profile: Profile, pen: Pen) -> Iterator[str]:
    """A stroke (n, 3) in one plane, with arcs where they fit; filament_mm: (n - 1,)."""
    flat = np.rint(points_mm[:, :2] * 1000.0) / 1000.0
    runs, arcs = fit_arcs(flat, filament_mm, profile.machine.arc_tolerance_mm - ROUNDING_MM)
    does, speed, most = np.array([PUSHING], np.int8), np.array([speed_mm_s]), np.array([stroke_filament_mm_s(profile)])

    def straight(first: int, last: int) -> str:
        points, filament = np.ascontiguousarray(points_mm[first : last + 1]), np.append(0.0, filament_mm[first:last])
        return pen.paths(Paths(points, filament, np.array([0, len(points)]), does, speed, most), Texts.of([b"", b""]))

    done = 0
    for (first, last), (x, y, clockwise) in zip(runs.tolist(), arcs.tolist(), strict=True):
        if first > done:
            yield straight(done, first)
        pushed = pen.filament(float(filament_mm[first:last].sum()))
        pen.known[:Z] = np.rint(points_mm[last, :2] * 1000.0).astype(np.int64)
        end, centre = pen.place_mm, (x - flat[first, 0], y - flat[first, 1])
        words = f" X{end[0]:.3f} Y{end[1]:.3f} I{centre[0]:.3f} J{centre[1]:.3f}{pushed}{pen.speed(speed_mm_s)}"
        yield f"{'G2' if clockwise > 0 else 'G3'}{words}\n"
        done = last
    if done < len(flat) - 1:
        yield straight(done, len(flat) - 1)


def _reorient(move: Reorient, next_part: BeginPart | None, pen: Pen) -> Iterator[str]:
    """The blocks around a turn of the table, and the turn."""
    yield ";TYPE:Custom"
    pen.kind = -1
    if pen.turned and next_part is not None:
        yield from _block("after_part", pen)
    values: dict[str, object] = {"tilt_deg": move.pose.tilt_deg, "turn_deg": move.pose.turn_deg, "z_mm": float(pen.place_mm[2])}
    if next_part is not None:
        values |= {"part": next_part.index, "part_layers": next_part.layers}
    yield from _block("before_part", pen, **values)
    pen.turned = True
    yield from turn(move.pose, move.speed_deg_s, pen)
