"""Polish: improve the final sequence of cuts of a search, with fewer cuts and off the grid of candidates; never worse.

Cuts that no longer save anything are dropped, every plane is moved while the forecast cost falls and the plane stays feasible,
and further cuts are added where there is room. The result is judged by its cost after cutting again.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from math import cos, radians, sin

import numpy as np

from mdp.cost.forecast import Forecast
from mdp.cost.symmetry import Mirror
from mdp.cut import passing_places
from mdp.directions.orientation import diameter_mm
from mdp.directions.unit_vectors import framed
from mdp.mesh import Floats
from mdp.overhang import BASE_TOLERANCE_MM
from mdp.plane import Plane
from mdp.ranking.node import Node
from mdp.ranking.ranking import rank_by_trade_off
from mdp.search.front import EQUAL
from mdp.search.neck import find_neck
from mdp.search.problem import Problem
from mdp.sweep.limbs import limb_mesh

# in offset steps, and degrees: the grid's directions are about 4.5 apart
STEPS = ((1.0, 3.0), (0.5, 1.5), (0.25, 0.75), (0.125, 0.375))
ROUNDS = 4  # moves by one step before the next smaller one
TRIES = 2  # moved planes that are cut before a plane stays where it is
ENOUGH = 1e-3  # a move that saves a smaller share of the risky area is not worth a cut
SAME_MM2 = 1e-6
# two planes this close to each other's mirror image are meant to be symmetric
PARTNER_COSINE, PARTNER_MM = cos(radians(20.0)), 5.0
NECK_REACH = 0.06  # share of the model's diameter: search range for necks around a plane
TRADE_OFF = 4.0  # trade-off for further cuts, as in the beam's second slot


def polish(problem: Problem, node: Node) -> Node:
    """The node with its cuts polished, and with further cuts if there is room."""
    best = refine_planes(problem, _drop_cuts(problem, node))
    longer = _add_cuts(problem, best)
    if longer is not best:
        longer = refine_planes(problem, _drop_cuts(problem, longer))
    return min((node, best, longer), key=lambda last: (last.cost_mm2, len(last.cuts)))


def make_regular(problem: Problem, node: Node, mirrors: Sequence[Mirror]) -> Node:
    """Move a node's planes to where a designer would put them, if the cost stays about equal: to necks, along large flats, and
    symmetric about mirror planes. Planes that lean slightly across a mirror become square to it, and of two nearly symmetric
    planes one becomes the other's mirror image.
    """
    most_mm2 = node.cost_mm2 * (1.0 + EQUAL)
    best = node
    of_mirrors = [partial(change, mirror=mirror) for change, mirror in product((_stand_upright, _pair), mirrors)]
    along = [partial(_align, problem)] if problem.terms.stair_weight > 0.0 else []
    for change in (partial(_move_to_neck, problem), *along, *of_mirrors):
        for position in range(len(problem.start.cuts), len(best.planes)):
            for planes in change(best, position):
                changed = None if problem.late() else problem.replay(best.path[position], planes)
                if changed is not None and changed.cost_mm2 <= most_mm2:
                    best = changed
                    break
    return best


def _move_to_neck(problem: Problem, last: Node, position: int) -> Iterator[list[Plane]]:
    """The planes from a position, the first of them moved to a nearby neck."""
    here, *later = last.planes[position:]
    node, face = last.path[position], _cut_face(last.path[position + 1])
    mesh, seen = node.remainder.mesh, node.seam_weights
    reach_mm = NECK_REACH * diameter_mm(problem.mesh)
    if here.limbs_mm is not None:  # rims of other limbs do not count
        away_mm = np.linalg.norm(mesh.vertices[mesh.faces].mean(axis=1) - face.mean(axis=0), axis=1)
        seen = np.where(away_mm < np.ptp(face, axis=0).max() + reach_mm, seen, 0.0)
    neck = find_neck(mesh, seen, here, reach_mm)
    if neck is not None:
        yield [replace(neck, limbs_mm=here.limbs_mm), *later]


def _align(problem: Problem, last: Node, position: int) -> Iterator[list[Plane]]:
    """The planes from a position, the first of them turned so that its part shows less stair-stepping on large flats."""
    here, *later = last.planes[position:]
    middle = _cut_face(last.path[position + 1]).mean(axis=0)
    for normal in problem.flats.beside(here.normal, problem.least_z):
        yield [replace(here, normal=normal, offset_mm=float(normal @ middle)), *later]


def _stand_upright(last: Node, position: int, mirror: Mirror) -> Iterator[list[Plane]]:
    """The planes from a position, the first of them made square to a mirror, if it nearly is."""
    here, *later = last.planes[position:]
    upright = mirror.upright(here, _cut_face(last.path[position + 1]).mean(axis=0))
    if upright is not None:
        yield [upright, *later]


def _pair(last: Node, position: int, mirror: Mirror) -> Iterator[list[Plane]]:
    """The planes from a position, with a nearly symmetric plane replaced by the mirror image of the first, or the other way
    round.
    """
    here, *later = last.planes[position:]
    vertices = last.path[position].remainder.mesh.vertices
    image = _image(mirror, here, vertices)
    for number, partner in enumerate(later):
        if float(partner.normal @ image.normal) > PARTNER_COSINE and abs(partner.offset_mm - image.offset_mm) < PARTNER_MM:
            yield [here, *later[:number], image, *later[number + 1 :]]
            yield [_image(mirror, partner, vertices), *later]


def _image(mirror: Mirror, plane: Plane, vertices: Floats) -> Plane:
    """A plane's mirror image; its limbs are given by the vertices above it nearest to the images of their points."""
    image = mirror.image(plane)
    if image.limbs_mm is None:
        return image
    above = vertices[image.heights_mm(vertices) > 0.0]
    if len(above) == 0:
        return image
    nearest = [int(np.argmin(np.linalg.norm(above - point, axis=1))) for point in image.limbs_mm]
    return replace(image, limbs_mm=above[nearest])


def _drop_cuts(problem: Problem, best: Node) -> Node:
    """Drop the cuts that save nothing, trying the earliest first."""
    position = len(problem.start.cuts)
    while position < len(best.planes) and not problem.late():
        before, planes = best.path[position], best.planes[position:]
        surface, shorter = Forecast.of(before.remainder, before.terms), None
        if surface.left_mm2(planes[1:]) <= surface.left_mm2(planes) + SAME_MM2:
            shorter = problem.replay(before, planes[1:])
        if shorter is not None and shorter.cost_mm2 <= best.cost_mm2 + SAME_MM2:
            best = shorter
        else:
            position += 1
    return best


def refine_planes(problem: Problem, best: Node) -> Node:
    """Refine all planes of a node in turn by local search on their offset and tilt, in the order of the cuts."""
    enough_mm2 = ENOUGH * problem.model.risky_mm2
    for position in range(len(problem.start.cuts), len(best.planes)):
        if problem.late():
            break
        before = best.path[position]
        surface = Forecast.of(before.remainder, before.terms)
        ever_better = list(_local_search(problem, surface, best, position))
        for planes in ever_better[: -TRIES - 1 : -1]:
            if problem.late() or before.residual_mm2 + surface.left_mm2(planes) > best.cost_mm2 - enough_mm2:
                break
            moved = problem.replay(before, planes)
            if moved is not None and moved.cost_mm2 < best.cost_mm2:
                best = moved
                break
    return best


def _add_cuts(problem: Problem, node: Node) -> Node:
    """Add further cuts, the best one at a time, while they reduce the cost."""
    while not problem.full(node) and not problem.late():
        table = problem.table(node)
        ranked = rank_by_trade_off([table], TRADE_OFF, node.cost_mm2)
        child = next((child for found in ranked if (child := problem.cut_row(table, found.row)) is not None), None)
        if child is None or child.cost_mm2 >= node.cost_mm2:
            break
        node = child
    return node


def _local_search(problem: Problem, surface: Forecast, last: Node, position: int) -> Iterator[list[Plane]]:
    """Local search on the plane at a position: ever better planes from there, the best ones last. surface: forecast before that
    cut.
    """
    here, *later = last.planes[position:]
    classes = surface.classes([here, *later])  # classes of the present direction; a taken plane is measured by its own classes
    reach = surface.reach([here, *later])
    least_mm2 = surface.left_mm2([here, *later], classes, reach)
    pivots = _pivots(_cut_face(last.path[position + 1]))
    for share, turn_deg in STEPS:
        for _ in range(ROUNDS):
            before_mm2 = least_mm2
            for plane in _neighbours(problem, here, pivots, share, turn_deg):
                left_mm2 = surface.left_mm2([plane, *later], classes, reach)
                if left_mm2 < least_mm2 - SAME_MM2 and problem.allowed(last.path[position], plane):
                    here, least_mm2 = plane, left_mm2
                    yield [here, *later]
            if least_mm2 == before_mm2 or problem.late():
                break


def _neighbours(problem: Problem, plane: Plane, pivots: Floats, share: float, turn_deg: float) -> Iterator[Plane]:
    """The neighbours of a plane: shifted both ways by a share of the offset step, leaning to four sides about the first pivot
    with and without a shift, and about the other pivots without one.
    """
    step_mm = share * problem.settings.offset_step_mm
    yield from (replace(plane, offset_mm=plane.offset_mm + shift) for shift in (-step_mm, step_mm))
    ((aside, across),) = framed(plane.normal[None], problem.axes)[1]
    for lean in (-aside, aside, -across, across):
        normal = cos(radians(turn_deg)) * plane.normal + sin(radians(turn_deg)) * lean
        for number, pivot in enumerate(pivots):
            offset_mm = plane.offset_mm + float((normal - plane.normal) @ pivot)
            for shift in (0.0, -step_mm, step_mm) if number == 0 else (0.0,):
                yield replace(plane, normal=normal, offset_mm=offset_mm + shift)


def _pivots(corners: Floats) -> Floats:
    """(3, 3) pivots: the centre of a cut face's corners, the corner farthest from it, and the corner farthest from that one: a
    plane that ends in a concave edge stays there when it leans about it.
    """
    middle = corners.mean(axis=0)
    one = corners[int(np.argmax(np.round(np.linalg.norm(corners - middle, axis=1), 6)))]
    other = corners[int(np.argmax(np.round(np.linalg.norm(corners - one, axis=1), 6)))]
    return np.stack([middle, one, other])


def _cut_face(node: Node) -> Floats:
    """(n, 3) corners of a node's last cut face; for a limb, those of its section."""
    base, points = node.base, node.remainder.mesh.vertices
    if base.limbs_mm is not None and node.parent is not None:
        return passing_places(limb_mesh(node.parent.remainder, base), base)
    heights = base.heights_mm(points)
    face: Floats = points[heights >= heights.max() - BASE_TOLERANCE_MM]
    return face
