"""A simulated heater: a first-order system that approaches its ceiling while heated and the room while not."""

from math import exp, inf, log

ROOM_C = 20.0


class Heater:
    """Temperature as a closed formula of time since the last order."""

    def __init__(self, limit_c: float, time_constant_s: float) -> None:
        self.target_c = 0.0
        self._limit_c = limit_c
        self._ceiling_c = 1.3 * limit_c + 50.0  # where full power would end: the limit is reached in finite time
        self._time_constant_s = time_constant_s
        self._from_c, self._since_s = ROOM_C, 0.0
        self.failed = False

    def set(self, target_c: float, now_s: float) -> None:
        """A new target, deg C, kept between 0 and the limit as the firmware does."""
        self._from_c, self._since_s = self.at(now_s), now_s
        self.target_c = min(max(target_c, 0.0), self._limit_c)

    def fail(self, now_s: float) -> None:
        """From now on it gives no heat whatever it is told: a cartridge that fell out."""
        self._from_c, self._since_s = self.at(now_s), now_s
        self.failed = True

    def at(self, now_s: float) -> float:
        """Temperature at a time, deg C."""
        goal, stop = self._goal()
        free = goal + (self._from_c - goal) * exp(-(now_s - self._since_s) / self._time_constant_s)
        return min(free, stop) if goal > self._from_c else max(free, stop)

    def reaches(self, value_c: float) -> float:
        """The time at which the temperature passes value_c on its way, s; inf when it never does."""
        goal, stop = self._goal()
        low, high = sorted((self._from_c, stop))
        if not low <= value_c <= high or value_c == goal:
            return inf
        return self._since_s + self._time_constant_s * log((self._from_c - goal) / (value_c - goal))

    def _goal(self) -> tuple[float, float]:
        """Where it would go without a thermostat, and where the thermostat stops it."""
        stop = ROOM_C if self.failed else max(self.target_c, ROOM_C)
        return (self._ceiling_c if stop > self._from_c else ROOM_C), stop
