"""What the commands that move do in a simulated printer: moves, arcs, dwelling, homing, modes, limits, overrides."""

from collections.abc import Iterator, Sequence

from machine.link.body import Body, Command, Words, Work, drained, flags_of
from machine.link.motion import Motion

COLD_C = 170.0  # Marlin's EXTRUDE_MINTEMP


def move(body: Body, words: Words, text: str) -> Work:
    """G0, G1; the caller has made sure of a free block."""
    motion, pushes = body.motion, True
    if body.must_home and (unhomed := motion.unhomed(words)) is not None:
        body.say(body.manner.unhomed.format(_told(unhomed)))
        return None
    if "E" in words and not body.cold_allowed and body.nozzle.at(body.now_s) < COLD_C:
        pushes = _is_idle(motion, words)
        if not pushes:
            for line in body.manner.cold:
                body.say(line)
            if not body.manner.cold_moves:
                return None
    if body.manner.beyond and (beyond := motion.beyond(words)) is not None:
        body.say(body.manner.beyond.format(_told(beyond)))
        return None
    pieces = motion.pieces(motion.target(words, pushes))
    if len(pieces) > 1:
        return _run(body, pieces)
    motion.reach(pieces[0], body.now_s)
    return None


def _told(place: Sequence[float]) -> str:
    """Coordinates as Klipper tells them."""
    x, y, z, *_, filament = place
    return f"{x:.3f} {y:.3f} {z:.3f} [{filament:.3f}]"


def _is_idle(motion: Motion, words: Words) -> bool:
    """Whether E tells the filament to stay where it is."""
    return words["E"] == (0.0 if motion.filament_relative else motion.place[5] + motion.shift[5])


def _run(body: Body, pieces: Sequence[Sequence[float]]) -> Iterator[float]:
    """Piece after piece, each waiting for a free block."""
    motion, halts = body.motion, body.motion.halts
    for piece in pieces:
        while not motion.planner.free(body.now_s):
            yield motion.planner.next_s()
        if motion.halts != halts:
            return
        motion.reach(piece, body.now_s)


def _arc(body: Body, words: Words, text: str) -> Work:
    pushes = "E" not in words or body.cold_allowed or body.nozzle.at(body.now_s) >= COLD_C or _is_idle(body.motion, words)
    if not pushes:
        for line in body.manner.cold:
            body.say(line)
    pieces = body.motion.arc(words, text.startswith("G2"), pushes)
    if not pieces:
        body.say("echo: Bad arc parameters")
    return _run(body, pieces)


def _dwell(body: Body, words: Words, text: str) -> Iterator[float]:
    yield from drained(body)
    until_s = body.now_s + max(0.0, words.get("S", words.get("P", 0.0) / 1000.0))
    while body.now_s < until_s:
        yield until_s


def _drain(body: Body, words: Words, text: str) -> Iterator[float]:
    yield from drained(body)


def _home(body: Body, words: Words, text: str) -> Iterator[float]:
    letters = flags_of(words, text[1:])
    axes = [axis for axis, letter in enumerate(body.motion.letters[:5]) if letter in letters] or list(range(5))
    yield from homed(body, axes)
    if body.manner.tells_place:
        body.say(body.place())


def homed(body: Body, axes: Sequence[int]) -> Iterator[float]:
    """Seek the endstops of axes."""
    yield from drained(body)
    until_s = body.now_s + body.motion.home(axes)
    while body.now_s < until_s:
        yield until_s
    body.note("homed " + "".join(body.motion.letters[axis] for axis in axes))


def _wait_for_person(body: Body, words: Words, text: str) -> Iterator[float]:
    """M0, M1: until M108, or for P milliseconds or S seconds."""
    yield from drained(body)
    seconds = words.get("S", words.get("P", 0.0) / 1000.0)
    until_s = body.now_s + seconds if seconds > 0 else float("inf")
    body.waits_for_person, body.impatient = True, False
    while body.now_s < until_s and not body.impatient:
        yield until_s
    body.waits_for_person = False


def _inches(body: Body, words: Words, text: str) -> Work:
    body.motion.inches = text.startswith("G20")
    return None


def _relative(body: Body, words: Words, text: str) -> Work:
    body.motion.relative = body.motion.filament_relative = text.startswith("G91")
    return None


def _filament_relative(body: Body, words: Words, text: str) -> Work:
    body.motion.filament_relative = text.startswith("M83")
    return None


def _follow(body: Body, words: Words, text: str) -> Iterator[float]:
    yield from drained(body)
    body.motion.follow(text.startswith("G43"))


def _accelerate(body: Body, words: Words, text: str) -> Work:
    body.motion.accelerate(words)
    return None


def _bound_accelerations(body: Body, words: Words, text: str) -> Work:
    body.motion.bound(words, body.motion.accelerations)
    return None


def _bound_speeds(body: Body, words: Words, text: str) -> Work:
    body.motion.bound(words, body.motion.speeds)
    return None


def _corner(body: Body, words: Words, text: str) -> Work:
    if words.get("X", -1.0) >= 0:
        body.motion.jerk_mm_s = words["X"]
    return None


def _override_feed(body: Body, words: Words, text: str) -> Work:
    if words.get("S", 0.0) > 0:
        body.motion.feed_share = words["S"] / 100.0
    elif "S" not in words:
        body.say(f"FR:{100 * body.motion.feed_share:.0f}%")
    return None


def _override_flow(body: Body, words: Words, text: str) -> Work:
    if words.get("S", -1.0) >= 0:
        body.motion.flow_share = words["S"] / 100.0
    elif "S" not in words:
        body.say(f"echo:E0 Flow: {100 * body.motion.flow_share:.0f}%")
    return None


def _limit(body: Body, words: Words, text: str) -> Work:
    """M211: soft limits on, off, told."""
    motion = body.motion
    if "S" in words:
        motion.soft_limits = words["S"] != 0
        return None
    least, most = ("".join(f" {a}:{b[side]:.2f}" for a, b in zip(motion.letters, motion.limits, strict=False)) for side in (0, 1))
    body.say(f"echo:Soft endstops: {'On' if motion.soft_limits else 'Off'}  Min: {least}   Max: {most}")
    return None


def _call_it(body: Body, words: Words, text: str) -> Work:
    body.motion.call_it(words)
    if body.manner.tells_place:
        body.say(body.place())
    return None


def _rest(body: Body, words: Words, text: str) -> Iterator[float]:
    yield from drained(body)
    body.motion.homed.clear()
    body.note("motors off")


def _stop(body: Body, words: Words, text: str) -> Work:
    body.motion.halt(body.now_s)
    body.note("M410")
    return None


MOVING: dict[str, Command] = {
    "G0": move,
    "G1": move,
    "G2": _arc,
    "G3": _arc,
    "G4": _dwell,
    "G20": _inches,
    "G21": _inches,
    "G28": _home,
    "G43.4": _follow,
    "G49": _follow,
    "G90": _relative,
    "G91": _relative,
    "G92": _call_it,
    "M0": _wait_for_person,
    "M1": _wait_for_person,
    "M18": _rest,
    "M82": _filament_relative,
    "M83": _filament_relative,
    "M84": _rest,
    "M201": _bound_accelerations,
    "M203": _bound_speeds,
    "M204": _accelerate,
    "M205": _corner,
    "M211": _limit,
    "M220": _override_feed,
    "M221": _override_flow,
    "M400": _drain,
    "M410": _stop,
}
