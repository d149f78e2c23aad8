"""Fit: whether parts fit a machine, checked before slicing: reach of the axes, plate, arrangement of models, and clearance of the
head.

Models of equal size stand in rows and columns, others one by one, the largest first, each as near as possible to its place. The
finished parts of other models are obstacles like the print beside a limb; all are represented by their convex hulls.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import product
from math import ceil, dist, hypot
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.kinematics.table import machine_points
from machine.planning.limits import ROUNDING, axis_limits, over_edge_mm
from machine.quantities import amount
from mdp.clearance import find_obstacle, passes_clear
from mdp.cut import convex_hull
from mdp.decomposition import Decomposition, Part
from mdp.head import Block, bodies
from mdp.mesh import Floats, Mesh
from mdp.overhang import PLATE_TOLERANCE_MM
from mdp.plane import Plane
from mdp.pose import Pose, least_rotation, level, poses
from profiles.errors import MoveError
from profiles.machine import Machine
from profiles.messages import key_name
from profiles.profile import Profile
from profiles.settings.support import MIDDLE
from slicer.interface.interface import AROUND_MM
from slicer.paths import SlicedPart
from slicer.raft import lift_mm, reach_mm

Place = tuple[float, float]
STILL = np.eye(3)  # identity rotation
EDGE_MM = 2.0  # distance to the plate's edge
STEP_MM = 2.5  # lattice of places that are tried besides those where boxes touch
ROUNDING_MM = 1e-6
ROUNDING_DIGITS = 6
CELLS_MM = (2.0, 0.6)  # finer cells would bring models at most 2 mm nearer, and take many times as long
SIDES = 8  # sides of the polygon that replaces the round corner of a brim
_ROUND = np.array([[np.cos(angle), np.sin(angle), 0.0] for angle in np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)])
PartOfModel = tuple[int, int]  # a model of the plate and one of its parts, both as indices from 0


def check_parts(parts: Sequence[Part], profile: Profile) -> None:
    """Raise MoveError when a part does not fit the machine at the model's place on the plate.

    Checks X, Y and Z in the part's pose, and the first part against the plate's edge. The model is centred on the turn axis. Half
    a line is subtracted at the sides, because the tip stays that far inside what it prints.
    """
    for part in parts:
        _check_reach(part, profile)
        if part.on_plate:
            check_standing(part.mesh, profile)


def _check_reach(part: Part, profile: Profile) -> None:
    machine = profile.machine
    reached = machine_points(machine, part.pose, part.mesh.vertices + _shift(profile))
    inset = 0.5 * profile.of_part(part.index).process.line_width_mm * np.array([1.0, 1.0, 0.0])
    ends = np.transpose([reached.min(axis=0) + inset, reached.max(axis=0) - inset])
    for values, (letter, limits) in zip(ends, list(axis_limits(machine).items())[:3], strict=True):
        for value in values:
            if not limits[0] - ROUNDING <= value <= limits[1] + ROUNDING:
                where = f"{machine.tilt.letter}{part.pose.tilt_deg:.1f} {machine.turn.letter}{part.pose.turn_deg:.1f}"
                raise MoveError(
                    f"part {part.index} reaches {letter} {value:.1f} mm at {where}, {letter} goes from {limits[0]:g} to "
                    f"{limits[1]:g} mm on {machine.name}: {_advice(profile)}"
                )


def check_standing(mesh: Mesh, profile: Profile) -> None:
    """Raise MoveError when the base of a model, centred on the turn axis, extends over the plate's edge at its place.

    Or when it lies over a clip. Brims and supports are not known yet; the dry run checks them.
    """
    _check_clips(mesh, profile)
    machine, inset_mm = profile.machine, 0.5 * profile.of_part(1).process.line_width_mm
    standing = mesh.vertices[mesh.vertices[:, 2] <= PLATE_TOLERANCE_MM, :2] + _shift(profile)[:2]
    over, edge = over_edge_mm(np.maximum(np.abs(standing) - inset_mm, 0.0), machine.table)
    over_mm = float(over.max(initial=-np.inf))
    if over_mm > ROUNDING:
        x, y = np.ptp(standing, axis=0)
        raise MoveError(
            f"the first layer on the plate is {amount(x, 1)} x {amount(y, 1)} mm, {amount(over_mm, 1)} mm over the edge of the "
            f"plate of {machine.name}, {edge}: {_advice(profile)}"
        )


def _check_clips(mesh: Mesh, profile: Profile) -> None:
    """Raise MoveError when a face of the base lies over one of the plate's clips."""
    corners = mesh.vertices[mesh.faces]
    low = (corners[:, :, 2] <= PLATE_TOLERANCE_MM).all(axis=1)
    base = corners[low, :, :2] + _shift(profile)[:2]
    for clip in profile.machine.table.clips:
        if _overlaps(base, np.array(list(product(*zip(clip.min_mm[:2], clip.max_mm[:2], strict=True))))):
            raise MoveError(
                f"the model would stand on the plate's {clip.name}: {key_name('process.place_mm')} moves it, "
                f"{key_name('process.scale')} makes it smaller"
            )


def _overlaps(triangles: Floats, rectangle: Floats) -> bool:
    """Whether any of (n, 3, 2) triangles overlaps the rectangle with (4, 2) corners along the axes: no side separates the two."""
    sides = np.roll(triangles, -1, axis=1) - triangles
    normals = np.concatenate([sides[..., ::-1] * (1.0, -1.0), np.broadcast_to(np.eye(2), (len(triangles), 2, 2))], axis=1)
    own, other = normals @ triangles.transpose(0, 2, 1), normals @ rectangle.T  # (n, 5, 3), (n, 5, 4)
    apart = (own.min(axis=2) >= other.max(axis=2)) | (own.max(axis=2) <= other.min(axis=2))
    return bool((~apart.any(axis=1)).any())


def _shift(profile: Profile) -> Floats:
    """(3,) translation of the model to its place, on its raft if it has one, mm."""
    return np.array([*profile.process.place_mm, lift_mm(profile)])


def _advice(profile: Profile) -> str:
    x, y = profile.process.place_mm
    if (x, y) == MIDDLE:
        return f"{key_name('process.scale')} makes the model smaller"
    return f"{key_name('process.place_mm')} moves it from {x:g}, {y:g} mm back towards the middle"


def standing_at(decomposition: Decomposition, place_mm: Place, up_mm: float = 0.0) -> Decomposition:
    """A decomposition moved by x, y and up, with its planes and marks."""
    if place_mm == MIDDLE and up_mm == 0.0:
        return decomposition
    shift = np.array([*place_mm, up_mm])
    rows = tuple(replace(row, planes=tuple(_plane_moved(plane, shift) for plane in row.planes)) for row in decomposition.front)
    parts = tuple(_part_moved(part, shift) for part in decomposition.parts)
    return replace(decomposition, mesh=decomposition.mesh.transform(STILL, shift), parts=parts, front=rows)


def lifted(
    decomposition: Decomposition, sliced: Sequence[SlicedPart], profile: Profile
) -> tuple[Decomposition, list[SlicedPart]]:
    """Parts that were sliced directly on the plate, and their layers, lifted onto their raft.

    The layers are the same as without a raft, and whatever is clear of the table is clear of the raft.
    """
    up = np.array([0.0, 0.0, lift_mm(profile)])
    moved = [piece.moved(*(part.rotation @ up)[:2].tolist()) for part, piece in zip(decomposition.parts, sliced, strict=True)]
    return standing_at(decomposition, MIDDLE, float(up[2])), moved


def mesh_at_place(mesh: Mesh, profile: Profile) -> Mesh:
    """A mesh at its place on the plate and on its raft, as printed."""
    return mesh.transform(STILL, _shift(profile))


def _part_moved(part: Part, shift: Floats) -> Part:
    lifted_mm = part.lifted_mm + float(shift[2]) if part.on_plate else 0.0
    moved = replace(part, mesh=part.mesh.transform(STILL, shift), base=_plane_moved(part.base, shift), lifted_mm=lifted_mm)
    return moved.with_marks(lambda mark: mark.transform(STILL, shift), lambda modifier: modifier.transform(STILL, shift))


def _plane_moved(plane: Plane, shift: Floats) -> Plane:
    limbs_mm = None if plane.limbs_mm is None else plane.limbs_mm + shift
    return Plane(plane.normal, plane.offset_mm + float(plane.normal @ shift), limbs_mm)


def _is_clear_of_clips(middles_mm: Floats, size_mm: Place, machine: Machine) -> NDArray[np.bool_]:
    """(...) whether boxes of one size on the level plate, (..., 2) their middles, can be printed without the head or a bead
    meeting a clip."""
    clear = np.ones(middles_mm.shape[:-1], np.bool_)
    for clip in machine.table.clips:
        for least, most, need_mm in _head_below(machine, clip.max_mm[2]):
            low, high = middles_mm - 0.5 * np.array(size_mm) + least, middles_mm + 0.5 * np.array(size_mm) + most
            clear &= ((low >= np.array(clip.max_mm[:2]) + need_mm) | (high <= np.array(clip.min_mm[:2]) - need_mm)).any(axis=-1)
    return clear


def _head_below(machine: Machine, height_mm: float) -> Iterator[tuple[Floats, Floats, float]]:
    """Least and greatest x, y of each body of the head that may come near a height while the tip is on the plate, relative to the
    tip, and the distance that it keeps; first the tip itself."""
    yield np.full(2, -EDGE_MM), np.full(2, EDGE_MM), 0.0
    for body in bodies(machine):
        if isinstance(body, Block):
            if body.min_mm[2] < height_mm + body.need_mm:
                yield np.array(body.min_mm[:2]), np.array(body.max_mm[:2]), body.need_mm
        elif body.discs_mm[0][1] < height_mm + body.need_mm:
            radii, lows_mm = np.transpose(body.discs_mm)
            radius = float(np.interp(height_mm + body.need_mm, lows_mm, radii))
            yield np.full(2, -radius), np.full(2, radius), body.need_mm


class Misfit(NamedTuple):
    """Failure to place all boxes on the plate.

    number: index of the first box without a place; standing: number of boxes that have a place; is_met: whether the head prevents
    it, because all boxes fit if collisions with the head are ignored.
    """

    number: int
    standing: int
    is_met: bool


def places_on_plate(size_mm: Place, gap_mm: float, count: int, machine: Machine, about_mm: Place = MIDDLE) -> list[Place]:
    """Up to `count` centres (workpiece x, y, mm) of equal boxes, gap_mm apart, the nearest to a place first.

    Rows and columns may have a box or a gap at that place or at the plate's centre: the arrangement with most boxes is taken, and
    among these the one nearest to the place.
    """
    lattices: list[list[Place]] = []
    for anchor_mm, shift in product(dict.fromkeys((about_mm, MIDDLE)), product((0.0, 0.5), (0.0, 0.5))):
        axes, reach_mm = [], machine.table.radius_mm + hypot(*anchor_mm)
        for side, part in zip(size_mm, shift, strict=True):
            most = ceil(2.0 * reach_mm / (side + gap_mm)) + 1
            axes.append([(k + part) * (side + gap_mm) for k in range(-most, most + 1)])
        middles = np.array(list(product(*axes))) + np.array(anchor_mm)
        over_mm, _ = over_edge_mm(np.abs(middles) + 0.5 * np.array(size_mm) + EDGE_MM, machine.table)
        inside = ((x, y) for x, y in middles[(over_mm <= 0.0) & _is_clear_of_clips(middles, size_mm, machine)].tolist())
        lattices.append(sorted(inside, key=lambda place: (round(dist(place, about_mm), 6), place[1], place[0]))[:count])
    return max(lattices, key=lambda places: (len(places), -max((dist(place, about_mm) for place in places), default=0.0)))


class Plate:
    """The models of a plate, each centred on the turn axis: their places, and whether the head clears them.

    together: the parts printed first, layer by layer; alone: those that follow in turn. brim_mm: width of the brim on the plate.
    With a raft all are lifted. sizes_mm: the models' boxes, gap_mm apart.
    """

    def __init__(
        self, models: Sequence[Decomposition], together: Sequence[PartOfModel], alone: Sequence[PartOfModel], profile: Profile,
        brim_mm: float, sizes_mm: Sequence[Place], gap_mm: float,
    ) -> None:  # fmt: skip
        self.models, self.together, self.alone, self.brim_mm = models, together, alone, brim_mm
        self._sizes_mm, self._gap_mm = sizes_mm, gap_mm
        self._profile, self._machine, self._up_mm = profile, profile.machine, lift_mm(profile)
        raised = {model: standing_at(model, MIDDLE, self._up_mm) for model in dict.fromkeys(models)}
        self._parts = [raised[model].parts for model in models]
        self._around_mm = {raised[model].parts[0]: self._width_around(model) for model in raised}
        self._hull, self._is_reached, self._passes = cache(self._find_hull), cache(self._find_reached), cache(self._find_passed)

    def arrange(self) -> list[Place] | Misfit:
        """The centres (workpiece x, y, mm) of the models' boxes around their place on the plate; or the misfit."""
        sizes_mm, about_mm = self._sizes_mm, self._profile.process.place_mm
        if len(set(sizes_mm)) == 1:
            rows = places_on_plate(sizes_mm[0], self._gap_mm, len(sizes_mm), self._machine, about_mm)
            if len(rows) < len(sizes_mm):
                return Misfit(len(rows), len(rows), False)
            if self.is_clear(dict(enumerate(rows))):
                return rows
        found = self._one_by_one(about_mm)
        if isinstance(found, Misfit):  # two boxes that fit side by side do not fit if the first one takes the centre
            from_corner = self._one_by_one((-self._machine.table.radius_mm, -self._machine.table.radius_mm))
            if isinstance(from_corner, Misfit):
                return max(found, from_corner, key=lambda misfit: misfit.standing)
            found = from_corner
        # move all together so that their bounding box is centred at their place, if they stay on the plate
        middles, halves = np.array(found), 0.5 * np.array(sizes_mm)
        moved = middles + np.array(about_mm) - 0.5 * ((middles - halves).min(axis=0) + (middles + halves).max(axis=0))
        over_mm, _ = over_edge_mm(np.abs(moved) + halves + EDGE_MM, self._machine.table)
        clear = [_is_clear_of_clips(place, size_mm, self._machine) for place, size_mm in zip(moved, sizes_mm, strict=True)]
        if (over_mm > ROUNDING_MM).any() or not all(clear):
            return found
        together: list[Place] = [(x, y) for x, y in moved.tolist()]
        return together if self.is_clear(dict(enumerate(together))) else found

    def _one_by_one(self, near_mm: Place) -> list[Place] | Misfit:
        """Place the largest first, each as near as possible to a place."""
        standing, sizes_mm = dict[int, Place](), self._sizes_mm
        for k in sorted(range(len(sizes_mm)), key=lambda k: (-sizes_mm[k][0] * sizes_mm[k][1], k)):
            places = self._free_places(k, standing, near_mm)
            place = next((place for place in places if self.is_clear({**standing, k: place})), None)
            if place is None:
                return Misfit(k, len(standing), bool(places))
            standing[k] = place
        return [standing[k] for k in range(len(sizes_mm))]

    def _free_places(self, number: int, standing: Mapping[int, Place], near_mm: Place) -> list[Place]:
        """Free places of a box, the nearest to a place first: beside and in line with placed boxes, and on a lattice."""
        size, reach_mm = np.array(self._sizes_mm[number]), self._machine.table.radius_mm
        boxes = np.array([[standing[k], self._sizes_mm[k]] for k in standing]).reshape(-1, 2, 2)
        apart, aligned = 0.5 * (boxes[:, 1] + size) + self._gap_mm, 0.5 * (boxes[:, 1] - size)
        beside = np.concatenate([boxes[:, 0] + sign * way for sign in (-1.0, 0.0, 1.0) for way in (apart, aligned)])
        lattice = np.arange(-ceil(reach_mm / STEP_MM), ceil(reach_mm / STEP_MM) + 1) * STEP_MM
        columns, rows = (np.unique(np.concatenate([beside[:, axis], lattice, [near_mm[axis]]])) for axis in (0, 1))
        places = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        over_mm, _ = over_edge_mm(np.abs(places) + 0.5 * size + EDGE_MM, self._machine.table)
        places = places[(over_mm <= ROUNDING_MM) & _is_clear_of_clips(places, self._sizes_mm[number], self._machine)]
        for (middle, _), least in zip(boxes, apart, strict=True):
            places = places[(np.abs(places - middle) >= least - ROUNDING_MM).any(axis=1)]
        away = np.round(np.hypot(*(places - np.array(near_mm)).T), 6)
        return [(x, y) for x, y in places[np.lexsort((places[:, 0], places[:, 1], away))].tolist()]

    def is_clear(self, places: Mapping[int, Place]) -> bool:
        """Whether the parts of the placed models can be printed there."""
        return all(self._allowed(number, places) for number, (k, _) in enumerate(self.alone) if k in places)

    def poses(self, places: Mapping[int, Place]) -> list[Pose]:
        """A pose for every part printed alone, with little turning of the table; each part must have one."""
        options = [self._allowed(number, places) for number in range(len(self.alone))]
        begins = [[level(self._machine)]] if self.together else []

        def fits(position: int, pose: Pose) -> bool:
            return bool(self._allowed(position - len(begins), places, [pose]))

        return least_rotation(self._machine, [*begins, *options], fits)[len(begins) :]

    def _width_around(self, model: Decomposition) -> float:
        """Reach of brim or raft and support around a model on the plate, mm; both also surround the support."""
        has_support = self._profile.process.support != "none" and any(part.risky_area_mm2 > 0.0 for part in model.parts)
        around_mm = reach_mm(self._profile.process) if self._up_mm else self.brim_mm
        return around_mm + (AROUND_MM if has_support else 0.0)

    def _allowed(self, number: int, places: Mapping[int, Place], tried: Sequence[Pose] | None = None) -> list[Pose]:
        """The poses in which a part can be printed beside everything printed before it."""
        model, machine = self.alone[number][0], self._machine
        part = self._parts[model][self.alone[number][1]]
        if tried is None:
            others = poses(machine, part.direction, part.pose.turn_deg) if part.base.limbs_mm is None else []
            tried = [part.pose, *(pose for pose in others if pose != part.pose)]
        if not self._profile.search.clearance:
            return list(tried[:1])
        before = [turn for turn in (*self.together, *self.alone[:number]) if turn[0] != model and turn[0] in places]
        return [
            pose
            for pose in tried
            if self._is_reached(part, pose, places[model])
            and all(self._passes(part, pose, self._parts[k][n], _away(places[model], places[k])) for k, n in before)
        ]

    def _find_reached(self, part: Part, pose: Pose, place: Place) -> bool:
        """Whether a part at a place is within the axes' limits and clear of the table."""
        points = self._hull(part).reshape(-1, 3) + np.array([*place, 0.0])
        return find_obstacle(self._machine, pose, points) is None

    def _find_passed(self, part: Part, pose: Pose, standing: Part, away_mm: Place) -> bool:
        """Whether the head clears a part of another model at a displacement from the part's own."""
        beside = self._hull(standing) + np.array([*away_mm, 0.0])
        base_mm = part.base.offset_mm - part.lifted_mm  # with its raft
        return passes_clear(self._machine, pose, (self._hull(part), beside), base_mm, CELLS_MM)

    def _find_hull(self, part: Part) -> Floats:
        """(m, 3, 3) corners of the faces of a part's hull; on the plate including brim, raft or support."""
        hull = convex_hull(part.mesh.vertices)
        if self._around_mm.get(part, 0.0) > 0.0:
            low = hull.vertices[hull.vertices[:, 2] <= part.lifted_mm + PLATE_TOLERANCE_MM]
            brims = (low[:, None] + self._around_mm[part] / np.cos(np.pi / SIDES) * _ROUND).reshape(-1, 3)
            plate = brims - [0.0, 0.0, part.lifted_mm]  # a raft is as high as the part is lifted
            hull = convex_hull(np.vstack([hull.vertices, brims, plate]))
        return hull.vertices[hull.faces]


def _away(here: Place, there: Place) -> Place:
    return round(there[0] - here[0], ROUNDING_DIGITS), round(there[1] - here[1], ROUNDING_DIGITS)
