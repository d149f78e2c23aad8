"""The processes that the workbench starts: none is left to the interpreter when the event loop ends, whenever that is."""

import asyncio
import os
import subprocess
import sys

from machine.app.workbench.work.processes import end_process, hear_the_ends, start_process
from tests.machine.workbench import is_there

SLEEPS = (sys.executable, "-c", "print(__import__('os').getpid(), flush=True); __import__('time').sleep(60)")


def test_a_process_that_is_killed_and_forgotten_is_heard_to_its_end() -> None:
    pid, closed = asyncio.run(killed())
    assert closed
    assert not is_there(pid)


def test_a_process_that_nobody_wants_any_more_when_it_has_started_is_ended() -> None:
    assert asyncio.run(cancelled()) == []


async def killed() -> tuple[int, bool]:
    """The number of a process, and whether its pipes are closed when the ends have been heard."""
    process = await start_process(SLEEPS)
    transport = process._transport  # type: ignore[attr-defined]
    end_process(process)
    await hear_the_ends(30.0)
    return process.pid, transport.is_closing()


async def cancelled() -> list[int]:
    """The children that are left when a start is cancelled in every one of its first moments."""
    before = _children()
    for moment in range(8):
        starting = asyncio.create_task(start_process(SLEEPS))
        for _ in range(moment):
            await asyncio.sleep(0)
        starting.cancel()
        await asyncio.wait([starting])
    await hear_the_ends(30.0)
    return sorted(_children() - before)


def _children() -> set[int]:
    """The processes that this one has started and that are still there."""
    listed = subprocess.run(["ps", "-eo", "pid,ppid"], capture_output=True, text=True, check=True).stdout.split()[2:]
    return {
        int(pid)
        for pid, parent in zip(listed[::2], listed[1::2], strict=True)
        if int(parent) == os.getpid() and is_there(int(pid))
    }
