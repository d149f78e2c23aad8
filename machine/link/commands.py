"""What each G-code does in a simulated printer: its body (motion, heaters, fan) and one function for each command.

A quick command returns None or its own text of `ok`; a slow one is a generator that yields the virtual time at which it
wants to look again.
"""

import re
from collections.abc import Callable, Iterator

from machine.dialects import DIALECTS
from machine.link.heater import Heater
from machine.link.motion import Motion
from profiles.machine import Machine

Words = dict[str, float]
Work = Iterator[float] | str | None

WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))")
FLAG = re.compile(r"([A-Z])(?![-+.\d])")
COLD_C = 170.0  # Marlin's EXTRUDE_MINTEMP
NEAR_C = 1.0  # Marlin's TEMP_WINDOW: a heater within it has arrived
NOZZLE_S, BED_S = 60.0, 240.0  # time constants of a 40 W hot end and a 300 W plate
TALK_S = 1.0  # Marlin tells temperatures so often while it waits for heat


class Body:
    """The printer behind the serial line. now_s is virtual; say() adds a line to what the host will read."""

    def __init__(self, machine: Machine, say: Callable[[str], None]) -> None:
        self.machine, self.say = machine, say
        self.now_s = 0.0
        self.motion = Motion(machine)
        self.nozzle = Heater(machine.nozzle_limit_c, NOZZLE_S)
        self.bed = Heater(machine.bed_limit_c, BED_S)
        self.fan = 0.0
        self.report_every_s = 0.0
        self.report_s = float("inf")
        self.waits_for_heat = False
        self.impatient = False
        self.events: list[tuple[float, str]] = []
        self.unknown = 0
        self.halt_wanted = False
        self.turning: dict[str, tuple[float, float]] = {}

    def note(self, what: str) -> None:
        """Put an event on record."""
        self.events.append((self.now_s, what))

    def temperatures(self) -> str:
        """`T:19.38 /0.00 B:...` as Marlin writes it."""
        nozzle, bed = self.nozzle, self.bed
        return (
            f"T:{nozzle.at(self.now_s):.2f} /{nozzle.target_c:.2f} B:{bed.at(self.now_s):.2f} /{bed.target_c:.2f} "
            f"@:{127 * (nozzle.target_c > 0)} B@:{127 * (bed.target_c > 0)}"
        )

    def off(self) -> None:
        """Heaters and fan off, motion stopped: kill, reset."""
        self.nozzle.set(0.0, self.now_s)
        self.bed.set(0.0, self.now_s)
        self.fan = 0.0
        self.motion.halt(self.now_s)


def words_of(text: str) -> Words:
    """The words with numbers of a command."""
    return {letter: float(value) for letter, value in WORD.findall(text)}


def move(body: Body, words: Words) -> None:
    """G0, G1; the caller has made sure of a free block."""
    body.motion.go(words, body.now_s, _pushes(body, words))


def _arc(body: Body, words: Words, text: str) -> Iterator[float]:
    """G2, G3: chord after chord, each waiting for a free block."""
    places = body.motion.arc(words, text.startswith("G2"), _pushes(body, words))
    if not places:
        body.say("echo: Bad arc parameters")
    for place in places:
        at = list(body.motion.native)
        while not body.motion.free(body.now_s):
            yield body.motion.next_free_s()
        if body.motion.native != at:  # stopped on the way
            return
        body.motion.reach(place, body.now_s)


def _pushes(body: Body, words: Words) -> bool:
    """False where a move would push filament through a cold nozzle, which is said."""
    hot = True
    if "E" in words and body.nozzle.at(body.now_s) < COLD_C:
        before = body.motion.native[5] + body.motion.shift[5]
        hot = words["E"] == (0.0 if body.motion.filament_relative else before)
        if not hot:
            body.say("echo: cold extrusion prevented")
    return hot


def _dwell(body: Body, words: Words, text: str) -> Iterator[float]:
    yield from drained(body)
    until_s = body.now_s + max(0.0, words.get("S", words.get("P", 0.0) / 1000.0))
    while body.now_s < until_s and not body.halt_wanted:
        yield until_s


def drained(body: Body) -> Iterator[float]:
    while body.motion.end_s > body.now_s:
        yield body.motion.end_s


def _drain(body: Body, words: Words, text: str) -> Iterator[float]:
    yield from drained(body)


def _home(body: Body, words: Words, text: str) -> Iterator[float]:
    yield from drained(body)
    letters = {*words, *FLAG.findall(text)}
    axes = [i for i, letter in enumerate(body.motion.letters[:5]) if letter in letters] or list(range(5))
    until_s = body.now_s + body.motion.home(axes)
    while body.now_s < until_s:
        yield until_s
    body.note("homed " + "".join(body.motion.letters[i] for i in axes))
    body.say(body.motion.told())


def _inches(body: Body, words: Words, text: str) -> Work:
    body.motion.inches = text.startswith("G20")
    return None


def _relative(body: Body, words: Words, text: str) -> Work:
    body.motion.relative = body.motion.filament_relative = text.startswith("G91")
    return None


def _filament_relative(body: Body, words: Words, text: str) -> Work:
    body.motion.filament_relative = text.startswith("M83")
    return None


def _accelerate(body: Body, words: Words, text: str) -> Work:
    body.motion.accelerate(words)
    return None


def _call_it(body: Body, words: Words, text: str) -> Work:
    body.motion.call_it(words)
    body.say(body.motion.told())
    return None


def heat(body: Body, words: Words, text: str) -> Work:
    heater, name = (body.nozzle, "nozzle") if text.startswith(("M104", "M109", "M568")) else (body.bed, "bed")
    wanted = words.get("S", words.get("R"))
    if wanted is not None:
        heater.set(wanted, body.now_s)
        body.note(f"{name} {heater.target_c:g}")
    return None


def heat_and_wait(body: Body, words: Words, text: str) -> Iterator[float]:
    heat(body, words, text)
    heater = body.nozzle if text.startswith("M109") else body.bed
    rising = heater.target_c > heater.at(body.now_s)
    if not rising and "R" not in words:
        return
    arrived_s = heater.reaches(heater.target_c - NEAR_C if rising else heater.target_c + NEAR_C)
    body.waits_for_heat, body.impatient = True, False
    while body.now_s < arrived_s < float("inf") and not body.impatient and not body.halt_wanted:
        yield min(arrived_s, body.now_s + TALK_S)
        body.say(f"{body.temperatures()} W:?")
    body.waits_for_heat = False


def _wait_for_all(body: Body, words: Words, text: str) -> Iterator[float]:
    """M116 (RepRapFirmware)."""
    yield from heat_and_wait(body, {"S": body.bed.target_c}, "M190")
    yield from heat_and_wait(body, {"S": body.nozzle.target_c}, "M109")


def _fan(body: Body, words: Words, text: str) -> Work:
    full = 1.0 if words.get("S", 255.0) <= DIALECTS[body.machine.dialect].fan_full == 1 else 255.0
    body.fan = min(max(words.get("S", full), 0.0), full) / full if text.startswith("M106") else 0.0
    body.note(f"fan {body.fan:.2f}")
    return None


def _tell_temperature(body: Body, words: Words, text: str) -> Work:
    return f"ok {body.temperatures()}"


def _tell_position(body: Body, words: Words, text: str) -> Work:
    body.say(body.motion.told())
    return None


def _report(body: Body, words: Words, text: str) -> Work:
    body.report_every_s = max(0.0, words.get("S", 0.0))
    body.report_s = body.now_s + body.report_every_s if body.report_every_s else float("inf")
    return None


def _rest(body: Body, words: Words, text: str) -> Iterator[float]:
    yield from drained(body)
    body.note("motors off")


def _hurry(body: Body, words: Words, text: str) -> Work:
    body.impatient = True
    return None


def _stop(body: Body, words: Words, text: str) -> Work:
    body.motion.halt(body.now_s)
    body.note("M410")
    return None


def _nothing(body: Body, words: Words, text: str) -> Work:
    return None


COMMANDS: dict[str, Callable[[Body, Words, str], Work]] = {
    "G2": _arc,
    "G3": _arc,
    "G4": _dwell,
    "G20": _inches,
    "G21": _inches,
    "G28": _home,
    "G90": _relative,
    "G91": _relative,
    "G92": _call_it,
    "M17": _nothing,
    "M18": _rest,
    "M73": _nothing,
    "M82": _filament_relative,
    "M83": _filament_relative,
    "M84": _rest,
    "M104": heat,
    "M105": _tell_temperature,
    "M106": _fan,
    "M107": _fan,
    "M108": _hurry,
    "M109": heat_and_wait,
    "M110": _nothing,
    "M114": _tell_position,
    "M117": _nothing,
    "M140": heat,
    "M155": _report,
    "M190": heat_and_wait,
    "M201": _nothing,
    "M203": _nothing,
    "M204": _accelerate,
    "M205": _nothing,
    "M220": _nothing,
    "M221": _nothing,
    "M400": _drain,
    "M410": _stop,
    "M116": _wait_for_all,
    "M486": _nothing,
    "M568": heat,
    "T0": _nothing,
}
