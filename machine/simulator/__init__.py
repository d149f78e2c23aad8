"""Simulated printer, which a host reaches only through a terminal or a socket.

`simulator.SimulatedPrinter` runs in real time or faster: a `firmware.SimulatedFirmware` behind a `cable.Cable`, which injects the
faults of a script.
"""
