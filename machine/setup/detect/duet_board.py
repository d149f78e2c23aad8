"""Duet board: what a RepRapFirmware says, by config.g or by its object model, and the values of a profile that follow."""

from dataclasses import dataclass, field

from machine.setup.detect.found import ACCELERATION, LIMITS, PRINTING, SPEED, AxisReadings, Found, Reading, has_box

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
    """What is read so far.

    axes: by letter, E for the filament; jerks_mm_s: by letter; heaters_c: greatest temperature by heater; nozzle, bed: their
    heaters, bed below 0: none; turns: the axes that M584 makes -> whether it says that they turn, None where it is silent;
    kinematics: by its name in found.KINEMATICS; probe: its type.
    """

    firmware: str = "RepRapFirmware"
    name: str = ""
    axes: dict[str, AxisReadings] = field(default_factory=dict)
    jerks_mm_s: dict[str, float] = field(default_factory=dict)
    heaters_c: dict[int, float] = field(default_factory=dict)
    nozzle: int = 1
    bed: int = 0
    turns: dict[str, bool | None] | None = None
    kinematics: str = "cartesian"
    probe: int = 0
    remarks: list[str] = field(default_factory=list)

    def found(self, file: str, kinematics_source: str, jerk_source: str, heat_source: str) -> Found:
        """The values of a profile; file: for messages. Raises ProfileError for kinematics that are not known."""
        if not has_box(self.kinematics, f"{file}: {kinematics_source}"):
            self.remarks.append(f"its kinematics are {self.kinematics}: how far X, Y and Z reach stands in no axis of them")
            for letter in PRINTING:
                self.axes.get(letter, {}).pop(LIMITS, None)
        others = {letter: (self.turns or {}).get(letter) for letter in self.axes if letter not in (*PRINTING, "E")}
        rotary = "".join(letter for letter, turns in others.items() if turns or (turns is None and letter in TURNING))
        doubtful = {
            letter: f"{file}: nothing says whether {letter} turns, as R1 of M584 does"
            for letter, turns in others.items()
            if turns is None and letter not in TURNING
        }
        settings = self._settings(jerk_source, heat_source)
        probe = PROBES.get(self.probe, "")
        return Found(self.firmware, "reprapfirmware", self.axes, rotary, doubtful, settings, {}, self.name, probe, self.remarks)

    def _settings(self, jerk_source: str, heat_source: str) -> dict[str, Reading]:
        settings: dict[str, Reading] = {}
        level = [self.jerks_mm_s[letter] for letter in "XY" if letter in self.jerks_mm_s]
        if level:
            settings["junction_speed_mm_s"] = Reading(min(level), jerk_source)
        filament = self.axes.get("E", {})
        for key, word in (("extruder_speed_mm_s", SPEED), ("extruder_acceleration_mm_s2", ACCELERATION)):
            if word in filament:
                settings[key] = filament[word]
        for key, heater in (("nozzle_limit_c", self.nozzle), ("bed_limit_c", self.bed)):
            if heater in self.heaters_c:
                settings[key] = Reading(self.heaters_c[heater], heat_source)
        if self.bed < 0:
            settings["bed_limit_c"] = Reading(0.0, "it has no heated bed")
        return settings
