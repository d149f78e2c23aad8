"""Standing: how the model on the bench stands, worked out anew whenever it is turned or set otherwise."""

from hashlib import sha256

from machine.workbench.bench.bench import Bench
from machine.workbench.session.base import SessionBase
from machine.workbench.work.standing import Standing
from profiles.errors import MeshError


class StandingModel:
    """The last one that is known, and of what."""

    def __init__(self, session: SessionBase) -> None:
        self._session = session
        self._wanted: tuple[object, ...] = ()
        self._known: Standing | None = None
        session.followers.append(self._follow)

    @property
    def now(self) -> Standing | None:
        """How the model on the bench stands; None: there is no model, or it is not known yet."""
        return self._known if self._wanted and self._wanted == _asked(self._session.bench) else None

    @property
    def pedestal_key(self) -> str:
        """What tells the pedestal from others: the page asks for its triangles by it; "": there is none."""
        bench = self._session.bench
        if self.now is None or not self.now.pedestal or bench.model is None:
            return ""
        return sha256(repr((bench.model.key, bench.rotation, bench.profile.search.pedestal_mm)).encode()).hexdigest()[:16]

    def _follow(self) -> None:
        asked = _asked(self._session.bench)
        if asked == self._wanted:
            return
        self._wanted, self._known = asked, None
        if asked:
            self._session.start(self._work(self._session.bench, asked))

    async def _work(self, bench: Bench, asked: tuple[object, ...]) -> None:
        standing: Standing = await self._session.hand.run("stand", bench)
        if self._wanted == asked:
            self._known = standing
            if standing.refusal:
                raise MeshError(standing.refusal)


def _asked(bench: Bench) -> tuple[object, ...]:
    """What decides how it stands and what is told of that; (): there is no model."""
    if bench.model is None:
        return ()
    process = bench.profile.of_part(1).process
    decides = process.self_supporting_angle_deg, process.line_width_mm, process.place_mm, bench.profile.machine
    brims = process.brim_mm, process.small_base_brim_mm, process.first_layer_height_mm
    copies = (bench.copies, max(bench.parts, 1), *brims) if bench.copies > 1 else ()
    return bench.model, bench.rotation, bench.profile.search.pedestal_mm, *decides, copies
