"""Dialects: how each firmware family writes what a machine program means; one row a family, named as in machine.dialect."""

from machine.dialects.dialect import Dialect
from machine.dialects.grblhal import GRBLHAL
from machine.dialects.klipper import KLIPPER, KLIPPER_STEPPERS
from machine.dialects.linuxcnc import LINUXCNC
from machine.dialects.marlin import MARLIN
from machine.dialects.reprapfirmware import REPRAPFIRMWARE

__all__ = ["DIALECTS", "Dialect"]

DIALECTS: dict[str, Dialect] = {
    "marlin": MARLIN,
    "reprapfirmware": REPRAPFIRMWARE,
    "klipper": KLIPPER,
    "klipper_steppers": KLIPPER_STEPPERS,
    "linuxcnc": LINUXCNC,
    "grblhal": GRBLHAL,
}
