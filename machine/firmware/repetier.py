"""Repetier-Firmware: prints what is written for Marlin.

`ok 12` names the line, nothing reports the free places: its own host counts characters against the receive buffer.
"""

from machine.firmware.firmware import Firmware
from machine.firmware.line import LineRules

REPETIER = Firmware(name="Repetier-Firmware", signs=("repetier",), line=LineRules(places=16))
