"""Clearance: every move of the head against the table's plate, and every turn of the table against the head, print included."""

import numpy as np
from numpy.typing import NDArray

from machine.collide import Body, Printed, bodies, directions, gaps_of, hull, refined_gap, sweep_gaps, swept, table_reach
from machine.dryrun.findings import MOST, Finding, cut_short
from machine.dryrun.stretches import stretches
from machine.parsed import MoveKind, ParsedProgram
from machine.reorient import poses_between
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.machine import Machine

STEP_DEG = 0.5
ROUNDING_MM = 2e-3  # three coordinates rounded to a thousandth
CONFIRMED = 12
MOST_TURNS = 2000


def findings(program: ParsedProgram, deposited: Floats, deposited_row: NDArray[np.int64], machine: Machine) -> list[Finding]:
    """Collisions of straight moves and turns; deposited: (m, 2, 3) workpiece segments laid by the rows deposited_row."""
    if not len(program.line):
        return []
    return [*_straight(program, machine), *_turns(program, deposited, deposited_row, machine)]


def _straight(program: ParsedProgram, machine: Machine) -> list[Finding]:
    """Moves with the table at rest, one group for every stretch between turns: two directions settle almost every move."""
    found: list[Finding] = []
    for stretch in stretches(program):
        if len(found) >= MOST:
            return [*found, cut_short(program, int(stretch.rows[0]), "straight moves")]
        tried = np.array([rotation(machine, stretch.pose) @ UP, UP])
        least = swept(program.start[stretch.rows, :3], program.end[stretch.rows, :3], tried)
        reach = table_reach(machine, stretch.pose, tried)
        for body in bodies(machine):
            close = gaps_of(body, least, tried, reach) < body.need_mm - ROUNDING_MM
            if close.any():
                found += _body(program, stretch.rows[close], body, machine, stretch.pose)
    return found


def _body(program: ParsedProgram, rows: NDArray[np.int64], body: Body, machine: Machine, pose: Pose) -> list[Finding]:
    """One body in one pose: the moves that two directions left open, by all directions and a search."""
    start, end = program.start[rows, :3], program.end[rows, :3]
    need = body.need_mm - ROUNDING_MM
    tried = directions(rotation(machine, pose) @ UP)
    gaps = sweep_gaps(body, start, end, tried, table_reach(machine, pose, tried))
    close = np.flatnonzero(gaps < need)
    if not len(close):
        return []
    worst = _confirmed(start, end, close, gaps, need, body, machine, pose)
    close = close[gaps[close] < need]
    if not len(close):
        return []
    row = int(rows[close[0]])
    where = f"{machine.tilt.letter}{pose.tilt_deg:.3f} {machine.turn.letter}{pose.turn_deg:.3f}"
    message = (
        f"{body.name} comes to {worst:.2f} mm from the table at {where}, {body.need_mm:g} mm are needed (moves: {len(close)})"
        if worst > 0
        else f"{body.name} runs into the table at {where} (moves: {len(close)})"
    )
    return [Finding("error", "collision", int(program.line[row]), int(program.part[row]), int(program.layer[row]), message)]


def _confirmed(
    start: Floats, end: Floats, close: NDArray[np.int64], gaps: Floats, need: float, body: Body, machine: Machine, pose: Pose
) -> float:
    """Improve the lower bounds of the worst moves; returns the least distance of all moves still too close."""
    for row in close[np.argsort(gaps[close])][:CONFIRMED]:
        gaps[row] = max(gaps[row], refined_gap(body, start[row], end[row], machine, pose))
    return float(gaps[close].min())


def _turns(program: ParsedProgram, deposited: Floats, deposited_row: NDArray[np.int64], machine: Machine) -> list[Finding]:
    """Every turn of the table; of a program that turns all the time (curved layers) an even choice, which is said."""
    found = []
    printed, done = hull(np.zeros((0, 3)), 0.0), 0
    rows = np.flatnonzero(program.kind == MoveKind.ROTATE)
    if len(rows) > MOST_TURNS:
        message = f"the table turns {len(rows)} times: only {MOST_TURNS} of the turns were tested for collisions"
        found.append(Finding("warning", "not-tested", int(program.line[rows[0]]), int(program.part[rows[0]]), 0, message))
        rows = rows[np.linspace(0, len(rows) - 1, MOST_TURNS).astype(np.int64)]
    for row in rows:
        if len(found) >= MOST:
            return [*found, cut_short(program, int(row), "turns")]
        before = int(np.searchsorted(deposited_row, row))
        if before > done:
            new = deposited[done:before].reshape(-1, 3)
            bead = 0.5 * float(program.width_mm[deposited_row[done:before]].max())
            printed, done = hull(np.vstack([printed.points_mm, new]), max(bead, printed.bead_mm)), before
        found += _turn(program, int(row), printed, machine)
    return found


def _turn(program: ParsedProgram, row: int, printed: Printed, machine: Machine) -> list[Finding]:
    """One turn of the table, in steps: all bodies against the plate and against the hull of what is printed."""
    start, end = program.start[row], program.end[row]
    poses = poses_between(Pose(*map(float, start[3:])), Pose(*map(float, end[3:])), STEP_DEG)
    share = np.linspace(0.0, 1.0, len(poses))[:, None]
    tips = start[:3] + share * (end[:3] - start[:3])
    least: dict[tuple[str, str], tuple[float, Pose]] = {}
    for pose, tip in zip(poses, tips, strict=True):
        for meeting, gap in _meetings(machine, printed, pose, tip).items():
            if gap < least.get(meeting, (np.inf, pose))[0]:
                least[meeting] = (gap, pose)
    return [
        Finding(
            "error", "collision", int(program.line[row]), int(program.part[row]), int(program.layer[row]),
            f"{body} {'comes to ' + format(gap, '.2f') + ' mm from' if gap > 0 else 'runs into'} {name} while the table turns, "
            f"at {machine.tilt.letter}{pose.tilt_deg:.1f} {machine.turn.letter}{pose.turn_deg:.1f}",
        )
        for (body, name), (gap, pose) in least.items()
    ]  # fmt: skip


def _meetings(machine: Machine, printed: Printed, pose: Pose, tip: Floats) -> dict[tuple[str, str], float]:
    """The gaps that are too small in one pose: (body, obstacle) -> mm. Most often all stands below the tip, seen by UP alone."""
    normal = rotation(machine, pose) @ UP
    found: dict[tuple[str, str], float] = {}
    for tried in (UP[None], directions(normal)):
        found = {}
        for name, reach in (("the table", table_reach(machine, pose, tried)), ("the print", printed.reach(machine, pose, tried))):
            for body in bodies(machine):
                gap = float(sweep_gaps(body, tip[None], tip[None], tried, reach)[0])
                if gap < body.need_mm - ROUNDING_MM:
                    found[body.name, name] = min(gap, found.get((body.name, name), np.inf))
        if not found:
            break
    return found
