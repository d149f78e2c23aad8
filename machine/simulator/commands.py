"""The commands that the simulated printer of each firmware knows: heat, fan, power supply, reports, messages."""

from collections.abc import Iterator
from math import inf

from machine.firmware import dialect_of
from machine.simulator.board import Board, Command, Work
from machine.simulator.motion import WordValues
from machine.simulator.motion_commands import MOVING

NEAR_C = 1.0  # Marlin's TEMP_WINDOW: a heater within it has arrived
REPORT_S = 1.0  # Marlin reports temperatures so often while it waits for heat
CAPABILITIES = (
    "SERIAL_XON_XOFF BINARY_FILE_TRANSFER EEPROM VOLUMETRIC AUTOREPORT_POS AUTOREPORT_TEMP PROGRESS PRINT_JOB AUTOLEVEL Z_PROBE "
    "SOFTWARE_POWER EMERGENCY_PARSER HOST_ACTION_COMMANDS SDCARD REPORTING MOTION_MODES ARCS BABYSTEPPING CHAMBER_TEMPERATURE"
)
THERE = ("PRINT_JOB", "SOFTWARE_POWER", "HOST_ACTION_COMMANDS", "ARCS")  # beside those that the build decides
ENDSTOP_MM = 0.01
WITHOUT_EFFECT = ("M17", "M73", "M117", "M486", "M572", "M665", "M876", "M900", "T0")


def heat(board: Board, words: WordValues, text: str) -> Work:
    """Give a heater its target: M104, M109, M568 the nozzle, others the bed."""
    heater = board.nozzle if text.startswith(("M104", "M109", "M568")) else board.bed
    wanted = words.get("S", words.get("R"))
    if wanted is not None and board.powered:
        heater.set(wanted, board.now_s)
        board.note(f"{heater.name} {heater.target_c:g}")
    return None


def heat_and_wait(board: Board, words: WordValues, text: str) -> Iterator[float]:
    """The same, and wait until it is there; R: also for a hotter one to cool."""
    heat(board, words, text)
    heater = board.nozzle if text.startswith("M109") else board.bed
    rising = heater.target_c > heater.at(board.now_s)
    if not rising and "R" not in words:
        return
    arrived_s = heater.reaches(heater.target_c - NEAR_C if rising else heater.target_c + NEAR_C)
    if arrived_s == inf and heater.trip_s == inf:
        return
    board.waits_for_heat, board.impatient = True, False
    while board.now_s < arrived_s and not board.impatient:
        yield min(arrived_s, board.now_s + REPORT_S)
        board.awake_s = board.now_s
        board.say(f"{board.temperatures()}{board.rules.while_heating}")
    board.waits_for_heat = False


def _wait_for_all(board: Board, words: WordValues, text: str) -> Iterator[float]:
    """M116 (RepRapFirmware)."""
    yield from heat_and_wait(board, {"S": board.bed.target_c}, "M190")
    yield from heat_and_wait(board, {"S": board.nozzle.target_c}, "M109")


def _fan(board: Board, words: WordValues, text: str) -> Work:
    full = 1.0 if words.get("S", 255.0) <= dialect_of(board.machine).fan_full == 1 else 255.0
    board.fan = min(max(words.get("S", full), 0.0), full) / full if text.startswith("M106") else 0.0
    board.note(f"fan {board.fan:.2f}")
    return None


def _allow_cold(board: Board, words: WordValues, text: str) -> Work:
    """M302."""
    if "P" in words:
        board.cold_allowed = words["P"] != 0
    elif "S" in words:
        board.cold_allowed = words["S"] <= 0
    return None


def _power(board: Board, words: WordValues, text: str) -> Work:
    """M80, M81: without the power supply nothing heats; what moves is planned and does not matter."""
    if text.startswith("M81"):
        board.off()
    board.powered = not text.startswith("M81")
    board.note(f"power {'on' if board.powered else 'off'}")
    return None


def _identify_firmware(board: Board, words: WordValues, text: str) -> Work:
    """M115: name, capabilities, and the axes' reach, the fourth axis on named i, j whatever their words are."""
    rules, build = board.rules, board.build
    name = rules.identity.format(axes=5 if board.machine.tilts else 3)
    if rules.identity_in_ok:
        return f"ok {name}"
    board.say(name)
    if rules.has_build_options:
        built = dict.fromkeys(("AUTOREPORT_POS", "AUTOREPORT_TEMP"), build.autoreport)
        built |= {"EMERGENCY_PARSER": build.emergency_parser, "REPORTING": build.realtime}
        for capability in CAPABILITIES.split():
            board.say(f"Cap:{capability}:{int(built.get(capability, capability in THERE))}")
        if build.geometry:
            board.say(_area(board))
    return None


def _area(board: Board) -> str:
    limits = board.motion.limits[: 5 if board.machine.tilts else 3]
    least, most = (",".join(f"{a}:{b[side]:.2f}" for a, b in zip("xyzij", limits, strict=False)) for side in (0, 1))
    reach = f"min:{{{least}}},max:{{{most}}}"
    return f"area:{{full:{{{reach}}},work:{{{reach}}}}}"


def _tell_settings(board: Board, words: WordValues, text: str) -> Work:
    """What a command stands at when it has no words of its own; M409 of RepRapFirmware names a key in them."""
    if not words or text.startswith("M409"):
        for line in board.rules.settings(text.strip(), board.motion.settings()):
            board.say(line)
    command = MOVING.get(text.split()[0])
    return command(board, words, text) if command is not None else None


def _autoreport_temperatures(board: Board, words: WordValues, text: str) -> Work:
    board.report_every_s = max(0.0, words.get("S", 0.0))
    board.report_s = board.now_s + board.report_every_s if board.report_every_s else inf
    return None


def _autoreport_position(board: Board, words: WordValues, text: str) -> Work:
    board.position_every_s = max(0.0, words.get("S", 0.0))
    board.position_s = board.now_s + board.position_every_s if board.position_every_s else inf
    return None


def _keep_alive(board: Board, words: WordValues, text: str) -> Work:
    """M113: seconds between `busy:`, 0 for none."""
    if "S" in words:
        board.busy_every_s = max(0.0, words["S"])
    else:
        board.say(f"echo:M113 S{board.busy_every_s:g}")
    return None


def _number_lines(board: Board, words: WordValues, text: str) -> Work:
    """A bare M110: its N is the number of the last line."""
    if "N" in words:
        board.number = int(words["N"])
    return None


def _send_to_host(board: Board, words: WordValues, text: str) -> Work:
    """M118: A1 makes it an action of the host, with the line end of another system; E1 an echo."""
    message, action, echo = text[4:].strip(), False, False
    while message[:2] in ("A0", "A1", "E0", "E1", "P0") and message[2:3] in ("", " "):
        action, echo = action or message[:2] == "A1", echo or message[:2] == "E1"
        message = message[2:].lstrip()
    board.say(f"{'echo:' if echo else ''}{'//' if action else ''}{message}" + ("\r" if action else ""))
    return None


def _report_endstops(board: Board, words: WordValues, text: str) -> Work:
    """M119: X and Y end at their least, Z at its greatest."""
    board.say("Reporting endstop status")
    real = board.motion.at(board.now_s)
    for axis, (letter, side) in enumerate((("x", 0), ("y", 0), ("z", 1))):
        limit = board.motion.limits[axis][side]
        touched = real[axis] <= limit + ENDSTOP_MM if side == 0 else real[axis] >= limit - ENDSTOP_MM
        board.say(f"{letter}_{('min', 'max')[side]}: {'TRIGGERED' if touched else 'open'}")
    return None


def _stop_waiting(board: Board, words: WordValues, text: str) -> Work:
    board.impatient = True
    return None


COMMANDS: dict[str, Command] = {
    **MOVING,
    **dict.fromkeys(("M92", "M201", "M203", "M204", "M205", "M211", "M409", "M503"), _tell_settings),
    **dict.fromkeys(("M80", "M81"), _power),
    **dict.fromkeys(("M104", "M140", "M568"), heat),
    **dict.fromkeys(("M109", "M190"), heat_and_wait),
    **dict.fromkeys(("M106", "M107"), _fan),
    "M105": lambda board, words, text: f"ok {board.temperatures()}",
    "M108": _stop_waiting,
    "M110": _number_lines,
    "M113": _keep_alive,
    "M114": lambda board, words, text: board.say(board.position()),
    "M115": _identify_firmware,
    "M116": _wait_for_all,
    "M118": _send_to_host,
    "M119": _report_endstops,
    "M154": _autoreport_position,
    "M155": _autoreport_temperatures,
    "M302": _allow_cold,
    **dict.fromkeys(WITHOUT_EFFECT, lambda board, words, text: None),
}
