"""Pieces: the parts on the bench as bodies of their own for the page, cut once for all that ask."""

import asyncio
from pathlib import Path

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.session.desk import Desk
from profiles.errors import PlanError


class Pieces:
    """The last ones that were asked for."""

    def __init__(self, desk: Desk) -> None:
        self._desk, self._one = desk, asyncio.Lock()
        self._drawn: tuple[Bench, Path] | None = None

    async def file(self) -> Path:
        """Those of what lies on the bench, as `work.pieces` packs them. Raises PlanError where there are none."""
        bench = self._desk.bench
        if bench.model is None or bench.cuts is None:
            raise PlanError("there are no parts to look at yet: find them first")
        async with self._one:
            if self._drawn is None or self._drawn[0].shaped != bench.shaped:
                out = self._desk.new_file()
                await self._desk.quick.run("draw_pieces", bench, out)
                if self._drawn is not None:
                    self._drawn[1].unlink(missing_ok=True)
                self._drawn = bench, out
            return self._drawn[1]
