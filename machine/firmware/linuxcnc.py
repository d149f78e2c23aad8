"""LinuxCNC and grblHAL, controllers of milling machines: filament is a plain axis in absolute millimetres, and G0 ignores F, so
travels are G1.

LinuxCNC: heaters and fan are user M-codes with the value in the P word. M104, M106, M107, M109, M140 and M190 are scripts of the
machine (its own codes are M100 to M199). M428 and M429 switch xyzac-trt-kins as in the sample configuration; a file ends with M2.
The interpreter ends a program at a code that is unknown and not remapped, at a word without a number, and at an E that no command
uses (rs274ngc/interp_array.cc, interp_check.cc).

grblHAL has no E word. M851 and M850 switch its A/C kinematics, whose positions are relative to the turn axis. Fans need a plug-in
that only switches on and off; M104, M109, M140 and M190 need a plug-in of the machine.
"""

from dataclasses import replace

from machine.firmware.dialect import Command, Dialect
from machine.firmware.firmware import Firmware

_LACKS = (
    "G29 G32 M17 M18 M82 M83 M84 M201 M203 M204 M205 M207 M208 M220 M221 M300 M302 M400 M420 M486 M500 M501 M568 M572 M600 M900"
)

# linuxcnc.org/docs, gcode; M428 and M429 are the remaps of the sample configuration for xyzac-trt-kins.
COMMANDS = {
    "G61": Command("exact path", changes=True),
    "M428": Command("follow the table", changes=True),
    "M429": Command("do not follow the table", changes=True),
    "M66": Command("wait for an input", waits="person"),
    **{
        f"M{code}": Command("a script of the machine's own", heats="any")
        for code in range(100, 200)
        if code not in (104, 106, 107, 109, 140, 190)  # scripts with a known effect
    },
}

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
    bare_words=False,
    lacks=frozenset(_LACKS.split()),
    serial=False,
    follow_persists=True,
    homed_before=True,
    wait_for_person=("(MSG, {text})", "M0"),
    commands=COMMANDS,
)

LINUXCNC = Firmware(name="LinuxCNC", dialects={"linuxcnc": DIALECT})

GRBLHAL_COMMANDS = {
    "G61": Command("exact path", changes=True),
    "M850": Command("do not follow the table", changes=True),
    "M851": Command("follow the table", changes=True),
}

GRBLHAL_DIALECT = replace(
    DIALECT,
    firmware="grblHAL",
    nozzle="M104 S{}",
    nozzle_wait="M109 S{}",
    fan_on="M106 P0",
    fan_off="M107 P0",
    modes=("G17 G21 G90 G94",),
    follow_on="M851",
    follow_off="M850",
    follow_from_turn_axis=True,
    value_word="S",
    lacks=frozenset({"M82", "M83"}),
    homed_before=False,
    commands=GRBLHAL_COMMANDS,
)

GRBLHAL = Firmware(name="grblHAL", dialects={"grblhal": GRBLHAL_DIALECT})
