"""What the commands that ask or tell do in a simulated printer: temperatures, places, identity, reports, messages."""

from math import inf

from machine.link.body import Body, Command, Words, Work
from machine.link.habits import Habits

CAPABILITIES = {
    "SERIAL_XON_XOFF": 0,
    "BINARY_FILE_TRANSFER": 0,
    "EEPROM": 0,
    "VOLUMETRIC": 0,
    "AUTOREPORT_POS": 1,
    "AUTOREPORT_TEMP": 1,
    "PROGRESS": 0,
    "PRINT_JOB": 1,
    "AUTOLEVEL": 0,
    "Z_PROBE": 0,
    "SOFTWARE_POWER": 1,
    "EMERGENCY_PARSER": 1,
    "HOST_ACTION_COMMANDS": 1,
    "SDCARD": 0,
    "REPORTING": 0,
    "MOTION_MODES": 0,
    "ARCS": 1,
    "BABYSTEPPING": 0,
    "CHAMBER_TEMPERATURE": 0,
}
ENDSTOP_MM = 0.01


def introduce(body: Body, habits: Habits) -> Work:
    """M115: name, capabilities, and the axes' reach, the fourth axis on named i, j whatever their words are."""
    manner = body.manner
    name = manner.identity.format(axes=5 if body.machine.tilts else 3)
    if manner.talks_in_ok:
        return f"ok {name}"
    body.say(name)
    if manner.options:
        known = CAPABILITIES | {
            "AUTOREPORT_POS": habits.autoreport,
            "AUTOREPORT_TEMP": habits.autoreport,
            "EMERGENCY_PARSER": habits.emergency_parser,
            "REPORTING": habits.realtime,
        }
        for capability, there in known.items():
            body.say(f"Cap:{capability}:{int(there)}")
        if habits.geometry:
            body.say(_area(body))
    return None


def _area(body: Body) -> str:
    limits = body.motion.limits[: 5 if body.machine.tilts else 3]
    least, most = (",".join(f"{a}:{b[side]:.2f}" for a, b in zip("xyzij", limits, strict=False)) for side in (0, 1))
    reach = f"min:{{{least}}},max:{{{most}}}"
    return f"area:{{full:{{{reach}}},work:{{{reach}}}}}"


def _tell_temperature(body: Body, words: Words, text: str) -> Work:
    return f"ok {body.temperatures()}"


def _tell_place(body: Body, words: Words, text: str) -> Work:
    body.say(body.place())
    return None


def _report_temperature(body: Body, words: Words, text: str) -> Work:
    body.report_every_s = max(0.0, words.get("S", 0.0))
    body.report_s = body.now_s + body.report_every_s if body.report_every_s else inf
    return None


def _report_place(body: Body, words: Words, text: str) -> Work:
    body.place_every_s = max(0.0, words.get("S", 0.0))
    body.place_s = body.now_s + body.place_every_s if body.place_every_s else inf
    return None


def _keep_alive(body: Body, words: Words, text: str) -> Work:
    """M113: seconds between `busy:`, 0 for none."""
    if "S" in words:
        body.busy_every_s = max(0.0, words["S"])
    else:
        body.say(f"echo:M113 S{body.busy_every_s:g}")
    return None


def _number_lines(body: Body, words: Words, text: str) -> Work:
    """A bare M110: its N is the number of the last line."""
    if "N" in words:
        body.number = int(words["N"])
    return None


def _tell_host(body: Body, words: Words, text: str) -> Work:
    """M118: A1 makes it an action of the host, with the line end of another system; E1 an echo."""
    message, action, echo = text[4:].strip(), False, False
    while message[:2] in ("A0", "A1", "E0", "E1", "P0") and message[2:3] in ("", " "):
        action, echo = action or message[:2] == "A1", echo or message[:2] == "E1"
        message = message[2:].lstrip()
    body.say(f"{'echo:' if echo else ''}{'//' if action else ''}{message}" + ("\r" if action else ""))
    return None


def _tell_endstops(body: Body, words: Words, text: str) -> Work:
    """M119: X and Y end at their least, Z at its greatest."""
    body.say("Reporting endstop status")
    real = body.motion.at(body.now_s)
    for axis, (letter, side) in enumerate((("x", 0), ("y", 0), ("z", 1))):
        limit = body.motion.limits[axis][side]
        touched = real[axis] <= limit + ENDSTOP_MM if side == 0 else real[axis] >= limit - ENDSTOP_MM
        body.say(f"{letter}_{('min', 'max')[side]}: {'TRIGGERED' if touched else 'open'}")
    return None


def _nothing(body: Body, words: Words, text: str) -> Work:
    return None


TELLING: dict[str, Command] = {
    "M17": _nothing,
    "M73": _nothing,
    "M105": _tell_temperature,
    "M110": _number_lines,
    "M113": _keep_alive,
    "M114": _tell_place,
    "M117": _nothing,
    "M118": _tell_host,
    "M119": _tell_endstops,
    "M154": _report_place,
    "M155": _report_temperature,
    "M486": _nothing,
    "M665": _nothing,
    "M876": _nothing,
    "T0": _nothing,
}
