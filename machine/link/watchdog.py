"""Watchdog: temperatures that stay away from what is wanted, or that are told no more, end a print.

A firmware guards its heaters itself (Marlin: 40 s beyond 4 K, 20 s without a rise of 2 K); the bounds here are wider, so that
this one speaks only where the firmware's is missing or does not see the fault.
"""

from dataclasses import dataclass, field
from math import inf

from machine.link.events import Temperature
from profiles.errors import PrinterError


@dataclass(frozen=True)
class Bounds:
    """How far (K) a heater may stay from its target for how long (s), and what counts as getting nearer (K) meanwhile."""

    name: str
    off_c: float
    off_s: float
    nearer_c: float = 2.0


NOZZLE = Bounds("nozzle", 20.0, 60.0)
BED = Bounds("bed", 15.0, 180.0, 1.0)
UNHEARD_S = 120.0  # a report is asked for every few seconds: so many questions do not stay unanswered by chance
OVER_LIMIT_C = 15.0
OVER_REPORTS = 2  # in a row: a byte lost on the line makes 200 of 20.0 once


@dataclass
class Heater:
    """One heater's way to its target."""

    bounds: Bounds
    target_c: float | None = None
    nearest_c: float = inf  # least distance from the target since it was set or reached
    nearest_s: float = 0.0  # when that was
    over: int = 0  # reports in a row beyond what the machine allows

    def saw(self, now_c: float | None, target_c: float | None, now_s: float) -> None:
        """Judge one report; raises PrinterError."""
        if now_c is None or not target_c:
            self.target_c = None
            return
        off, bounds = abs(now_c - target_c), self.bounds
        if target_c != self.target_c or off <= bounds.off_c:
            self.target_c, self.nearest_c, self.nearest_s = target_c, max(off, bounds.off_c), now_s
        elif off <= self.nearest_c - bounds.nearer_c:
            self.nearest_c, self.nearest_s = off, now_s
        elif now_s - self.nearest_s > bounds.off_s:
            raise PrinterError(
                f"the {bounds.name} has been at {now_c:.0f} deg C for {now_s - self.nearest_s:.0f} s although {target_c:.0f} is "
                "wanted: its heater or its sensor has failed"
            )


@dataclass
class Watchdog:
    """saw() with every report; wait() now and then. most_c: what nozzle and bed must never exceed by far, deg C."""

    most_c: tuple[float, float] = (inf, inf)
    heard_s: float | None = None
    _heaters: tuple[Heater, Heater] = field(default_factory=lambda: (Heater(NOZZLE), Heater(BED)))

    def saw(self, told: Temperature, now_s: float) -> None:
        """Judge a report. Raises PrinterError."""
        self.heard_s = now_s
        pairs = ((told.nozzle_c, told.nozzle_target_c), (told.bed_c, told.bed_target_c))
        for heater, most_c, (now_c, target_c) in zip(self._heaters, self.most_c, pairs, strict=True):
            heater.over = heater.over + 1 if now_c is not None and now_c > most_c + OVER_LIMIT_C else 0
            if heater.over >= OVER_REPORTS:
                raise PrinterError(f"the {heater.bounds.name} is at {now_c:.0f} deg C: this machine allows at most {most_c:g}")
            if not heater.over:
                heater.saw(now_c, target_c, now_s)

    def wait(self, now_s: float, mute: bool = False) -> None:
        """Judge silence while a heater is on; raises PrinterError. A printer that never told anything is not judged, nor one that
        cannot tell anything now (mute).
        """
        if mute and self.heard_s is not None:
            self.heard_s = now_s
        heated = any(heater.target_c for heater in self._heaters)
        if self.heard_s is not None and heated and now_s - self.heard_s > UNHEARD_S:
            raise PrinterError(f"the printer has told no temperature for {now_s - self.heard_s:.0f} s although a heater is on")
