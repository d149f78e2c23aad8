"""Plan: sliced parts in order become one program of strokes, travels and reorientations in machine coordinates."""

from collections.abc import Iterator, Sequence
from math import isnan, pi

import numpy as np

from machine.kinematics.collision import Printed, hull, join_hulls
from machine.kinematics.table import part_shift, workpiece_points
from machine.planning import limits
from machine.planning.lift import over_print_mm, standing_beads
from machine.planning.moves import BeginLayer, BeginPart, MachineProgram, Move, Pause, Reorient, Stroke, Travel, rows
from machine.planning.park_position import beside, find_park_position
from machine.planning.priming import run_in
from machine.planning.purge import purge_lanes, purge_width_mm
from machine.planning.reorient import Route, Speeds, Turn, route, top_z
from machine.planning.stops import Stop, stops_by_layer
from machine.planning.travel import Tip, go, lift_speed, prime, retract, to_path, travel_speed
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Floats
from mdp.pose import Pose, level
from profiles.profile import Profile
from slicer.paths import KINDS, Kind, Layer, Path, SlicedPart, bead_area_mm2
from slicer.strokes.speed import stroke_accelerations
from slicer.strokes.wiping import STANDING_MM, wipe_trail

MOST_COASTED = 0.25  # a path coasts over this share of its length at most


def plan(
    decomposition: Decomposition, sliced: Sequence[SlicedPart], profile: Profile, stops: Sequence[Stop] = ()
) -> MachineProgram:
    """The machine program of a decomposition's sliced parts, in print order; parts without a path are left out.

    stops: where the print waits for a person. After the last part the table goes back to level, so that the next print's homing
    finds it level, and the tip aside. Raises SliceError for a stop at a layer that is not there; MoveError: a point outside the
    axis limits, or no safe place for the head while the table turns.
    """
    parts = {part.index: part for part in decomposition.parts}
    pieces = [piece for piece in sliced if any(len(layer) for layer in piece.layers)]
    machine = profile.machine
    tip = Tip(np.zeros(3), level(machine))
    moves: list[Move] = []
    printed: list[Printed] = []
    done: list[tuple[Part, SlicedPart]] = []
    has_limbs = False  # from the first limb on, earlier parts may stand higher than the tip
    begins_level = bool(pieces) and parts[pieces[0].index].pose == tip.pose  # the line is on the plate as it was homed
    lanes = purge_lanes(decomposition.parts, pieces, profile) if begins_level else None
    stopped = stops_by_layer(stops, pieces)
    for piece in pieces:
        part = parts[piece.index]
        shift = part_shift(machine, part.pose, part.base.offset_mm)
        begin = BeginPart(part.index, part.pose, len(piece.layers), piece.unsupported)
        target = _first_point(piece) + shift
        is_limb = part.base.limbs_mm is not None
        has_limbs, earlier = has_limbs or is_limb, join_hulls(printed)
        standing = earlier if has_limbs else None
        if printed:
            moves += _reach(tip, begin, target, earlier, profile, standing)
        else:
            moves += _begin(tip, begin, target, lanes, profile)
        tip.limb = (part.index, standing_beads(part, done, machine)) if is_limb else None
        for number, layer in enumerate(piece.layers, start=1):
            if (part.index, number) in stopped:
                moves += _stop(tip, Pause(part.index, number, stopped[part.index, number]), profile, standing)
            if len(layer):
                begin_layer = BeginLayer(part.index, number, layer.z_mm, layer.height_mm, layer.fan, layer.nozzle_add_c)
                moves += [begin_layer, *_layer(tip, layer, shift, profile, on_plate=part.index == number == 1)]
        printed.append(_printed(piece, part, shift, profile))
        done.append((part, piece))
    if pieces:
        earlier = join_hulls(printed)
        moves += _finish(tip, pieces[-1].index, earlier, profile, earlier if has_limbs else None)
    program = MachineProgram.of(decomposition.name, moves)
    limits.check(program, rows(program, machine.tilt.zero_deg, machine.turn.zero_deg), machine)
    return program


def _begin(tip: Tip, part: BeginPart, target: Floats, lanes: Floats | None, profile: Profile) -> Iterator[Move]:
    """To the first part, over the purge line; lanes: (n, 3) machine points of it.

    Where the start block leaves the tip is not known: the first two travels stand for going up, then across.
    """
    machine, near = profile.machine, target if lanes is None else lanes[0]
    tip.at_mm = np.array([*near[:2], min(top_z(machine, tip.pose), machine.z.limits_mm[1])])
    way = _route(Turn(tip.pose, part.pose, tip.at_mm, near), part.index, join_hulls([]), profile)
    tip.at_mm = np.array([*way.over_mm, way.z_mm])
    for speed in (lift_speed(profile), travel_speed(profile)):
        yield Travel(np.array([tip.at_mm, tip.at_mm]), speed)
    yield _reorient(tip, part.pose, profile)
    if lanes is not None:
        yield from _down_to(tip, near, way.across_z_mm, profile)
        yield from _purge(tip, lanes, profile)
        yield from retract(tip, profile)
    yield part
    across_mm = way.across_z_mm if lanes is None else float(near[2]) + machine.clearance_mm
    yield from _down_to(tip, target, min(across_mm, machine.z.limits_mm[1]), profile)


def _purge(tip: Tip, lanes: Floats, profile: Profile) -> Iterator[Move]:
    """The line on the plate, from where the tip stands."""
    process, width_mm = profile.process, purge_width_mm(profile)
    path = Path(
        Kind.PURGE, lanes[:, :2], width_mm, process.first_layer_speed_mm_s, profile.material.flow, np.zeros((0, 2)), False
    )
    line = Layer.of(0.0, process.first_layer_height_mm, [path], 0.0)
    yield from _strokes(line, lanes, profile, stroke_accelerations(profile, True))
    tip.at_mm, tip.trail = lanes[-1], wipe_trail(lanes, width_mm)


def _reach(
    tip: Tip, part: BeginPart, target: Floats, printed: Printed, profile: Profile, standing: Printed | None
) -> Iterator[Move]:
    """Retract, lift, turn the table, cross over to above the target, go down; standing: what may be higher than both places."""
    yield from retract(tip, profile)
    way = _route(_turn(tip, part.pose, target, standing, profile), part.index, printed, profile)
    yield from _to_stand(tip, way, profile)
    if tip.pose != part.pose:
        yield _reorient(tip, part.pose, profile)
        tip.run_in_mm = profile.material.prime_extra_mm
    yield part
    yield from _down_to(tip, target, way.across_z_mm, profile)


def _down_to(tip: Tip, target: Floats, across_z_mm: float, profile: Profile) -> Iterator[Move]:
    """Up to a height, across to above a target, and down."""
    yield from go(tip, [*tip.at_mm[:2], across_z_mm], profile)
    yield from go(tip, [*target[:2], across_z_mm], profile)
    yield from go(tip, list(target), profile)


def _to_stand(tip: Tip, way: Route, profile: Profile) -> Iterator[Move]:
    """Straight up, then across to where the tip stands while the table turns."""
    yield from go(tip, [*tip.at_mm[:2], way.z_mm], profile)
    yield from go(tip, [*way.over_mm, way.z_mm], profile)


def _turn(tip: Tip, pose: Pose, target: Floats | None, standing: Printed | None, profile: Profile) -> Turn:
    """A turn of the table that leads over all that may stand."""
    if standing is None:
        return Turn(tip.pose, pose, tip.at_mm, target)
    before, after = (over_print_mm(profile.machine, standing, turned) for turned in (tip.pose, pose))
    return Turn(tip.pose, pose, tip.at_mm, target, (before, after))


def _route(turn: Turn, part: int, printed: Printed, profile: Profile) -> Route:
    return route(turn, part, printed, profile.machine, Speeds(lift_speed(profile), travel_speed(profile)))


def _reorient(tip: Tip, pose: Pose, profile: Profile) -> Reorient:
    speed = limits.turn_speed(pose.tilt_deg - tip.pose.tilt_deg, pose.turn_deg - tip.pose.turn_deg, profile.machine)
    tip.pose = pose
    tip.forget()
    return Reorient(pose, speed)


def _layer(tip: Tip, layer: Layer, shift: Floats, profile: Profile, *, on_plate: bool) -> Iterator[Move]:
    points = layer.points_mm + shift
    starts, approach, passed = layer.starts.tolist(), layer.approach + shift[:2], layer.approach_starts.tolist()
    strokes = _strokes(layer, points, profile, stroke_accelerations(profile, on_plate))
    steps = points[layer.starts[1:-1]] - points[layer.starts[1:-1] - 1]
    apart = [True, *(np.linalg.norm(steps, axis=1) > STANDING_MM).tolist()]  # a stroke may begin where the one before it ends
    for k, (stroke, retracts) in enumerate(zip(strokes, layer.retract.tolist(), strict=True)):
        if apart[k]:
            yield from to_path(tip, stroke.points_mm[0], approach[passed[k] : passed[k + 1]], retracts, shift, profile)
            yield from prime(tip, profile)
        yield run_in(stroke, layer, tip, profile)
        tip.printed.append((points[starts[k] : starts[k + 1]], layer, k, shift))
        tip.at_mm = stroke.points_mm[-1]


def _strokes(layer: Layer, points: Floats, profile: Profile, accelerations: dict[Kind, float] | None) -> Iterator[Stroke]:
    """The strokes of a layer whose points are at (n, 3) machine coordinates.

    Filament by volume (a stroke's flow holds the material's); the speed lowered to what axes, extruder and hot end can do.
    """
    machine, material = profile.machine, profile.material
    filament_mm2 = pi * material.diameter_mm**2 / 4.0
    area_mm2 = bead_area_mm2(layer.width_mm, layer.height_mm) * layer.flow
    with np.errstate(divide="ignore"):
        fastest = min(material.volumetric_limit_mm3_s, machine.extruder_speed_mm_s * filament_mm2) / np.maximum(area_mm2, 0.0)
    speeds = limits.travel_speeds(points, layer.starts, np.minimum(layer.speed_mm_s, fastest), machine)
    steps = np.diff(layer.points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    filament_mm = lengths * np.repeat(area_mm2, np.diff(layer.starts))[1:] / filament_mm2
    coasts = np.append(layer.retract[1:], False) & (material.coast_mm > 0.0)
    starts, columns = layer.starts.tolist(), (layer.kind, speeds, layer.width_mm, layer.own_fan, coasts)
    for k, (number, speed, width_mm, fan, coast) in enumerate(zip(*(column.tolist() for column in columns), strict=True)):
        kind, way, pushed = KINDS[number], points[starts[k] : starts[k + 1]], filament_mm[starts[k] : starts[k + 1] - 1]
        if coast:
            way, pushed = _coasted(way, lengths[starts[k] : starts[k + 1] - 1], pushed, material.coast_mm)
        acceleration = None if accelerations is None else accelerations[kind]
        yield Stroke(kind, way, pushed, speed, width_mm, None if isnan(fan) else fan, acceleration)


def _stop(tip: Tip, pause: Pause, profile: Profile, standing: Printed | None) -> Iterator[Move]:
    """Retract and go straight up, above all of table and cradle as far as Z allows: a firmware may then move the head aside.

    standing: what may be higher than the tip, which rises above all of it.
    """
    machine = profile.machine
    yield from retract(tip, profile)
    z = max(float(tip.at_mm[2]) + machine.lift_mm, top_z(machine, tip.pose))
    if standing is not None:
        z = max(z, over_print_mm(machine, standing, tip.pose))  # Z reaches it: the way to the part led over it
    yield from go(tip, [*tip.at_mm[:2], min(z, machine.z.limits_mm[1])], profile)
    yield pause


def _coasted(points: Floats, lengths: Floats, filament_mm: Floats, coast_mm: float) -> tuple[Floats, Floats]:
    """Points and filament of a stroke whose last coast_mm push nothing; a step is cut where that begins."""
    done = np.cumsum(lengths)
    if coast_mm >= MOST_COASTED * float(done[-1]):
        return points, filament_mm
    until = float(done[-1]) - coast_mm
    k = int(np.searchsorted(done, until))
    share = 1.0 - (done[k] - until) / lengths[k] if lengths[k] > 0.0 else 1.0
    points = np.insert(points, k + 1, points[k] + share * (points[k + 1] - points[k]), axis=0)
    pushed = np.insert(filament_mm, k, share * filament_mm[k])
    pushed[k + 1 :] = 0.0
    return points, pushed


def _finish(tip: Tip, part: int, printed: Printed, profile: Profile, standing: Printed | None) -> Iterator[Move]:
    """Retract, bring the table back to level, and go aside: a hot tip drips where it stands, and the print is to be taken off.

    standing: what may be higher than the tip.
    """
    machine = profile.machine
    yield from retract(tip, profile)
    home = level(machine)
    if tip.pose != home:
        way = _route(_turn(tip, home, None, standing, profile), part, printed, profile)
        yield from _to_stand(tip, way, profile)
        yield _reorient(tip, home, profile)
    park = find_park_position(machine, printed, tip.at_mm, home, beside(machine, printed, tip.at_mm, home))
    if park is None:
        yield from go(tip, [*tip.at_mm[:2], min(float(tip.at_mm[2]) + machine.lift_mm, machine.z.limits_mm[1])], profile)
        return
    yield from go(tip, list(park.lift_mm), profile)
    yield from go(tip, list(park.stand_mm), profile)


def _first_point(piece: SlicedPart) -> Floats:
    """(3,) part frame: where the first stroke begins."""
    layer = next(layer for layer in piece.layers if len(layer))
    return np.array([*layer.points[0], layer.z_mm])


def _printed(piece: SlicedPart, part: Part, shift: Floats, profile: Profile) -> Printed:
    """What a finished part covers, in the workpiece frame."""
    widest = max(float(layer.width_mm.max(initial=0.0)) for layer in piece.layers)
    corners = hull(piece.points_mm, 0.0).points_mm
    return hull(workpiece_points(profile.machine, part.pose, corners + shift), 0.5 * widest)
