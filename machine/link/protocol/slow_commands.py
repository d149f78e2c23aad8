"""Slow commands: how long the `ok` of each may take. Such a command travels alone."""

from machine.link.protocol.framing import name_of

# The most a healthy printer needs, s: beyond it the printer is asked again, and given up after some questions.
HEATING_S = 3600.0  # a big bed in a cold room takes half an hour
PROBING_S = 1800.0  # a mesh of 15 x 15 points
HOMING_S = 600.0  # five axes at the speed of the slowest
HANDS_S = 86400.0  # a person changes the filament
SLOW_S = {
    "G4": HEATING_S,
    "G28": HOMING_S,
    "G29": PROBING_S,
    "G30": HOMING_S,
    "G32": PROBING_S,
    "G33": PROBING_S,
    "G34": PROBING_S,
    "M48": PROBING_S,
    "M109": HEATING_S,
    "M116": HEATING_S,
    "M125": HANDS_S,
    "M190": HEATING_S,
    "M191": HEATING_S,
    "M226": HANDS_S,
    "M303": HEATING_S,
    "M400": HEATING_S,
    # While an AVR writes its EEPROM the receive interrupt is off: bytes that come then are lost.
    "M500": 10.0,
    "M502": 10.0,
    "M600": HANDS_S,
    "M701": HANDS_S,
    "M702": HANDS_S,
    "TEMPERATURE_WAIT": HEATING_S,
    "BED_MESH_CALIBRATE": PROBING_S,
    "PAUSE": HANDS_S,
    "MANUAL_STEPPER": HOMING_S,
}


HOMING = {"G28", "G29", "G30", "G32", "G33", "G34", "G38.2", "G38.3", "G38.4", "G38.5", "M48"}


def is_waited_for(command: str) -> bool:
    """Whether a command must be waited for when a print is ended: homing and probing must not be stopped, a dwell cannot be."""
    name = name_of(command)
    return name in HOMING or name == "G4" or name.upper().startswith("HOME")


def slow_timeout_s(command: str) -> float:
    """How long the answer to a slow command may take, 0 for a quick one."""
    if command[0] == "G" and command[1:2] in ("0", "1"):  # most lines of a program; none of these is slow
        return 0.0
    return SLOW_S.get(name_of(command), 0.0)
