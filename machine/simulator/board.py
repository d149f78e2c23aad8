"""The board of a simulated printer: its build options, clock, motion, heaters and fan, and the orders it is given."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import exp, inf, log
from typing import NamedTuple

from machine.firmware import simulation_of
from machine.gcode.line_text import MESSAGES
from machine.gcode.words import read_values, read_words
from machine.simulator.contact import ProbedTable
from machine.simulator.motion import Motion, WordValues
from profiles.machine import Machine

# None: done, answered with ok; a text: its own ok; else the virtual times at which a slow command wants to look again.
Work = Iterator[float] | str | None
Command = Callable[["Board", "Order"], Work]

NOZZLE_S, BED_S = 60.0, 240.0  # time constants of a 40 W hot end and a 300 W plate
EVENTS = 10000  # kept where the moves are not all kept either
ROOM_C = 20.0
GUARD_S, GUARD_C = 40.0, 4.0  # Marlin's THERMAL_PROTECTION_PERIOD and _HYSTERESIS
WATCH_S = 40.0  # Marlin's WATCH_TEMP_PERIOD: a heater that has a target must have become warmer by then
CALM_C = 1.0  # as near to its target a heater counts as there


class Order(NamedTuple):
    """A command as words.split_command parts it into name and rest."""

    name: str
    rest: str

    @property
    def text(self) -> str:
        """The whole command."""
        return self.name + self.rest

    @property
    def words(self) -> WordValues:
        """Its words; a text that is shown has none."""
        return {} if self.name in MESSAGES else dict(read_words(self.rest))

    @property
    def values(self) -> dict[str, str]:
        """KEY=VALUE of a macro."""
        return read_values(self.rest)


@dataclass(frozen=True)
class BuildOptions:
    """Build options of a simulated firmware."""

    advanced_ok: bool = True
    emergency_parser: bool = True
    busy: bool = True
    autoreport: bool = True
    rx_ring: int | None = None  # bytes of a UART's receive ring that overflows; None: USB, which waits
    realtime: bool = False  # Marlin's REALTIME_REPORTING_COMMANDS
    geometry: bool = True  # its M115_GEOMETRY_REPORT
    waits: bool = False  # its NO_TIMEOUTS, `wait` every second when idle
    resend_ok: bool = True  # an `ok` follows each Resend (Smoothieware has none)
    must_home: bool = False  # X Y Z are not moved before they are homed (Klipper, RRF, Marlin's NO_MOTION_BEFORE_HOMING)
    home_start: bool = True  # after a restart it believes itself at its home positions as Marlin does, otherwise at 0 0 0
    checksums: bool = False  # lines without number and checksum are refused
    queue: int | None = None  # Marlin's BUFSIZE, lines kept before the one at work is done; None: its default


def build_options(machine: Machine, baud: int | None) -> BuildOptions:
    """The usual build: USB without a baud rate, with one a UART whose ring is machine.receive_bytes."""
    return BuildOptions(rx_ring=machine.receive_bytes if baud else None)


class Heater:
    """Temperature as a closed formula of time since the last order."""

    def __init__(self, name: str, limit_c: float, time_constant_s: float) -> None:
        self.name = name
        self.target_c = 0.0
        self._limit_c = limit_c
        self._ceiling_c = 1.3 * limit_c + 50.0  # where full power would end: the limit is reached in finite time
        self._time_constant_s = time_constant_s
        self._from_c, self._since_s = ROOM_C, 0.0
        self._failed = False
        self.trip_s = inf  # when the firmware's guard will see that it does not heat
        self.trip = ""

    def set(self, target_c: float, now_s: float) -> None:
        """A new target, deg C, kept between 0 and the limit as the firmware does."""
        self._from_c, self._since_s = self.at(now_s), now_s
        self.target_c = min(max(target_c, 0.0), self._limit_c)
        self._guard(now_s)

    def fail(self, now_s: float) -> None:
        """From now on it gives no heat whatever its target: a cartridge that fell out."""
        self._from_c, self._since_s = self.at(now_s), now_s
        self._failed = True
        self._guard(now_s)

    def at(self, now_s: float) -> float:
        """Temperature at a time, deg C."""
        goal, stop = self._goal()
        free = goal + (self._from_c - goal) * exp(-(now_s - self._since_s) / self._time_constant_s)
        return min(free, stop) if goal > self._from_c else max(free, stop)

    def reaches(self, value_c: float) -> float:
        """The time at which the temperature passes value_c on its way, s; inf when it never does."""
        goal, stop = self._goal()
        low, high = sorted((self._from_c, stop))
        if not low <= value_c <= high or value_c == goal:
            return inf
        return self._since_s + self._time_constant_s * log((self._from_c - goal) / (value_c - goal))

    def _goal(self) -> tuple[float, float]:
        """Its final temperature without a thermostat, and the one at which the thermostat stops it."""
        stop = ROOM_C if self._failed else max(self.target_c, ROOM_C)
        return (self._ceiling_c if stop > self._from_c else ROOM_C), stop

    def _guard(self, now_s: float) -> None:
        """When Marlin's thermal protection would stop a heater that gives no heat, and with which words."""
        self.trip_s, self.trip = inf, ""
        if not self._failed or self.target_c <= ROOM_C:
            return
        if self._from_c >= self.target_c - CALM_C:
            self.trip_s, self.trip = self.reaches(self.target_c - GUARD_C) + GUARD_S, "Thermal Runaway"
        else:
            self.trip_s, self.trip = now_s + WATCH_S, "Heating failed"


class Board:
    """Motion, heaters and fan of the printer. now_s is virtual; say() adds a line to the answers. kept_moves: kept on record,
    None: all.

    table: what a probe meets; None: the machine has no probe.
    """

    def __init__(
        self,
        machine: Machine,
        build: BuildOptions,
        say: Callable[[str], None],
        kept_moves: int | None = None,
        table: ProbedTable | None = None,
    ) -> None:
        self.machine, self.build, self.say, self.table = machine, build, say, table
        self.rules = simulation_of(machine)
        self.now_s = 0.0
        self.motion = Motion(machine, self.note, kept_moves, build.home_start)
        self.nozzle = Heater("nozzle", machine.nozzle_limit_c, NOZZLE_S)
        self.bed = Heater("bed", machine.bed_limit_c, BED_S)
        self.events: list[tuple[float, str]] = []
        self.troubles: list[tuple[float, str]] = []
        self._most_events = None if kept_moves is None else EVENTS
        self.unknown = 0
        self.turning: dict[int, tuple[float, float]] = {}
        self.busy_every_s = 0.0
        self.number: int | None = None  # set by M110, for the firmware to take over
        self.fan = 0.0
        self.forget()

    def forget(self) -> None:
        """The board restarts."""
        self.powered, self.must_home = True, self.build.must_home
        self.idle_after_s = self.rules.idle_after_s
        self.awake_s = 0.0  # what is no move has kept the motors on until then
        self.waits_for_heat = self.waits_for_person = self.impatient = self.cold_allowed = self.homes = False
        self.report_every_s = self.position_every_s = 0.0
        self.report_s = self.position_s = inf

    def note(self, what: str, trouble: bool = False) -> None:
        """Put an event on record; trouble: it is none that a program asks for."""
        self.events.append((self.now_s, what))
        if trouble:
            self.troubles.append((self.now_s, what))
        if self._most_events is not None and len(self.events) > 2 * self._most_events:
            del self.events[: self._most_events]

    def refuse(self, text: str) -> None:
        """Say that a command is not known."""
        self.unknown += 1
        self.say(self.rules.unknown.format(text))

    def temperatures(self) -> str:
        """Nozzle and bed as the firmware reports them."""
        nozzle, bed = self.nozzle, self.bed
        return self.rules.temperatures(nozzle.at(self.now_s), nozzle.target_c, bed.at(self.now_s), bed.target_c)

    def position(self) -> str:
        """The answer to M114 as the firmware writes it."""
        motion = self.motion
        coordinates = dict(zip(motion.letters, motion.coordinates(), strict=True))
        steps = dict(zip(motion.letters, motion.counts(self.now_s), strict=False))
        if not self.machine.tilts:
            for letter in motion.letters[3:5]:
                del coordinates[letter], steps[letter]
        return self.rules.position(coordinates, steps)

    @property
    def idle_s(self) -> float:
        """When the firmware lets its motors go if nothing moves before; inf: never."""
        motion = self.motion
        if not motion.energised:
            return inf
        next_s = motion.planner.next_s()
        since_s = max(motion.planner.ended_s, self.awake_s) if next_s == inf else next_s
        return since_s + self.idle_after_s

    def idle(self) -> None:
        """The idle time is over: motors off, and heaters where the firmware shuts down."""
        self.motion.planner.run(self.now_s)
        if self.idle_s > self.now_s:  # a move that was planned has begun meanwhile
            return
        self.let_go(range(self.rules.idle_axes))
        if self.rules.idle_shuts_down:
            self.nozzle.set(0.0, self.now_s)
            self.bed.set(0.0, self.now_s)
            self.motion.homed.clear()
            self.must_home = True

    def let_go(self, axes: Sequence[int]) -> None:
        """Motors off."""
        self.motion.let_go(axes)
        self.note("motors off")

    def off(self) -> None:
        """Heaters and fan off, motion stopped: kill, reset."""
        self.nozzle.set(0.0, self.now_s)
        self.bed.set(0.0, self.now_s)
        self.fan = 0.0
        self.motion.halt(self.now_s)


def wait_for_moves(board: Board) -> Iterator[float]:
    """Until all planned moves are over."""
    planner = board.motion.planner
    while (next_s := planner.next_s()) < inf:
        if next_s > board.now_s:
            yield next_s
        planner.run(board.now_s)
    planner.barrier(board.now_s)
