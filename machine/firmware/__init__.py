"""Firmwares: the dialect of each, its answers and its simulation; one line of the table each.

`dialect_of(machine)` is the dialect written for a machine, `simulation_of(machine)` the simulation of its firmware,
`identify(text)` the firmware of an answer to M115. `firmware` has the overhead of bytes and numbered lines on the serial line,
and its rates.
"""

from machine.firmware.dialect import Dialect
from machine.firmware.firmware import Firmware, SimulationRules
from machine.firmware.klipper import KLIPPER
from machine.firmware.linuxcnc import GRBLHAL, LINUXCNC
from machine.firmware.marlin import MARLIN, REPETIER, SIMULATED, SMOOTHIEWARE
from machine.firmware.reprapfirmware import REPRAPFIRMWARE
from profiles.machine import Machine

__all__ = ["FIRMWARES", "Dialect", "Firmware", "dialect_of", "dialects", "firmware_of", "identify", "simulation_of"]

FIRMWARES: tuple[Firmware, ...] = (MARLIN, REPETIER, SMOOTHIEWARE, REPRAPFIRMWARE, KLIPPER, LINUXCNC, GRBLHAL)


def dialects() -> dict[str, Dialect]:
    """Every dialect by its name in machine.dialect."""
    return {name: dialect for firmware in FIRMWARES for name, dialect in firmware.dialects.items()}


def dialect_of(machine: Machine) -> Dialect:
    """The dialect of a machine."""
    return dialects()[machine.dialect]


def firmware_of(machine: Machine) -> Firmware:
    """The firmware of a machine's dialect."""
    return next(firmware for firmware in FIRMWARES if machine.dialect in firmware.dialects)


def simulation_of(machine: Machine) -> SimulationRules:
    """The rules that simulate a machine's firmware; Marlin's for one without rules, which opens files itself."""
    return firmware_of(machine).simulated or SIMULATED


def identify(identity: str) -> Firmware | None:
    """The firmware of a FIRMWARE_NAME line, None for an unknown one; forks keep the name of their origin."""
    folded = identity.lower()
    return next((firmware for firmware in FIRMWARES if any(sign in folded for sign in firmware.signs)), None)
