"""Placement: what is worked out as soon as a model lies on a bench or stands otherwise: how it stands, the ways in which it
rests, and what planes on it need."""

from hashlib import sha256
from itertools import count
from typing import Any

from machine.workbench.bench.bench import Bench
from machine.workbench.session.base import Derived, SessionBase
from machine.workbench.work.models import Resting, Standing
from mdp.read import MANY_FACES
from profiles.effect import effect_of_change
from profiles.errors import MeshError
from profiles.frozen import Effect
from profiles.profile import Profile

CHANGING_S = 0.2  # of a bench, until it is made ready as it is
_numbers = count(1)  # of the benches of all sessions, whose processes may be the same


class Readiness(Derived[None]):
    """What planes on the bench need, prepared in a process of its own, which knows by the bench's number what it has worked out
    already; very large models wait for the first plane."""

    def __init__(self, session: SessionBase) -> None:
        self._made_of: tuple[object, ...] = (None, None, None)  # the bench of the last number
        self._profile: Profile | None = None
        self._number = 0
        self._model = ""  # key of that of the bench that was made ready last
        super().__init__(session, self._number_to_prepare, self._prepare)

    def load(self) -> None:
        """Load what all planes need, while the first model is read."""
        if not self._number:
            self._session.start(self._session.hand.run("load_kernels"))

    async def ask(self, task: str, bench: Bench, *given: Any) -> Any:
        """What a task of work.trials says of a bench."""
        return await self._session.hand.run(task, self._number_of(bench), bench, *given)

    def _number_to_prepare(self, bench: Bench) -> int | None:
        return None if bench.model is None or bench.model.faces > MANY_FACES else self._number_of(bench)

    def _number_of(self, bench: Bench) -> int:
        made_of = (bench.model and bench.model.key, bench.rotation, bench.zones)
        if any(new is not old for new, old in zip(made_of, self._made_of, strict=True)) or not self._serves(bench.profile):
            self._made_of, self._profile, self._number = made_of, bench.profile, next(_numbers)
        return self._number

    def _serves(self, profile: Profile) -> bool:
        """Whether what was made ready serves another profile: planes read of it what a search does."""
        if profile is self._profile:
            return True
        serves = self._profile is not None and effect_of_change(self._profile, profile) < Effect.REACH
        if serves:
            self._profile = profile
        return serves

    async def _prepare(self, bench: Bench) -> None:
        """Make a bench ready, unless it changes at once again."""
        assert bench.model is not None
        if bench.model.key == self._model and not await self.rests(CHANGING_S):
            return
        self._model = bench.model.key
        self.tell(True)
        await self._session.hand.run("make_ready", self._number_of(bench), bench)


def standing_of(session: SessionBase) -> Derived[Standing]:
    """How the model on the bench stands."""

    async def stand(bench: Bench) -> Standing:
        standing: Standing = await session.hand.run("stand", bench)
        if standing.refusal:
            session.refuse(MeshError(standing.refusal))
        return standing

    return Derived(session, _stands_by, stand)


def _stands_by(bench: Bench) -> tuple[object, ...] | None:
    """What decides how it stands and what is told of that; None: there is no model."""
    if bench.model is None:
        return None
    process = bench.profile.of_part(1).process
    decides = process.self_supporting_angle_deg, process.line_width_mm, process.place_mm, bench.profile.machine
    copies = (bench.copies, bench.cuts, bench.zones, bench.profile) if bench.copies > 1 else ()
    return bench.model, bench.rotation, bench.profile.search.pedestal_mm, *decides, copies


def pedestal_key(bench: Bench, standing: Standing | None) -> str:
    """What tells the pedestal from others: the page asks for its triangles by it; "": there is none."""
    if standing is None or not standing.pedestal or bench.model is None:
        return ""
    return sha256(repr((bench.model.key, bench.rotation, bench.profile.search.pedestal_mm)).encode()).hexdigest()[:16]


def resting_of(session: SessionBase, readiness: Readiness) -> Derived[tuple[Resting, ...]]:
    """The ways in which the model on the bench rests, ranked when its planes are made ready: a person waits for those more."""

    async def rank(bench: Bench) -> tuple[Resting, ...]:
        await readiness.wait()
        ranked: tuple[Resting, ...] = await session.quick.run("rank_resting", bench.model, session.bench.profile.of_all_parts)
        return ranked

    return Derived(session, lambda bench: bench.model, rank)
