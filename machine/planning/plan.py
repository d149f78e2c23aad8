"""Plan: joins sliced parts to a program of strokes, travels and reorientations in machine coordinates, after a purge line on the
plate."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, product
from math import sqrt

import numpy as np

from machine.kinematics.collision import Printed, hull, join_hulls
from machine.kinematics.table import machine_points, part_shift, workpiece_points
from machine.planning import limits
from machine.planning.layer import Tip, go, print_layer, retract, standing_beside
from machine.planning.limits import axis_limits
from machine.planning.moves import TRAVEL, BeginLayer, BeginPart, MachineProgram, Pause, Reorient
from machine.planning.stand import Turn, beside, find_park_position, is_way_clear, obstacle_top_mm, over_print_mm, route
from machine.planning.stops import Stop, stops_by_layer
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Floats
from mdp.pose import Pose, level
from profiles.machine import Machine
from profiles.profile import Profile
from slicer.paths import NUMBER, Kind, Layer, Path, SlicedPart

PURGE_WIDTH = 2.0  # width of the purge line, in nozzle widths: a thick bead fills the nozzle soon and peels off in one piece
EDGE_MM, GAP_MM = 1.0, 3.0  # distance to the plate's edge and to prints near the plate
LOW_MM = 2.0  # prints higher above the plate pass over the line
MOST_LANES, SHORTEST_MM = 4, 10.0
OUTWARD = np.array([[0.0, -1.0], [-1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])  # front, left, right, rear: the front is the most visible


def plan(
    decomposition: Decomposition, sliced: Sequence[SlicedPart], profile: Profile, stops: Sequence[Stop] = ()
) -> MachineProgram:
    """The machine program of a decomposition's sliced parts, in print order; parts without a path are omitted.

    stops: where the print waits for the user. After the last part the table returns to level, for the next homing, and the tip
    moves aside. Raises SliceError for a stop at a missing layer; MoveError for a point outside the axis limits, or without a safe
    position of the head during a turn.
    """
    parts = {part.index: part for part in decomposition.parts}
    pieces = [piece for piece in sliced if any(len(layer) for layer in piece.layers)]
    machine = profile.machine
    tip = Tip(profile, np.zeros(3), level(machine), join_hulls([]))
    printed: list[Printed] = []
    done: list[tuple[Part, SlicedPart]] = []
    begins_level = bool(pieces) and parts[pieces[0].index].pose == tip.pose  # the line is on the plate in its homed pose
    lanes = purge_lanes(decomposition.parts, pieces, profile) if begins_level else None
    stopped = stops_by_layer(stops, pieces)
    for piece in pieces:
        part = parts[piece.index]
        shift = part_shift(machine, part.pose, part.base.offset_mm)
        begin = BeginPart(part.index, part.pose, len(piece.layers), piece.unsupported)
        first = next(layer for layer in piece.layers if len(layer))
        target = np.array([*first.points[0], first.z_mm]) + shift
        is_limb = part.base.limbs_mm is not None
        tip.has_limbs = tip.has_limbs or is_limb
        across_mm = _turned(tip, part.pose, target, part.index) if printed else _begin(tip, begin, target, lanes)
        tip.mark(begin)
        _go_down(tip, target, across_mm)
        if is_limb or machine.table.clips:
            tip.beside = part.index, standing_beside(part, done if is_limb else [], machine)
        else:
            tip.beside = None
        _print_layers(tip, part, piece, shift, stopped)
        printed.append(_outline(part, piece, shift, machine))
        tip.printed = join_hulls(printed)
        done.append((part, piece))
    if pieces:
        _finish(tip, pieces[-1].index)
    program = MachineProgram.of(decomposition.name, tip.moves, tip.marks)
    limits.check(program, machine)
    return program


def _print_layers(tip: Tip, part: Part, piece: SlicedPart, shift: Floats, stopped: Mapping[tuple[int, int], bool]) -> None:
    """Print the layers of a part with the stops before them. shift: (3,) from the part's frame to the machine's; stopped: (part,
    layer) -> whether to change the filament before it."""
    for number, layer in enumerate(piece.layers, start=1):
        if (part.index, number) in stopped:
            _stop(tip, Pause(part.index, number, stopped[part.index, number]))
        if len(layer):
            z_mm = layer.z_mm + part.lifted_mm
            tip.mark(BeginLayer(part.index, number, z_mm, layer.height_mm, layer.fan, layer.nozzle_add_c))
            print_layer(tip, layer, layer.points_mm + shift, shift, on_plate=part.on_plate and number == 1)


def _outline(part: Part, piece: SlicedPart, shift: Floats, machine: Machine) -> Printed:
    """The hull of a printed part in the workpiece frame, plus half its widest bead."""
    widest_mm = max(float(layer.width_mm.max(initial=0.0)) for layer in piece.layers)
    corners = hull(piece.points_mm, 0.0).points_mm + shift
    return hull(workpiece_points(machine, part.pose, corners), 0.5 * widest_mm)


def _begin(tip: Tip, part: BeginPart, target: Floats, lanes: Floats | None) -> float:
    """Travel to the first part, over the purge line; returns Z of the crossing. lanes: (n, 3) machine points of the line. The
    tip's position after the start block is unknown: the first two travels represent going up, then across."""
    machine, near = tip.profile.machine, target if lanes is None else lanes[0]
    most = machine.z.limits_mm[1]
    tip.at_mm = np.array([*near[:2], min(obstacle_top_mm(machine, None, tip.pose) + machine.lift_mm, most)])
    way = route(Turn(tip.pose, part.pose, tip.at_mm, near), part.index, tip.printed, machine, tip.speeds)
    stand = np.array([*way.over_mm, way.z_mm])
    for speed in (tip.speeds.lift_mm_s, tip.speeds.travel_mm_s):
        tip.move(TRAVEL, np.array([stand, stand]), 0.0, speed)
    _turn(tip, part.pose)
    across_mm = way.across_z_mm
    if lanes is not None:
        _go_down(tip, lanes[0], across_mm)
        process, flow, none = tip.profile.process, tip.profile.material.flow, np.zeros((0, 2))
        path = Path(
            Kind.PURGE, lanes[:, :2], PURGE_WIDTH * machine.head.nozzle_mm, process.first_layer_speed_mm_s, flow, none, False
        )
        line = Layer.of(0.0, process.first_layer_height_mm, [path], 0.0)
        print_layer(tip, line, lanes, np.zeros(3), on_plate=True)
        retract(tip)
        across_mm = min(float(lanes[0, 2]) + machine.clearance_mm, most)
    return across_mm


def _go_down(tip: Tip, target: Floats, across_z_mm: float) -> None:
    """Travel up to a height, across to above a target, and down."""
    go(tip, [*tip.at_mm[:2], across_z_mm], [*target[:2], across_z_mm], target)


def _turned(tip: Tip, pose: Pose, target: Floats | None, part: int) -> float:
    """Retract, move to a stand above everything that may be higher, and turn the table; returns Z of the next crossing."""
    retract(tip)
    machine, turn = tip.profile.machine, Turn(tip.pose, pose, tip.at_mm, target)
    if tip.has_limbs:
        least_z_mm = over_print_mm(machine, tip.printed, turn.start), over_print_mm(machine, tip.printed, turn.end)
        turn = replace(turn, least_z_mm=least_z_mm)
    way = route(turn, part, tip.printed, machine, tip.speeds)
    go(tip, [*tip.at_mm[:2], way.z_mm], [*way.over_mm, way.z_mm])
    if tip.pose != pose:
        _turn(tip, pose)
        tip.run_in_mm = tip.profile.material.prime_extra_mm
    return way.across_z_mm


def _turn(tip: Tip, pose: Pose) -> None:
    """Turn the table."""
    speed = limits.turn_speed(pose.tilt_deg - tip.pose.tilt_deg, pose.turn_deg - tip.pose.turn_deg, tip.profile.machine)
    tip.mark(Reorient(pose, speed))


def _stop(tip: Tip, pause: Pause) -> None:
    """Retract and rise as far above table, cradle and print as Z allows, for a firmware that may then move the head aside."""
    machine = tip.profile.machine
    retract(tip)
    z = max(float(tip.at_mm[2]), obstacle_top_mm(machine, None, tip.pose)) + machine.lift_mm
    if tip.has_limbs:
        z = max(z, over_print_mm(machine, tip.printed, tip.pose))  # Z reaches it: the way to the part led over it
    go(tip, [*tip.at_mm[:2], min(z, machine.z.limits_mm[1])])
    tip.mark(pause)


def _finish(tip: Tip, part: int) -> None:
    """Retract, turn the table back to level, and move aside: a hot tip oozes, and the print must be accessible."""
    machine, printed = tip.profile.machine, tip.printed
    retract(tip)
    home = level(machine)
    if tip.pose != home:
        _turned(tip, home, None, part)
    park = find_park_position(machine, printed, tip.at_mm, home, beside(machine, printed, tip.at_mm, home))
    if park is None:
        go(tip, [*tip.at_mm[:2], min(float(tip.at_mm[2]) + machine.lift_mm, machine.z.limits_mm[1])])
    else:
        go(tip, park.lift_mm, park.stand_mm)


def purge_lanes(parts: Sequence[Part], sliced: Sequence[SlicedPart], profile: Profile) -> Floats | None:
    """(n, 3) machine points of the purge line along the plate's edge, in one to four lanes; None without space for it.

    The line keeps a distance from everything that any part prints near the plate; the head does not collide with the cradle.
    """
    machine, length_mm = profile.machine, profile.machine.purge_mm
    if length_mm <= 0.0:
        return None
    low, z_mm = _low_strokes(parts, sliced, machine), profile.process.first_layer_height_mm
    width_mm = PURGE_WIDTH * machine.head.nozzle_mm
    pose, (least, most) = level(machine), np.array(list(axis_limits(machine).values())[:3]).T
    for count, outward in product(range(1, MOST_LANES + 1), OUTWARD):
        lanes = _lanes(machine, outward, count, length_mm / count, width_mm)
        if lanes is None or (count > 1 and length_mm / count < SHORTEST_MM) or _touches(low, lanes, 0.5 * width_mm + GAP_MM):
            continue
        points = machine_points(machine, pose, np.column_stack([lanes, np.full(len(lanes), z_mm)]))
        reached = bool(((points >= least) & (points <= most)).all())
        if reached and all(is_way_clear(machine, pose, a, b) for a, b in pairwise(points)):
            return points
    return None


def has_purge(program: MachineProgram) -> bool:
    """Whether a program prints a purge line."""
    return bool((program.what == NUMBER[Kind.PURGE]).any())


def _low_strokes(parts: Sequence[Part], sliced: Sequence[SlicedPart], machine: Machine) -> Floats:
    """(m, 2, 2) ends, seen from above, of all beads near the plate, workpiece frame."""
    beads = [np.zeros((0, 2, 2))]
    for piece in sliced:
        part = next(part for part in parts if part.index == piece.index)
        ends = np.cumsum(np.concatenate([np.diff(layer.starts) for layer in piece.layers])) - 1
        placed = workpiece_points(machine, part.pose, piece.points_mm + part_shift(machine, part.pose, part.base.offset_mm))
        low = np.minimum(placed[:-1, 2], placed[1:, 2]) < LOW_MM
        low[ends[:-1]] = False  # a stroke's last point does not lead to the next stroke
        beads.append(np.stack([placed[:-1][low, :2], placed[1:][low, :2]], axis=1))
    return np.concatenate(beads)


def _lanes(machine: Machine, outward: Floats, count: int, length_mm: float, width_mm: float) -> Floats | None:
    """(2 count, 2) workpiece points of lanes across a direction, as far out on the plate as they fit."""
    half, deep = 0.5 * (length_mm + width_mm), count * width_mm
    if machine.table.size_mm is None:
        radius = machine.table.radius_mm - EDGE_MM
        edge = sqrt(radius**2 - half**2) if half < radius else 0.0
    else:
        along, across = (float(np.abs(outward) @ machine.table.size_mm[::step]) for step in (1, -1))
        edge = 0.5 * along - EDGE_MM if half <= 0.5 * across - EDGE_MM else 0.0
    if edge - deep <= 0.0:
        return None
    sideways = np.array([-outward[1], outward[0]])
    away = edge - width_mm * (np.repeat(np.arange(count), 2) + 0.5)
    turns = 0.5 * length_mm * np.array([-1.0, 1.0, 1.0, -1.0] * count)[: 2 * count]
    lanes: Floats = away[:, None] * outward + turns[:, None] * sideways
    return lanes


def _touches(beads: Floats, lanes: Floats, gap_mm: float) -> bool:
    """Whether any bead meets the lanes' bounding box grown by a gap."""
    low, high = lanes.min(axis=0) - gap_mm, lanes.max(axis=0) + gap_mm
    begin, step = beads[:, 0], beads[:, 1] - beads[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        first, last = (low - begin) / step, (high - begin) / step
    parallel = np.abs(step) < 1e-12
    inside = (begin >= low) & (begin <= high)
    enter = np.where(parallel, np.where(inside, -np.inf, np.inf), np.minimum(first, last)).max(axis=1, initial=-np.inf)
    leave = np.where(parallel, np.where(inside, np.inf, -np.inf), np.maximum(first, last)).min(axis=1, initial=np.inf)
    return bool(((enter <= leave) & (enter <= 1.0) & (leave >= 0.0)).any())
