"""Planner of a simulated printer: queued blocks, each as fast as those behind it let the machine stop.

The rules are those of the dry run's timeline (constant acceleration, a speed change at corners that no axis exceeds), but only
queued blocks are known: a block that begins without a successor ends at a standstill, as in Marlin.
"""

from array import array
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, sqrt
from operator import sub

from machine.firmware.marlin import FIRST_MOVE_BLOCKS, FIRST_MOVE_DELAY_S

TINY = 1e-9

Axes = Sequence[float]  # X Y Z tilt turn E
ROW = 15  # numbers of a move: 6 for its beginning, 6 for its end, feed, start time, duration
EXTRUDES_MM = 1e-9  # smaller differences of running filament totals are rounding


@dataclass(slots=True)
class Block:
    """A straight move of six axes. measure: the axes along which F and all speeds count (0: X Y Z, 1: rotary, 2: filament)."""

    start: Axes
    end: Axes
    direction: Axes
    feed: float
    length: float
    measure: int
    cruise: float
    acceleration: float
    corner2: float = 0.0  # squares of the greatest and the planned speed at its beginning
    entry2: float = 0.0
    v0: float = 0.0
    v1: float = 0.0
    peak: float = 0.0
    begin_s: float = 0.0
    duration_s: float = 0.0
    end_s: float = 0.0

    def settle(self, begin_s: float, v0: float, next2: float) -> None:
        """Fix the block's speeds when it begins; next2: square of the greatest entry speed of its successor."""
        a, length = self.acceleration, self.length
        most2 = v0 * v0 + 2.0 * a * length
        v1 = sqrt(next2 if next2 < most2 else most2)
        peak = sqrt(0.5 * (v0 * v0 + v1 * v1) + a * length)
        if peak > self.cruise:
            peak = self.cruise
        ramps = (2.0 * peak * peak - v0 * v0 - v1 * v1) / (2.0 * a)
        even = length - ramps if length > ramps else 0.0
        self.v0, self.v1, self.peak, self.begin_s = v0, v1, peak, begin_s
        self.duration_s = duration_s = (2.0 * peak - v0 - v1) / a + even / peak
        self.end_s = begin_s + duration_s

    def share(self, now_s: float) -> float:
        """Fraction of the block completed, 0 to 1."""
        t, a, length = now_s - self.begin_s, self.acceleration, self.length
        if t >= self.duration_s:
            return 1.0
        rising_s, falling_s = (self.peak - self.v0) / a, (self.peak - self.v1) / a
        if t < rising_s:
            return max(0.0, (self.v0 + 0.5 * a * t) * t / length)
        left_s = self.duration_s - t
        if left_s < falling_s:
            return 1.0 - (self.v1 + 0.5 * a * left_s) * left_s / length
        return ((self.v0 + self.peak) * 0.5 * rising_s + self.peak * (t - rising_s)) / length

    def at(self, now_s: float) -> list[float]:
        """Position of the axes at a time during the block."""
        share = self.share(now_s)
        return [a + share * (b - a) for a, b in zip(self.start, self.end, strict=True)]


class ExecutedMoves:
    """The moves that have begun. kept_moves: least number of moves in `rows` (at most twice as many); None: all.

    moves, strokes, pushed_mm, moving_s: sums over all of them; strokes push filament while another axis moves.
    """

    def __init__(self, kept_moves: int | None = None) -> None:
        self.rows = array("d")
        self._most = None if kept_moves is None else max(1, 2 * kept_moves) * ROW
        self.moves = self.strokes = 0
        self.pushed_mm = self.moving_s = 0.0

    def add(self, block: Block) -> None:
        """Add a block that begins."""
        rows = self.rows
        start, end, duration_s = block.start, block.end, block.duration_s
        rows.extend((*start, *end, block.feed, block.begin_s, duration_s))
        self._count(start, end, duration_s, 1)
        if self._most is not None and len(rows) >= self._most:
            del rows[: -self._most // 2]

    def cut(self, block: Block, planned: Sequence[float], planned_s: float) -> None:
        """Correct the newest block, which ended early, to its new end and duration; planned: those before."""
        base = len(self.rows) - ROW
        self._count(block.start, planned, planned_s, -1)
        if list(block.start) == list(block.end):  # it had only just begun
            del self.rows[base:]
            return
        self._count(block.start, block.end, block.duration_s, 1)
        for axis in range(6):
            self.rows[base + 6 + axis] = block.end[axis]
        self.rows[-1] = block.duration_s

    def _count(self, start: Sequence[float], end: Sequence[float], duration_s: float, times: int) -> None:
        self.moves += times
        self.moving_s += times * duration_s
        pushed = end[5] - start[5]
        if pushed > EXTRUDES_MM and start[:5] != end[:5]:
            self.strokes += times
            self.pushed_mm += times * pushed


class Planner:
    """Blocks are added by add(); run() begins those whose time has come and passes them to `begun`.

    underruns: how often it ran dry although the machine need not have stopped; slowed: blocks slowed down for lack of queued
    ones; ended_s: end of the newest finished block.
    """

    def __init__(self, begun: Callable[[Block], None], blocks: int, min_segment_s: float) -> None:
        self._begun, self._blocks, self._min_segment_s = begun, blocks, min_segment_s
        self._waiting: deque[Block] = deque()
        self._current: Block | None = None
        self._last: Block | None = None  # the one that ended last, unless something has made the machine wait
        self._gate_s = 0.0
        self.ended_s = 0.0
        self.underruns = self.slowed = 0

    def free(self, now_s: float) -> int:
        """Number of free places."""
        current = self._current
        if current is None or current.end_s <= now_s:
            self.run(now_s)
        return self._blocks - len(self._waiting) - (self._current is not None)

    def next_s(self) -> float:
        """When the current block ends or the first one begins; inf: nothing is planned."""
        if self._current is not None:
            return self._current.end_s
        return self._gate_s if self._waiting else inf

    def run(self, now_s: float) -> None:
        """Begin and end blocks up to a time."""
        while True:
            current = self._current
            if current is not None:
                begin_s, v0 = current.end_s, current.v1
                if begin_s > now_s:
                    return
                self._last, self._current, self.ended_s = current, None, begin_s
            else:
                begin_s, v0 = self._gate_s, 0.0
            if not self._waiting or begin_s > now_s:
                return
            block = self._waiting.popleft()
            block.settle(begin_s, v0, self._waiting[0].entry2 if self._waiting else 0.0)
            self._current = block
            self._begun(block)

    def add(self, block: Block, jerk: float, now_s: float) -> None:
        """Queue a block; jerk: speed change allowed to an axis at a corner, mm/s."""
        waiting = self._waiting
        queued = self._blocks - self.free(now_s)
        if 2 <= queued < self._blocks // 2 + 1:
            self._slow_down(block, queued)
        if waiting:
            block.corner2 = corner2(waiting[-1], block, jerk)
        elif self._current is None:
            if self._last is not None and corner2(self._last, block, jerk) > 0.0:
                self.underruns += 1
            self._gate_s = now_s + FIRST_MOVE_DELAY_S
        waiting.append(block)
        if len(waiting) >= FIRST_MOVE_BLOCKS:
            self._gate_s = min(self._gate_s, now_s)
        self._look_back()

    def barrier(self, now_s: float) -> None:
        """Note that the program itself waits: a machine at rest has not run dry."""
        self.run(now_s)
        self._last = None

    def ahead(self) -> list[Block]:
        """Copies of the blocks that have not begun, timed as if nothing followed."""
        begin_s, v0 = self._gate_s, 0.0
        if self._current is not None:
            begin_s, v0 = self._current.end_s, self._current.v1
        timed = []
        for index, block in enumerate(self._waiting):
            block.settle(begin_s, v0, self._waiting[index + 1].entry2 if index + 1 < len(self._waiting) else 0.0)
            begin_s, v0 = block.end_s, block.v1
            timed.append(block)
        return timed

    def under_way(self) -> Block | None:
        """The block that has begun and not ended."""
        return self._current

    def halt(self, now_s: float) -> Axes | None:
        """Stop at once and drop the queue; returns the position of the axes, None when nothing was planned.

        The current block is cut short: its end and duration change.
        """
        self.run(now_s)
        cut, self._current, self._last, self.ended_s = self._current, None, None, now_s
        stop = self._waiting[0].start if self._waiting else None
        self._waiting.clear()
        if cut is not None:
            cut.end = stop = cut.at(now_s)
            cut.duration_s, cut.end_s = now_s - cut.begin_s, now_s
        return stop

    def at(self, now_s: float, idle: Axes) -> Axes:
        """The position of the axes; idle: their position when nothing is planned."""
        if self._current is not None:
            return self._current.at(now_s)
        return self._waiting[0].start if self._waiting else idle

    def _slow_down(self, block: Block, queued: int) -> None:
        """Slow a block down as Marlin's SLOWDOWN does, which gives the host time to send more."""
        seconds = block.length / block.cruise
        if seconds < self._min_segment_s:
            block.cruise = block.length / (seconds + 2.0 * (self._min_segment_s - seconds) / queued)
            self.slowed += 1

    def _look_back(self) -> None:
        """Raise the entry speeds of queued blocks from the newest back, while that changes anything."""
        following2 = 0.0
        for block in reversed(self._waiting):
            entry2 = following2 + 2.0 * block.acceleration * block.length
            if entry2 > block.corner2:
                entry2 = block.corner2
            if entry2 == block.entry2:
                return
            block.entry2 = following2 = entry2


def corner2(before: Block, after: Block, jerk: float) -> float:
    """Square of the greatest speed at a corner: no axis changes its speed by more than `jerk`."""
    if before.measure != after.measure:
        return 0.0
    v = before.cruise if before.cruise < after.cruise else after.cruise
    change = max(map(abs, map(sub, before.direction, after.direction)))
    if change * v > jerk:
        v = jerk / change
    return v * v


def block_of(start: Axes, end: Axes, feed: float, speeds: Axes, accelerations: Axes, most_mm_s2: float) -> Block | None:
    """A block between positions; None when nothing moves. most_mm_s2: acceleration for moves of X Y Z."""
    deltas = list(map(sub, end, start))
    x, y, z, tilt, turn, filament = deltas
    length, measure = sqrt(x * x + y * y + z * z), 0
    if length <= TINY:
        length, measure = sqrt(tilt * tilt + turn * turn), 1
        if length <= TINY:
            length, measure = abs(filament), 2
            if length <= TINY:
                return None
    direction = [0.0] * 6
    cruise, acceleration = feed, inf
    for axis, delta in enumerate(deltas):
        if delta:  # most moves leave half of the axes at rest
            direction[axis] = share = delta / length
            share = abs(share)
            if cruise * share > speeds[axis]:
                cruise = speeds[axis] / share
            if acceleration * share > accelerations[axis]:
                acceleration = accelerations[axis] / share
    if measure == 0 and most_mm_s2 < acceleration:
        acceleration = most_mm_s2
    return Block(start, end, direction, feed, length, measure, cruise, acceleration)
