"""Layer: a layer's strokes as moves, as fast as axes, extruder and hot end allow, and the travels between them: retraction with a
wipe, lift, and crossing at a height at which the head clears clips and the print beside a limb.

Filament that replaces what oozed during a turn of the table is pushed within an inner stroke, not at standstill. How much oozed
is unknown. At the beginning of a wall, excess filament would leave a blob on the seam; spread over the first stretch of infill or
support it only makes that a little thicker.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import ceil, inf, nan, pi, sqrt
from typing import NamedTuple

import numpy as np

from machine.kinematics.collision import Printed
from machine.planning.limits import path_speed, path_speeds, stroke_filament_mm_s, wipe_filament_mm_s
from machine.planning.moves import MARK, POINTS, REORIENT, RETRACT, SPEED, TRAVEL, WIPE, Mark, Moves, Reorient, add_point, add_row
from mdp.clearance import StandingColumns, highest_in_cells
from mdp.decomposition import Part
from mdp.kernels.arrays import longs, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from mdp.pose import Pose
from profiles.errors import MoveError
from profiles.machine import Machine, TableBox
from profiles.profile import Profile
from slicer.estimate.timing import Speeds, speeds_of
from slicer.geometry.polyline import length_between
from slicer.interface.interface import frame_change
from slicer.paths import Kind, Layer, SlicedPart, bead_area_mm2
from slicer.strokes.speed import stroke_accelerations
from slicer.strokes.travels import STANDING_MM, distance, first_length, runs_round, wipe_trail

TO_AND_FRO = 4  # reversals of a wipe on a single stroke shorter than it
NOWHERE = np.zeros((0, 3))
NO_ENDS = np.zeros(0, dtype=np.int64)
STEP_MM = 0.5  # between sample points of paths and beads, and size of the cells of which only the highest point counts
MOST_COASTED = 0.25  # greatest fraction of a path for coasting
RUN_MM = 20.0  # length of a stroke over which the filament of a turn is spread
MOST_FULL = 1.5  # factor on a bead's nominal filament: filament that did not ooze must not fill the space twice
SEEN = (Kind.OUTER_WALL, Kind.OVERHANG, Kind.TOP_SKIN)


@dataclass
class Tip:
    """Position of the tip (machine X Y Z), pose of the table, hull of the earlier parts, and all moves so far.

    trail: (n, 3) path of a wipe over the strokes since the last retraction. run_in_mm: filament that the next inner strokes are
    to push in addition. beside: the index of a part with obstacles beside it (a limb's other pieces, clips), and these.
    has_limbs: a limb has been printed, so that the print may be higher than the tip.
    """

    profile: Profile
    at_mm: Floats
    pose: Pose
    printed: Printed
    has_limbs: bool = False
    retracted_mm: float = 0.0
    prime_extra_mm: float = 0.0
    run_in_mm: float = 0.0
    trail: Floats = field(default_factory=lambda: NOWHERE)
    beside: tuple[int, StandingColumns] | None = None
    moves: list[Moves] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)

    @cached_property
    def speeds(self) -> Speeds:
        """Speed limits of moves between strokes."""
        return speeds_of(self.profile)

    def add(self, moves: Moves) -> None:
        """Append moves that begin at the tip."""
        self.moves.append(moves)
        if len(moves.ways):
            self.at_mm = moves.ways[-1, :3]

    def move(self, what: int, way_mm: Floats, pushed_mm: Floats | float, speed: float, acceleration_mm_s2: float = inf) -> None:
        """Append a move that is not a stroke, along (n, 3) points."""
        ways = np.empty((len(way_mm), 4))
        ways[:, :3], ways[:, 3] = way_mm, pushed_mm
        self.add(Moves(ways, np.array([[what, len(way_mm), speed, nan, nan, acceleration_mm_s2]])))

    def mark(self, mark: Mark) -> None:
        """Append a mark or a turn of the table; after a turn earlier strokes cannot be wiped over."""
        self.marks.append(mark)
        if isinstance(mark, Reorient):
            self.move(REORIENT, self.at_mm[None], 0.0, mark.speed_deg_s)
            self.pose, self.trail = mark.pose, NOWHERE
        else:
            self.move(MARK, NOWHERE, 0.0, 0.0)


def height_to(tip: Tip, start: Floats, approach: Floats, retracts: bool, shift: Floats) -> float:
    """Z at which the tip crosses along an approach (k, 2) to a stroke's start, retracted if `retracts`.

    The tip retracts and lifts wherever the head would hit a clip or the print beside a limb.
    """
    if retracts:
        retract(tip)
    lift, level = tip.profile.process.lift_mm if retracts else 0.0, float(start[2])
    over = max(level, min(level + lift, tip.profile.machine.z.limits_mm[1]))
    if tip.beside is None:
        return over
    clear = _over_standing(tip, approach, start, shift, over)
    if clear > over and not retracts:
        retract(tip)  # a wipe moves the tip
        clear = _over_standing(tip, approach, start, shift, over)
    return clear


def _over_standing(tip: Tip, approach: Floats, start: Floats, shift: Floats, over: float) -> float:
    """Z at which the head clears the obstacles beside the part on the way to a path's start. `over` if that suffices, else the
    least sufficient height with the clearance of the nozzle."""
    assert tip.beside is not None
    (part, standing), machine = tip.beside, tip.profile.machine
    way = np.vstack([tip.at_mm[:2], approach, start[:2]])
    z_mm = clear_height_mm(standing, way - shift[:2], over - float(shift[2])) + float(shift[2])
    if z_mm <= over + STANDING_MM:
        return over
    z_mm += machine.clearance_mm
    if z_mm > machine.z.limits_mm[1]:
        raise MoveError(
            f"part {part}: a travel within it needs the tip at Z {z_mm:.1f} mm for the head to pass the bodies beside it, "
            f"{machine.name} allows at most {machine.z.limits_mm[1]:g} mm"
        )
    return z_mm


def go(tip: Tip, *goals_mm: Sequence[float] | Floats) -> None:
    """Append straight travels from place to place, vertical ones at the lift speed."""
    for goal_mm in goals_mm:
        tip.add(_straight(tip.at_mm, np.array(goal_mm, dtype=np.float64), tip.speeds))


@kernel
def _straight(at_mm: Floats, goal_mm: Floats, speeds: Speeds) -> Moves:
    out, done = Moves(table(3, 4), table(1, 6)), longs(2, 0)
    add_point(out, done, at_mm[0], at_mm[1], at_mm[2], 0.0)
    add_travel(out, done, table(0, 2), goal_mm[0], goal_mm[1], goal_mm[2], speeds)
    return Moves(out.ways[1 : done[0]], out.rows[: done[1]])


@no_nrt
def add_travel(out: Moves, done: Indices, between_mm: Floats, x_mm: float, y_mm: float, z_mm: float, speeds: Speeds) -> None:
    """Write a travel from the last point past (k, 2) places at the goal's height to the goal. Points at the tip's position are
    omitted, as are travels of length 0. done: as in add_point."""
    first, upright = done[0], True
    x, y, z = out.ways[first - 1, 0], out.ways[first - 1, 1], out.ways[first - 1, 2]
    add_point(out, done, x, y, z, 0.0)
    for k in range(len(between_mm) + 1):
        to_x, to_y = (between_mm[k, 0], between_mm[k, 1]) if k < len(between_mm) else (x_mm, y_mm)
        if np.sqrt((to_x - x) ** 2 + (to_y - y) ** 2 + (z_mm - z) ** 2) > STANDING_MM:
            add_point(out, done, to_x, to_y, z_mm, 0.0)
            upright = upright and abs(to_x - x) <= STANDING_MM and abs(to_y - y) <= STANDING_MM
        x, y, z = to_x, to_y, z_mm
    if done[0] == first + 1:
        done[0] = first
        return
    speed = path_speed(out.ways, first, done[0], speeds.lift_mm_s if upright else speeds.travel_mm_s, speeds.axes_mm_s)
    add_row(out, done, TRAVEL, done[0] - first, speed, speeds.acceleration_mm_s2)


def retract(tip: Tip) -> None:
    """Retract the rest of the retraction length, wiping over the last strokes if there are any."""
    material, speeds = tip.profile.material, tip.speeds
    amount = material.retract_mm - tip.retracted_mm
    if amount <= 0:
        return
    tip.retracted_mm += amount
    tip.prime_extra_mm = max(tip.prime_extra_mm, material.retract_prime_extra_mm)
    way, tip.trail = tip.trail, NOWHERE
    length = np.linalg.norm(np.diff(way, axis=0), axis=1)
    if len(way) < 2 or float(np.linalg.norm(way[0] - tip.at_mm)) > STANDING_MM:
        tip.move(RETRACT, tip.at_mm[None], -amount, speeds.filament_mm_s)
        return
    filament_mm_s = min(speeds.filament_mm_s, wipe_filament_mm_s(tip.profile.machine))
    speed = min(speeds.travel_mm_s, float(length.sum()) * filament_mm_s / amount)
    (speed,) = path_speeds(way, np.array([0, len(way)]), np.array([speed]), speeds.axes_mm_s)
    tip.move(WIPE, way, np.append(0.0, -length * (amount / length.sum())), speed)


class Laid(NamedTuple):
    """Strokes of a layer in machine coordinates, mm: points (n, 3), their starts (k + 1,), widths (k,), whether a wipe may follow
    each; all approach points (m, 2) and their starts (k + 1,)."""

    points: Floats
    starts: Indices
    width: Floats
    wiped: Mask
    approach: Floats
    approach_starts: Indices


@kernel
def trail_after(laid: Laid, first: int, end: int, before: Floats, wipe_mm: float) -> Floats:
    """Path (n, 3) of a wipe of wipe_mm after some strokes of a layer; before: the path before them, empty once retracted."""
    from_here = end - 1
    while from_here > first and not _suffices(laid, from_here, wipe_mm):
        from_here -= 1
    trail = before
    for k in range(from_here, end):
        trail = first_length(_trail_after(laid, k, trail, wipe_mm), wipe_mm)
    return trail


@no_nrt
def _suffices(laid: Laid, k: int, wipe_mm: float) -> bool:
    """Whether a wipe after a stroke is independent of the strokes before it."""
    if laid.wiped[k]:
        return bool(length_between(laid.points, laid.starts[k], laid.starts[k + 1]) >= wipe_mm)
    return not runs_round(laid.points[laid.starts[k] : laid.starts[k + 1]], laid.width[k])


@helper
def _trail_after(laid: Laid, k: int, before: Floats, wipe_mm: float) -> Floats:
    """Path of a wipe after one stroke.

    If the stroke is too short, the path continues via its beginning to earlier strokes of the layer, or back and forth without
    these. If it must not follow the stroke itself, it uses the earlier ones only.
    """
    points = laid.points[laid.starts[k] : laid.starts[k + 1]]
    if not laid.wiped[k] and not (len(before) and runs_round(points, laid.width[k])):
        return before[:0]
    own = wipe_trail(points, laid.width[k])
    if not laid.wiped[k]:
        for axis in range(3):
            own[0, axis], own[1, axis] = points[-1, axis], points[0, axis]
        own = own[:2]
    if distance(points, 0, len(points) - 1) >= wipe_mm or length_between(own, 0, len(own)) >= wipe_mm:
        return own
    passed = laid.approach[laid.approach_starts[k] : laid.approach_starts[k + 1]]
    goes_on = len(before) > 0 and abs(before[0, 2] - points[0, 2]) <= STANDING_MM
    once = len(own) + (len(passed) + len(before) if goes_on else 0)
    trail: Floats = table(once + TO_AND_FRO * (once - 1), 3)
    for i in range(once):
        for axis in range(3):
            if i < len(own):
                trail[i, axis] = own[i, axis]
            elif i < len(own) + len(passed):
                trail[i, axis] = passed[len(own) + len(passed) - 1 - i, axis] if axis < 2 else points[0, 2]
            else:
                trail[i, axis] = before[i - len(own) - len(passed), axis]
    count = once
    for _ in range(TO_AND_FRO):
        if length_between(trail, 0, count) >= wipe_mm:
            break
        for i in range(count, count + once - 1):
            for axis in range(3):
                trail[i, axis] = trail[2 * (count - 1) - i, axis]
        count += once - 1
    return trail[:count]


def standing_beside(printing: Part, printed: Sequence[tuple[Part, SlicedPart]], machine: Machine) -> StandingColumns:
    """The printed beads and the clips above the base plane of a part, in its frame.

    Beads less than their width above the plane are left out: they are the steps of the cut face below a limb.
    """
    tops, widest_mm = [np.zeros((0, 3))], 0.0
    for clip in machine.table.clips:
        placed = _lattice(clip) @ printing.rotation.T - (0.0, 0.0, printing.base.offset_mm)
        tops.append(placed[placed[:, 2] > 0.0])
    for part, piece in printed:
        turn, shift = frame_change(part, printing)
        for layer in piece.layers:
            placed, width_mm = layer.points_mm @ turn.T + shift, np.repeat(layer.width_mm, np.diff(layer.starts))
            high = placed[:, 2] > width_mm
            if not high.any():
                continue
            points, before = _resampled(placed, layer.starts[1:-1] - 1)
            tops.append(points[points[:, 2] > width_mm[before]])
            widest_mm = max(widest_mm, float(width_mm[high].max()))
    slack_mm = 0.5 * widest_mm + (1.0 + sqrt(0.5)) * STEP_MM  # half a step of path and of bead, half a cell's diagonal
    return StandingColumns.of(highest_in_cells(np.concatenate(tops), STEP_MM), slack_mm, machine)


def _lattice(box: TableBox) -> Floats:
    """(n, 3) points throughout a box, at most STEP_MM apart along each axis."""
    counts = [ceil((most - least) / STEP_MM) + 1 for least, most in zip(box.min_mm, box.max_mm, strict=True)]
    axes = [np.linspace(a, b, count) for a, b, count in zip(box.min_mm, box.max_mm, counts, strict=True)]
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)


def clear_height_mm(standing: StandingColumns, way_mm: Floats, height_mm: float) -> float:
    """The least height, at least height_mm, at which the tip may move along a path (n, 2) in the part's frame."""
    return max(height_mm, float(standing.least_tip_mm(_resampled(way_mm)[0], height_mm).max()))


def _resampled(way_mm: Floats, ends: Indices = NO_ENDS) -> tuple[Floats, Indices]:
    """A path (n, d) with added points at most STEP_MM apart, and the index of the original point before each.

    ends: points after which the path is interrupted.
    """
    steps = np.diff(way_mm, axis=0)
    counts = np.maximum(np.ceil(np.linalg.norm(steps, axis=1) / STEP_MM), 1).astype(np.int64)
    counts[ends] = 1
    share = (np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)) / np.repeat(counts, counts)
    points: Floats = np.repeat(way_mm[:-1], counts, axis=0) + share[:, None] * np.repeat(steps, counts, axis=0)
    before = np.append(np.repeat(np.arange(len(counts)), counts), len(counts))
    return np.concatenate([points, way_mm[-1:]]), before


def print_layer(tip: Tip, layer: Layer, points: Floats, shift: Floats, *, on_plate: bool) -> None:
    """Print a layer whose points are at (n, 3) machine coordinates, shifted from its own.

    The moves from one retraction to the next are written at once.
    """
    profile, starts = tip.profile, layer.starts
    strokes = _strokes(tip, layer, points, on_plate=on_plate)
    tip.run_in_mm -= run_in(strokes, layer, tip.run_in_mm, profile)
    laid = Laid(points, starts, layer.width_mm, layer.wiped, layer.approach + shift[:2], layer.approach_starts)
    firsts = points[starts[:-1]]
    apart = np.linalg.norm(firsts - np.vstack([tip.at_mm, points[starts[1:-1] - 1]]), axis=1) > STANDING_MM
    alone = apart if tip.beside is not None else apart & layer.retract  # a stroke may begin at the end of the one before it
    ways = np.concatenate([[0], np.cumsum(strokes.rows[:, POINTS].astype(np.int64))])
    for a, b in pairwise([0, *(np.flatnonzero(alone[1:]) + 1).tolist(), len(layer)]):
        over = float(firsts[a, 2])
        if apart[a]:
            approach = laid.approach[laid.approach_starts[a] : laid.approach_starts[a + 1]]
            over = height_to(tip, firsts[a], approach, bool(layer.retract[a]), shift)
        begin = np.array([*tip.at_mm, over, tip.retracted_mm + tip.prime_extra_mm])
        piece = Moves(strokes.ways[ways[a] : ways[b]], strokes.rows[a:b])
        tip.add(_lay(piece, apart[a:b], laid.approach, laid.approach_starts[a : b + 1], begin, tip.speeds))
        tip.retracted_mm = tip.prime_extra_mm = 0.0
        tip.trail = trail_after(laid, a, b, tip.trail, profile.material.wipe_mm)


def _strokes(tip: Tip, layer: Layer, points: Floats, *, on_plate: bool) -> Moves:
    """The strokes of a layer whose points are at (n, 3) machine coordinates.

    Filament by volume (a stroke's flow includes the material's); speed limited by axes, extruder and hot end.
    """
    profile, counts = tip.profile, np.diff(layer.starts)
    material = profile.material
    filament_mm2 = pi * material.diameter_mm**2 / 4.0
    area_mm2 = bead_area_mm2(layer.width_mm, layer.height_mm) * layer.flow
    with np.errstate(divide="ignore"):
        fastest = stroke_filament_mm_s(profile) * filament_mm2 / np.maximum(area_mm2, 0.0)
    speeds = path_speeds(points, layer.starts, np.minimum(layer.speed_mm_s, fastest), tip.speeds.axes_mm_s)
    accelerations = stroke_accelerations(profile, on_plate)[layer.kind]
    ways = _ways(points, layer.points, layer.starts, area_mm2, filament_mm2)
    rows = np.column_stack([layer.kind, counts, speeds, layer.width_mm, layer.own_fan, accelerations])
    if material.coast_mm > 0.0:
        return _coasted(Moves(ways, rows), layer.points, np.append(layer.retract[1:], False), material.coast_mm)
    return Moves(ways, rows)


def _ways(points_mm: Floats, flat_mm: Floats, starts: Indices, area_mm2: Floats, filament_mm2: float) -> Floats:
    """(n, 4) points of strokes with the filament of beads of (k,) areas; flat_mm (n, 2): the points before the shift."""
    steps_mm = np.hypot(*np.diff(flat_mm, axis=0, prepend=flat_mm[:1]).T)
    steps_mm[starts[:-1]] = 0.0
    return np.column_stack([points_mm, steps_mm * np.repeat(area_mm2, np.diff(starts)) / filament_mm2])


@kernel
def _coasted(strokes: Moves, flat_mm: Floats, coasts: Mask, coast_mm: float) -> Moves:
    """The strokes, some of which push nothing over their last coast_mm, where a step is split. flat_mm: as in _ways."""
    out, done = Moves(table(len(strokes.ways) + len(coasts), 4), strokes.rows), longs(2, 0)
    first = 0
    for k in range(len(coasts)):
        end = first + int(strokes.rows[k, POINTS])
        total, run, pushes = length_between(flat_mm, first, end), 0.0, True
        until = total - coast_mm if coasts[k] and coast_mm < MOST_COASTED * total else np.inf
        for i in range(first, end):
            here, pushed = strokes.ways[i], strokes.ways[i, 3]
            step = length_between(flat_mm, i - 1, i + 1) if i > first else 0.0
            run += step
            if i > first and pushes and run >= until:
                before, share = strokes.ways[i - 1], 1.0 - (run - until) / step if step > 0.0 else 1.0
                x, y = before[0] + share * (here[0] - before[0]), before[1] + share * (here[1] - before[1])
                add_point(out, done, x, y, before[2] + share * (here[2] - before[2]), share * pushed)
                out.rows[k, POINTS] += 1
                pushes = False
            add_point(out, done, here[0], here[1], here[2], pushed if pushes else 0.0)
        first = end
    return Moves(out.ways[: done[0]], out.rows)


def run_in(strokes: Moves, layer: Layer, more_mm: float, profile: Profile) -> float:
    """Add the filament due after a turn to the strokes of a layer; returns the amount added, mm.

    A stroke takes up to half more than its nominal filament; visible strokes take it only in a layer without others.
    """
    if more_mm <= 0.0:
        return 0.0
    seen, taken_mm = layer.is_of(*SEEN), 0.0
    filament_mm2 = 0.25 * pi * profile.material.diameter_mm**2
    fastest = stroke_filament_mm_s(profile)
    needed_mm = bead_area_mm2(layer.width_mm, layer.height_mm) * profile.material.flow / filament_mm2  # per millimetre
    ends = np.cumsum(strokes.rows[:, POINTS].astype(np.int64))
    for k in np.flatnonzero(~seen | seen.all()).tolist():
        if taken_mm >= more_mm:
            break
        way = strokes.ways[ends[k] - int(strokes.rows[k, POINTS]) : ends[k]]
        length, pushed = np.linalg.norm(np.diff(way[:, :3], axis=0), axis=1), way[1:, 3]
        run = np.where(np.cumsum(length) - length < RUN_MM, length, 0.0)
        more = min(more_mm - taken_mm, float((MOST_FULL * needed_mm[k] * length - pushed)[run > 0.0].sum()))
        if more > 0.0:
            taken_mm += more
            pushed += more * run / run.sum()
            densest = float((pushed[length > 0.0] / length[length > 0.0]).max())
            strokes.rows[k, SPEED] = min(strokes.rows[k, SPEED], fastest / densest)
    return taken_mm


@kernel
def _lay(strokes: Moves, apart: Mask, approach: Floats, approach_starts: Indices, begin: Floats, speeds: Speeds) -> Moves:
    """Strokes with travels, along the approach, to those that do not begin at the end of the previous one.

    begin: (5,) X Y Z of the tip, Z of the crossing to the first stroke, and filament to push before that.
    """
    most = len(strokes.ways) + approach_starts[-1] - approach_starts[0] + 7 * len(apart) + 1  # three travels and a push
    out, done = Moves(table(most, 4), table(5 * len(apart), 6)), longs(2, 0)
    add_point(out, done, begin[0], begin[1], begin[2], 0.0)
    first = 0
    for k in range(len(strokes.rows)):
        start, points = strokes.ways[first], int(strokes.rows[k, POINTS])
        if apart[k]:
            over = begin[3] if k == 0 else start[2]
            at = out.ways[done[0] - 1]
            if abs(over - at[2]) > STANDING_MM:
                add_travel(out, done, approach[:0], at[0], at[1], over, speeds)
            add_travel(out, done, approach[approach_starts[k] : approach_starts[k + 1]], start[0], start[1], over, speeds)
            add_travel(out, done, approach[:0], start[0], start[1], start[2], speeds)
        if k == 0 and begin[4] > 0.0:
            add_point(out, done, start[0], start[1], start[2], begin[4])
            add_row(out, done, RETRACT, 1, speeds.filament_mm_s, np.inf)
        for i in range(first, first + points):
            add_point(out, done, strokes.ways[i, 0], strokes.ways[i, 1], strokes.ways[i, 2], strokes.ways[i, 3])
        for column in range(6):
            out.rows[done[1], column] = strokes.rows[k, column]
        done[1] += 1
        first += points
    return Moves(out.ways[1 : done[0]], out.rows[: done[1]])
