"""An invented firmware, written as CONTRIBUTING.md describes."""

from machine.firmware.dialect import Command, Dialect
from machine.firmware.firmware import Firmware, LineRules, SimulationRules

MADE_UP = Firmware(
    name="Made-up",
    signs=("made-up",),
    dialects={
        "made_up": Dialect(
            firmware="Made-up",
            longest_line=80,
            nozzle="M104 S{}",
            nozzle_wait="M109 S{}",
            fan_on="M106 S{}",
            fan_full=1,
            modes=("G90", "G21", "M83"),
            progress="M73 P{} R{}",
            part_begin="M117 part {number}",
            filament_mode="set",
            follow_on="M430",
            follow_off="M431",
            wait_for_person=("M118 {text}", "M1"),
            commands={
                "M430": Command("follow the table", changes=True),
                "M431": Command("do not follow the table", changes=True),
            },
        )
    },
    line=LineRules(places_plain=2, last_number=9_900, reports_rotary_axes=True),
    simulated=SimulationRules(
        identity="FIRMWARE_NAME:Made-up 1.0",
        banner=("Made-up is up and running.",),
        numbers="resend",
        queue_lines=2,
        blocks=8,
        urgent="lines",
        unknown="what is {}?",
        cold=("too cold",),
        unhomed="not homed",
        kill=("Error:stopped",),
        lacks=frozenset({"G2", "G3"}),
    ),
)
