"""The event loops of the benches and of the prints: a blocked one does not delay the other."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from threading import Event
from types import SimpleNamespace
from typing import Any

import pytest
from starlette.types import Receive, Scope, Send

from machine.dryrun.findings import known_findings
from machine.pipeline.requests import Given
from machine.printing.destination import Simulated
from machine.printing.job import PrintJob
from machine.workbench.printing.at_page import Slices
from machine.workbench.printing.commands import PageOfPrints, obey
from machine.workbench.printing.prints import Prints
from machine.workbench.printing.running_print import RunningPrint
from machine.workbench.session.base import in_loop
from machine.workbench.session.long_work import Slicing
from machine.workbench.session.session import Session, Workbench
from machine.workbench.web.serve import event_loop
from machine.workbench.web.server import Served, answered_in, application
from machine.workbench.web.uploads import Uploads
from profiles.profile import load

Loop = asyncio.AbstractEventLoop
PORT, TOKEN = 8000, "token"
PROFILE = load()


@pytest.fixture
def benches() -> Iterator[Loop]:
    with event_loop("benches") as loop:
        yield loop


def test_an_emergency_stop_is_given_while_the_sessions_hang(benches: Loop, monkeypatch: pytest.MonkeyPatch) -> None:
    given, hangs = Event(), Event()
    monkeypatch.setattr(RunningPrint, "stop_at_once", lambda job: given.set())
    workbench, prints = Workbench(lambda pools: Session(PROFILE, Given(), pools)), Prints()
    prints.prints.append(RunningPrint(1, PrintJob(Simulated()), "", prints.notify))

    async def hang() -> bool:
        hangs.set()
        return given.wait(60.0)

    async def begin() -> None:
        workbench.sessions[1] = Session(PROFILE, Given(), workbench.pools)

    async def run() -> bool:
        said: asyncio.Queue[Any] = asyncio.Queue()
        messages: asyncio.Queue[Any] = asyncio.Queue()
        await in_loop(benches, begin())
        app = application(Served(workbench, benches, prints, Uploads(1)), TOKEN, PORT)
        line = asyncio.create_task(app(scope(f"/{TOKEN}/1/prints"), said.get, messages.put))  # type: ignore[arg-type]
        said.put_nowait({"type": "websocket.connect"})
        while (await messages.get())["type"] != "websocket.send":
            pass
        hanging = asyncio.create_task(in_loop(benches, hang()))
        while not hangs.is_set():
            await asyncio.sleep(0.01)
        for command in ('{"do": "check", "port": "sim"}', '{"do": "emergency"}'):  # the first waits for the bench, which hangs
            said.put_nowait({"type": "websocket.receive", "text": command})
        stopped = await hanging
        said.put_nowait({"type": "websocket.disconnect", "code": 1001})
        await line
        await in_loop(benches, _close(workbench))
        return stopped

    assert asyncio.run(run())


class TakenAway(Slicing):
    """Slices that the bench's loop removes between two reads of them, if it gets a turn there."""

    def __init__(self, loop: asyncio.AbstractEventLoop, slices: Any) -> None:
        self.done = slices
        self._loop, self._gone = loop, Event()

    def lacking(self) -> str:
        self._loop.call_soon_threadsafe(self._take_away)
        self._gone.wait(0.2)
        return ""

    def _take_away(self) -> None:
        self.done = None
        self._gone.set()


def test_an_order_is_of_one_moment_of_its_bench(benches: Loop, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[PrintJob] = []
    monkeypatch.setattr(Prints, "begin", lambda prints, page, job: begun.append(job))
    bench = SimpleNamespace(model=SimpleNamespace(name="box.stl"))
    sliced = SimpleNamespace(known=known_findings([], PROFILE, []), errors=(), gcode=Path("a.gcode"), key="key")
    slicing = TakenAway(benches, SimpleNamespace(bench=bench, sliced=sliced))
    session: Any = SimpleNamespace(closed=False, bench=bench, slicing=slicing)

    async def run() -> None:
        work = obey(PageOfPrints("mine", session, Prints(), benches), {"do": "check", "port": "sim"})
        assert work is not None
        await work

    asyncio.run(run())
    assert [job.load.gcode for job in begun if isinstance(job.load, Slices)] == [Path("a.gcode")]


def scope(path: str) -> dict[str, Any]:
    """A websocket requested by a page of this server."""
    host = f"127.0.0.1:{PORT}"
    headers = [(b"host", host.encode()), (b"origin", f"http://{host}".encode())]
    return {"type": "websocket", "path": path, "headers": headers, "query_string": b"page=mine"}


async def _close(workbench: Workbench) -> None:
    await workbench.close_all()


def test_an_application_hears_and_answers_from_the_other_loop_and_is_cancelled_with_its_request(
    benches: Loop,
) -> None:
    loops: list[Any] = []
    ended = Event()

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        loops.append(asyncio.get_running_loop())
        try:
            await send({"type": "answer", "body": (await receive())["body"]})
            await asyncio.Event().wait()
        finally:
            ended.set()

    async def run() -> Any:
        said: asyncio.Queue[Any] = asyncio.Queue()

        async def receive() -> Any:
            loops.append(asyncio.get_running_loop())
            return {"body": "asked"}

        answering = asyncio.create_task(answered_in(benches, app)({"type": "http"}, receive, said.put))
        answer = await said.get()
        answering.cancel()
        await asyncio.wait([answering])
        return answer["body"], asyncio.get_running_loop()

    body, here = asyncio.run(run())
    assert ended.wait(60.0)
    assert (body, loops) == ("asked", [benches, here])
