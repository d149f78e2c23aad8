"""Observable: a version that grows with every change, and whoever waits for a newer one."""

import asyncio
from collections.abc import Callable


class Observable:
    """All from the event loop. listeners: called with every change, before whoever waits for it; closed: no more come."""

    def __init__(self) -> None:
        self.version, self.closed = 0, False
        self.listeners: list[Callable[[], None]] = []
        self._changed = asyncio.Event()

    def notify(self) -> None:
        """Let the pages know that something has changed."""
        self.version += 1
        self._changed.set()
        self._changed = asyncio.Event()
        for listen in self.listeners:
            listen()

    async def changed(self, seen: int) -> None:
        """Return when there is something newer than the version that was seen."""
        while self.version == seen:
            await self._changed.wait()
