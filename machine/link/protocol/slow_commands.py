"""Slow commands: how long the `ok` of each may take. Such a command travels alone."""

from machine.link.protocol.framing import name_of

# The most a healthy printer needs, s: beyond it the printer is asked again, and given up after some questions.
HEATING_S = 3600.0  # a big bed in a cold room takes half an hour
PROBING_S = 1800.0  # a mesh of 15 x 15 points
HOMING_S = 600.0  # five axes at the speed of the slowest
HANDS_S = 86400.0  # a person changes the filament
SLOW_S = {
    **dict.fromkeys(("G4", "M109", "M116", "M190", "M191", "M303", "M400", "TEMPERATURE_WAIT"), HEATING_S),
    **dict.fromkeys(("G29", "G32", "G33", "G34", "M48", "BED_MESH_CALIBRATE"), PROBING_S),
    **dict.fromkeys(("G28", "G30", "MANUAL_STEPPER"), HOMING_S),
    **dict.fromkeys(("M125", "M226", "M600", "M701", "M702", "PAUSE"), HANDS_S),
    **dict.fromkeys(("M500", "M502"), 10.0),  # while an AVR writes its EEPROM the receive interrupt is off: bytes are lost
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
