"""A simulated heater: a first-order system that approaches its ceiling while heated and the room while not, and its guard."""

from math import exp, inf, log

ROOM_C = 20.0
GUARD_S, GUARD_C = 40.0, 4.0  # Marlin's THERMAL_PROTECTION_PERIOD and _HYSTERESIS
WATCH_S = 40.0  # Marlin's WATCH_TEMP_PERIOD: a heater that is told to heat must have become warmer by then
CALM_C = 1.0  # as near to its target a heater counts as there


class Heater:
    """Temperature as a closed formula of time since the last order."""

    def __init__(self, name: str, limit_c: float, time_constant_s: float) -> None:
        self.name = name
        self.target_c = 0.0
        self._limit_c = limit_c
        self._ceiling_c = 1.3 * limit_c + 50.0  # where full power would end: the limit is reached in finite time
        self._time_constant_s = time_constant_s
        self._from_c, self._since_s = ROOM_C, 0.0
        self._failed = False
        self.trip_s = inf  # when the firmware's guard will see that it does not heat
        self.trip = ""

    def set(self, target_c: float, now_s: float) -> None:
        """A new target, deg C, kept between 0 and the limit as the firmware does."""
        self._from_c, self._since_s = self.at(now_s), now_s
        self.target_c = min(max(target_c, 0.0), self._limit_c)
        self._guard(now_s)

    def fail(self, now_s: float) -> None:
        """From now on it gives no heat whatever it is told: a cartridge that fell out."""
        self._from_c, self._since_s = self.at(now_s), now_s
        self._failed = True
        self._guard(now_s)

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
        stop = ROOM_C if self._failed else max(self.target_c, ROOM_C)
        return (self._ceiling_c if stop > self._from_c else ROOM_C), stop

    def _guard(self, now_s: float) -> None:
        """When Marlin's thermal protection would stop a heater that gives no heat, and with which words."""
        self.trip_s, self.trip = inf, ""
        if not self._failed or self.target_c <= ROOM_C:
            return
        if self._from_c >= self.target_c - CALM_C:
            self.trip_s, self.trip = self.reaches(self.target_c - GUARD_C) + GUARD_S, "Thermal Runaway"
        else:
            self.trip_s, self.trip = now_s + WATCH_S, "Heating failed"
