"""Plate: the arrangement of a coupon's bars, and the parts in which they are printed.

The jointed bars lean outward on a ring, alternately low and high. Part 1 is everything below the joints, and the bars in one
piece, with the table level. Then the table tilts by a bar's lean and turns the bar upright, which is printed on along its axis:
one part per bar, the low ones first. Nothing may stand above the base plane of a part, which decides how much higher the high
ones are.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from math import cos, degrees, pi, radians, sin, sqrt

import manifold3d as m3
import numpy as np

from machine.setup.coupon.bars import Shape, bar, least_height_mm, stand
from machine.setup.coupon.design import JOINTS, KINDS
from mdp.clearance import allowed_poses, find_obstacle
from mdp.cut import Solid, cut, mesh_of
from mdp.decomposition import ORDER_TOLERANCE_MM, Decomposition, Part
from mdp.mesh import Floats
from mdp.plane import PLATFORM, Plane
from mdp.pose import least_rotation, level, poses, rotation, shift
from profiles.errors import MoveError
from profiles.machine import Machine
from profiles.messages import key_name
from profiles.profile import Profile

LEANS_DEG = (45.0, 40.0, 35.0, 30.0, 25.0, 20.0)
HEIGHTS_MM = (0.0, 4.0, 9.0, 14.0, 19.0)  # above the least at which the lower end of a bar is whole
RISES_MM = tuple(float(rise) for rise in range(31))
GAP_MM = 3.0  # between bars, and to the plate's edge
PITCH = 2.0 * pi / JOINTS
LOW_MM = 1.0  # a bar's section below this stands on the plate
FLAT = (0.0, 0.0), (0.0, 0.0)
Halves = tuple[Floats, Floats, m3.CrossSection]


@dataclass(frozen=True)
class Ring:
    """Arrangement of the jointed bars: their lean, and heights and radii of the low and the high joints."""

    lean_rad: float
    heights_mm: tuple[float, float]
    radii_mm: tuple[float, float]

    def place(self, joint: int) -> tuple[float, float, float]:
        """Turn (radians), radius and height of a joint, counted from 0 in print order: the low ones first."""
        high, of_level = divmod(joint, JOINTS // 2)
        return PITCH * (2 * of_level + high + 0.5), self.radii_mm[high], self.heights_mm[high]

    def base(self, joint: int) -> Plane:
        """The plane of a joint, its normal along the bar's axis."""
        turn, radius, height = self.place(joint)
        out, up = sin(self.lean_rad), cos(self.lean_rad)
        return Plane(np.array([out * cos(turn), out * sin(turn), up]), out * radius + up * height)


def coupon(shape: Shape, profile: Profile) -> Decomposition:
    """The bars of the plate in parts. Raises MoveError for a machine that cannot print them, with the obstacle."""
    machine = profile.machine
    if not machine.tilts:
        raise MoveError(f"{machine.name} has three axes: the joints of a coupon are made on a table that tilts")
    ring, whole = _ring(shape, profile), _in_one_piece(shape)
    bars = [_jointed(shape, ring, joint) for joint in range(JOINTS)]
    tops, stubs = zip(*(cut(jointed, ring.base(joint)) for joint, jointed in enumerate(bars)), strict=True)
    pieces = [mesh_of(m3.Manifold.compose([*stubs, *whole])), *(mesh_of(top) for top in tops)]
    bases = [PLATFORM, *(ring.base(joint) for joint in range(JOINTS))]
    options = [allowed_poses(machine, base.normal, mesh.vertices) for base, mesh in zip(bases, pieces, strict=True)]
    chosen = least_rotation(machine, [[level(machine)], *options[1:]])
    parts = tuple(
        Part(k + 1, mesh, base, pose, rotation(machine, pose), mesh.volume_mm3, 0.0)
        for k, (mesh, base, pose) in enumerate(zip(pieces, bases, chosen, strict=True))
    )
    model = mesh_of(m3.Manifold.compose([*bars, *whole]))
    return Decomposition(f"coupon of {shape.name} bars", model, parts, 1, "none", 0.0, 0.0, 0, 0, 0.0)


def _jointed(shape: Shape, ring: Ring, joint: int) -> Solid:
    """A whole jointed bar."""
    turn, radius, height = ring.place(joint)
    return stand(bar(shape, ring.lean_rad, height, joint + 1), shape, turn, radius)


def _in_one_piece(shape: Shape) -> list[Solid]:
    """Two bars upright beside the plate's centre, two flat along X in front and behind."""
    height = least_height_mm(shape, 0.0)
    upright = [stand(bar(shape, 0.0, height, JOINTS + k), shape, 0.0, 0.0) for k in (1, 2)]
    lying = [bar(shape, 0.0, height, JOINTS + k, True).rotate((0.0, 0.0, -90.0)) for k in (3, 4)]
    (wide, deep), across = _size(upright[0]), _size(lying[0])[1]
    beside, before = 0.5 * (wide + GAP_MM), 0.5 * (deep + across) + GAP_MM
    places = ((-beside, 0.0), (beside, 0.0), (0.0, -before), (0.0, before))
    return [_centred(solid).translate((x, y, 0.0)) for solid, (x, y) in zip([*upright, *lying], places, strict=True)]


def _size(solid: Solid) -> tuple[float, float]:
    x0, y0, _, x1, y1, _ = solid.bounding_box()
    return x1 - x0, y1 - y0


def _centred(solid: Solid) -> Solid:
    x0, y0, _, x1, y1, _ = solid.bounding_box()
    return solid.translate((-0.5 * (x0 + x1), -0.5 * (y0 + y1), 0.0))


def _ring(shape: Shape, profile: Profile) -> Ring:
    """The ring with the steepest lean, then the lowest joints, at which table, head and bars are clear of each other. Raises
    MoveError with the obstacle of the ring that comes nearest to that."""
    machine = profile.machine
    leans = [lean for lean in LEANS_DEG if lean <= profile.process.self_supporting_angle_deg]
    if not leans:
        allowed = f"at least {LEANS_DEG[-1]:g} deg, by which bars lean, is allowed"
        raise MoveError(
            f"{key_name('process.self_supporting_angle_deg')} is {profile.process.self_supporting_angle_deg:g}: {allowed}"
        )
    reached = [lean for lean in leans if all(poses(machine, Ring(radians(lean), *FLAT).base(k).normal) for k in range(JOINTS))]
    if not reached:
        raise MoveError(
            f"{machine.name} cannot tilt its table by {LEANS_DEG[-1]:g} deg towards all sides: the joints of a coupon are made so"
        )
    nearest: tuple[int, str] = (0, "")
    whole, halves = _in_one_piece(shape), cache(partial(_halves, shape))
    for lean_deg in reached:
        for ring in _rings(shape, radians(lean_deg), machine):
            problem = _problem(shape, ring, whole, halves, machine)
            if problem is None:
                return ring
            nearest = max(problem, nearest, key=lambda tried: tried[0])  # among the last ones, which lean least
    raise MoveError(f"no coupon of {shape.name} bars can be printed on {machine.name}: {nearest[1]}")


def _rings(shape: Shape, lean_rad: float, machine: Machine) -> Iterator[Ring]:
    """Rings as wide as the plate and the level table's X and Y allow, low and narrow ones first."""
    table = machine.table
    edge = (table.radius_mm if table.size_mm is None else 0.5 * min(table.size_mm)) - GAP_MM
    middle = shift(machine, level(machine))
    reach = min(abs(limit - middle[k]) for k, axis in enumerate((machine.x, machine.y)) for limit in axis.limits_mm)
    farthest = float(reach) - 0.5 * shape.depth_mm * cos(lean_rad)

    @cache
    def radius(height: float) -> float:
        _, _, z0, x1, _, z1 = bar(shape, lean_rad, height).trim_by_plane((0.0, -1.0, 0.0), -LOW_MM).bounding_box()
        return min(farthest, sqrt(max(0.0, edge**2 - (0.5 * (z1 - z0)) ** 2)) - float(x1))

    for low in (least_height_mm(shape, lean_rad) + more for more in HEIGHTS_MM):
        for rise in RISES_MM:
            yield Ring(lean_rad, (low, low + rise), (radius(low), radius(low + rise)))


def _halves(shape: Shape, lean_rad: float, height_mm: float) -> Halves:
    """Corners (n, 3) above and below the joint of a bar that leans along x, its joint above the plate's centre, and the outline
    of its lower half with a gap around it."""
    base = Plane(np.array([sin(lean_rad), 0.0, cos(lean_rad)]), height_mm * cos(lean_rad))
    top, stub = cut(stand(bar(shape, lean_rad, height_mm), shape, 0.0, 0.0), base)
    return mesh_of(top).vertices, mesh_of(stub).vertices, _around(stub)


def _around(solid: Solid) -> m3.CrossSection:
    return solid.project().offset(0.5 * GAP_MM - 1e-3, m3.JoinType.Miter)


def _problem(
    shape: Shape, ring: Ring, whole: Sequence[Solid], halves: Callable[[float, float], Halves], machine: Machine
) -> tuple[int, str] | None:
    """The obstacle of a ring, and how near the ring comes to being printable; None without one."""
    places = [ring.place(joint) for joint in range(JOINTS)]
    bars = [halves(ring.lean_rad, height) for _, _, height in places]
    tops, stubs, outlines = zip(*bars, strict=True)
    around = [outline.translate((r, 0.0)).rotate(degrees(turn)) for outline, (turn, r, _) in zip(outlines, places, strict=True)]
    around += [_around(solid) for solid in whole]
    if sum(area.area() for area in around) > m3.CrossSection.batch_boolean(around, m3.OpType.Add).area() + 0.01:
        return 1, f"its plate, {machine.table.radius_mm:g} mm in radius, has no room for {len(KINDS)} bars side by side"
    standing = [_turned(stub, turn, r) for stub, (turn, r, _) in zip(stubs, places, strict=True)]
    below = np.vstack([*standing, *(mesh_of(solid).vertices for solid in whole)])
    obstacle = find_obstacle(machine, level(machine), below)
    if obstacle is not None:
        return 1, obstacle
    for joint, (top, (turn, r, _)) in enumerate(zip(tops, places, strict=True)):
        base, vertices = ring.base(joint), _turned(top, turn, r)
        if float(base.heights_mm(below).max()) > ORDER_TOLERANCE_MM:
            return 2, f"bars {shape.above_mm:g} mm long above their joints would stand in the head's way on so small a plate"
        if not allowed_poses(machine, base.normal, vertices):
            pose = poses(machine, base.normal)[0]
            return 3, find_obstacle(machine, pose, vertices) or ""
        below = np.vstack([below, vertices])
    return None


def _turned(corners: Floats, turn_rad: float, radius_mm: float) -> Floats:
    """Corners (n, 3) moved outward along x, then turned about z."""
    x, y = corners[:, 0] + radius_mm, corners[:, 1]
    return np.column_stack([x * cos(turn_rad) - y * sin(turn_rad), x * sin(turn_rad) + y * cos(turn_rad), corners[:, 2]])
