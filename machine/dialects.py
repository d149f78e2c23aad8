"""Dialects: how a firmware family writes what the program means; one row a family."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Dialect:
    """Words of a firmware. {} takes the value; a fan's value is 0 to 255."""

    travel: str
    stroke: str
    arc_right: str
    arc_left: str
    fan_on: str
    fan_off: str
    nozzle: str
    nozzle_wait: str
    progress: str
    acceleration: str
    reset_filament: str
    longest_line: int


DIALECTS = {
    "marlin": Dialect(
        travel="G0",
        stroke="G1",
        arc_right="G2",
        arc_left="G3",
        fan_on="M106 S{}",
        fan_off="M107",
        nozzle="M104 S{}",
        nozzle_wait="M109 S{}",
        progress="M73 P{} R{}",
        acceleration="M204 P{} T{}",  # both: Klipper takes no P alone
        reset_filament="G92 E0",
        longest_line=95,  # MAX_CMD_SIZE 96 with the closing zero: a longer line loses its checksum
    ),
}
