"""The body of a simulated printer: motion, heaters, fan and clock behind the serial line, and the words its commands read."""

import re
from collections.abc import Callable, Iterator, Mapping
from math import inf

from machine.link.habits import Manner, manner_of
from machine.link.heater import Heater
from machine.link.motion import Motion
from profiles.machine import Machine

Words = Mapping[str, float]
# None: done, answered with ok; a text: its own ok; else the virtual times at which a slow command wants to look again.
Work = Iterator[float] | str | None
Command = Callable[["Body", Words, str], Work]

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
FLAG = re.compile(r"([A-Z])(?!\s*[-+.\d])")
NOZZLE_S, BED_S = 60.0, 240.0  # time constants of a 40 W hot end and a 300 W plate
EVENTS = 10000  # kept where the moves are not all kept either


class Body:
    """now_s is virtual; say() adds a line to what the host will read. kept: moves kept on record, None: all."""

    def __init__(self, machine: Machine, say: Callable[[str], None], kept: int | None = None) -> None:
        self.machine, self.say = machine, say
        self.manner: Manner = manner_of(machine.dialect)
        self.now_s = 0.0
        self.motion = Motion(machine, self.note, self.manner.blocks, kept, self.manner.min_segment_s)
        self.nozzle = Heater("nozzle", machine.nozzle_limit_c, NOZZLE_S)
        self.bed = Heater("bed", machine.bed_limit_c, BED_S)
        self.events: list[tuple[float, str]] = []
        self._most_events = None if kept is None else EVENTS
        self.unknown = 0
        self.turning: dict[str, tuple[float, float]] = {}
        self.busy_every_s = 0.0
        self.must_home = False
        self.number: int | None = None  # told by M110, for the firmware to take over
        self.fan = 0.0
        self.forget()

    def forget(self) -> None:
        """The board restarts."""
        self.powered = True
        self.waits_for_heat = self.waits_for_person = self.impatient = self.cold_allowed = False
        self.report_every_s = self.place_every_s = 0.0
        self.report_s = self.place_s = inf

    def note(self, what: str) -> None:
        """Put an event on record."""
        self.events.append((self.now_s, what))
        if self._most_events is not None and len(self.events) > 2 * self._most_events:
            del self.events[: self._most_events]

    def temperatures(self) -> str:
        """`T:19.38 /0.00 B:...` as the firmware writes it."""
        nozzle, bed = self.nozzle, self.bed
        if self.manner.talks_in_ok:
            return f"B:{bed.at(self.now_s):.1f} /{bed.target_c:.1f} T0:{nozzle.at(self.now_s):.1f} /{nozzle.target_c:.1f}"
        return (
            f"T:{nozzle.at(self.now_s):.2f} /{nozzle.target_c:.2f} B:{bed.at(self.now_s):.2f} /{bed.target_c:.2f} "
            f"@:{127 * (nozzle.target_c > 0)} B@:{127 * (bed.target_c > 0)}"
        )

    def place(self) -> str:
        """The answer to M114 as the firmware writes it."""
        motion = self.motion
        logical = dict(zip(motion.letters, motion.coordinates(), strict=True))
        counts = dict(zip(motion.letters, motion.counts(self.now_s), strict=False))
        if not self.machine.tilts:
            for letter in motion.letters[3:5]:
                del logical[letter], counts[letter]
        if self.manner.numbers == "ignore":
            return " ".join(f"{letter}:{logical[letter]:.3f}" for letter in "XYZE")
        if self.manner.numbers == "drop":
            told = " ".join(f"{letter}:{value:.3f}" for letter, value in logical.items())
            steps, bare = " ".join(map(str, counts.values())), " ".join(f"{logical[letter]:.3f}" for letter in counts)
            return f"{told} E0:{logical['E']:.1f} Count {steps} Machine {bare} Bed comp 0.000"
        told = " ".join(f"{letter}:{value:.2f}" for letter, value in logical.items())
        return f"{told} Count " + " ".join(f"{letter}:{count}" for letter, count in counts.items())

    def off(self) -> None:
        """Heaters and fan off, motion stopped: kill, reset."""
        self.nozzle.set(0.0, self.now_s)
        self.bed.set(0.0, self.now_s)
        self.fan = 0.0
        self.motion.halt(self.now_s)


def words_of(text: str) -> dict[str, float]:
    """The words with numbers of a command."""
    return {letter: float(value) for letter, value in WORD.findall(text)}


def flags_of(words: Words, text: str) -> set[str]:
    """The letters of a command, with numbers or without."""
    return {*words, *FLAG.findall(text)}


def drained(body: Body) -> Iterator[float]:
    """Until all planned moves are over."""
    planner = body.motion.planner
    while (next_s := planner.next_s()) < inf:
        if next_s > body.now_s:
            yield next_s
        planner.run(body.now_s)
    planner.barrier(body.now_s)
