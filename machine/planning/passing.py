"""Passing: whether the head passes the models that stand on the plate while it prints another, and at which poses of the table.

The finished parts of other models stand beside a part as a print stands beside a limb. All are taken as their convex hulls.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from machine.planning.fit import Place, standing_at
from mdp.clearance import find_obstacle, passes_clear
from mdp.cut import convex_hull
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Floats
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.pose import Pose, least_rotation, level, poses
from profiles.profile import Profile
from profiles.settings.plate import MIDDLE
from slicer.interface.interface import AROUND_MM
from slicer.raft import lift_mm, reach_mm

ROUNDING_DIGITS = 6
CELLS_MM = (2.0, 0.6)  # finer ones would bring models nearer to each other by 2 mm at most, and take many times as long
SIDES = 8  # sides of the polygon that stands for the round corner of a brim
_ROUND = np.array([[np.cos(angle), np.sin(angle), 0.0] for angle in np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)])
Turn = tuple[int, int]  # a model of the plate and one of its parts, both by their places in the lists, from 0


class Passing:
    """The models of a plate, each about the turn axis, and whether the head passes them.

    together: the parts that are printed first, layer by layer; alone: those that follow one after the other. brim_mm: width of
    the brim around what stands on the plate. With a raft all stand higher.
    """

    def __init__(
        self, models: Sequence[Decomposition], together: Sequence[Turn], alone: Sequence[Turn], profile: Profile, brim_mm: float
    ) -> None:
        self.models, self.together, self.alone, self.brim_mm = models, together, alone, brim_mm
        self._profile, self._up_mm = profile, lift_mm(profile)
        lifted = {model: standing_at(model, MIDDLE, self._up_mm) for model in dict.fromkeys(models)}
        self._parts = [lifted[model].parts for model in models]
        self._around_mm = {lifted[model].parts[0]: self._width_around(model) for model in lifted}
        self._hulls: dict[Part, Floats] = {}
        self._known: dict[tuple[object, ...], bool] = {}

    def is_clear(self, places: Mapping[int, Place]) -> bool:
        """Whether the parts of the models that have places can be printed there."""
        return all(self._allowed(number, places) for number, (k, _) in enumerate(self.alone) if k in places)

    def poses(self, places: Mapping[int, Place]) -> list[Pose]:
        """For every part that is printed alone its pose, so that the table turns little; each part must have one."""
        options = [self._allowed(number, places) for number in range(len(self.alone))]
        begins = [[level(self._profile.machine)]] if self.together else []

        def fits(position: int, pose: Pose) -> bool:
            return bool(self._allowed(position - len(begins), places, [pose]))

        return least_rotation(self._profile.machine, [*begins, *options], fits)[len(begins) :]

    def _width_around(self, model: Decomposition) -> float:
        """How far brim or raft and support reach around a model on the plate, mm; both run round the support."""
        has_support = self._profile.process.support != "none" and any(part.risky_area_mm2 > 0.0 for part in model.parts)
        around_mm = reach_mm(self._profile.process) if self._up_mm else self.brim_mm
        return around_mm + (AROUND_MM if has_support else 0.0)

    def _part(self, turn: Turn) -> Part:
        return self._parts[turn[0]][turn[1]]

    def _allowed(self, number: int, places: Mapping[int, Place], tried: Sequence[Pose] | None = None) -> list[Pose]:
        """The poses at which a part can be printed while all that comes before it stands."""
        model, machine = self.alone[number][0], self._profile.machine
        part = self._part(self.alone[number])
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
            and all(self._passes(part, pose, self._part(turn), _away(places[model], places[turn[0]])) for turn in before)
        ]

    def _is_reached(self, part: Part, pose: Pose, place: Place) -> bool:
        """Whether a part at a place is within the axes' limits, and clear of the table."""
        key = part, pose, place
        if key not in self._known:
            points = self._hull(part).reshape(-1, 3) + np.array([*place, 0.0])
            self._known[key] = find_obstacle(self._profile.machine, pose, points) is None
        return self._known[key]

    def _passes(self, part: Part, pose: Pose, standing: Part, away_mm: Place) -> bool:
        """Whether the head passes a part of another model that stands away_mm from the part's own."""
        key = part, pose, standing, away_mm
        if key not in self._known:
            beside = self._hull(standing) + np.array([*away_mm, 0.0])
            base_mm = part.base.offset_mm - part.lifted_mm  # with its raft
            self._known[key] = passes_clear(self._profile.machine, pose, self._hull(part), beside, base_mm, CELLS_MM)
        return self._known[key]

    def _hull(self, part: Part) -> Floats:
        """(m, 3, 3) corners of the faces of a part's hull, of one on the plate with what is around its base."""
        if part not in self._hulls:
            hull = convex_hull(part.mesh.vertices)
            if self._around_mm.get(part, 0.0) > 0.0:
                low = hull.vertices[hull.vertices[:, 2] <= part.lifted_mm + PLATFORM_TOLERANCE_MM]
                brims = (low[:, None] + self._around_mm[part] / np.cos(np.pi / SIDES) * _ROUND).reshape(-1, 3)
                plate = brims - [0.0, 0.0, part.lifted_mm]  # where a raft is as high as the part is lifted
                hull = convex_hull(np.vstack([hull.vertices, brims, plate]))
            self._hulls[part] = hull.vertices[hull.faces]
        return self._hulls[part]


def _away(here: Place, there: Place) -> Place:
    return round(there[0] - here[0], ROUNDING_DIGITS), round(there[1] - here[1], ROUNDING_DIGITS)
