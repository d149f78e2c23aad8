"""Pieces: the parts on the bench as bodies of their own for the page, cut once for all that ask."""

import asyncio
from pathlib import Path

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.session.base import SessionBase


class Pieces:
    """The last ones that were asked for."""

    def __init__(self, session: SessionBase) -> None:
        self._session, self._one = session, asyncio.Lock()
        self._drawn: tuple[Bench, Path] | None = None

    async def file(self) -> Path:
        """Those of the model on the bench, as `work.pieces` packs them. Raises UserError where they cannot be cut."""
        bench = self._session.bench
        async with self._one:
            if self._drawn is None or self._drawn[0].shaped != bench.shaped:
                out = self._session.new_file()
                await self._session.quick.run("draw_pieces", bench, out)
                if self._drawn is not None:
                    self._drawn[1].unlink(missing_ok=True)
                self._drawn = bench, out
            return self._drawn[1]
