"""What Marlin tells of its settings: M503, and M92, M201, M203, M204, M205 and M211 without words.

MarlinSettings::report in module/settings.cpp and the M..._report functions of gcode/config and gcode/control (Marlin 2.1): M503
puts `echo:` before every line and a heading before each; asked one by one the commands tell the line alone, two places behind
the point, axes by the letters of their words.
"""

from collections.abc import Iterable, Mapping

from machine.firmware.simulation import SimulatedSettings

STEPS_E = 93.0  # a mm of filament
HEADINGS = {
    "M92": "Steps per unit",
    "M203": "Max feedrates (units/s)",
    "M201": "Max Acceleration (units/s2)",
    "M204": "Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>)",
    "M205": "Advanced (B<min_segment_time_us> S<min_feedrate> T<min_travel_feedrate> X<max_jerk> Y<max_jerk> Z<max_jerk>)",
    "M211": "Soft endstops",
}


def settings_report(command: str, settings: SimulatedSettings) -> list[str]:
    """The lines that answer a command without words; [] for one that tells nothing."""
    lines = _lines(settings)
    if command == "M503":
        told = ("echo:; Linear Units:", "echo:  G21 ; (mm)")
        return [*told, *(line for name, heading in HEADINGS.items() for line in _under(heading, lines[name]))]
    return lines.get(command, [])


def _lines(settings: SimulatedSettings) -> Mapping[str, list[str]]:
    letters, soft = settings.letters, settings.soft_limits
    least, most = (_words(letters, [ends[side] for ends in settings.limits]) for side in (0, 1))
    accelerations = f"P{settings.printing:.2f} R{settings.accelerations[-1]:.2f} T{settings.travelling:.2f}"
    return {
        "M92": [f"  M92{_words(letters, (*settings.steps, STEPS_E))}"],
        "M203": [f"  M203{_words(letters, settings.speeds)}"],
        "M201": [f"  M201{_words(letters, settings.accelerations)}"],
        "M204": [f"  M204 {accelerations}"],
        "M205": [f"  M205 B20000.00 S0.00 T0.00{_words(letters, [settings.jerk] * len(letters))}"],
        "M211": [f"  M211 S{int(soft)} ; {'ON' if soft else 'OFF'}", f"  Min: {least}   Max: {most}"],
    }


def _under(heading: str, lines: Iterable[str]) -> list[str]:
    return [f"echo:; {heading}:", *(f"echo:{line}" for line in lines)]


def _words(letters: str, values: Iterable[float]) -> str:
    return "".join(f" {letter}{value:.2f}" for letter, value in zip(letters, values, strict=False))
