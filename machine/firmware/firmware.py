"""Firmware: everything the program knows about one, so that a new one is a new file."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from machine.firmware.dialect import Dialect
from machine.firmware.line import LineRules
from machine.firmware.probing import ProbingRules
from machine.firmware.simulation import SimulationRules


@dataclass(frozen=True)
class Firmware:
    """name: what people call it. signs: words of its FIRMWARE_NAME line in M115, lower case; (): it is not recognised.

    dialects: name in machine.dialect -> what is written for it; none of a firmware that prints what is written for another.
    line: its end of the serial line. simulated: None: the simulated printer behaves as Marlin. probing: None: it is not asked to.
    """

    name: str
    signs: tuple[str, ...] = ()
    dialects: Mapping[str, Dialect] = field(default_factory=dict)
    line: LineRules = field(default_factory=LineRules)
    simulated: SimulationRules | None = None
    probing: ProbingRules | None = None
