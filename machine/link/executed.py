"""Executed: the moves a simulated printer has begun, as rows of numbers, all of them or the last ones only, and their sums."""

from array import array
from collections.abc import Sequence

from machine.link.planner import Block

ROW = 15  # numbers of a move: 6 where it begins, 6 where it ends, feed, begin, duration
EXTRUDES_MM = 1e-9  # differences of running filament totals below this are rounding


class Executed:
    """kept: how many moves stay in `rows` at least (twice as many at most); None: all.

    moves, strokes, pushed_mm, moving_s: sums over all of them; strokes push filament while another axis moves.
    """

    def __init__(self, kept: int | None = None) -> None:
        self.rows = array("d")
        self._most = None if kept is None else max(1, 2 * kept) * ROW
        self.moves = self.strokes = 0
        self.pushed_mm = self.moving_s = 0.0

    def add(self, block: Block) -> None:
        """A block begins."""
        rows = self.rows
        rows.extend((*block.start, *block.end, block.feed, block.begin_s, block.duration_s))
        self._count(block.start, block.end, block.duration_s, 1)
        if self._most is not None and len(rows) >= self._most:
            del rows[: -self._most // 2]

    def cut(self, block: Block, planned: Sequence[float], planned_s: float) -> None:
        """The block that began last ends early: it has its new end and duration; planned: those it had before."""
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
        if pushed > EXTRUDES_MM and any(a != b for a, b in zip(start[:5], end[:5], strict=True)):
            self.strokes += times
            self.pushed_mm += times * pushed
