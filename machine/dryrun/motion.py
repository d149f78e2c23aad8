"""Motion: findings about axes: limits, speeds, homing, and turning during extrusion or when the firmware starts to follow."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, at_event, at_row, per_part, unless_own
from machine.firmware import dialect_of
from machine.gcode.commands import EVERY
from machine.gcode.reader.parsed import AT_ONCE, MoveKind, ParsedProgram, pieces
from machine.planning.limits import ROUNDING, axis_limits
from mdp.mesh import Floats
from profiles.machine import Machine
from slicer.estimate.timing import axis_speeds, lengths, move_times

STANDSTILLS = frozenset(name for name, command in EVERY.items() if command.waits or command.homes)
SLACK = 1.001
ROUNDING_MM_S = 1.0 / 60.0  # F is written as a whole number
STILL = 3  # measure of a row without motion
WRITTEN = np.array([1e-3, 1e-3, 1e-3, 1e-4, 1e-4, 1e-5])  # possible error of a step from the rounding of its ends
LEVEL_DEG = 0.01
TURNED_DEG = 1e-3


def findings(program: ParsedProgram, machine: Machine) -> list[Finding]:
    """All findings about the axes."""
    return [
        *_outside(program, machine),
        *_too_fast(program, machine),
        *_homing(program, machine),
        *(_moves_before_homing(program) if not dialect_of(machine).homed_before else ()),
        *_turning_strokes(program, machine),
        *_following_switches(program, machine),
    ]


def _outside(program: ParsedProgram, machine: Machine) -> Iterator[Finding]:
    for axis, (letter, (least, most)) in enumerate(axis_limits(machine).items()):
        if least - ROUNDING <= program.bounds[0, axis] and program.bounds[1, axis] <= most + ROUNDING:
            continue
        values = program.end[:, axis]
        unit = "mm" if axis < 3 else "deg"
        allowed = f"allowed is {least:g} to {most:g} {unit} (moves: {{count}})"
        above, below = np.flatnonzero(values > most + ROUNDING), np.flatnonzero(values < least - ROUNDING)
        yield from per_part(program, above, values[above], f"{letter} goes to {{value}} {unit}, {allowed}", code="axis-limit")
        yield from per_part(program, below, -values[below], f"{letter} goes to -{{value}} {unit}, {allowed}", code="axis-limit")


def times_s(program: ParsedProgram, machine: Machine) -> Floats:
    """(n,) seconds of each row, computed in pieces that end at standstills and thus are independent."""
    stop, seconds, begin = standstills(program), np.empty(len(program.line)), 0
    while begin < len(seconds):
        some = _until_standstill(program, begin)
        accelerations = program.remarks.acceleration[program.remark[some]]
        seconds[some] = move_times(program.changes(some), program.feed[some] / 60.0, stop[some], machine, accelerations)
        begin = some.stop
    return seconds


def _until_standstill(program: ParsedProgram, begin: int) -> slice:
    """Rows from `begin`, about AT_ONCE, up to the end of a run of moves that F measures alike; such runs end at a standstill."""
    count, last = AT_ONCE, len(program.line)
    while begin + count < last:
        _, measure = lengths(program.changes(slice(begin, begin + count)))
        moving = np.flatnonzero(measure < STILL)
        ends = moving[1:][np.diff(measure[moving]) != 0]
        if len(ends):
            return slice(begin, begin + int(ends[-1]))
        count *= 2
    return slice(begin, last)


def standstills(program: ParsedProgram) -> NDArray[np.bool_]:
    """(n,) mask of rows before which the machine always stops."""
    stop = np.zeros(len(program.line), dtype=np.bool_)
    stop[[event.row for event in program.events if event.code in STANDSTILLS and event.row < len(stop)]] = True
    return stop


def _too_fast(program: ParsedProgram, machine: Machine) -> Iterator[Finding]:
    """In every part the axes whose programmed speed is beyond their limit: the firmware slows such moves down."""
    most = axis_speeds(machine)
    allowed, fast, asked = most * SLACK + ROUNDING_MM_S, [np.zeros(0, np.int64)], [np.zeros((0, 6))]
    for some in pieces(len(program.line)):
        change = program.changes(some)
        way = np.maximum(lengths(change)[0], 1e-9)
        speeds = np.maximum(np.abs(change) - WRITTEN, 0.0) / way[:, None] * (program.feed[some] / 60.0)[:, None]
        over = (speeds > allowed).any(axis=1)
        fast.append(some.start + np.flatnonzero(over))
        asked.append(speeds[over])
    rows, speeds = np.concatenate(fast), np.concatenate(asked)
    for axis, letter in enumerate([*axis_limits(machine), "E"]):
        unit = "deg/s" if axis in (3, 4) else "mm/s"
        message = f"{letter} is programmed at {{value}} {unit}: the firmware slows it to {most[axis]:g} {unit} (moves: {{count}})"
        too_fast = speeds[:, axis] > allowed[axis]
        yield from per_part(program, rows[too_fast], speeds[too_fast, axis], message, code="axis-speed", severity="warning")


def _homing(program: ParsedProgram, machine: Machine) -> Iterator[Finding]:
    for event in program.events:
        if event.code != "G28" or event.row == 0:
            continue
        tilt = float(program.end[event.row - 1, 3])
        later = [e for e in program.events if e.code == "G92" and machine.tilt.letter in e.letters and e.row == event.row]
        if abs(tilt - machine.tilt.zero_deg) > LEVEL_DEG and not any(e.line < event.line for e in later):
            message = f"homing while the table stands at {machine.tilt.letter}{tilt:.3f}: it must be level"
            yield at_event(program, event, "error", "homing-tilted", message)
        printed = program.kind[: event.row] == MoveKind.EXTRUDE
        if printed.any() and (not set(event.letters) & set("XYZ") or "Z" in event.letters):
            message = "Z is homed after plastic was laid: the tip may run into the print unless the machine homes upwards"
            yield at_event(program, event, "warning", "homing-over-print", message)


def _moves_before_homing(program: ParsedProgram) -> list[Finding]:
    """The first move of a linear axis that has been neither homed nor given a position."""
    events = sorted((e for e in program.events if e.code in ("G28", "G92")), key=lambda e: e.row)
    for axis, letter in enumerate("XYZ"):
        moved = np.abs(program.end[:, axis] - program.start[:, axis]) > 1e-9
        first = int(moved.argmax()) if moved.any() else len(moved)
        homed = [
            e for e in events if e.row <= first and (letter in e.letters or (e.code == "G28" and not set(e.letters) & set("XYZ")))
        ]
        if first < len(moved) and not homed:
            severity, unless = unless_own(program, 0, first)
            return [at_row(program, first, severity, "not-homed", f"{letter} moves before it is homed{unless}")]
    return []


def _turning_strokes(program: ParsedProgram, machine: Machine) -> Iterable[Finding]:
    rows = np.flatnonzero((program.kind == MoveKind.ROTATE) & (program.e_mm > 1e-9))
    letters = f"{machine.tilt.letter} or {machine.turn.letter}"
    message = f"{letters} turns while {{value}} mm of filament are extruded (moves: {{count}})"
    return per_part(program, rows, program.e_mm[rows], message, code="turning-stroke")


def _following_switches(program: ParsedProgram, machine: Machine) -> Iterator[Finding]:
    """Errors for switching that keeps the coordinates in a pose other than A0 C0, where it changes the position."""
    dialect = dialect_of(machine)
    if not dialect.follow_keeps_coordinates:
        return
    level = np.array([machine.tilt.zero_deg, machine.turn.zero_deg])
    for event in program.events:
        if event.code not in (dialect.follow_on, dialect.follow_off) or event.row == 0:
            continue
        stands = program.end[event.row - 1, 3:5]
        if np.abs(stands - level).max() > TURNED_DEG:
            stands_at = f"{machine.tilt.letter}{stands[0]:g} {machine.turn.letter}{stands[1]:g}"
            home = f"{machine.tilt.letter}{level[0]:g} {machine.turn.letter}{level[1]:g}"
            message = f"{event.code} while the table stands at {stands_at}: Marlin loses the position; turn it to {home} first"
            yield at_event(program, event, "error", "following-switched", message)
