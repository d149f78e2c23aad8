"""User-defined planes: cuts made in turn, completed by the search where a value is missing, or rejected with the reason.

A plane is rejected only if it cannot be printed: it misses the model, cuts the plate, leaves a floating piece, is out of the
machine's reach, makes the head meet the table, leaves a sliver or a base that the nozzle could break, or passes through a
[[keep]] zone. A small gain, a small part or a long seam is the user's own decision.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from math import ceil, cos, floor, radians, sin

import numpy as np

from mdp.clearance import find_obstacle, lowest_body
from mdp.cut import above, divide, mesh_of, passing_places
from mdp.directions.unit_vectors import frame_across
from mdp.mesh import NO_COLOUR, Floats, Mesh, colour_text
from mdp.overhang import BASE_TOLERANCE_MM, threshold
from mdp.plane import Plane
from mdp.pose import poses
from mdp.ranking.candidates import COPLANAR_MM, REASONS, Bounds, Reason, check, gain_mm2, residual_mm2
from mdp.ranking.node import Node
from mdp.search.plan_file import ZONE_KINDS, PlanFile, PlannedPart, mesh_sha256
from mdp.search.problem import FINEST, Problem
from mdp.sweep.limbs import limb_mesh
from mdp.sweep.sweep import gains
from mdp.zone import FARTHEST_MM, Brushed, Grown, Painted
from profiles.errors import CutError, PlanError
from profiles.messages import key_name, phrase

EQUAL_MM2 = 1e-6
SHIFT_MM, MOST_SHIFTS = 0.1, 10  # shifts of the planes around an infeasible one, for each lean
LEANS_DEG = (0.0, 1.0, 3.0)
MOST_PLACES = 400  # offsets along a normal that are checked for the nearest feasible plane
FARTHER_LEANS_DEG = (*LEANS_DEG, 10.0, 30.0)  # on a model with steps all the way up only these avoid the steps
OUT_OF_REACH = "what it stands on is out of reach"
LIMB_SHIFT_MM = 0.5  # between the offsets tried for limbs, each of which is checked separately
MOST_SHOWN = 8  # colours in a message


def check_plan(plan: PlanFile, mesh: Mesh, name: str) -> None:
    """Raise PlanError if a plan belongs to another model, or names faces that the model lacks, by colour, number or point."""
    if plan.sha256 and plan.sha256 != mesh_sha256(mesh):
        raise PlanError(
            f"{plan.label.removesuffix(': ') or 'the plan'} was made for another model: "
            f"{plan.model or 'its model'} is not {name} as it is read now "
            f"(the file has changed, or {key_name('process.scale')}, {key_name('process.rotate_deg')} or "
            f"{key_name('search.pedestal_mm')}; without the line sha256 the "
            "planes are tried all the same)"
        )
    for kind in ZONE_KINDS:
        for number, zone in enumerate(getattr(plan.zones, kind), start=1):
            label = f"{plan.label}{kind} {number}:"
            if isinstance(zone, Painted):
                _check_colour(zone, mesh, name, f"{label} colour is {colour_text(zone.colour)}")
            elif isinstance(zone, Brushed):
                zone.check_on(mesh, f"{label} ")
            elif isinstance(zone, Grown) and (away_mm := zone.away_mm(mesh)) > FARTHEST_MM:
                point = ", ".join(f"{x:g}" for x in zone.point_mm)
                raise PlanError(f"{label} point_mm is [{point}], {away_mm:.3g} mm from {name}: up to {FARTHEST_MM:g} is allowed")


def _check_colour(zone: Painted, mesh: Mesh, name: str, label: str) -> None:
    if mesh.colours is None:
        raise PlanError(f"{label}, but {name} paints no face: a 3MF, PLY, GLB or STEP file with colours is expected")
    used = [colour for colour in np.unique(mesh.colours).tolist() if colour != NO_COLOUR]
    if zone.colour not in used:
        shown = ", ".join(map(colour_text, used[:MOST_SHOWN])) + (", ..." if len(used) > MOST_SHOWN else "")
        raise PlanError(f"{label}, but no face of {name} is painted so; its colours are {shown}")


def cut_by_hand(problem: Problem, plan: PlanFile) -> Node:
    """The node after the cuts of all planned parts, from the last one in print order. Raises PlanError, and CutError for an
    infeasible plane.
    """
    node, least_mm = problem.root, FINEST * problem.settings.offset_step_mm
    for number in range(len(plan.parts) + 1, 1, -1):
        planned, label = plan.parts[number - 2], f"{plan.label}part {number}"
        offset_mm = planned.offset_mm  # a grid of offsets through a plane next to the origin would have too many planes
        if offset_mm is not None and 0.0 < abs(offset_mm) < least_mm:
            raise PlanError(f"{label}: offset_mm is {offset_mm:g}: 0 or at least {least_mm:g} is allowed")
        child = try_planes(problem, node, [planned.plane or _complete(problem, node, planned, label)])
        if isinstance(child, Rejection):
            raise CutError(f"{label} cannot be cut off: {child.text}", part=number, reason=child.text)
        node = child
    return node


@dataclass(frozen=True, eq=False)
class Rejection:
    """Why a user's plane cannot cut a node. reason: the failed check, FEASIBLE if there is nothing to cut."""

    node: Node
    text: str
    reason: Reason = Reason.FEASIBLE


def try_planes(problem: Problem, node: Node, planes: Sequence[Plane]) -> Node | Rejection:
    """The node after a user's cuts in turn, or the rejection of the first impossible one."""
    for plane in planes:
        child = _cut(problem, node, plane)
        if isinstance(child, Rejection):
            return child
        node = child
    return node


def _cut(problem: Problem, node: Node, plane: Plane) -> Node | Rejection:
    """The node after a user's cut, or its rejection."""
    named = name_limbs(node, plane)
    if isinstance(named, Rejection):
        return named
    why = _find_violation(problem, node, named)
    if why is not None:
        return why
    child = problem.cut(node, named)
    if child is not None:
        return child
    if named.limbs_mm is None:
        return Rejection(node, OUT_OF_REACH, Reason.REACH)
    return _find_collision(problem, node, named) or Rejection(node, REASONS[Reason.FLOATING], Reason.FLOATING)


def name_limbs(node: Node, plane: Plane) -> Plane | Rejection:
    """A plane whose limbs are given by vertices. A point selects the nearest piece above the plane; unless all points are
    vertices, each piece is represented by its farthest vertex. If the limbs are everything above the plane, limbs_mm is None.
    """
    if plane.limbs_mm is None:
        return plane
    limbs, standing = divide(above(node.solid, plane), plane.limbs_mm)
    if limbs.is_empty():
        return Rejection(node, "nothing lies above its plane")
    surface = mesh_of(limbs)
    away_mm = [surface.distance_mm(point) for point in plane.limbs_mm]
    if max(away_mm) > FARTHEST_MM:
        place = ", ".join(f"{x:.4g}" for x in plane.limbs_mm[int(np.argmax(away_mm))])
        return Rejection(node, f"no piece above its plane lies at {place}: the nearest one is {max(away_mm):.3g} mm away")
    if standing.is_empty():
        return replace(plane, limbs_mm=None)
    high = surface.vertices[plane.heights_mm(surface.vertices) > BASE_TOLERANCE_MM]
    bodies = [mesh_of(piece) for piece in limbs.decompose() if piece.volume() > 0.0]  # the others are voids
    if len(bodies) == len(plane.limbs_mm) and all((high == point).all(axis=1).any() for point in plane.limbs_mm):
        return plane
    tops = [body.vertices[np.argmax(body.vertices @ plane.normal)] for body in bodies]
    return replace(plane, limbs_mm=np.array(tops))


def cut_near(problem: Problem, node: Node, plane: Plane) -> Node | None:
    """The node after a cut by the nearest feasible plane: the plane itself, a shifted one, or one that leans by a few degrees;
    None if there is none.
    """
    children = (try_planes(problem, node, [near]) for near in chain([plane], _beside(problem, node, plane)))
    return next((child for child in children if isinstance(child, Node)), None)


def _beside(problem: Problem, node: Node, plane: Plane) -> Iterator[Plane]:
    """Feasible planes around an infeasible one, by the sweep: shifted ones, nearest first, then leaning ones."""
    if plane.limbs_mm is not None:  # one by one, leaning about the limbs' section
        passed = passing_places(limb_mesh(node.remainder, plane), plane)
        middle = passed.mean(axis=0) if len(passed) else plane.offset_mm * plane.normal
        for lean_deg in LEANS_DEG:
            for normal in _leaning(plane.normal, lean_deg):
                for shift in sorted(range(-MOST_SHIFTS, MOST_SHIFTS + 1), key=abs):
                    offset_mm = float(normal @ middle) + SHIFT_MM * shift
                    yield from _if_feasible(problem, node, replace(plane, normal=normal, offset_mm=offset_mm))
        return
    vertices, passed = node.remainder.mesh.vertices, passing_places(node.remainder.mesh, plane)
    if len(passed) == 0:
        return
    middle = passed.mean(axis=0)
    shifts = np.arange(-MOST_SHIFTS, MOST_SHIFTS + 1)
    for lean_deg in LEANS_DEG:
        normals = _leaning(plane.normal, lean_deg)
        offsets = (np.rint(normals @ middle / SHIFT_MM)[:, None] + shifts) * SHIFT_MM
        heights = vertices @ normals.T
        row, column = np.nonzero((heights.min(axis=0) < offsets.T).T & (heights.max(axis=0) > offsets.T).T)
        checked = check(node.remainder, _limits(problem, normals), SHIFT_MM, row.astype(np.int32), offsets[row, column])
        for place in np.argsort(np.abs(shifts[column]), kind="stable"):
            if checked.reason[place] == Reason.FEASIBLE:
                yield Plane(normals[row[place]], float(offsets[row[place], column[place]]))


def planes_near(problem: Problem, node: Node, plane: Plane) -> Iterator[Plane]:
    """Feasible planes by the sweep, over the whole height of the remainder: first those with the same normal, nearest first, then
    those that lean by a few degrees.
    """
    vertices = node.remainder.mesh.vertices
    if plane.limbs_mm is not None:  # along its normal only
        heights = vertices @ plane.normal
        low, high = float(heights.min()), float(heights.max())
        offsets = np.arange(low, high, max(LIMB_SHIFT_MM, (high - low) / MOST_PLACES))
        for offset_mm in offsets[np.argsort(np.abs(offsets - plane.offset_mm), kind="stable")]:
            yield from _if_feasible(problem, node, replace(plane, offset_mm=float(offset_mm)))
        return
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    middle = middle - plane.heights_mm(middle[None])[0] * plane.normal  # pivot of the planes that lean
    for lean_deg in FARTHER_LEANS_DEG:
        for normal in _leaning(plane.normal, lean_deg):
            heights = vertices @ normal
            low, high = float(heights.min()), float(heights.max())
            step_mm = max(SHIFT_MM, (high - low) / MOST_PLACES)
            offsets = np.arange(floor(low / step_mm) + 1, ceil(high / step_mm)) * np.float64(step_mm)
            limits, row = _limits(problem, normal[None]), np.zeros(len(offsets), np.int32)
            free = offsets[check(node.remainder, limits, step_mm, row, offsets).reason == Reason.FEASIBLE]
            for offset_mm in free[np.argsort(np.abs(free - normal @ middle), kind="stable")]:
                yield Plane(normal, float(offset_mm))


def _if_feasible(problem: Problem, node: Node, plane: Plane) -> Iterator[Plane]:
    """Yields the plane with its limbs named, if it is feasible."""
    named = name_limbs(node, plane)
    if isinstance(named, Plane) and rejection(problem, node, named) is None:
        yield named


def _leaning(normal: Floats, lean_deg: float) -> Floats:
    """(k, 3) normals that lean to four sides; the normal itself for 0."""
    if lean_deg == 0.0:
        return normal[None]
    aside, across = frame_across(normal)
    return cos(radians(lean_deg)) * normal + sin(radians(lean_deg)) * np.stack([aside, -aside, across, -across])


def rejection(problem: Problem, node: Node, plane: Plane) -> Rejection | None:
    """Why a user's plane cannot cut a node, without cutting; None if it can."""
    return _find_violation(problem, node, plane) or _find_collision(problem, node, plane)


def _find_collision(problem: Problem, node: Node, plane: Plane) -> Rejection | None:
    """A rejection if the head would meet parts standing beside the limbs of a plane; None if it would not."""
    if plane.limbs_mm is None or problem.is_clear(node, plane):
        return None
    return Rejection(node, REASONS[Reason.STANDING], Reason.STANDING)


def _find_violation(problem: Problem, node: Node, plane: Plane) -> Rejection | None:
    """Why a plane cannot cut a node, parts beside limbs aside: it cuts nothing, the sweep rejects it, or no pose works for the
    part.
    """
    missed = _missed_reason(problem, node, plane)
    if missed is not None:
        return Rejection(node, missed)
    limits = _limits(problem, plane.normal[None])
    reason, sliver_mm = problem.check(node, plane, limits)
    if reason != Reason.FEASIBLE:
        return Rejection(node, _reason_text(problem, node, plane, limits, reason, sliver_mm), reason)
    if not problem.settings.clearance:
        return None
    points, machine = node.corners_cut(plane) + problem.place_mm, problem.machine
    if len(points) == 0:
        return Rejection(node, "nothing lies above its plane", Reason.REACH)
    obstacles = [find_obstacle(machine, pose, points) for pose in poses(machine, plane.normal)]
    if any(obstacle is None for obstacle in obstacles):
        return None
    return Rejection(
        node, "; the other way round ".join(obstacle for obstacle in obstacles if obstacle) or OUT_OF_REACH, Reason.REACH
    )


def _limits(problem: Problem, directions: Floats) -> Bounds:
    """The bounds of (k, 3) directions, without preferences that are not physical limits."""
    return replace(problem.bounds_along(directions), least_volume_mm3=0.0, least_interface_mm2=0.0)


def _reason_text(problem: Problem, node: Node, plane: Plane, limits: Bounds, reason: Reason, sliver_mm: float) -> str:
    """A rejection by the sweep as a message with numbers."""
    text = REASONS[reason]
    match reason:
        case Reason.PLATFORM:
            least, offset = f"{ceil(10.0 * limits.least_offset_mm[0]) / 10.0:g}", f"{plane.offset_mm:.3g}"
            by_file = f"offset_mm must be at least {least} (now {offset})"
            text += f"; {phrase('page', by_file, f'move it to {least} mm or more at this tilt (now {offset})')}"
        case Reason.REACH:
            text += f" of its normal on {problem.machine.name}"
        case Reason.CLEARANCE:
            needed, body, _ = min(lowest_body(problem.machine, pose) for pose in poses(problem.machine, plane.normal))
            text = f"the head's {body} would meet the table: what is cut off must begin at least {needed:.1f} mm above it"
            top_mm = float(problem.mesh.bounds_mm[1, 2])
            if needed >= top_mm:
                which = "this model" if problem.limits.least_height_mm.min() >= top_mm else "this model at this tilt"
                text += f", and the model is {top_mm:.1f} mm high: {problem.machine.name} cannot cut {which}"
        case Reason.INTERFACE:
            text = "a piece of it would float: nothing printed before lies below it"
        case Reason.FRAGILE:
            visible = f"{sliver_mm:.2g}" if sliver_mm >= 1e-4 else "less than 0.001"
            sliver = f"its plane would leave a sliver {phrase('page', f'{sliver_mm:.2g}', visible)} mm thin"
            text = f"{sliver}: {limits.fragile_mm:g} is the least ({key_name('search.fragile_mm')})"
        case Reason.KEEP:
            number = problem.zones.crossed(plane)
            zone = phrase("protected", f"zone {number} of [[keep]], which stays whole", number)
            text = f"its plane would pass through {zone}"
        case Reason.WEAK:
            stress = f"{problem.stress_mpa(node, plane):.3g} MPa at its base, {problem.bearable_mpa:.3g} are allowed"
            text += f": {problem.settings.nozzle_load_n:g} N at its top are {stress}"
    return text


def _missed_reason(problem: Problem, node: Node, plane: Plane) -> str | None:
    """Why a plane cuts nothing: it misses the model, or later parts already contain what it would cut."""
    heights = plane.heights_mm(node.remainder.mesh.vertices)
    if heights.min() < -COPLANAR_MM and heights.max() > COPLANAR_MM:
        return None
    whole = plane.heights_mm(problem.mesh.vertices) + plane.offset_mm
    if whole.min() < plane.offset_mm - COPLANAR_MM and whole.max() > plane.offset_mm + COPLANAR_MM:
        side = "above" if heights.max() <= COPLANAR_MM else "below"
        return f"nothing is left {side} its plane, later parts have taken it: change the order"
    return (
        f"its plane misses the model: along its normal the model lies between {whole.min():.1f} and {whole.max():.1f} mm, "
        f"{phrase('offset', f'offset_mm is {plane.offset_mm:.6g}', f'{plane.offset_mm:.1f}')}"
    )


def _complete(problem: Problem, node: Node, planned: PlannedPart, label: str) -> Plane:
    """The plane of a part whose normal or offset is missing: the feasible one that saves most, among equals the one with the
    largest part. Raises PlanError if there is none.
    """
    if planned.normal is None and planned.offset_mm is None:
        raise PlanError(f"{label} has neither normal nor offset_mm: leave it out, the search adds parts by itself")
    directions = problem.limits.directions if planned.normal is None else np.array([planned.normal])
    limits, step_mm = _limits(problem, directions), problem.step_mm(planned.offset_mm or 0.0)
    swept = gains(node.remainder, directions, step_mm, threshold(problem.terms.angle_deg))
    wanted = swept.used
    if planned.offset_mm is not None:
        wanted &= swept.first[:, None] + np.arange(wanted.shape[1]) == round(planned.offset_mm / step_mm)
    direction = np.nonzero(wanted)[0]
    missing = "normal" if planned.normal is None else "offset_mm"
    if len(direction) == 0:
        raise PlanError(f"{label}: no {missing} can be found for it, no such plane cuts what is left of the model")
    offset_mm, gains_mm2 = swept.offsets_mm(step_mm)[wanted], gain_mm2(swept, residual_mm2(swept, problem.terms))[wanted]
    reason = check(node.remainder, limits, step_mm, direction.astype(np.int32), offset_mm).reason
    for row in np.lexsort((offset_mm, -directions[direction, 2], -np.round(gains_mm2 / EQUAL_MM2))):
        if reason[row] == Reason.FEASIBLE:
            offset = float(offset_mm[row]) if planned.offset_mm is None else planned.offset_mm
            plane = Plane(directions[direction[row]], offset)
            if _find_violation(problem, node, plane) is None and problem.cut(node, plane) is not None:
                return plane
    counts = [(int((reason == why).sum()), text) for why, text in REASONS.items()]
    shares = "; ".join(f"{count} because {text}" for count, text in counts if count)
    feasible = f"{int((reason == Reason.FEASIBLE).sum())} because no pose serves them"
    raise PlanError(f"{label}: no {missing} can be found for it among {len(reason)}: {shares or feasible}")
