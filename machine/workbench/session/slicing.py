"""Slicing: the slices that a session has or makes, and whether they are of what lies on the bench now."""

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass, field

from machine.workbench.bench.bench import Bench
from machine.workbench.session.base import WAITING, SessionBase
from machine.workbench.work.slices import Sliced, SlicesSoFar
from profiles.errors import PlanError

ENDED = "slicing has ended, for what lies on the workbench is another now: slice it again"


@dataclass(frozen=True, eq=False)
class SlicingUnderWay:
    """The bench that is sliced, the number of the slices, how far they are, and what is seen of the parts that are ready."""

    bench: Bench
    number: int
    text: str
    shares: tuple[float, ...] = ()
    walls: Mapping[int, bytes] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Slices:
    """Finished slices: what they are of, their number, and what is seen of each part."""

    bench: Bench
    number: int
    sliced: Sliced
    walls: Mapping[int, bytes]


class Slicing:
    """under_way: what is sliced now; done: the last slices."""

    def __init__(self, session: SessionBase) -> None:
        self.under_way: SlicingUnderWay | None = None
        self.done: Slices | None = None
        self._session = session
        self._count = 0
        self._task: asyncio.Task[None] | None = None
        session.followers.append(self._follow)

    def latest(self) -> Slices | None:
        """The last slices of the model on the bench, though it may have been turned, cut or set otherwise since."""
        return self.done if self.done is not None and self.done.bench.model is self._session.bench.model else None

    @property
    def out_of_date(self) -> bool:
        """Whether the last slices are of something else than what lies on the bench now."""
        return self.done is not None and self.done.bench.printed != self._session.bench.printed

    def lacking(self) -> str:
        """Why there are no slices of what lies on the bench now; "" where there are."""
        if self.latest() is None:
            return "what is on the workbench is not sliced yet: slice it first"
        return "what is on the workbench has changed since it was sliced: slice it again" if self.out_of_date else ""

    def needed(self) -> Slices:
        """The slices of what lies on the bench now. Raises PlanError where there are none."""
        if sentence := self.lacking():
            raise PlanError(sentence)
        assert self.done is not None
        return self.done

    def walls_of(self, number: int, part: int) -> bytes | None:
        """What is seen of a part of the slices of a number; None where it is not there, or not there yet."""
        for slices in (self.under_way, self.done):
            if slices is not None and slices.number == number:
                return slices.walls.get(part)
        return None

    def begin(self) -> None:
        """Slice the model on the bench, if nothing is being sliced."""
        bench = self._session.bench
        if self.under_way is None:
            self._count += 1
            begins = WAITING if self._session.long.pool.full else "cutting the parts"
            self.under_way = SlicingUnderWay(bench, self._count, begins)
            self._task = self._session.start(self._slice(self.under_way))

    def stop(self) -> str:
        """End the slicing. What became of it, as a sentence; "" where nothing was sliced."""
        under_way, self.under_way = self.under_way, None
        if under_way is None or self._task is None:
            return ""
        self._task.cancel()
        return "Slicing was stopped: " + ("the slices from before stay." if self.latest() else "there are no slices.")

    async def _slice(self, begun: SlicingUnderWay) -> None:
        walls: dict[int, bytes] = {}

        def follow(so_far: SlicesSoFar) -> None:
            walls.update(so_far.walls)
            if self.under_way is None or self.under_way.number != begun.number:
                return
            self.under_way = SlicingUnderWay(begun.bench, begun.number, so_far.text, so_far.shares, walls)
            self._session.notify()

        try:
            files = self._session.new_file(), self._session.new_file()
            sliced: Sliced = await self._session.long.run("slice_bench", begun.bench, *files, tell=follow)
            if self.done is not None:
                self.done.sliced.page.unlink(missing_ok=True)
                self.done.sliced.gcode.unlink(missing_ok=True)
            self.done = Slices(begun.bench, begun.number, sliced, walls)
        finally:
            if self.under_way is not None and self.under_way.number == begun.number:
                self.under_way = None

    def _follow(self) -> None:
        if self.under_way is not None and self.under_way.bench.printed != self._session.bench.printed:
            self.stop()
            self._session.add_problem(ENDED)
