"""Marlin 2.1: rotary axes are the words of AXIS4_NAME and AXIS5_NAME; M73, M486 and arcs are build options it may lack.

TCP (G43.4, G49) exists in the fork DerAndere1/Marlin, branch Marlin2ForPipetBot, only. Its F on mixed moves counts X Y Z.
"""

from machine.dialects.dialect import Dialect

MARLIN = Dialect(
    firmware="Marlin",
    longest_line=95,  # MAX_CMD_SIZE 96 with the closing zero: a longer line loses its checksum
    nozzle="M104 S{}",
    nozzle_wait="M109 S{}",
    fan_on="M106 S{}",
    progress="M73 P{} R{}",
    acceleration="M204 P{} T{}",
    parts="M486 T{parts}",
    part_begin="M486 S{index}",
    part_end="M486 S-1",
    follow_on="G43.4",
    follow_off="G49",
    filament_mode="set",
    stands=("G92 X{x_mm} Y{y_mm} Z{z_mm} {tilt}{tilt_deg} {turn}{turn_deg}",),
)
