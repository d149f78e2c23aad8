"""Pedestal: what the model on the bench stands on, worked out anew whenever it is turned or set otherwise."""

from hashlib import sha256

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.session.desk import Desk
from machine.app.workbench.work.pedestal import OnPedestal


class Pedestal:
    """The last one; the figures of a bench whose own is not known yet are those without."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._wanted: tuple[object, ...] = ()
        self._known: OnPedestal | None = None
        desk.followers.append(self._follow)

    @property
    def now(self) -> OnPedestal | None:
        """Of what lies on the bench; None: there is none, or it is not known yet."""
        return self._known if self._wanted and self._wanted == _asked(self._desk.bench) else None

    @property
    def key(self) -> str:
        """What tells it from others: the page asks for its triangles by it; "": there is none."""
        bench = self._desk.bench
        if self.now is None or bench.model is None:
            return ""
        return sha256(repr((bench.model.key, bench.rotation, bench.profile.search.pedestal_mm)).encode()).hexdigest()[:16]

    def _follow(self) -> None:
        asked = _asked(self._desk.bench)
        if asked == self._wanted:
            return
        self._wanted, self._known = asked, None
        if asked:
            self._desk.start(self._work(self._desk.bench, asked))

    async def _work(self, bench: Bench, asked: tuple[object, ...]) -> None:
        found = await self._desk.quick.run("stand_on_pedestal", bench)
        if self._wanted == asked:
            self._known = found


def _asked(bench: Bench) -> tuple[object, ...]:
    """What decides the pedestal and what is told of it; (): there is none."""
    profile = bench.profile
    if bench.model is None or profile.search.pedestal_mm <= 0.0:
        return ()
    limits = profile.process.self_supporting_angle_deg, profile.machine
    return bench.model, bench.rotation, profile.search.pedestal_mm, *limits
