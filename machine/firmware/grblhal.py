"""grblHAL: no E word, so filament is a plain axis in absolute millimetres; G0 ignores F, so travels are G1.

M851 and M850 switch its A/C kinematics, whose places count from the turn axis. Fans come with a plug-in that knows on and off;
M104, M109, M140 and M190 need a plug-in of the machine's own.
"""

from machine.firmware.dialect import Command, Dialect
from machine.firmware.firmware import Firmware

COMMANDS = {
    "G61": Command("exact path", changes=True),
    "M850": Command("do not follow the table", changes=True),
    "M851": Command("follow the table", changes=True),
}

DIALECT = Dialect(
    firmware="grblHAL",
    longest_line=250,
    nozzle="M104 S{}",
    nozzle_wait="M109 S{}",
    fan_on="M106 P0",
    fan_off="M107 P0",
    travel="G1",
    filament="UVW",
    filament_relative=False,
    filament_mode="set",
    modes=("G17 G21 G90 G94",),
    last="M2",
    follow_on="M851",
    follow_off="M850",
    follow_from_turn_axis=True,
    inverse_time=True,
    rapid=True,
    bare_words=False,
    lacks=frozenset({"M82", "M83"}),
    serial=False,
    follow_persists=True,
    wait_for_person=("(MSG, {text})", "M0"),
    commands=COMMANDS,
)

GRBLHAL = Firmware(name="grblHAL", dialects={"grblhal": DIALECT})
