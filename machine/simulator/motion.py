"""Motion of a simulated printer: coordinates and their modes, limits, kinematics, and moves for the planner."""

from collections.abc import Callable, Mapping, Sequence
from math import ceil, hypot, inf, pi, sqrt

from machine.firmware import simulation_of
from machine.firmware.firmware import SimulatedSettings
from machine.gcode.arcs import arc_centre, chords, sweep_rad
from machine.gcode.modes import Modes, axes_of
from machine.kinematics.table import origin_mm
from machine.simulator.planner import Axes, ExecutedMoves, Planner, block_of
from mdp.pose import Pose, rotation, shift
from profiles.machine import Machine
from slicer.estimate.timing import axis_accelerations, axis_speeds

FIRST_FEED = 25.0  # mm/s before the first F: Marlin's 1500 mm/min
TINY_MM = 1e-9
SLACK = 1e-6  # tolerance of limits for coordinates with few decimals
SLIP_MM = 0.4  # and deg: a motor without current is moved by hand or weight, and catches at another step
HARD_MM = 2.0  # from a soft limit to the axis's hard stop
ARC_MM, CIRCLE_CHORDS = 1.0, 72  # Marlin's MAX_ARC_SEGMENT_MM and MIN_CIRCLE_SEGMENTS
SEGMENTS_PER_S = 200.0  # segments in a turn that the firmware follows
STEPS = (80.0, 80.0, 400.0, 80.0, 80.0)  # per mm or degree, for M114's Count

WordValues = Mapping[str, float]  # by letter


class TcpKinematics:
    """Conversion of X Y Z tilt turn both ways; the rotation of the last pose is cached, for most moves keep theirs."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._origin: list[float] = origin_mm(machine).tolist()
        self._pose: tuple[float, float] | None = None

    def positions(self, tip: Axes) -> list[float]:
        """Positions of the axes when the tip is at a point: R (tip - origin) + shift."""
        self._turn(tip[3], tip[4])
        x, y, z = (p - o for p, o in zip(tip[:3], self._origin, strict=True))
        return [a * x + b * y + c * z + s for (a, b, c), s in zip(self._rotation, self._shift, strict=True)] + list(tip[3:5])

    def tip(self, positions: Axes) -> list[float]:
        """Position of the tip relative to the table at these positions of the axes."""
        self._turn(positions[3], positions[4])
        x, y, z = (p - s for p, s in zip(positions[:3], self._shift, strict=True))
        columns = zip(*self._rotation, strict=True)
        return [a * x + b * y + c * z + o for (a, b, c), o in zip(columns, self._origin, strict=True)] + list(positions[3:5])

    def _turn(self, tilt_deg: float, turn_deg: float) -> None:
        if self._pose != (tilt_deg, turn_deg):
            pose = Pose(tilt_deg, turn_deg)
            self._pose = (tilt_deg, turn_deg)
            self._rotation: list[list[float]] = rotation(self._machine, pose).tolist()
            self._shift: list[float] = shift(self._machine, pose).tolist()


class Motion:
    """Axes X Y Z tilt turn E. position: the firmware's belief, in its own coordinates; plus modes.offset the program's.

    With TCP it is the tip's position relative to the table, else the axes'. The true axes differ by an offset after a reset, or
    when TCP is switched with a turned table; `executed` has the true moves.
    """

    def __init__(
        self,
        machine: Machine,
        note: Callable[[str, bool], None] = lambda what, trouble: None,
        kept_moves: int | None = None,
        home_start: bool = True,
    ) -> None:
        rules = simulation_of(machine)
        axes = (machine.x, machine.y, machine.z)
        self._axes = axes_of(machine)
        self.letters = self._axes.letters
        self.limits = [a.limits_mm for a in axes] + [machine.tilt.limits_deg, machine.turn.limits_deg]
        rotary = (machine.tilt, machine.turn)
        self._home = [*machine.home[:3], *(a.zero_deg if a.home_deg is None else a.home_deg for a in rotary)]
        self._starts_at_home = rules.starts_at_home and home_start
        self.executed = ExecutedMoves(kept_moves)
        self.planner = Planner(self.executed.add, rules.blocks, rules.min_segment_s)
        self._machine, self._note = machine, note
        self._tcp = TcpKinematics(machine)
        # Positions of the axes when all planned blocks are over, filament as a running total.
        self._real = [*machine.home[:3], machine.tilt.zero_deg, machine.turn.zero_deg, 0.0] if self._starts_at_home else [0.0] * 6
        self._offset = [0.0] * 5
        self.clamped = self.halts = 0
        self.forget()

    def forget(self) -> None:
        """Reset the firmware's state by a restart: the axes stay, the firmware assumes home or zero and its defaults."""
        machine = self._machine
        self.position = [*machine.home, 0.0] if self._starts_at_home else [0.0] * 6
        self.modes = Modes(self._axes, feed=60.0 * FIRST_FEED)
        self._offset = [real - position for real, position in zip(self._real[:5], self.position, strict=False)]
        self.follows = False
        self.soft_limits = True
        self.homed: set[int] = set()
        self.energised = False
        self.feed_share = self.flow_share = 1.0
        self.speeds: list[float] = axis_speeds(machine).tolist()
        self.accelerations: list[float] = axis_accelerations(machine).tolist()
        self.jerk_mm_s = machine.junction_speed_mm_s
        self._printing = self._travelling = inf  # mm/s² set by M204 for X Y Z; inf: the axes' limits

    def target(self, words: WordValues, extrude: bool = True) -> list[float]:
        """The end of a G0 or G1, whose F is applied; without `extrude` (cold nozzle) the filament stays."""
        destination = self._wanted(words)
        if self.soft_limits:
            self._clamp(destination)
        if not extrude:
            self.modes.offset[5] += destination[5] - self.position[5]
            destination[5] = self.position[5]
        return destination

    def _clamp(self, destination: list[float]) -> None:
        """Clip at the soft limits; Marlin does so silently, and only on homed axes: on others the program's coordinates are
        counted."""
        homed, everywhere, offset = self.homed, not self._starts_at_home, self.modes.offset
        for axis, (low, high) in enumerate(self.limits):
            limited = everywhere or axis in homed
            coordinate = destination[axis] if limited else destination[axis] + offset[axis]
            if not low - SLACK <= coordinate <= high + SLACK:
                self.clamped += 1
                destination[axis] = min(max(destination[axis], low), high) if limited else destination[axis]

    def turned(self, angles_deg: Mapping[int, float]) -> list[float]:
        """The end of a turn of single axes to the program's coordinates."""
        destination = self.position[:]
        for axis, angle in angles_deg.items():
            destination[axis] = angle - self.modes.offset[axis]
        if self.soft_limits:
            self._clamp(destination)
        return destination

    def pushes(self, words: WordValues) -> bool:
        """Whether a move turns the extruder."""
        return abs(self._wanted(words)[5] - self.position[5]) > TINY_MM

    def unhomed(self, words: WordValues) -> list[float] | None:
        """The program's coordinates of a target that moves X, Y or Z before homing; None for any other."""
        wanted = [axis for axis, letter in enumerate(self.letters[:3]) if letter in words and axis not in self.homed]
        return [p + s for p, s in zip(self._wanted(words), self.modes.offset, strict=True)] if wanted else None

    def beyond(self, words: WordValues) -> list[float] | None:
        """The program's coordinates of a target outside the soft limits; None for one inside."""
        destination = self._wanted(words)
        inside = all(low - SLACK <= p <= high + SLACK for p, (low, high) in zip(destination, self.limits, strict=False))
        return None if inside else [p + s for p, s in zip(destination, self.modes.offset, strict=True)]

    def _wanted(self, words: WordValues) -> list[float]:
        destination = self.position[:]
        self.modes.move(destination, words.items())
        return destination

    @property
    def feed_mm_s(self) -> float:
        """The feed rate of F, before M220; deg/s if only the table turns."""
        return self.modes.feed / 60.0

    def pieces(self, target: Sequence[float]) -> list[list[float]]:
        """Ends of the straight moves to a target: one, but many when the firmware follows the turning table."""
        here = self.position
        if not self.follows or target[3:5] == here[3:5]:
            return [list(target)]
        return _evenly(here, target, max(1, ceil(self._seconds(here, target) * SEGMENTS_PER_S)))

    def arc(self, words: WordValues, clockwise: bool, extrude: bool) -> list[list[float]]:
        """Ends of the chords of a G2 or G3; [] for what Marlin answers with "Bad arc parameters"."""
        scale = self.modes.unit_mm
        start, end = self.position, self.target(words, extrude)
        begin, finish = (start[0], start[1]), (end[0], end[1])
        centre = arc_centre(begin, finish, {letter: scale * words[letter] for letter in "RIJ" if letter in words}, clockwise)
        if centre is None or centre == begin:
            return []
        sweep = sweep_rad(begin, finish, centre, clockwise)
        radius = hypot(start[0] - centre[0], start[1] - centre[1])
        count = max(1, ceil(abs(sweep) * radius / ARC_MM), ceil(abs(sweep) / (2.0 * pi) * CIRCLE_CHORDS))
        rest = _evenly(start[2:], end[2:], count)
        return [[x, y, *others] for (x, y), others in zip(chords(begin, finish, centre, sweep, count), rest, strict=True)]

    def reach(self, destination: Sequence[float], now_s: float, feed_mm_s: float | None = None) -> None:
        """Plan one straight move, at the speed of F or a given one."""
        here, real = self.position, self._real
        x, y, z, tilt, turn = self._tcp.positions(destination) if self.follows else destination[:5]
        from_x, from_y, from_z, from_tilt, from_turn = self._offset
        end = [x + from_x, y + from_y, z + from_z, tilt + from_tilt, turn + from_turn]
        self._meet_ends(end)
        end.append(real[5] + (destination[5] - here[5]) * self.flow_share)
        feed = self.feed_mm_s * self.feed_share if feed_mm_s is None else feed_mm_s
        if self.follows and destination[:5] != here[:5] and (seconds := self._seconds(here, destination)) > 0.0:
            feed = _length(real, end) / seconds
        most_mm_s2 = self._printing if end[5] != real[5] else self._travelling
        block = block_of(real, end, feed, self.speeds, self.accelerations, most_mm_s2)
        self.position, self._real = list(destination), end
        if block is not None:
            self.energised = True
            block.feed = self.feed_mm_s if feed_mm_s is None else feed_mm_s / self.feed_share
            self.planner.add(block, self.jerk_mm_s, now_s)

    def shift_z(self, by_mm: float) -> None:
        """A baby step: raise every later position by this much."""
        self._offset[2] += by_mm

    def _seconds(self, here: Sequence[float], destination: Sequence[float]) -> float:
        """Duration of a followed move at F, s."""
        return _length(here, destination) / (self.feed_mm_s * self.feed_share)

    def _meet_ends(self, end: list[float]) -> None:
        """Stop an axis that is driven against its hard stop, without the firmware's knowledge."""
        for axis, (low, high) in enumerate(self.limits):
            if not low - HARD_MM <= end[axis] <= high + HARD_MM:
                stopped = min(max(end[axis], low - HARD_MM), high + HARD_MM)
                self._offset[axis] += stopped - end[axis]
                end[axis] = stopped
                self._note(f"{self.letters[axis]} driven against its end", True)

    def home(self, axes: Sequence[int]) -> float:
        """Put axes at their home positions (X Y minimum, Z maximum, table level); returns the duration, s."""
        self.homed.update(axes)
        self.energised = True
        travel_s = max((abs(self._home[a] - self._real[a]) / self.speeds[a] for a in axes), default=0.0)
        real = self._real[:]
        for axis in axes:
            real[axis], self._offset[axis], self.modes.offset[axis] = self._home[axis], 0.0, 0.0
        self._real = real
        self._believe()
        return 2.0 * travel_s + 1.0

    def let_go(self, axes: Sequence[int]) -> None:
        """Switch motors off: the axes slip, without the firmware's knowledge."""
        self.energised = False
        real = self._real[:]
        for axis in axes:
            slip = min(SLIP_MM, real[axis] - (self.limits[axis][0] - HARD_MM))
            real[axis] -= slip
            self._offset[axis] -= slip
        self._real = real

    def follow(self, on: bool) -> None:
        """G43.4, G49: coordinates stay, as in firmwares without knowledge of the change; a turned table then has a wrong
        position."""
        if on != self.follows:
            self.follows = on
            positions = self._tcp.positions(self.position) if on else self.position[:5]
            self._offset = [r - p for r, p in zip(self._real, positions, strict=False)]

    def accelerate(self, words: WordValues) -> None:
        """M204: P for moves with filament, T for those without, S for both; values not above 0 change nothing."""
        scale = self.modes.unit_mm
        for letter, value in words.items():
            if value > 0 and letter in "PS":
                self._printing = value * scale
            if value > 0 and letter in "TS":
                self._travelling = value * scale

    def bound(self, words: WordValues, bounds: list[float]) -> None:
        """M201, M203: greatest accelerations or speeds of single axes."""
        for axis, most in self.modes.named(words.items()):
            if most > 0:
                bounds[axis] = most

    def settings(self) -> SimulatedSettings:
        """The firmware's present settings."""
        machine = self._machine
        there = range(6) if machine.tilts else (0, 1, 2, 5)
        usual = min(self.accelerations[:2])
        printing, travelling = (usual if a == inf else a for a in (self._printing, self._travelling))
        return SimulatedSettings(
            letters="".join(self.letters[axis] for axis in there),
            limits=[self.limits[axis] for axis in there if axis < 5],
            steps=[STEPS[axis] for axis in there if axis < 5],
            speeds=[self.speeds[axis] for axis in there],
            accelerations=[self.accelerations[axis] for axis in there],
            printing=printing,
            travelling=travelling,
            jerk=self.jerk_mm_s,
            soft_limits=self.soft_limits,
            nozzle_limit_c=machine.nozzle_limit_c,
            bed_limit_c=machine.bed_limit_c,
        )

    def rename(self, words: WordValues) -> None:
        """G92: give the axes' position these coordinates."""
        for axis, coordinate in self.modes.named(words.items()):
            self.set_coordinate(axis, coordinate)

    def set_coordinate(self, axis: int, coordinate: float) -> None:
        """Give the position of one axis another coordinate."""
        self.modes.offset[axis] = coordinate - self.position[axis]

    def halt(self, now_s: float) -> None:
        """Stop at once: later blocks are dropped, the current one ends where it is."""
        self.planner.run(now_s)
        cut = self.planner.under_way()
        planned, planned_s = (cut.end, cut.duration_s) if cut is not None else ((), 0.0)
        stopped = self.planner.halt(now_s)
        self.halts += 1
        if cut is not None:
            self.executed.cut(cut, planned, planned_s)
        if stopped is not None:
            self.position[5] += (stopped[5] - self._real[5]) / (self.flow_share or 1.0)
            self._real = list(stopped)
            self._believe()

    def _believe(self) -> None:
        """Compute the position from the axes."""
        positions = [r - o for r, o in zip(self._real, self._offset, strict=False)]
        self.position[:5] = self._tcp.tip(positions) if self.follows else positions

    def at(self, now_s: float) -> list[float]:
        """The true position of the axes now, X Y Z tilt turn."""
        self.planner.run(now_s)
        return list(self.planner.at(now_s, self._real))[:5]

    def counts(self, now_s: float) -> list[int]:
        """Steps of the axes as the firmware counts them, at this moment."""
        now = zip(self.at(now_s), self._offset, STEPS, strict=True)
        return [round((position - offset) * steps) for position, offset, steps in now]

    def coordinates(self) -> list[float]:
        """The program's coordinates when all planned moves are over."""
        return [p + s for p, s in zip(self.position, self.modes.offset, strict=True)]


def _evenly(here: Sequence[float], target: Sequence[float], count: int) -> list[list[float]]:
    return [[a + k / count * (b - a) for a, b in zip(here, target, strict=True)] for k in range(1, count + 1)]


def _length(a: Sequence[float], b: Sequence[float]) -> float:
    """The length that F measures: of X Y Z; of the rotary axes if those are at rest; else of the filament."""
    x, y, z, tilt, turn, filament = (q - p for p, q in zip(a, b, strict=True))
    return sqrt(x * x + y * y + z * z) or hypot(tilt, turn) or abs(filament)
