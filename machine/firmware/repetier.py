"""Repetier-Firmware: prints what is written for Marlin.

`ok 12` names the line, nothing reports the free places: its own host counts characters against the receive buffer. M84 S sets
the idle time of its motors as Marlin's does (Commands.cpp, STEPPER_INACTIVE_TIME 360).
"""

from machine.firmware.firmware import Firmware
from machine.firmware.line import LineRules
from machine.firmware.marlin import MOTORS_STAY_ON

REPETIER = Firmware(name="Repetier-Firmware", signs=("repetier",), line=LineRules(places=16, keep_awake=MOTORS_STAY_ON))
