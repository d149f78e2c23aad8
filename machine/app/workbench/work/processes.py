"""Processes: those that the workbench starts, each leading a session of its own, so that Ctrl-C at the terminal reaches the
workbench alone, and one signal ends it with all that it has started."""

import asyncio
import os
import signal
from collections.abc import Callable
from contextlib import suppress
from typing import Any
from weakref import WeakKeyDictionary

Process = asyncio.subprocess.Process
Tell = Callable[[Any], None]  # what a task calls to say something to its bench meanwhile


class _Here:
    """Those of one event loop that start, and that have started: whoever has ended one need not hold it, its pipes are still
    open."""

    def __init__(self) -> None:
        self.starting: set[asyncio.Task[Process]] = set()
        self.started: set[Process] = set()


_of_loops: WeakKeyDictionary[asyncio.AbstractEventLoop, _Here] = WeakKeyDictionary()


def _here() -> _Here:
    return _of_loops.setdefault(asyncio.get_running_loop(), _Here())


async def start_process(command: tuple[str, ...]) -> Process:
    """A process that hears and answers through pipes. Whoever is cancelled while it starts need not end it."""
    starting, here = asyncio.create_task(_start(command)), _here()
    here.starting.add(starting)
    starting.add_done_callback(here.starting.discard)
    try:
        return await asyncio.shield(starting)
    except asyncio.CancelledError:
        starting.add_done_callback(lambda started: end_process(started.result()))
        raise


def end_process(process: Process | None) -> None:
    """Kill a process with all that it has started, if it still runs."""
    if process is None or process.returncode is not None:
        return
    with suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()


async def hear_the_ends(within_s: float) -> None:
    """Wait until all that this event loop has started are gone and their pipes closed, at most so long: a loop that closes before
    leaves them to the interpreter, whose complaint would be the program's last words."""
    with suppress(TimeoutError):
        async with asyncio.timeout(within_s):
            await asyncio.gather(*_here().starting, return_exceptions=True)
            await asyncio.gather(*(_hear_the_end(process) for process in _here().started))


async def _start(command: tuple[str, ...]) -> Process:
    pipe, nowhere = asyncio.subprocess.PIPE, asyncio.subprocess.DEVNULL
    process = await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe, stderr=nowhere, start_new_session=True)
    started = _here().started
    started.difference_update([process for process in started if _is_heard(process)])
    started.add(process)
    return process


async def _hear_the_end(process: Process) -> None:
    assert process.stdout is not None
    while not _is_heard(process):
        with suppress(RuntimeError):  # somebody listens still, who is cancelled or will hear the end, too
            await process.stdout.read()
        await asyncio.sleep(0.01)


def _is_heard(process: Process) -> bool:
    """Whether it has ended and its pipe is read to the end."""
    return process.returncode is not None and process.stdout is not None and process.stdout.at_eof()
