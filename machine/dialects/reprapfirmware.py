"""RepRapFirmware 3: the words are those of M584 (A C, B C or U V); fans count 0 to 1, M568 sets a tool's temperature.

Mainline has no TCP, so coordinates are the table's.
"""

from machine.dialects.dialect import Dialect

REPRAPFIRMWARE = Dialect(
    firmware="RepRapFirmware",
    longest_line=120,  # it keeps more; the stream's checksum is made for no longer ones
    nozzle="M568 P0 S{}",
    nozzle_wait="M109 S{}",
    fan_on="M106 P0 S{}",
    fan_off="M106 P0 S0",
    fan_full=1,
    progress="M73 P{} R{}",
    acceleration="M204 P{} T{}",
    parts="M486 T{parts}",
    part_begin='M486 S{index} A"part {number}"',
    part_end="M486 S-1",
    stands=("G92 X{x_mm} Y{y_mm} Z{z_mm} {tilt}{tilt_deg} {turn}{turn_deg}",),
)
