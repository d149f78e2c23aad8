"""Sessions thread: the event loop of the sessions and of all that answers their pages. Prints have another one, that of the
program, so that an emergency stop waits for nothing that a bench has the processor do."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from threading import Event, Thread
from typing import Any, TypeVar

from starlette.types import ASGIApp, Receive, Scope, Send

T = TypeVar("T")


class SessionsThread:
    """Begins with its object; it does not keep the program from ending."""

    def __init__(self) -> None:
        ready = Event()
        self._loop: asyncio.AbstractEventLoop
        self._ended: asyncio.Event
        self._thread = Thread(target=asyncio.run, args=(self._live(ready),), name="sessions", daemon=True)
        self._thread.start()
        ready.wait()

    async def run(self, work: Coroutine[Any, Any, T]) -> T:
        """What work in that loop gives; to cancel the waiting cancels the work."""
        return await _in(self._loop, work)

    async def call(self, function: Callable[[], T]) -> T:
        """What a function gives when it is called in that loop: nothing there changes while it runs."""

        async def called() -> T:
            return function()

        return await self.run(called())

    def application(self, app: ASGIApp) -> ASGIApp:
        """An application that lives in that loop, for the server of another one."""

        async def answer(scope: Scope, receive: Receive, send: Send) -> None:
            server = asyncio.get_running_loop()

            def from_there(call: Callable[..., Awaitable[T]]) -> Callable[..., Awaitable[T]]:
                async def called(*given: Any) -> T:
                    return await _in(server, call(*given))  # type: ignore[arg-type]

                return called

            await self.run(app(scope, from_there(receive), from_there(send)))  # type: ignore[arg-type]

        return answer

    async def end(self, within_s: float) -> None:
        """End it, without waiting for what hangs."""
        self._loop.call_soon_threadsafe(self._ended.set)
        await asyncio.to_thread(self._thread.join, within_s)

    async def _live(self, ready: Event) -> None:
        self._loop, self._ended = asyncio.get_running_loop(), asyncio.Event()
        ready.set()
        await self._ended.wait()


async def _in(loop: asyncio.AbstractEventLoop, work: Coroutine[Any, Any, T]) -> T:
    return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(work, loop))
