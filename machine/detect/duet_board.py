"""Duet board: what a RepRapFirmware tells, whichever way it tells it, and the values that follow."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from machine.detect.found import ACCELERATION, PRINTING, SPEED, AxisReadings, Found, Reading, rounded

MINUTE_S = 60.0
TURNING = "ABCD"  # GCodes3.cpp, DoDriveMapping: of these letters an axis turns unless R0 says otherwise
PROBES = {  # Endstops/EndstopDefs.h, ZProbeType
    1: "an analogue probe",
    5: "a switch as its probe",
    8: "a switch as its probe",
    9: "a BLTouch as its probe",
    10: "the stall of its Z motors as its probe",
    11: "a scanning probe",
}


@dataclass
class DuetBoard:
    """axes: by letter, E for the filament; jerks_mm_s: by letter; heaters_c: greatest temperature by heater; nozzle, bed: which
    heaters they are, bed below 0: none; turns: letters of which it is said whether they turn; probe: its type."""

    firmware: str = "RepRapFirmware"
    name: str = ""
    axes: dict[str, AxisReadings] = field(default_factory=dict)
    jerks_mm_s: dict[str, float] = field(default_factory=dict)
    heaters_c: dict[int, float] = field(default_factory=dict)
    nozzle: int = 1
    bed: int = 0
    turns: dict[str, bool] = field(default_factory=dict)
    probe: int = 0
    remarks: list[str] = field(default_factory=list)

    def found(self, jerk_source: str, heat_source: str) -> Found:
        """The values of a profile."""
        rotary = self._rotary()
        settings = self._settings(jerk_source, heat_source)
        probe, remarks = PROBES.get(self.probe, ""), tuple(self.remarks)
        return Found(self.firmware, "reprapfirmware", self.axes, rotary, settings, name=self.name, probe=probe, remarks=remarks)

    def _rotary(self) -> str:
        """Letters of the axes that turn; where fewer than two are said to and there are just two others, those, as U and V of
        Open5x."""
        others = [letter for letter in self.axes if letter not in (*PRINTING, "E")]
        turning = [letter for letter in others if self.turns.get(letter, letter in TURNING)]
        if len(turning) < 2 == len(others):
            taken = " and ".join(letter for letter in others if letter not in turning)
            self.remarks.append(f"{taken} taken for axes that turn, which nothing says of them")
            return "".join(others)
        return "".join(turning)

    def _settings(self, jerk_source: str, heat_source: str) -> dict[str, Reading]:
        settings: dict[str, Reading] = {}
        level = [self.jerks_mm_s[letter] for letter in "XY" if letter in self.jerks_mm_s]
        if level:
            settings["junction_speed_mm_s"] = Reading(rounded(min(level)), jerk_source)
        filament: Mapping[str, Reading] = self.axes.get("E", {})
        for key, word in (("extruder_speed_mm_s", SPEED), ("extruder_acceleration_mm_s2", ACCELERATION)):
            if word in filament:
                settings[key] = filament[word]
        if self.nozzle in self.heaters_c:
            settings["nozzle_limit_c"] = Reading(rounded(self.heaters_c[self.nozzle]), heat_source)
        if self.bed < 0:
            settings["bed_limit_c"] = Reading(0.0, "it has no heated bed")
        elif self.bed in self.heaters_c:
            settings["bed_limit_c"] = Reading(rounded(self.heaters_c[self.bed]), heat_source)
        return settings
