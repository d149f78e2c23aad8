"""Heard: what a process says, in an event loop. A thread waits for it, which holds up the end of neither loop nor program."""

import asyncio
from collections.abc import AsyncGenerator, Iterator
from contextlib import suppress
from threading import Thread
from typing import TypeVar

Value = TypeVar("Value")


async def heard(values: Iterator[Value]) -> AsyncGenerator[Value, None]:
    """Values that have to be waited for, and the error that ends them; who leaves before makes sure that they end."""
    loop, coming = asyncio.get_running_loop(), asyncio.Queue[tuple[Value] | Exception | None]()

    def hear() -> None:
        with suppress(RuntimeError):  # the loop is closed
            try:
                for value in values:
                    loop.call_soon_threadsafe(coming.put_nowait, (value,))
            except Exception as error:  # noqa: BLE001 - it is raised in the loop
                loop.call_soon_threadsafe(coming.put_nowait, error)
            else:
                loop.call_soon_threadsafe(coming.put_nowait, None)

    Thread(target=hear, name="heard", daemon=True).start()
    while (came := await coming.get()) is not None:
        if isinstance(came, Exception):
            raise came
        yield came[0]
