"""The simulated printer; a host sees it only through a terminal or a socket.

`simulator.SimulatedPrinter` runs in real time or faster: a `firmware.SimulatedFirmware` behind a `cable.Cable`, which lets the
faults of a script happen.
"""
