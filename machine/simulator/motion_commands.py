"""What the commands that move do in a simulated printer: moves, arcs, dwelling, homing, modes, limits, overrides."""

from collections.abc import Generator, Iterator, Sequence
from math import inf

from machine.gcode.words import read_letters, split_command
from machine.simulator.board import Board, Command, Work, wait_for_moves
from machine.simulator.motion import WordValues

MODES = ("G20", "G21", "G90", "G91", "M82", "M83")
COLD_C = 170.0  # Marlin's EXTRUDE_MINTEMP


def move(board: Board, words: WordValues, text: str) -> Work:
    """G0, G1; the caller has made sure of a free block."""
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
    """Whether its filament is pushed too; when the nozzle is too cold for it, that is said."""
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
    """Piece after piece, each waiting for a free block."""
    motion, halts = board.motion, board.motion.halts
    for piece in pieces:
        while not motion.planner.free(board.now_s):
            yield motion.planner.next_s()
        if motion.halts != halts:
            return
        motion.reach(piece, board.now_s)


def _arc(board: Board, words: WordValues, text: str) -> Work:
    pieces = board.motion.arc(words, text.startswith("G2"), _pushes(board, words))
    if not pieces:
        board.say("echo: Bad arc parameters")
    return _run(board, pieces)


def _dwell(board: Board, words: WordValues, text: str) -> Iterator[float]:
    yield from wait_for_moves(board)
    until_s = board.now_s + max(0.0, words.get("S", words.get("P", 0.0) / 1000.0))
    while board.now_s < until_s:
        yield until_s
    if board.rules.idle is not None and board.rules.idle.shuts_down:
        board.awake_s = board.now_s


def _home(board: Board, words: WordValues, text: str) -> Iterator[float]:
    letters = read_letters(split_command(text)[1])
    axes = [axis for axis, letter in enumerate(board.motion.letters[:5]) if letter in letters] or list(range(5))
    yield from seek_endstops(board, axes)
    if board.rules.reports_position:
        board.say(board.position())


def seek_endstops(board: Board, axes: Sequence[int]) -> Iterator[float]:
    """Seek the endstops of axes."""
    yield from wait_for_moves(board)
    until_s = board.now_s + board.motion.home(axes)
    board.homes, board.awake_s = True, until_s
    while board.now_s < until_s:
        yield until_s
    board.homes = False
    board.note("homed " + "".join(board.motion.letters[axis] for axis in axes))


def _wait_for_person(board: Board, words: WordValues, text: str) -> Iterator[float]:
    """M0, M1: until M108, or for P milliseconds or S seconds."""
    yield from wait_for_moves(board)
    seconds = words.get("S", words.get("P", 0.0) / 1000.0)
    until_s = board.now_s + seconds if seconds > 0 else float("inf")
    board.waits_for_person, board.impatient = True, False
    while board.now_s < until_s and not board.impatient:
        yield until_s
    board.waits_for_person = False


def probe(board: Board, words: WordValues, text: str) -> Work:
    """G38.3: down to a Z or to contact, as Marlin's gcode/probe/G38.cpp and RepRapFirmware's straight probe do."""
    if board.table is None:
        board.unknown += 1
        board.say(board.rules.unknown.format(text))
        return None
    return _probe(board, words)


def _probe(board: Board, words: WordValues) -> Iterator[float]:
    yield from wait_for_moves(board)
    target = board.motion.target({letter: value for letter, value in words.items() if letter in "ZF"})
    yield from seek_contact(board, target)


def seek_contact(board: Board, target: list[float], feed_mm_s: float | None = None) -> Generator[float, None, bool]:
    """Move down to a target or until the probe triggers; whether it did."""
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


def _follow(board: Board, words: WordValues, text: str) -> Iterator[float]:
    yield from wait_for_moves(board)
    board.motion.follow(text.startswith("G43"))


def _corner(board: Board, words: WordValues, text: str) -> Work:
    if words.get("X", -1.0) >= 0:
        board.motion.jerk_mm_s = words["X"]
    return None


def _override_feed(board: Board, words: WordValues, text: str) -> Work:
    if words.get("S", 0.0) > 0:
        board.motion.feed_share = words["S"] / 100.0
    elif "S" not in words:
        board.say(f"FR:{100 * board.motion.feed_share:.0f}%")
    return None


def _override_flow(board: Board, words: WordValues, text: str) -> Work:
    if words.get("S", -1.0) >= 0:
        board.motion.flow_share = words["S"] / 100.0
    elif "S" not in words:
        board.say(f"echo:E0 Flow: {100 * board.motion.flow_share:.0f}%")
    return None


def _limit(board: Board, words: WordValues, text: str) -> Work:
    """M211: soft limits on and off."""
    if "S" in words:
        board.motion.soft_limits = words["S"] != 0
    return None


def _rename(board: Board, words: WordValues, text: str) -> Work:
    board.motion.rename(words)
    if board.rules.reports_position:
        board.say(board.position())
    return None


def _rest(board: Board, words: WordValues, text: str) -> Iterator[float]:
    """M18, M84: motors off; with S only after S idle seconds, 0: never."""
    idle = board.rules.idle
    if "S" in words and (idle is None or not idle.shuts_down):
        if idle is not None:
            board.idle_after_s, board.awake_s = words["S"] or inf, board.now_s
        return
    yield from wait_for_moves(board)
    board.motion.homed.clear()
    board.let_go(range(5))


def _stop(board: Board, words: WordValues, text: str) -> Work:
    board.motion.halt(board.now_s)
    board.note("M410")
    return None


MOVING: dict[str, Command] = {
    **dict.fromkeys(MODES, lambda board, words, text: board.motion.modes.set(split_command(text)[0])),
    **dict.fromkeys(("G0", "G1"), move),
    **dict.fromkeys(("G2", "G3"), _arc),
    "G4": _dwell,
    "G28": _home,
    "G38.3": probe,
    **dict.fromkeys(("G43.4", "G49"), _follow),
    "G92": _rename,
    **dict.fromkeys(("M0", "M1"), _wait_for_person),
    **dict.fromkeys(("M18", "M84"), _rest),
    "M201": lambda board, words, text: board.motion.bound(words, board.motion.accelerations),
    "M203": lambda board, words, text: board.motion.bound(words, board.motion.speeds),
    "M204": lambda board, words, text: board.motion.accelerate(words),
    "M205": _corner,
    "M211": _limit,
    "M220": _override_feed,
    "M221": _override_flow,
    "M400": lambda board, words, text: wait_for_moves(board),
    "M410": _stop,
}
