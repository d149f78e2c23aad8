"""Clearance: checks every move of the head against table and cradle, and every turn of these against the head."""

from collections.abc import Iterator
from math import ceil

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import MOST, Finding, at_row, cut_short
from machine.dryrun.strokes import Beads
from machine.gcode.reader.parsed import MoveKind, ParsedProgram, pieces, pose_runs
from machine.kinematics.collision import Printed, Reach, gaps_of, hull, refined_gap, solids, sweep_gaps, swept, swing_mm
from machine.planning.limits import axis_limits
from mdp.head import Body, bodies, directions
from mdp.mesh import Floats, Indices
from mdp.pose import UP, Pose, rotation
from profiles.machine import Machine
from slicer.paths import Kind

FIRST_MM = 20.0  # path length between the first poses tried
MOST_LEFT_MM = 0.05
MOST_POSES = 2000
AT_ONCE = 20_000  # moves times directions fill memory
CONFIRMED = 200
ROUNDING_MM = 2e-3  # three coordinates rounded to a thousandth
MOST_TURNS = 2000
Solid = tuple[str, Reach]


def findings(program: ParsedProgram, deposited: Beads, machine: Machine) -> list[Finding]:
    """Collisions of straight moves and of turns."""
    if not len(program.line):
        return []
    return [*_straight(program, machine), *_turns(program, deposited, machine)]


def _straight(program: ParsedProgram, machine: Machine) -> list[Finding]:
    """Collisions of moves with the table at rest, one group per pose: two directions settle almost every move."""
    problems: list[Finding] = []
    tried = ~_rises_from_home(program) & (program.kind != MoveKind.ROTATE)
    for run, pose in pose_runs(program):
        if len(problems) >= MOST:
            return [*problems, cut_short(program, run.start, "straight moves")]
        for body, solid, close in _close(program, run, tried[run], pose, machine):
            problems += _body(program, close, pose, body, solid, machine)
    return problems


def _rises_from_home(program: ParsedProgram) -> NDArray[np.bool_]:
    """(n,) moves straight up from a homed position. There the tip is on the plate or above it, although a calibrated plate may be
    above the assumed 0."""
    up = np.flatnonzero(program.end[:, 2] > program.start[:, 2])
    start, end, before = program.start[up], program.end[up], program.end[np.maximum(up - 1, 0)]
    from_home = (up == 0) | (start[:, :3] != before[:, :3]).any(axis=1)
    aside = [0, 1, 3, 4]
    rises = np.zeros(len(program.line), dtype=np.bool_)
    rises[up] = from_home & (start[:, aside] == end[:, aside]).all(axis=1)
    return rises


def _close(
    program: ParsedProgram, run: slice, is_tried: NDArray[np.bool_], pose: Pose, machine: Machine
) -> Iterator[tuple[Body, Solid, Indices]]:
    """Pairs of body and solid that two directions do not separate in one pose, with the moves concerned."""
    tried = np.array([rotation(machine, pose) @ UP, UP])
    meetings = [(body, solid, body.least(tried) - solid[1](tried)) for solid in solids(machine, pose) for body in bodies(machine)]
    close: list[list[NDArray[np.int64]]] = [[] for _ in meetings]
    for some in pieces(len(is_tried)):
        rows = run.start + some.start + np.flatnonzero(is_tried[some])
        least = swept(program.start[rows, :3], program.end[rows, :3], tried)
        nearest = least.min(axis=1, initial=np.inf)[:, None]
        for (body, _, margin), own in zip(meetings, close, strict=True):
            if gaps_of(nearest, margin)[0] < body.need_mm:  # else one direction separates all of them
                own.append(rows[gaps_of(least, margin) < body.need_mm - ROUNDING_MM])
    for (body, solid, _), own in zip(meetings, close, strict=True):
        if any(map(len, own)):
            yield body, solid, np.concatenate(own)


def _body(program: ParsedProgram, rows: Indices, pose: Pose, body: Body, solid: Solid, machine: Machine) -> list[Finding]:
    """Collisions of one body with one solid in one pose, among the moves left open, by all directions and a search."""
    start, end = program.start[rows, :3], program.end[rows, :3]
    need = body.need_mm - ROUNDING_MM
    normal = rotation(machine, pose) @ UP
    tried = directions(normal)
    reach = solid[1](tried)
    pieces = [slice(k, k + AT_ONCE) for k in range(0, len(rows), AT_ONCE)]
    gaps = np.concatenate([sweep_gaps(body, start[piece], end[piece], tried, reach) for piece in pieces])
    close = np.flatnonzero(gaps < need)
    for k in close[np.argsort(gaps[close])][:CONFIRMED]:
        gaps[k] = max(gaps[k], refined_gap(body, start[k], end[k], normal, solid[1]))
        if gaps[k] < need:
            break
    close = close[gaps[close] < need]
    if not len(close):
        return []
    row, worst = int(rows[close[0]]), float(gaps[close].min())
    where = f"{machine.tilt.letter}{pose.tilt_deg:.3f} {machine.turn.letter}{pose.turn_deg:.3f}"
    message = (
        f"{body.name} comes to {worst:.2f} mm from {solid[0]} at {where}, {body.need_mm:g} mm are needed (moves: {len(close)})"
        if worst > 0
        else f"{body.name} runs into {solid[0]} at {where} (moves: {len(close)})"
    )
    return [at_row(program, row, "error", "collision", message)]


def _turns(program: ParsedProgram, deposited: Beads, machine: Machine) -> list[Finding]:
    """Collisions of every turn of the table; for continuous turning (curved layers) an even selection, which is reported.

    The print is treated as one convex body. Purge lines below the clearance of the plate are left out: at the plate's edge they
    would make it far too large.
    """
    problems = []
    purge = np.flatnonzero(program.rows_of_types(Kind.PURGE.value)[deposited.rows])
    counted = np.ones(len(deposited.rows), dtype=np.bool_)
    counted[purge] = deposited.segments(purge)[:, :, 2].max(axis=1, initial=0.0) > machine.clearance_mm
    printed, done = hull(np.zeros((0, 3)), 0.0), 0
    rows = np.flatnonzero(program.kind == MoveKind.ROTATE)
    if len(rows) > MOST_TURNS:
        message = f"the table turns {len(rows)} times: only {MOST_TURNS} of the turns were tested for collisions"
        problems.append(Finding("warning", "not-tested", int(program.line[rows[0]]), int(program.part[rows[0]]), 0, message))
        rows = rows[np.linspace(0, len(rows) - 1, MOST_TURNS).astype(np.int64)]
    for row in rows:
        if len(problems) >= MOST:
            return [*problems, cut_short(program, int(row), "turns")]
        before = int(np.searchsorted(deposited.rows, row))
        for some in pieces(before - done):
            new = np.arange(done, before)[some][counted[done:before][some]]
            bead = 0.5 * float(program.remarks.width_mm[program.remark[deposited.rows[new]]].max(initial=0.0))
            points = np.vstack([printed.points_mm, deposited.segments(new).reshape(-1, 3)])
            printed = hull(points, max(bead, printed.bead_mm))
        done = before
        problems += _turn(program, int(row), printed, machine)
    return problems


def _turn(program: ParsedProgram, row: int, printed: Printed, machine: Machine) -> Iterator[Finding]:
    """Findings of one turn of the table, with poses so dense that the gaps at two neighbours cover all poses between them.

    Between two poses every point of the turning bodies moves by at most `_way_mm` relative to the tip; when the gaps at both ends
    leave less than half of that, the pose between them is tried too, down to a path of MOST_LEFT_MM. Whatever remains open after
    MOST_POSES is reported.
    """
    start, end = _limit_turn(program.start[row], program.end[row], machine)
    way = _way_mm(start, end, printed, machine)
    least: dict[tuple[str, str], tuple[float, Pose]] = {}

    def pose_at(share: float) -> Pose:
        tilt, turn = start[3:] + share * (end[3:] - start[3:])
        return Pose(float(tilt), float(turn))

    def room(share: float, most: float) -> float:
        """Spare gap at a fraction of the turn, at most `most`; bodies that come too near are noted."""
        pose = pose_at(share)
        left, met = _room(machine, printed, pose, start[:3] + share * (end[:3] - start[:3]), most)
        for meeting, gap in met.items():
            if gap < least.get(meeting, (np.inf, pose))[0]:
                least[meeting] = (gap, pose)
        return left

    steps = min(max(1, ceil(way / FIRST_MM)), MOST_POSES)
    shares = [k / steps for k in range(steps + 1)]
    rooms = [room(share, way / steps) for share in shares]
    open_intervals = list(zip(shares, shares[1:], rooms, rooms[1:], strict=False))
    for _ in range(max(MOST_POSES - steps, 0)):
        if not open_intervals:
            break
        low, high, left, right = open_intervals.pop()
        distance = (high - low) * way
        if left + right >= distance or distance <= MOST_LEFT_MM or min(left, right) <= 0.0:
            continue
        middle = 0.5 * (low + high)
        between = room(middle, 0.5 * distance)
        open_intervals += [(low, middle, left, between), (middle, high, between, right)]
    if open_intervals:
        message = "the table turns so far that not all of the turn was tested for collisions"
        yield at_row(program, row, "warning", "not-tested", message)
    for (body, solid), (gap, pose) in least.items():
        meets = f"comes to {gap:.2f} mm from" if gap > 0 else "runs into"
        where = f"{machine.tilt.letter}{pose.tilt_deg:.1f} {machine.turn.letter}{pose.turn_deg:.1f}"
        yield at_row(program, row, "error", "collision", f"{body} {meets} {solid} while the table turns, at {where}")


def _limit_turn(start: Floats, end: Floats, machine: Machine) -> tuple[Floats, Floats]:
    """Ends of a turn clipped to the axis limits (another finding reports those), and to one revolution if only the turn axis
    moves."""
    least, most = np.transpose(list(axis_limits(machine).values())[3:])
    start, end = (np.concatenate([side[:3], np.clip(side[3:], least, most)]) for side in (start, end))
    turned = end[4] - start[4]
    if abs(turned) > 360.0 and np.all(end[:4] == start[:4]):
        end[4] = start[4] + np.copysign(360.0, turned)
    return start, end


def _way_mm(start: Floats, end: Floats, printed: Printed, machine: Machine) -> float:
    """Upper bound of the path of any point of table, cradle and print relative to the tip during a turn."""
    turned = np.abs(np.radians(end[3:] - start[3:])).sum()
    return float(np.linalg.norm(end[:3] - start[:3]) + turned * swing_mm(machine, printed))


def _room(machine: Machine, printed: Printed, pose: Pose, tip: Floats, most: float) -> tuple[float, dict[tuple[str, str], float]]:
    """Spare gap in one pose (at most `most`), and the gaps that are too small: (body, solid) -> mm."""
    normal = rotation(machine, pose) @ UP
    met: dict[tuple[str, str], float] = {}
    left, head, around = most, bodies(machine), directions(normal)
    tried = np.vstack([UP, around])
    lowest = [tried @ tip + body.least(tried) for body in head]
    for name, reach_of in solids(machine, pose, printed):
        reach = reach_of(tried)
        for body, least in zip(head, lowest, strict=True):
            need, gap = body.need_mm - ROUNDING_MM, float((least - reach).max())
            if gap < need:
                gap = max(gap, refined_gap(body, tip, tip, normal, reach_of))
            if gap < need:
                met[body.name, name] = min(gap, met.get((body.name, name), np.inf))
            left = min(left, gap - need)
    return left, met
