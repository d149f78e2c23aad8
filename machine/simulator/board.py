"""Board of a simulated printer: its build options, clock, motion, heaters and fan, and the orders it receives."""

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

# None: done, answered with ok; a text: a different ok; else the virtual times at which a slow command continues.
Work = Iterator[float] | str | None
Command = Callable[["Board", "Order"], Work]

NOZZLE_S, BED_S = 60.0, 240.0  # time constants of a 40 W hot end and a 300 W plate
EVENTS = 10000  # kept when moves are limited too
ROOM_C = 20.0
GUARD_S, GUARD_C = 40.0, 4.0  # Marlin's THERMAL_PROTECTION_PERIOD and _HYSTERESIS
WATCH_S = 40.0  # Marlin's WATCH_TEMP_PERIOD: a heater with a target must have become warmer by then
CALM_C = 1.0  # a heater this near to its target has reached it


class Order(NamedTuple):
    """A command split into name and rest by words.split_command."""

    name: str
    rest: str

    @property
    def text(self) -> str:
        """The whole command."""
        return self.name + self.rest

    @property
    def words(self) -> WordValues:
        """Its words; empty for a displayed text."""
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
    rx_ring: int | None = None  # bytes of a UART's receive ring, which may overflow; None: USB, which waits
    realtime: bool = False  # Marlin's REALTIME_REPORTING_COMMANDS
    geometry: bool = True  # its M115_GEOMETRY_REPORT
    waits: bool = False  # its NO_TIMEOUTS, `wait` every second when idle
    resend_ok: bool = True  # an `ok` follows each Resend (Smoothieware has none)
    must_home: bool = False  # X Y Z do not move before homing (Klipper, RRF, Marlin's NO_MOTION_BEFORE_HOMING)
    home_start: bool = True  # after a restart it assumes its home positions as Marlin does, otherwise 0 0 0
    checksums: bool = False  # lines without number and checksum are refused
    queue: int | None = None  # Marlin's BUFSIZE, lines queued behind the current one; None: its default


def build_options(machine: Machine, baud: int | None) -> BuildOptions:
    """The usual build: USB without a baud rate, else a UART whose ring is machine.receive_bytes."""
    return BuildOptions(rx_ring=machine.receive_bytes if baud else None)


class Heater:
    """A heater whose temperature is a closed formula of the time since the last order."""

    def __init__(self, name: str, limit_c: float, time_constant_s: float) -> None:
        self.name = name
        self.target_c = 0.0
        self._limit_c = limit_c
        self._ceiling_c = 1.3 * limit_c + 50.0  # final temperature at full power: the limit is reached in finite time
        self._time_constant_s = time_constant_s
        self._from_c, self._since_s = ROOM_C, 0.0
        self._failed = False
        self.trip_s = inf  # when the firmware's protection detects that it does not heat
        self.trip = ""

    def set(self, target_c: float, now_s: float) -> None:
        """Set a target, deg C, limited like the firmware does."""
        self._from_c, self._since_s = self.at(now_s), now_s
        self.target_c = min(max(target_c, 0.0), self._limit_c)
        self._guard(now_s)

    def fail(self, now_s: float) -> None:
        """Stop heating whatever the target, like a cartridge that fell out."""
        self._from_c, self._since_s = self.at(now_s), now_s
        self._failed = True
        self._guard(now_s)

    def at(self, now_s: float) -> float:
        """Temperature at a time, deg C."""
        goal, stop = self._goal()
        free = goal + (self._from_c - goal) * exp(-(now_s - self._since_s) / self._time_constant_s)
        return min(free, stop) if goal > self._from_c else max(free, stop)

    def reaches(self, value_c: float) -> float:
        """Time at which the temperature passes value_c, s; inf for never."""
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
        """Set when Marlin's thermal protection would stop a failed heater, and its message."""
        self.trip_s, self.trip = inf, ""
        if not self._failed or self.target_c <= ROOM_C:
            return
        if self._from_c >= self.target_c - CALM_C:
            self.trip_s, self.trip = self.reaches(self.target_c - GUARD_C) + GUARD_S, "Thermal Runaway"
        else:
            self.trip_s, self.trip = now_s + WATCH_S, "Heating failed"


class Board:
    """Motion, heaters and fan of the printer. now_s is virtual; say() adds a line to the answers.

    kept_moves: number of moves to record, None: all. table: the probed surface; None: the machine has no probe.
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
        """Reset the state, as by a restart of the board."""
        self.powered, self.must_home = True, self.build.must_home
        self.idle_after_s = self.rules.idle_after_s
        self.awake_s = 0.0  # the last time that something other than a move kept the motors on
        self.waits_for_heat = self.waits_for_person = self.impatient = self.cold_allowed = self.homes = False
        self.report_every_s = self.position_every_s = 0.0
        self.report_s = self.position_s = inf

    def note(self, what: str, trouble: bool = False) -> None:
        """Record an event; trouble: one that no program causes."""
        self.events.append((self.now_s, what))
        if trouble:
            self.troubles.append((self.now_s, what))
        if self._most_events is not None and len(self.events) > 2 * self._most_events:
            del self.events[: self._most_events]

    def refuse(self, text: str) -> None:
        """Report an unknown command."""
        self.unknown += 1
        self.say(self.rules.unknown.format(text))

    def temperatures(self) -> str:
        """Nozzle and bed as the firmware reports them."""
        nozzle, bed = self.nozzle, self.bed
        return self.rules.temperatures(nozzle.at(self.now_s), nozzle.target_c, bed.at(self.now_s), bed.target_c)

    def position(self) -> str:
        """The firmware's answer to M114."""
        motion = self.motion
        coordinates = dict(zip(motion.letters, motion.coordinates(), strict=True))
        steps = dict(zip(motion.letters, motion.counts(self.now_s), strict=False))
        if not self.machine.tilts:
            for letter in motion.letters[3:5]:
                del coordinates[letter], steps[letter]
        return self.rules.position(coordinates, steps)

    @property
    def idle_s(self) -> float:
        """When the firmware switches idle motors off; inf: never."""
        motion = self.motion
        if not motion.energised:
            return inf
        next_s = motion.planner.next_s()
        since_s = max(motion.planner.ended_s, self.awake_s) if next_s == inf else next_s
        return since_s + self.idle_after_s

    def idle(self) -> None:
        """End of the idle time: motors off, and heaters if the firmware shuts down."""
        self.motion.planner.run(self.now_s)
        if self.idle_s > self.now_s:  # a planned move has begun meanwhile
            return
        self.let_go(range(self.rules.idle_axes))
        if self.rules.idle_shuts_down:
            self.nozzle.set(0.0, self.now_s)
            self.bed.set(0.0, self.now_s)
            self.motion.homed.clear()
            self.must_home = True

    def let_go(self, axes: Sequence[int]) -> None:
        """Switch motors off."""
        self.motion.let_go(axes)
        self.note("motors off")

    def off(self) -> None:
        """Heaters and fan off, motion stopped: kill, reset."""
        self.nozzle.set(0.0, self.now_s)
        self.bed.set(0.0, self.now_s)
        self.fan = 0.0
        self.motion.halt(self.now_s)


def wait_for_moves(board: Board) -> Iterator[float]:
    """Wait until all planned moves are over."""
    planner = board.motion.planner
    while (next_s := planner.next_s()) < inf:
        if next_s > board.now_s:
            yield next_s
        planner.run(board.now_s)
    planner.barrier(board.now_s)
