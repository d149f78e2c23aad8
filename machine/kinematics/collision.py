"""Collision: distances of the head's bodies from table, cradle and print, by separating directions.

The distance of two convex bodies is the greatest gap over all unit directions d, where the gap is the least d . x of the one
minus the greatest d . x of the other. Trying some directions gives a lower bound of the distance: a verdict "clear" is always
right. A straight move is tested as the convex body it sweeps: one direction must separate both ends from the obstacle.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from manifold3d import Manifold

from machine.kinematics.table import machine_points
from mdp.directions.unit_vectors import spread
from mdp.head import Body, corners, directions
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.machine import Machine, Table, TableBox

FAR_MM = 1e9
REFINEMENTS = 40


def table_reach(machine: Machine, pose: Pose) -> "Reach":
    """(k,) greatest d . x over the table's plate at a pose, in the frame of X Y Z, for (k, 3) directions."""
    table = machine.table
    if table.size_mm is not None:
        x, y = (0.5 * size for size in table.size_mm)
        return partial(_corner_reach, machine_points(machine, pose, corners((-x, -y, -table.thickness_mm), (x, y, 0.0))))
    return partial(_plate_reach, table, rotation(machine, pose) @ UP, machine_points(machine, pose, np.zeros((1, 3)))[0])


def _plate_reach(table: Table, normal: Floats, centre: Floats, tried: Floats) -> Floats:
    """(k,) greatest d . x over a round plate."""
    along = tried @ normal
    across = np.sqrt(np.maximum(0.0, 1.0 - along**2))
    reach: Floats = tried @ centre + table.radius_mm * across + np.maximum(0.0, -along) * table.thickness_mm
    return reach


def _reach_of_box(machine: Machine, box: TableBox, pose: Pose) -> "Reach":
    return partial(_corner_reach, machine_points(machine, pose, corners(box.min_mm, box.max_mm)))


def _corner_reach(points: Floats, tried: Floats) -> Floats:
    reach: Floats = (tried @ points.T).max(axis=1)
    return reach


@dataclass(frozen=True, eq=False)
class Printed:
    """The print on the table: the corners of its convex hull, workpiece frame, and the extent of beads outside them."""

    points_mm: Floats
    bead_mm: float

    def reach(self, machine: Machine, pose: Pose, tried: Floats) -> Floats:
        """(k,) greatest d . x over the print at a pose, in the frame of X Y Z."""
        if not len(self.points_mm):
            return np.full(len(tried), -FAR_MM)
        reach: Floats = (machine_points(machine, pose, self.points_mm) @ tried.T).max(axis=0) + self.bead_mm
        return reach


def hull(points_mm: Floats, bead_mm: float) -> Printed:
    """The hull of (n, 3) workpiece points, the centres of beads that extend bead_mm to each side."""
    corners = np.zeros((0, 3))
    if len(points_mm) > 3:
        corners = np.asarray(Manifold.hull_points(points_mm).to_mesh64().vert_properties)[:, :3]
    return Printed(corners if len(corners) else points_mm.reshape(-1, 3), bead_mm)


def join_hulls(pieces: list[Printed]) -> Printed:
    """Several printed pieces as one: the hull of their hulls, which has the same reach in all directions."""
    points = [piece.points_mm for piece in pieces]
    return hull(np.vstack([np.zeros((0, 3)), *points]), max((piece.bead_mm for piece in pieces), default=0.0))


Reach = Callable[[Floats], Floats]  # (k, 3) directions -> (k,) reach of a solid along each


def solids(machine: Machine, pose: Pose, printed: Printed | None = None) -> list[tuple[str, Reach]]:
    """The solids that the head can meet at a pose: table, clips, cradle bodies, print; with names for messages."""
    unturned = Pose(pose.tilt_deg, machine.turn.zero_deg)  # the cradle tilts with the table but does not turn
    bodies: list[tuple[str, Reach]] = [("the table", table_reach(machine, pose))]
    bodies += [(f"the plate's {box.name}", _reach_of_box(machine, box, pose)) for box in machine.table.clips]
    bodies += [(f"the cradle's {box.name}", _reach_of_box(machine, box, unturned)) for box in machine.cradle]
    if printed is not None and len(printed.points_mm):
        bodies.append(("the print", partial(printed.reach, machine, pose)))
    return bodies


def swing_mm(machine: Machine, printed: Printed) -> float:
    """Upper bound of the distance of a point of table, cradle and print from either rotary axis."""
    between = float(np.linalg.norm(np.array(machine.tilt.point_mm) - np.array(machine.turn.point_mm)))
    reach = float(np.hypot(machine.table.radius_mm, machine.table.thickness_mm))
    reach = max(reach, float(np.linalg.norm(printed.points_mm, axis=1).max(initial=0.0)) + printed.bead_mm)
    for box in (*machine.table.clips, *machine.cradle):
        reach = max(reach, float(np.linalg.norm(corners(box.min_mm, box.max_mm), axis=1).max()))
    return reach + between


def sweep_gaps(body: Body, start: Floats, end: Floats, tried: Floats, reach: Floats) -> Floats:
    """(n,) lower bounds of the distance of a body from an obstacle while the tip moves from (n, 3) start to (n, 3) end."""
    return gaps_of(swept(start, end, tried), body.least(tried) - reach)


def swept(start: Floats, end: Floats, tried: Floats) -> Floats:
    """(k, n) least d . tip along each of n straight moves, for (k, 3) directions."""
    return np.minimum(tried @ start.T, tried @ end.T)


def gaps_of(least: Floats, margin: Floats) -> Floats:
    """(n,) greatest gap over k directions: `least` from swept(), `margin`: (k,) of the body over the reach of the obstacle."""
    best: Floats = (least + margin[:, None]).max(axis=0)
    return best


def refined_gap(body: Body, start: Floats, end: Floats, normal: Floats, reach: Reach) -> float:
    """The distance of one swept body from a solid, improved from the best tried direction by pattern search.

    normal: the table's. The gap is a concave function of the direction, so that the search cannot get stuck.
    """
    tried = directions(normal)
    step, best, gap = 0.2, tried[0], -np.inf
    for _ in range(REFINEMENTS):
        gaps = np.minimum(tried @ start, tried @ end) + body.least(tried) - reach(tried)
        k = int(np.argmax(gaps))
        if gaps[k] > gap + 1e-6:
            gap, best = float(gaps[k]), tried[k]
        else:
            step *= 0.5
        tried = best + step * spread(24)
        tried /= np.linalg.norm(tried, axis=1)[:, None]
    return gap
