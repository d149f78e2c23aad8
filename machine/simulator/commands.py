"""Commands of the simulated printers: one table for all firmwares; their rules list what each lacks.

A command receives the board and the order, and works at once or as an iterator of the virtual times at which it continues.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from math import hypot, inf

from machine.firmware import dialect_of
from machine.firmware.klipper import COMMANDS as MACROS
from machine.firmware.klipper import PROBING, stepper_name
from machine.gcode.commands import HOMES
from machine.gcode.words import read_letters, read_number
from machine.simulator.board import Board, Command, Heater, Order, Work, wait_for_moves
from machine.simulator.motion import WordValues

COLD_C = 170.0  # Marlin's EXTRUDE_MINTEMP
NEAR_C = 1.0  # Marlin's TEMP_WINDOW: a heater within it has arrived
REPORT_S = 1.0  # Marlin's interval of temperature reports while it waits for heat
CAPABILITIES = (
    "SERIAL_XON_XOFF BINARY_FILE_TRANSFER EEPROM VOLUMETRIC AUTOREPORT_POS AUTOREPORT_TEMP PROGRESS PRINT_JOB AUTOLEVEL Z_PROBE "
    "SOFTWARE_POWER EMERGENCY_PARSER HOST_ACTION_COMMANDS SDCARD REPORTING MOTION_MODES ARCS BABYSTEPPING CHAMBER_TEMPERATURE"
)
THERE = ("PRINT_JOB", "SOFTWARE_POWER", "HOST_ACTION_COMMANDS", "ARCS", "BABYSTEPPING")  # besides those that depend on the build
ENDSTOP_MM = 0.01


def command_of(board: Board, name: str) -> Command | None:
    """The function of a command or macro; None if the firmware does not know it.

    HOME_AB and the like are macros that machines define.
    """
    if name[1:2].isdigit():
        return None if name in board.rules.lacks else COMMANDS.get(name)
    if not dialect_of(board.machine).macros:
        return None
    name = name.upper()
    return _home_by_macro if HOMES.fullmatch(name) else COMMANDS.get(name)


def move(board: Board, words: WordValues) -> Work:
    """Execute G0 or G1; the caller has ensured a free block."""
    motion = board.motion
    if board.must_home and (unhomed := motion.unhomed(words)) is not None:
        board.say(board.rules.unhomed.format(_coordinates(unhomed)))
        return None
    pushes = _pushes(board, words)
    if not (pushes or board.rules.cold_moves):
        return None
    if board.rules.out_of_range and (beyond := motion.beyond(words)) is not None:
        board.say(board.rules.out_of_range.format(_coordinates(beyond)))
        return None
    target = motion.target(words, pushes)
    if motion.follows and len(pieces := motion.pieces(target)) > 1:
        return _run(board, pieces)
    motion.reach(target, board.now_s)
    return None


def _pushes(board: Board, words: WordValues) -> bool:
    """Whether filament is pushed; if the nozzle is too cold, the firmware says so."""
    if "E" not in words or board.cold_allowed or board.nozzle.at(board.now_s) >= COLD_C or not board.motion.pushes(words):
        return True
    for line in board.rules.cold:
        board.say(line)
    return False


def _coordinates(coordinates: Sequence[float]) -> str:
    """Coordinates as Klipper writes them: x y z [filament]."""
    x, y, z, *_, filament = coordinates
    return f"{x:.3f} {y:.3f} {z:.3f} [{filament:.3f}]"


def _run(board: Board, pieces: Sequence[Sequence[float]]) -> Iterator[float]:
    """Plan piece after piece, each waiting for a free block."""
    motion, halts = board.motion, board.motion.halts
    for piece in pieces:
        while not motion.planner.free(board.now_s):
            yield motion.planner.next_s()
        if motion.halts != halts:
            return
        motion.reach(piece, board.now_s)


def _arc(board: Board, order: Order) -> Work:
    words = order.words
    pieces = board.motion.arc(words, order.name == "G2", _pushes(board, words))
    if not pieces:
        board.say("echo: Bad arc parameters")
    return _run(board, pieces)


def _dwell(board: Board, order: Order) -> Iterator[float]:
    yield from wait_for_moves(board)
    until_s = board.now_s + max(0.0, _seconds(order.words))
    while board.now_s < until_s:
        yield until_s
    if board.rules.idle_shuts_down:
        board.awake_s = board.now_s


def _seconds(words: WordValues) -> float:
    """S seconds or P milliseconds."""
    return words.get("S", words.get("P", 0.0) / 1000.0)


def _set_mode(board: Board, order: Order) -> Work:
    board.motion.modes.set(order.name)
    return None


def _follow(board: Board, order: Order) -> Iterator[float]:
    yield from wait_for_moves(board)
    board.motion.follow(order.name == "G43.4")


def _rename(board: Board, order: Order) -> Work:
    board.motion.rename(order.words)
    if board.rules.reports_position:
        board.say(board.position())
    return None


def _home(board: Board, order: Order) -> Iterator[float]:
    letters = read_letters(order.rest)
    axes = [axis for axis, letter in enumerate(board.motion.letters[:5]) if letter in letters] or list(range(5))
    yield from _seek_endstops(board, axes)
    if board.rules.reports_position:
        board.say(board.position())


def _home_by_macro(board: Board, order: Order) -> Iterator[float]:
    letters = order.name.upper().removeprefix("HOME_")
    return _seek_endstops(board, [axis for axis, letter in enumerate(board.motion.letters[:5]) if letter in letters])


def _seek_endstops(board: Board, axes: Sequence[int]) -> Iterator[float]:
    yield from wait_for_moves(board)
    until_s = board.now_s + board.motion.home(axes)
    board.homes, board.awake_s = True, until_s
    while board.now_s < until_s:
        yield until_s
    board.homes = False
    board.note("homed " + "".join(board.motion.letters[axis] for axis in axes))


def _probe(board: Board, order: Order) -> Iterator[float]:
    """G38.3: down to a Z or to contact, as in Marlin's gcode/probe/G38.cpp and RepRapFirmware's straight probe."""
    if board.table is None:
        board.refuse(order.text)
        return
    yield from wait_for_moves(board)
    yield from _seek_contact(board, board.motion.target({letter: v for letter, v in order.words.items() if letter in "ZF"}))


def _probe_by_macro(board: Board, order: Order) -> Iterator[float]:
    """PROBE, with the answers of klippy/extras/probe.py and homing.py; the configured probe offset is 0."""
    if board.table is None:
        board.refuse("PROBE")
        return
    yield from wait_for_moves(board)
    motion, speed_mm_s = board.motion, _number(order, "PROBE_SPEED", 5.0)
    if 2 not in motion.homed:
        board.say("!! Must home before probe")
        return
    began = motion.position[2]
    met = yield from _seek_contact(board, [*motion.position[:2], motion.limits[2][0], *motion.position[3:]], speed_mm_s)
    x, y, z = motion.coordinates()[:3]
    if not met:
        board.say(f"!! {PROBING.silent}")
    elif motion.position[2] == began:
        board.say(f"!! {PROBING.early}")
    else:
        board.say(f"// probe: at {x:.3f},{y:.3f} bed will contact at z={z:.6f}")
        board.say(f"// Result: at {x:.3f},{y:.3f} estimate contact at z={z:.6f}")


def _seek_contact(board: Board, target: list[float], feed_mm_s: float | None = None) -> Generator[float, None, bool]:
    """Move down to a target or until the probe triggers; returns whether it did."""
    motion, table = board.motion, board.table
    assert table is not None
    real = motion.at(board.now_s)
    shift = motion.position[2] - real[2]
    stop = table.stop_z(real, target[2] - shift)
    met = stop == stop
    if met:
        target[2] = stop + shift
    board.note(f"probing down to Z{target[2]:.3f}")
    motion.reach(target, board.now_s, feed_mm_s)
    yield from wait_for_moves(board)
    return met


def _turn(board: Board, order: Order) -> Iterator[float]:
    """MANUAL_STEPPER: SYNC=0 starts a turn together with the next one."""
    machine, values = board.machine, order.values
    axes = {stepper_name(machine.tilt): (3, machine.tilt), stepper_name(machine.turn): (4, machine.turn)}
    index, axis = axes.get(values.get("STEPPER", ""), (0, None))
    if axis is None:
        board.unknown += 1
        board.say(f"!! The value '{values.get('STEPPER', '')}' is not valid for STEPPER")
        return
    if "SET_POSITION" in values:
        board.motion.set_coordinate(index, _number(order, "SET_POSITION"))
    if values.get("STOP_ON_ENDSTOP", "0") != "0":
        yield from _seek_endstops(board, [index])
        return
    if "MOVE" in values:
        board.turning[index] = (_number(order, "MOVE"), max(_number(order, "SPEED", axis.speed_deg_s), 1e-3))
    if board.turning and values.get("SYNC", "1") != "0":
        yield from _turn_together(board)


def _turn_together(board: Board) -> Iterator[float]:
    motion = board.motion
    while not motion.planner.free(board.now_s):
        yield motion.planner.next_s()
    here = motion.coordinates()
    far = {axis: abs(angle - here[axis]) for axis, (angle, _) in board.turning.items()}
    seconds = max(far[axis] / speed for axis, (_, speed) in board.turning.items())
    target = motion.turned({axis: angle for axis, (angle, _) in board.turning.items()})
    board.turning.clear()
    motion.reach(target, board.now_s, hypot(*far.values()) / seconds if seconds > 0 else None)
    yield from wait_for_moves(board)


def _number(order: Order, key: str, default: float = 0.0) -> float:
    number = read_number(order.values.get(key, ""))
    return default if number is None else number


def _wait_for_person(board: Board, order: Order) -> Iterator[float]:
    """M0, M1: wait for M108, or for P milliseconds or S seconds."""
    yield from wait_for_moves(board)
    seconds = _seconds(order.words)
    until_s = board.now_s + seconds if seconds > 0 else inf
    board.waits_for_person, board.impatient = True, False
    while board.now_s < until_s and not board.impatient:
        yield until_s
    board.waits_for_person = False


def _stop_waiting(board: Board, order: Order) -> Work:
    board.impatient = True
    return None


def _stop(board: Board, order: Order) -> Work:
    board.motion.halt(board.now_s)
    board.note("M410")
    return None


def _rest(board: Board, order: Order) -> Iterator[float]:
    """M18, M84: motors off; with S only after S idle seconds, 0: never."""
    words = order.words
    if "S" in words and not board.rules.idle_shuts_down:
        if board.rules.idle_after_s < inf:
            board.idle_after_s, board.awake_s = words["S"] or inf, board.now_s
        return
    yield from wait_for_moves(board)
    board.motion.homed.clear()
    board.let_go(range(5))


def _setting(change: Callable[[Board, WordValues], None] | None = None) -> Command:
    """A command that reports its setting when it has no words; M409 of RepRapFirmware names a key in them."""

    def run(board: Board, order: Order) -> Work:
        if not order.words or order.name == "M409":
            for line in board.rules.settings(order.text.strip(), board.motion.settings()):
                board.say(line)
        if change is not None:
            change(board, order.words)
        return None

    return run


def _corner(board: Board, words: WordValues) -> None:
    if words.get("X", -1.0) >= 0:
        board.motion.jerk_mm_s = words["X"]


def _limit(board: Board, words: WordValues) -> None:
    """M211: soft limits on and off."""
    if "S" in words:
        board.motion.soft_limits = words["S"] != 0


def _override_feed(board: Board, order: Order) -> Work:
    percent = order.words.get("S")
    if percent is None:
        board.say(f"FR:{100 * board.motion.feed_share:.0f}%")
    elif percent > 0:
        board.motion.feed_share = percent / 100.0
    return None


def _override_flow(board: Board, order: Order) -> Work:
    percent = order.words.get("S")
    if percent is None:
        board.say(f"echo:E0 Flow: {100 * board.motion.flow_share:.0f}%")
    elif percent >= 0:
        board.motion.flow_share = percent / 100.0
    return None


def _babystep(board: Board, order: Order) -> Work:
    """M290, SET_GCODE_OFFSET: the axis Z moves, at once or with the next move; the coordinate as the firmware knows it stays.
    Marlin answers M290 but ignores it until Z is homed."""
    named = order.name == "M290"
    if dialect_of(board.machine).babystep_homed and 2 not in board.motion.homed:
        return None
    board.motion.shift_z(order.words.get("Z", 0.0) if named else float(order.values.get("Z_ADJUST", 0.0)))
    if named or order.values.get("MOVE") == "1":
        board.motion.reach(board.motion.position, board.now_s)
    return None


def _heater(board: Board, order: Order) -> Heater:
    """The heater of M104, M109, M568, M140 or M190."""
    return board.nozzle if order.name in ("M104", "M109", "M568") else board.bed


def _set_target(board: Board, heater: Heater, target_c: float | None) -> None:
    if target_c is not None and board.powered:
        heater.set(target_c, board.now_s)
        board.note(f"{heater.name} {heater.target_c:g}")


def _wait_for_heat(board: Board, heater: Heater, cooling: bool = False) -> Iterator[float]:
    """Wait for a heater's target; cooling: also when it is hotter."""
    rising = heater.target_c > heater.at(board.now_s)
    if not rising and not cooling:
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


def _heat(board: Board, order: Order) -> Work:
    words = order.words
    _set_target(board, _heater(board, order), words.get("S", words.get("R")))
    return None


def _heat_and_wait(board: Board, order: Order) -> Iterator[float]:
    _heat(board, order)
    yield from _wait_for_heat(board, _heater(board, order), "R" in order.words)


def _wait_for_all(board: Board, order: Order) -> Iterator[float]:
    """M116 (RepRapFirmware): wait for all heaters."""
    for heater in (board.bed, board.nozzle):
        _set_target(board, heater, heater.target_c)
        yield from _wait_for_heat(board, heater)


def _heat_by_macro(board: Board, order: Order) -> Work:
    heater = {"extruder": board.nozzle, "heater_bed": board.bed}.get(order.values.get("HEATER", ""))
    if heater is not None:
        _set_target(board, heater, _number(order, "TARGET"))
    return None


def _wait_by_macro(board: Board, order: Order) -> Iterator[float]:
    heater = board.bed if order.values.get("SENSOR") == "heater_bed" else board.nozzle
    _set_target(board, heater, heater.target_c)
    yield from _wait_for_heat(board, heater)


def _heaters_off(board: Board, order: Order) -> Work:
    for heater in (board.nozzle, board.bed):
        _set_target(board, heater, 0.0)
    return None


def _allow_cold(board: Board, order: Order) -> Work:
    words = order.words
    if "P" in words:
        board.cold_allowed = words["P"] != 0
    elif "S" in words:
        board.cold_allowed = words["S"] <= 0
    return None


def _fan(board: Board, order: Order) -> Work:
    speed = order.words.get("S")
    full = 1.0 if speed is not None and speed <= dialect_of(board.machine).fan_full == 1 else 255.0
    board.fan = min(max(full if speed is None else speed, 0.0), full) / full if order.name == "M106" else 0.0
    board.note(f"fan {board.fan:.2f}")
    return None


def _power(board: Board, order: Order) -> Work:
    """M80, M81: without power nothing heats; moves are still planned, without effect."""
    board.powered = order.name == "M80"
    if not board.powered:
        board.off()
    board.note(f"power {'on' if board.powered else 'off'}")
    return None


def _identify_firmware(board: Board, order: Order) -> Work:
    """M115: name, capabilities, and the axes' reach, from the fourth axis as i, j whatever their letters are."""
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


def _autoreport(board: Board, order: Order) -> Work:
    """M155 temperatures, M154 the position, every S seconds; 0: off."""
    every_s = max(0.0, order.words.get("S", 0.0))
    next_s = board.now_s + every_s if every_s else inf
    if order.name == "M155":
        board.report_every_s, board.report_s = every_s, next_s
    else:
        board.position_every_s, board.position_s = every_s, next_s
    return None


def _keep_alive(board: Board, order: Order) -> Work:
    """M113: seconds between `busy:`, 0 for none."""
    if "S" in order.words:
        board.busy_every_s = max(0.0, order.words["S"])
    else:
        board.say(f"echo:M113 S{board.busy_every_s:g}")
    return None


def _number_lines(board: Board, order: Order) -> Work:
    """Bare M110: its N is the number of the last line."""
    if "N" in order.words:
        board.number = int(order.words["N"])
    return None


def _send_to_host(board: Board, order: Order) -> Work:
    """M118: A1 makes it an action of the host, with the line end of another system; E1 an echo."""
    message, action, echo = order.rest.strip(), False, False
    while message[:2] in ("A0", "A1", "E0", "E1", "P0") and message[2:3] in ("", " "):
        action, echo = action or message[:2] == "A1", echo or message[:2] == "E1"
        message = message[2:].lstrip()
    board.say(f"{'echo:' if echo else ''}{'//' if action else ''}{message}" + ("\r" if action else ""))
    return None


def _report_endstops(board: Board, order: Order) -> Work:
    """M119: X and Y end at their minimum, Z at its maximum."""
    board.say("Reporting endstop status")
    real = board.motion.at(board.now_s)
    for axis, (letter, side) in enumerate((("x", 0), ("y", 0), ("z", 1))):
        limit = board.motion.limits[axis][side]
        touched = real[axis] <= limit + ENDSTOP_MM if side == 0 else real[axis] >= limit - ENDSTOP_MM
        board.say(f"{letter}_{('min', 'max')[side]}: {'TRIGGERED' if touched else 'open'}")
    return None


def _nothing(board: Board, order: Order) -> Work:
    return None


COMMANDS: dict[str, Command] = {  # besides G0 and G1, which wait for a free block
    "G2": _arc,
    "G3": _arc,
    "G4": _dwell,
    **dict.fromkeys(("G20", "G21", "G90", "G91", "M82", "M83"), _set_mode),
    "G28": _home,
    "G38.3": _probe,
    "G43.4": _follow,
    "G49": _follow,
    "G92": _rename,
    "M0": _wait_for_person,
    "M1": _wait_for_person,
    "M18": _rest,
    "M80": _power,
    "M81": _power,
    "M84": _rest,
    "M92": _setting(),
    "M104": _heat,
    "M105": lambda board, order: f"ok {board.temperatures()}",
    "M106": _fan,
    "M107": _fan,
    "M108": _stop_waiting,
    "M109": _heat_and_wait,
    "M110": _number_lines,
    "M113": _keep_alive,
    "M114": lambda board, order: board.say(board.position()),
    "M115": _identify_firmware,
    "M116": _wait_for_all,
    "M118": _send_to_host,
    "M119": _report_endstops,
    "M140": _heat,
    "M154": _autoreport,
    "M155": _autoreport,
    "M190": _heat_and_wait,
    "M201": _setting(lambda board, words: board.motion.bound(words, board.motion.accelerations)),
    "M203": _setting(lambda board, words: board.motion.bound(words, board.motion.speeds)),
    "M204": _setting(lambda board, words: board.motion.accelerate(words)),
    "M205": _setting(_corner),
    "M211": _setting(_limit),
    "M220": _override_feed,
    "M221": _override_flow,
    "M290": _babystep,
    "M302": _allow_cold,
    "M400": lambda board, order: wait_for_moves(board),
    "M409": _setting(),
    "M410": _stop,
    "M503": _setting(),
    "M568": _heat,
    **dict.fromkeys(("M17", "M73", "M117", "M486", "M572", "M665", "M876", "M900", "T0"), _nothing),
    "MANUAL_STEPPER": _turn,
    "PROBE": _probe_by_macro,
    "SET_GCODE_OFFSET": _babystep,
    "SET_HEATER_TEMPERATURE": _heat_by_macro,
    "TEMPERATURE_WAIT": _wait_by_macro,
    "TURN_OFF_HEATERS": _heaters_off,
    **{name: _nothing for name, command in MACROS.items() if command.shows or command.tunes},
}
