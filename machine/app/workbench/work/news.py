"""News: a version that grows with every change, and whoever waits for a newer one."""

import asyncio


class News:
    """All from the event loop."""

    def __init__(self) -> None:
        self.version = 0
        self._changed = asyncio.Event()

    def tell(self) -> None:
        """Let the pages know that something has changed."""
        self.version += 1
        self._changed.set()
        self._changed = asyncio.Event()

    async def changed(self, seen: int) -> None:
        """Return when there is something newer than the version that was seen."""
        while self.version == seen:
            await self._changed.wait()
