"""LinuxCNC: filament is a plain axis in absolute millimetres, heaters and fan are user M-codes whose value is the P word.

M104, M106, M107, M109, M140 and M190 are scripts of the machine (its own codes are M100 to M199). G0 ignores F, so travels are
G1. M428 and M429 switch xyzac-trt-kins as the sample configuration does; a file ends with M2.
"""

from machine.firmware.dialect import Dialect
from machine.firmware.firmware import Firmware

DIALECT = Dialect(
    firmware="LinuxCNC",
    longest_line=250,
    nozzle="M104 P{}",
    nozzle_wait="M109 P{}",
    fan_on="M106 P{}",
    travel="G1",
    filament="UVW",
    filament_relative=False,
    filament_mode="set",
    modes=("G17 G21 G90 G94", "G64 P0.02"),
    last="M2",
    follow_on="M428",
    follow_off="M429",
    inverse_time=True,
    rapid=True,
    value_word="P",
    serial=False,
    follow_persists=True,
    homed_before=True,
    wait_for_person=("(MSG, {text})", "M0"),
)

LINUXCNC = Firmware(name="LinuxCNC", dialects={"linuxcnc": DIALECT})
