"""Firmwares: what is sent to each, how it answers and how it is simulated; one line of the table each.

`dialect_of(machine)` is what is written for a machine, `simulation_of(machine)` how its firmware is simulated, `identify(text)`
the firmware of an answer to M115. `firmware` has what a byte and a numbered line cost on the serial line, and its rates.
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
    """The dialect that is written for a machine."""
    return dialects()[machine.dialect]


def firmware_of(machine: Machine) -> Firmware:
    """The firmware that a machine's dialect is written for."""
    return next(firmware for firmware in FIRMWARES if machine.dialect in firmware.dialects)


def simulation_of(machine: Machine) -> SimulationRules:
    """The rules by which a machine's firmware is simulated; one that opens files itself has no rules of its own and is taken for
    Marlin."""
    return firmware_of(machine).simulated or SIMULATED


def identify(identity: str) -> Firmware | None:
    """The firmware of a FIRMWARE_NAME line, None for an unknown one; forks keep the name of what they were forked from."""
    folded = identity.lower()
    return next((firmware for firmware in FIRMWARES if any(sign in folded for sign in firmware.signs)), None)
