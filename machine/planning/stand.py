"""Stand: position and height of the tip during a turn of the table, a pause and after the print, and the ways there.

A park position is straight up along the nozzle, and aside at a height above everything. A route of a turn: straight up, across to
the stand, turn, across to above the next part's first point, straight down. For every stand the least safe height follows from
separating directions in closed form; the stand with the fastest route is taken. Safe means that during the whole turn every body
of the head keeps lift_mm (or clearance_mm, if greater) from plate, cradle and print, swept: between two sampled poses each reach
is bounded by its greater end and the sagitta.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import ceil, hypot, inf, radians

import numpy as np

from machine.kinematics.collision import Printed, solids, sweep_gaps, swing_mm
from mdp.directions.unit_vectors import spread
from mdp.head import bodies, directions
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.errors import MoveError
from profiles.machine import Machine
from slicer.estimate.timing import Speeds, move_times

ASIDE_MM = 1.0  # margin at the ends of the axes
BESIDE_MM = 20.0  # from the outline of a finished print: ooze falls beside it, and a hand can reach it
PARTS = 4  # number of pieces in which a way is tested when it is not clear as a whole
STEP_DEG = 0.5
MOST_STEPS = 1500
STANDS = 7
FIELD = 60
TRIED = 12
COARSE = 16


@dataclass(frozen=True)
class Park:
    """Axis positions, mm: the tip rises to lift_mm and moves to stand_mm; both equal if it stays there."""

    lift_mm: tuple[float, float, float]
    stand_mm: tuple[float, float, float]


def find_park_position(
    machine: Machine, printed: Printed, at_mm: Floats, pose: Pose, stands: Sequence[tuple[float, float]] = ()
) -> Park | None:
    """A park position for a tip at at_mm (axis positions X Y Z); None when no way up is proved clear.

    stands: X, Y of possible places besides the corners of the axes; the nearest is taken.
    """
    x, y, z = (float(value) for value in at_mm)
    most = machine.z.limits_mm[1]
    top = obstacle_top_mm(machine, printed, pose) + machine.lift_mm
    height = min(max(top, z + min(machine.lift_mm, most - z)), most)
    while not is_way_clear(machine, pose, np.array([x, y, z]), np.array([x, y, height]), parts=PARTS):
        height = z + (height - z) / 2.0
        if height - z < min(1.0, machine.clearance_mm):
            return None
    lift = (x, y, height)
    if height < min(top, most) - 1e-9:
        return Park(lift, lift)
    xs, ys = ((low + ASIDE_MM, high - ASIDE_MM) for low, high in (machine.x.limits_mm, machine.y.limits_mm))
    for point in sorted([*stands, *product(xs, ys)], key=lambda point: abs(point[0] - x) + abs(point[1] - y)):
        stand = (*point, height)
        if height >= top - 1e-9 or is_way_clear(machine, pose, np.array(lift), np.array(stand), printed, PARTS):
            return Park(lift, stand)
    return Park(lift, lift)


def beside(machine: Machine, printed: Printed, at_mm: Floats, pose: Pose) -> list[tuple[float, float]]:
    """X, Y beside a finished print within the axes' reach: straight out to each side, or the tip's own if outside."""
    x, y = (float(value) for value in at_mm[:2])
    right, back, left, front = printed.reach(machine, pose, np.vstack([np.eye(3)[:2], -np.eye(3)[:2]]))
    outline = ((-left, right), (-front, back))
    if any(value <= low - BESIDE_MM or value >= high + BESIDE_MM for value, (low, high) in zip((x, y), outline, strict=True)):
        return [(x, y)]
    places = []
    for axis, (low, high) in zip((machine.x, machine.y), outline, strict=True):
        for value in (low - BESIDE_MM, high + BESIDE_MM):
            within = min(max(value, axis.limits_mm[0] + ASIDE_MM), axis.limits_mm[1] - ASIDE_MM)
            if not low <= within <= high:
                places.append((within, y) if axis is machine.x else (x, within))
    return places


def obstacle_top_mm(machine: Machine, printed: Printed | None, pose: Pose) -> float:
    """Greatest Z of table, cradle and print at a pose."""
    return max(float(reach_of(UP[None])[0]) for _, reach_of in solids(machine, pose, printed))


def over_print_mm(machine: Machine, printed: Printed, pose: Pose) -> float:
    """Z at which the tip clears the whole print at a pose."""
    return float(printed.reach(machine, pose, UP[None])[0]) + machine.clearance_mm


def is_way_clear(
    machine: Machine, pose: Pose, start: Floats, end: Floats, printed: Printed | None = None, parts: int = 1
) -> bool:
    """Whether each body of the head keeps its clearance from table, cradle and print while the tip moves from start to end.

    The move is tested in `parts` pieces: a separating direction is easier to find for a short piece.
    """
    tried = directions(rotation(machine, pose) @ UP)
    shares = np.linspace(0.0, 1.0, parts + 1)[:, None]
    places = start + shares * (end - start)
    for _, reach_of in solids(machine, pose, printed):
        reach = reach_of(tried)
        for body in bodies(machine):
            if float(sweep_gaps(body, places[:-1], places[1:], tried, reach).min()) < body.need_mm - 1e-6:
                return False
    return True


@dataclass(frozen=True, eq=False)
class Turn:
    """A turn of the table while the tip goes from one place to another, machine X Y Z; target_mm None: the move ends with it.

    least_z_mm: least Z of the crossings before and after the turn, for prints higher than both places.
    """

    start: Pose
    end: Pose
    at_mm: Floats
    target_mm: Floats | None
    least_z_mm: tuple[float, float] = (-inf, -inf)


@dataclass(frozen=True)
class Route:
    """The tip waits at X, Y of over_mm and at z_mm during the turn, and crosses to the next part at across_z_mm.

    seconds: of all moves without the turn.
    """

    over_mm: tuple[float, float]
    z_mm: float
    across_z_mm: float
    seconds: float


def poses_between(start: Pose, end: Pose) -> list[Pose]:
    """Poses from start to end, both included, both axes in proportion, STEP_DEG apart (farther when they would be too many)."""
    tilt, turn = end.tilt_deg - start.tilt_deg, end.turn_deg - start.turn_deg
    count = min(max(1, ceil(hypot(tilt, turn) / STEP_DEG)), MOST_STEPS)
    return [Pose(start.tilt_deg + tilt * k / count, start.turn_deg + turn * k / count) for k in range(count + 1)]


def least_z(machine: Machine, tried: Floats, reach: Floats, over_mm: tuple[float, float], every: int = 1) -> float:
    """Least Z above which the tip may stand at X, Y while solids reach (p, s, k) along (k, 3) directions; inf if none.

    Along an upward direction the gap grows with Z, so each direction gives a least Z of its own. every: use only every nth of the
    short turns, which gives a lower bound.
    """
    need_mm = max(machine.lift_mm, machine.clearance_mm)
    least_mm = np.array([body.least(tried) for body in bodies(machine)]) + tried[:, :2] @ np.array(over_mm)
    return float(_least_z(reach, every, need_mm, least_mm, np.ascontiguousarray(tried[:, 2])))


@kernel
def _least_z(reach: Floats, every: int, need_mm: float, least_mm: Floats, up: Floats) -> float:
    """Kernel of least_z: maximum over bodies, solids and short turns of the minimum over directions. A direction that requires no
    more than the maximum so far settles its combination."""
    highest, first = -inf, 0
    for body in range(len(least_mm)):
        for p in range(0, len(reach), every):
            for s in range(reach.shape[1]):
                least, at = inf, first
                for k in range(-1, len(up)):
                    d = first if k < 0 else k
                    missing = reach[p, s, d] + need_mm - least_mm[body, d]
                    level = -inf if missing <= 0.0 else inf
                    z = missing / up[d] if up[d] > 1e-9 else level
                    if z < least:
                        least, at = z, d
                    if least <= highest:
                        break
                highest, first = max(highest, least), at
    return highest


def sweep(machine: Machine, printed: Printed, start: Pose, end: Pose) -> tuple[Floats, Floats]:
    """Reach of everything that turns below the head between two poses, including the print: (k, 3) directions, and (p, s, k)
    reaches of s solids in p short turns. The directions are those of some poses' normals and a field, without downward ones."""
    turning = poses_between(start, end)
    fans = [directions(rotation(machine, pose) @ UP)[:27] for pose in turning[:: max(1, len(turning) // TRIED)]]
    around = np.radians(np.arange(0.0, 360.0, 15.0))
    level = np.column_stack([np.cos(around), np.sin(around), np.zeros(len(around))])
    tried = np.vstack([UP[None], *fans, spread(2 * FIELD), level])
    tried = np.unique(np.round(tried[tried[:, 2] >= -1e-12], 12), axis=0)
    reach = np.array([[reach_of(tried) for _, reach_of in solids(machine, pose, printed)] for pose in turning])
    step = radians(hypot(turning[1].tilt_deg - turning[0].tilt_deg, turning[1].turn_deg - turning[0].turn_deg))
    # d . x changes along the turn with a second derivative of at most 2 r a^2, a the angle of both axes together
    sagitta = swing_mm(machine, printed) * step**2 / 4.0
    return tried, np.maximum(reach[:-1], reach[1:]) + sagitta


def route(turn: Turn, part: int, printed: Printed, machine: Machine, speeds: Speeds) -> Route:
    """The fastest safe route of a turn before a part. Raises MoveError when no stand is safe within the axis limits."""
    tried, reach = sweep(machine, printed, turn.start, turn.end)
    best: Route | None = None
    lowest = inf
    for over_mm in stands(machine, turn):
        for every in (COARSE, 1):
            least = least_z(machine, tried, reach, over_mm, every)
            candidate = _at(over_mm, least, turn, machine, speeds)
            if candidate.across_z_mm > machine.z.limits_mm[1] or (best is not None and candidate.seconds >= best.seconds):
                break
        else:
            best = candidate if _ways_clear(candidate, turn, machine) else best
        lowest = min(lowest, candidate.across_z_mm)
    if best is not None:
        return best
    where = f"turning the table to {machine.tilt.letter}{turn.end.tilt_deg:.3f} {machine.turn.letter}{turn.end.turn_deg:.3f}"
    limit_mm = machine.z.limits_mm[1]
    raise MoveError(
        f"part {part}: {where if turn.start != turn.end else 'the way to it'} needs "
        + (
            f"the tip at Z {lowest:.1f} mm, {machine.name} allows at most {limit_mm:g} mm"
            if lowest > limit_mm
            else "a place for the head that it cannot reach without touching the print"
        )
    )


def _at(over: tuple[float, float], least_z: float, turn: Turn, machine: Machine, speeds: Speeds) -> Route:
    """The route with the lowest stand at a place, clear of the finished print and of the next part."""
    z = max(least_z, turn.least_z_mm[0], min(float(turn.at_mm[2]) + machine.clearance_mm, machine.z.limits_mm[1]))
    across = z
    if turn.target_mm is not None:
        across = max(z, turn.least_z_mm[1], min(float(turn.target_mm[2]) + machine.clearance_mm, machine.z.limits_mm[1]))
    seconds = way_s(turn, over, (z, across), machine, speeds) if across < inf else inf
    return Route(over, z, across, seconds)


def stands(machine: Machine, turn: Turn) -> Iterator[tuple[float, float]]:
    """Candidate stands: the tip's place, above the next first point, half way, then a lattice over X and Y."""
    here = turn.at_mm[:2]
    there = here if turn.target_mm is None else turn.target_mm[:2]
    yield from ((float(x), float(y)) for x, y in (here, there, 0.5 * (here + there)))
    yield from product(*(np.linspace(*axis.limits_mm, STANDS).tolist() for axis in (machine.x, machine.y)))


def way_s(turn: Turn, over: tuple[float, float], z_mm: tuple[float, float], machine: Machine, speeds: Speeds) -> float:
    """Seconds of a route, with stops between its moves."""
    before, after = _places(turn, over, z_mm)
    steps = np.zeros((len(before) + len(after) - 2, 6))
    steps[:, :3] = np.diff(np.array([*before, *after[1:]]), axis=0)
    upright = np.hypot(steps[:, 0], steps[:, 1]) < 1e-9
    speed = np.where(upright, speeds.lift_mm_s, speeds.travel_mm_s)
    return float(move_times(steps, speed, np.ones(len(steps), dtype=np.bool_), machine).sum())


def _places(turn: Turn, over: tuple[float, float], z_mm: tuple[float, float]) -> tuple[list[Floats], list[Floats]]:
    """Points of a route: up to the first of z_mm and to `over`; after the turn, to the second of them, across, and down."""
    at, target = turn.at_mm, turn.target_mm
    stand = np.array([*over, z_mm[0]])
    before = [at, np.array([*at[:2], z_mm[0]]), stand]
    if target is None:
        return before, [stand]
    return before, [stand, np.array([*over, z_mm[1]]), np.array([*target[:2], z_mm[1]]), target]


def _ways_clear(candidate: Route, turn: Turn, machine: Machine) -> bool:
    """Whether the ways to the stand, in the first pose, and from it, in the second, are clear of table and cradle.

    The print need not be tested: in both poses the crossings are above it, and nothing is below the head where the tip moves
    vertically.
    """
    halves = _places(turn, candidate.over_mm, (candidate.z_mm, candidate.across_z_mm))
    ways = [(pose, a, b) for pose, places in zip((turn.start, turn.end), halves, strict=True) for a, b in pairwise(places)]
    return all(is_way_clear(machine, pose, a, b) for pose, a, b in ways if float(np.linalg.norm(b - a)) > 1e-9)
