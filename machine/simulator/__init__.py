"""The simulated printer; a host sees it only through a terminal or a socket.

`simulator.SimulatedPrinter` runs in real time or faster, `virtual.VirtualPrinter` in memory on a clock of its own; both are a
`firmware.SimulatedFirmware` behind a `cable.Cable`, which lets the faults of a script happen.
"""
