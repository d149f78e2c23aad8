"""Smoothieware: prints what is written for Marlin; no ok follows its Resend."""

from machine.firmware.firmware import Firmware
from machine.firmware.line import LineRules

SMOOTHIEWARE = Firmware(name="Smoothieware", signs=("smoothie",), line=LineRules(resend_ok=False))
