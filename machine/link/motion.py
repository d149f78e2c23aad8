"""The moving half of a simulated printer: positions, coordinate modes, soft limits, and a queue of timed blocks."""

from array import array
from collections import deque
from collections.abc import Mapping, Sequence
from math import ceil, inf, pi

from machine.arcs import centre_of, chords, sweep_rad
from profiles.machine import Machine

BLOCKS = 16  # Marlin's BLOCK_BUFFER_SIZE
ROW = 15  # numbers of a recorded move: 6 where it begins, 6 where it ends, feed, begin, duration
FIRST_FEED = 25.0  # mm/s until a program gives an F: Marlin's 1500 mm/min
SLACK = 1e-6  # a coordinate printed with few decimals may stand this far outside a limit
INCH_MM = 25.4
ARC_MM, CIRCLE_CHORDS = 1.0, 72  # Marlin's MAX_ARC_SEGMENT_MM and MIN_CIRCLE_SEGMENTS


class Motion:
    """Axes X Y Z tilt turn E; `native` is what the machine means, native + shift what the program means.

    Moves go into `rows` when they are planned; a move that a stop cuts short is cut short there too.
    """

    def __init__(self, machine: Machine) -> None:
        axes = (machine.x, machine.y, machine.z)
        self.letters = ("X", "Y", "Z", machine.tilt.letter, machine.turn.letter, "E")
        self._limits = [a.limits_mm for a in axes] + [machine.tilt.limits_deg, machine.turn.limits_deg]
        self._home = [machine.x.limits_mm[0], machine.y.limits_mm[0], machine.z.limits_mm[1]]
        self._home += [machine.tilt.zero_deg, machine.turn.zero_deg]
        self._speeds = [a.speed_mm_s for a in axes]
        self._speeds += [machine.tilt.speed_deg_s, machine.turn.speed_deg_s, machine.extruder_speed_mm_s]
        self._accelerations = [a.acceleration_mm_s2 for a in axes] + [
            machine.tilt.acceleration_deg_s2,
            machine.turn.acceleration_deg_s2,
            machine.extruder_acceleration_mm_s2,
        ]
        self._junction = machine.junction_speed_mm_s
        self._printing = self._travelling = inf  # mm/s2 told by M204 for X Y Z; inf: what the axes allow
        self.native = [0.0] * 6
        self.shift = [0.0] * 6
        self.relative = self.filament_relative = self.inches = False
        self.feed = FIRST_FEED
        self.clamped = 0
        self.rows = array("d")
        self._ends: deque[float] = deque()
        self.end_s = 0.0

    def free(self, now_s: float) -> int:
        """Free places of the queue; blocks that are over leave it."""
        ends = self._ends
        while ends and ends[0] <= now_s:
            ends.popleft()
        return BLOCKS - len(ends)

    def next_free_s(self) -> float:
        """When the block under way ends."""
        return self._ends[0] if self._ends else 0.0

    def go(self, words: Mapping[str, float], now_s: float, extrude: bool) -> None:
        """Plan one G0 or G1; without `extrude` (cold nozzle) the filament stands still."""
        start = tuple(self.native)
        self._aim(words)
        if not extrude:
            self.shift[5] += self.native[5] - start[5]
            self.native[5] = start[5]
        self._plan(start, now_s)

    def arc(self, words: Mapping[str, float], clockwise: bool, extrude: bool) -> list[list[float]]:
        """Where the chords of a G2 or G3 end, in `native` terms; [] for what Marlin answers with "Bad arc parameters"."""
        scale = INCH_MM if self.inches else 1.0
        start = list(self.native)
        self._aim(words)
        if not extrude:
            self.shift[5] += self.native[5] - start[5]
            self.native[5] = start[5]
        end, self.native[:] = list(self.native), start
        begin, finish = (start[0], start[1]), (end[0], end[1])
        if "R" in words:
            centre = centre_of(begin, finish, words["R"] * scale, clockwise)
        else:
            centre = (start[0] + words.get("I", 0.0) * scale, start[1] + words.get("J", 0.0) * scale)
        if centre is None or centre == begin:
            return []
        sweep = sweep_rad(begin, finish, centre, clockwise)
        radius = ((start[0] - centre[0]) ** 2 + (start[1] - centre[1]) ** 2) ** 0.5
        count = max(1, ceil(abs(sweep) * radius / ARC_MM), ceil(abs(sweep) / (2.0 * pi) * CIRCLE_CHORDS))
        shares = [k / count for k in range(1, count + 1)]
        return [
            [x, y, *(a + share * (b - a) for a, b in zip(start[2:], end[2:], strict=True))]
            for share, (x, y) in zip(shares, chords(begin, finish, centre, sweep, count), strict=True)
        ]

    def reach(self, place: Sequence[float], now_s: float) -> None:
        """Plan one chord of an arc."""
        start = tuple(self.native)
        self.native[:] = [self._allowed(axis, value) for axis, value in enumerate(place)]
        self._plan(start, now_s)

    def _aim(self, words: Mapping[str, float]) -> None:
        """Take over the feed and the target of a move."""
        scale = INCH_MM if self.inches else 1.0
        if "F" in words and words["F"] > 0:
            self.feed = words["F"] * scale / 60.0
        for axis, letter in enumerate(self.letters):
            if letter in words:
                value = words[letter] * (1.0 if 3 <= axis < 5 else scale)
                relative = self.relative if axis < 5 else self.filament_relative
                self.native[axis] = self._allowed(axis, self.native[axis] + value if relative else value - self.shift[axis])

    def _plan(self, start: Sequence[float], now_s: float) -> None:
        deltas = [b - a for a, b in zip(start, self.native, strict=True)]
        if not any(deltas):
            return
        duration_s, begin_s = self._duration_s(deltas), max(now_s, self.end_s)
        self.end_s = begin_s + duration_s
        self._ends.append(self.end_s)
        self.rows.extend((*start, *self.native, self.feed, begin_s, duration_s))

    def _allowed(self, axis: int, value: float) -> float:
        """Marlin clamps a target outside the soft limits without a word."""
        if axis == 5:
            return value
        low, high = self._limits[axis]
        if low - SLACK <= value <= high + SLACK:
            return value
        self.clamped += 1
        return min(max(value, low), high)

    def _duration_s(self, deltas: Sequence[float]) -> float:
        """A trapezoid from junction speed over feed to junction speed, slowed to what every axis can do.

        The feed counts along X Y Z, for moves without them along tilt and turn, else along the filament.
        """
        x, y, z, tilt, turn, filament = deltas
        linear = (x * x + y * y + z * z) ** 0.5
        length = linear or (tilt * tilt + turn * turn) ** 0.5 or abs(filament)
        slowest_s, acceleration = length / self.feed, 1e9
        for delta, speed, most in zip(deltas, self._speeds, self._accelerations, strict=True):
            if delta:
                size = abs(delta)
                slowest_s = max(slowest_s, size / speed)
                acceleration = min(acceleration, most * length / size)
        if linear:
            acceleration = min(acceleration, self._printing if filament else self._travelling)
        speed = length / slowest_s
        corner = min(speed, self._junction) if linear else 0.0
        ramps = (speed * speed - corner * corner) / acceleration
        if ramps <= length:
            return 2.0 * (speed - corner) / acceleration + (length - ramps) / speed
        peak: float = (corner * corner + acceleration * length) ** 0.5
        return 2.0 * (peak - corner) / acceleration

    def home(self, axes: Sequence[int]) -> float:
        """Put axes at their home positions (X Y least, Z greatest, table level); returns how long it takes, s."""
        travel_s = max((abs(self._home[a] - self.native[a]) / self._speeds[a] for a in axes), default=0.0)
        for axis in axes:
            self.native[axis], self.shift[axis] = self._home[axis], 0.0
        return 2.0 * travel_s + 1.0

    def accelerate(self, words: Mapping[str, float]) -> None:
        """M204: P for moves that push filament, T for those that do not, S for both; what is not above 0 tells nothing."""
        scale = INCH_MM if self.inches else 1.0
        for letter, value in words.items():
            if value > 0 and letter in "PS":
                self._printing = value * scale
            if value > 0 and letter in "TS":
                self._travelling = value * scale

    def call_it(self, words: Mapping[str, float]) -> None:
        """G92: the place where the axes stand gets these coordinates."""
        for axis, letter in enumerate(self.letters):
            if letter in words:
                scale = INCH_MM if self.inches and not 3 <= axis < 5 else 1.0
                self.shift[axis] = words[letter] * scale - self.native[axis]

    def halt(self, now_s: float) -> None:
        """Stop at once: later blocks never happen, the one under way ends where it is."""
        rows = self.rows
        while rows and rows[-2] >= now_s:
            self.native[:] = rows[-ROW : -ROW + 6]
            del rows[-ROW:]
        if rows and rows[-2] + rows[-1] > now_s:
            share = (now_s - rows[-2]) / rows[-1]
            base = len(rows) - ROW
            for axis in range(6):
                rows[base + 6 + axis] = rows[base + axis] + share * (rows[base + 6 + axis] - rows[base + axis])
            self.native[:] = rows[base + 6 : base + 12]
            rows[-1] *= share
        self._ends.clear()
        self.end_s = now_s

    def told(self) -> str:
        """The answer to M114."""
        logical = [n + s for n, s in zip(self.native, self.shift, strict=True)]
        place = " ".join(f"{letter}:{value:.2f}" for letter, value in zip(self.letters, logical, strict=True))
        count = " ".join(f"{letter}:{80 * value:.0f}" for letter, value in zip(self.letters[:5], self.native[:5], strict=True))
        return f"{place} Count {count}"
