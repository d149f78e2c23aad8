"""Park: where the tip waits during a pause, straight up along the nozzle and aside, clear of table, cradle and print.

The way: up at the place where the print stopped, across at a height above which nothing stands, and back the same way.
"""

from dataclasses import dataclass, field
from itertools import product

import numpy as np

from machine.collide import Printed, solids, sweep_gaps
from machine.coordinates import axis_positions, followed, origin_mm
from machine.kinematics.table import workpiece_points
from machine.link.modal import E_AXIS, Modal
from mdp.head import bodies, directions
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.machine import Machine

BEAD_MM = 1.0  # half a bead's width and more
ASIDE_MM = 1.0  # kept from the ends of the axes
PARTS = 4  # a way is tried in so many pieces when it is not clear as a whole


@dataclass(frozen=True)
class Park:
    """Axis positions, mm: the tip goes up to lift_mm and from there to stand_mm; the same place twice where it stays."""

    lift_mm: tuple[float, float, float]
    stand_mm: tuple[float, float, float]


@dataclass
class Laid:
    """Boxes around what was printed at each pose: a bound of the print that costs nothing to keep."""

    machine: Machine
    _boxes: dict[tuple[float, float], list[float]] = field(default_factory=dict)

    def follow(self, modal: Modal, command: str) -> tuple[bool, bool]:
        """Hand a command to `modal` and keep the boxes in step; whether it moves something, and whether it lays plastic."""
        before, pulled = modal.at[E_AXIS], modal.pulled_mm
        if not modal.take(command):
            return False, False
        after = modal.at[E_AXIS]
        stroke = command[:2] in ("G1", "G2", "G3") and not command[2:3].isdigit()
        lays = stroke and not pulled and (before is None or after is None or after > before)
        if lays:
            self.push(modal.place())
        return True, lays

    def push(self, place: tuple[float | None, ...]) -> None:
        """Filament was pushed on the way to a place, X Y Z tilt turn."""
        x, y, z, tilt, turn = place[:5]
        if x is None or y is None or z is None:
            return
        tilt = self.machine.tilt.zero_deg if tilt is None else tilt
        turn = self.machine.turn.zero_deg if turn is None else turn
        box = self._boxes.get((tilt, turn))
        if box is None:
            self._boxes[tilt, turn] = [x, y, z, x, y, z]
            return
        for axis, value in enumerate((x, y, z)):
            if value < box[axis]:
                box[axis] = value
            elif value > box[axis + 3]:
                box[axis + 3] = value

    def printed(self, followed_table: bool = False) -> Printed:
        """The corners of all boxes in the workpiece frame; followed_table: the places were those of the table already."""
        corners = [np.zeros((0, 3))]
        for (tilt, turn), box in self._boxes.items():
            places = np.array(list(product(*zip(box[:3], box[3:], strict=True))))
            if followed_table:
                corners.append(places - origin_mm(self.machine))
            else:
                corners.append(workpiece_points(self.machine, Pose(tilt, turn), places))
        return Printed(np.vstack(corners), BEAD_MM)


def parked(machine: Machine, printed: Printed, at_mm: Floats, pose: Pose) -> Park | None:
    """Where to wait when the tip stands at at_mm (axis positions X Y Z); None when no way up is proved clear."""
    x, y, z = (float(value) for value in at_mm)
    most = machine.z.limits_mm[1]
    top = top_mm(machine, printed, pose) + machine.lift_mm
    height = min(max(top, z + min(machine.lift_mm, most - z)), most)
    while not _clear(machine, pose, np.array([x, y, z]), np.array([x, y, height])):
        height = z + (height - z) / 2.0
        if height - z < min(1.0, machine.clearance_mm):
            return None
    lift = (x, y, height)
    if height < min(top, most) - 1e-9:
        return Park(lift, lift)
    corners = sorted(_corners(machine), key=lambda corner: abs(corner[0] - x) + abs(corner[1] - y))
    for corner in corners:
        stand = (*corner, height)
        if height >= top - 1e-9 or _clear(machine, pose, np.array(lift), np.array(stand), printed):
            return Park(lift, stand)
    return Park(lift, lift)


def moves(machine: Machine, park: Park, pose: Pose, following: bool) -> list[str]:
    """G0 words of the way up and aside, as the firmware calls the places now; following: it follows the table (TCP)."""
    ways = [park.lift_mm] if park.stand_mm == park.lift_mm else [park.lift_mm, park.stand_mm]
    places = np.array(ways)
    if following:
        places = followed(machine, pose, places)
        return [f"X{x:.3f} Y{y:.3f} Z{z:.3f}" for x, y, z in places]
    first = f"Z{places[0][2]:.3f}"
    return [first, *(f"X{x:.3f} Y{y:.3f}" for x, y, _ in places[1:])]


def standing_mm(machine: Machine, place: tuple[float | None, ...], following: bool) -> tuple[Floats, Pose] | None:
    """(3,) axis positions and the pose of a place as the program calls it; None where a coordinate is not known."""
    x, y, z, tilt, turn = place[:5]
    if x is None or y is None or z is None:
        return None
    pose = Pose(machine.tilt.zero_deg if tilt is None else tilt, machine.turn.zero_deg if turn is None else turn)
    at = np.array([[x, y, z, pose.tilt_deg, pose.turn_deg]])
    return (axis_positions(machine, at)[0] if following else at[0, :3]), pose


def lift_words(machine: Machine, pose: Pose, far_mm: float, following: bool) -> str:
    """Words of a step along the nozzle, for G91."""
    step = rotation(machine, pose).T @ (far_mm * UP) if following else far_mm * UP
    return " ".join(f"{letter}{value:.3f}" for letter, value in zip("XYZ", step, strict=True) if abs(value) > 5e-4)


def top_mm(machine: Machine, printed: Printed, pose: Pose) -> float:
    """Greatest Z of table, cradle and print at a pose."""
    return max(float(reach_of(UP[None])[0]) for _, reach_of in solids(machine, pose, printed))


def _corners(machine: Machine) -> list[tuple[float, float]]:
    (left, right), (front, back) = machine.x.limits_mm, machine.y.limits_mm
    return [(x, y) for x in (left + ASIDE_MM, right - ASIDE_MM) for y in (front + ASIDE_MM, back - ASIDE_MM)]


def _clear(machine: Machine, pose: Pose, start: Floats, end: Floats, printed: Printed | None = None) -> bool:
    """True when each body keeps what it must from the solids, piece by piece of the way."""
    normal = rotation(machine, pose) @ UP
    tried = np.vstack([UP, normal, directions(normal)])
    shares = np.linspace(0.0, 1.0, PARTS + 1)
    begins = start + shares[:-1, None] * (end - start)
    ends = start + shares[1:, None] * (end - start)
    for _, reach_of in solids(machine, pose, printed):
        reach = reach_of(tried)
        for body in bodies(machine):
            if float(sweep_gaps(body, begins, ends, tried, reach).min()) < body.need_mm - 1e-6:
                return False
    return True
