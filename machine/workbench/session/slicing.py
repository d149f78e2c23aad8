"""Slicing: the slices that a session has or makes, whether they are of what lies on the bench now, and what they cost beside the
same model in one piece."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from machine.program import Alternative
from machine.workbench.bench.bench import Bench
from machine.workbench.session.base import WAITING, Derived, SessionBase
from machine.workbench.work.slices import Sliced, SlicesSoFar
from profiles.errors import PlanError

ENDED = "slicing has ended, for what lies on the workbench is another now: slice it again"


@dataclass(frozen=True, eq=False)
class Slices:
    """Finished slices: what they are of, their number, and what is seen of each part."""

    bench: Bench
    number: int
    sliced: Sliced
    walls: Mapping[int, bytes]


class Slicing(Derived[Slices]):
    """progress: SlicesSoFar, with all parts that are ready, of the slices of this number; done: the last slices."""

    def __init__(self, session: SessionBase) -> None:
        super().__init__(session, lambda bench: bench.printed, self._slice, by_itself=False, interrupts=True)

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
        if self.progress is not None and self.number == number:
            drawn: bytes | None = self.progress.walls.get(part)
            return drawn
        return self.done.walls.get(part) if self.done is not None and self.done.number == number else None

    def slice(self) -> None:
        """Slice the model on the bench, if nothing is being sliced."""
        self.begin(SlicesSoFar(WAITING if self._session.long.pool.full else "cutting the parts"))

    def interrupted(self) -> None:
        """Tell the pages."""
        self._session.add_problem(ENDED)

    async def _slice(self, bench: Bench) -> Slices:
        walls: dict[int, bytes] = {}
        number, tell = self.number, self.teller()

        def follow(so_far: SlicesSoFar) -> None:
            walls.update(so_far.walls)
            tell(replace(so_far, walls=walls))

        files = self._session.new_file(), self._session.new_file()
        sliced: Sliced = await self._session.long.run("slice_bench", bench, *files, tell=follow)
        if self.done is not None:
            self.done.sliced.page.unlink(missing_ok=True)
            self.done.sliced.gcode.unlink(missing_ok=True)
        return Slices(bench, number, sliced, walls)


class Comparing(Derived[tuple[Alternative, ...]]):
    """The slices of the bench beside their model in one piece; progress: how far that is, in words."""

    def __init__(self, session: SessionBase, slicing: Slicing) -> None:
        self._slicing = slicing
        super().__init__(
            session,
            lambda bench: None if (slices := slicing.latest()) is None else slices.bench.printed,
            lambda bench: session.long.run("compare_bench", bench, tell=self.teller()),
            by_itself=False,
            interrupts=True,
        )

    def rows(self) -> tuple[Alternative, ...]:
        """The last slices, then their model in one piece; none where these slices have not been compared."""
        slices, others = self._slicing.latest(), self.result
        return () if slices is None or others is None else (slices.sliced.cost, *others)

    def compare(self) -> None:
        """Compare what is sliced, if that is not done yet; a comparison of earlier slices ends."""
        if self.stale:
            self.stop()
        if not self.rows():
            self.begin(WAITING if self._session.long.pool.full else "comparing")
