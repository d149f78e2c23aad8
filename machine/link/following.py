"""Following: the kinematics a firmware runs itself (G43.4): places on the table become positions of the axes."""

from collections.abc import Sequence

from machine.coordinates import origin_mm
from mdp.pose import Pose, rotation, shift
from profiles.machine import Machine

Place = Sequence[float]


class Following:
    """X Y Z tilt turn either way; the rotation of the pose asked for last is kept, for most moves stay at theirs."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._origin: list[float] = origin_mm(machine).tolist()
        self._pose: tuple[float, float] | None = None

    def positions(self, place: Place) -> list[float]:
        """Where the axes stand when the tip is at a place: R (place - origin) + shift."""
        self._turn(place[3], place[4])
        x, y, z = (p - o for p, o in zip(place[:3], self._origin, strict=True))
        return [a * x + b * y + c * z + s for (a, b, c), s in zip(self._rotation, self._shift, strict=True)] + list(place[3:5])

    def place(self, positions: Place) -> list[float]:
        """Where the tip is on the table when the axes stand so."""
        self._turn(positions[3], positions[4])
        x, y, z = (p - s for p, s in zip(positions[:3], self._shift, strict=True))
        columns = zip(*self._rotation, strict=True)
        return [a * x + b * y + c * z + o for (a, b, c), o in zip(columns, self._origin, strict=True)] + list(positions[3:5])

    def _turn(self, tilt_deg: float, turn_deg: float) -> None:
        if self._pose != (tilt_deg, turn_deg):
            pose = Pose(tilt_deg, turn_deg)
            self._pose = (tilt_deg, turn_deg)
            self._rotation: list[list[float]] = rotation(self._machine, pose).tolist()
            self._shift: list[float] = shift(self._machine, pose).tolist()
