"""The event loop of the sessions and that of the prints: what hangs in the one holds up nothing in the other."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from starlette.types import Receive, Scope, Send

from machine.app.requests import Given, PrintRequest
from machine.app.workbench.printing.order import PrintOrder
from machine.app.workbench.printing.prints import Prints
from machine.app.workbench.printing.running_print import RunningPrint
from machine.app.workbench.session.session import Session
from machine.app.workbench.session.workbench import Workbench
from machine.app.workbench.web.server import Served, application
from machine.app.workbench.web.sessions_thread import SessionsThread
from machine.app.workbench.web.uploads import Uploads
from profiles.profile import load

PORT, TOKEN = 8000, "token"
PROFILE = load()


@pytest.fixture
def sessions() -> Iterator[SessionsThread]:
    thread = SessionsThread()
    yield thread
    asyncio.run(thread.end(30.0))


def test_an_emergency_stop_is_given_while_the_sessions_hang(sessions: SessionsThread, monkeypatch: pytest.MonkeyPatch) -> None:
    given, hangs = Event(), Event()
    monkeypatch.setattr(RunningPrint, "stop_at_once", lambda job: given.set())
    workbench, prints = Workbench(lambda pools: Session(PROFILE, Given(), pools)), Prints()
    order = PrintOrder("a", Path("a.gcode"), PROFILE, PrintRequest("sim"))
    prints.prints.append(RunningPrint(1, order, "", prints.notify))

    async def hang() -> bool:
        hangs.set()
        return given.wait(60.0)

    async def begin() -> None:
        workbench.sessions[1] = Session(PROFILE, Given(), workbench.pools)

    async def run() -> bool:
        said: asyncio.Queue[Any] = asyncio.Queue()
        messages: asyncio.Queue[Any] = asyncio.Queue()
        await sessions.run(begin())
        app = application(Served(workbench, sessions, prints, Uploads(1)), TOKEN, PORT)
        line = asyncio.create_task(app(scope(f"/{TOKEN}/1/prints"), said.get, messages.put))  # type: ignore[arg-type]
        said.put_nowait({"type": "websocket.connect"})
        while (await messages.get())["type"] != "websocket.send":
            pass
        hanging = asyncio.create_task(sessions.run(hang()))
        while not hangs.is_set():
            await asyncio.sleep(0.01)
        said.put_nowait({"type": "websocket.receive", "text": '{"do": "emergency"}'})
        stopped = await hanging
        said.put_nowait({"type": "websocket.disconnect", "code": 1001})
        await line
        await sessions.run(_close(workbench))
        return stopped

    assert asyncio.run(run())


def scope(path: str) -> dict[str, Any]:
    """A websocket that a page of this server asks for."""
    host = f"127.0.0.1:{PORT}"
    headers = [(b"host", host.encode()), (b"origin", f"http://{host}".encode())]
    return {"type": "websocket", "path": path, "headers": headers, "query_string": b"page=mine"}


async def _close(workbench: Workbench) -> None:
    await workbench.close_all()


def test_an_application_hears_and_answers_from_the_other_loop_and_is_cancelled_with_its_request(sessions: SessionsThread) -> None:
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

        answering = asyncio.create_task(sessions.application(app)({"type": "http"}, receive, said.put))
        answer = await said.get()
        answering.cancel()
        await asyncio.wait([answering])
        return answer["body"], asyncio.get_running_loop()

    body, here = asyncio.run(run())
    assert ended.wait(60.0)
    assert (body, loops) == ("asked", [sessions._loop, here])
