"""A page's websocket to the prints, separate because they change five times a second."""

import asyncio
import json
import secrets
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.websockets import WebSocket

from machine.crash import bug_in_words, log_bug
from machine.printing.servers.http import fetch_picture
from machine.workbench.access.limits import DEVICE, check_print_command
from machine.workbench.bench.page_words import page_words
from machine.workbench.printing.commands import PageOfPrints, Work, obey
from machine.workbench.printing.prints import Prints
from machine.workbench.session.session import Workbench
from machine.workbench.web.line import parsed, receive, refuse_closed, send, tell, until_either_ends
from profiles.errors import PrinterError, ServerError, UserError

MOST_COMMAND = 10_000  # characters


def prints_line(
    prints: Prints, workbench: Workbench, benches: asyncio.AbstractEventLoop
) -> Callable[[WebSocket], Awaitable[None]]:
    """Handler of a page's websocket: state out, commands in. `?page=` names the page, so that it is recognised when it
    reconnects.

    Each websocket has a task that sends the newest state, so a page that does not read only blocks itself. The session lives in
    another event loop and is read only there, except for its existence.
    """

    async def talk(socket: WebSocket) -> None:
        session = workbench.sessions.get(socket.path_params["session"])
        if session is None:
            await refuse_closed(socket)
            return
        page = socket.query_params.get("page", "")[:40] or secrets.token_urlsafe(9)
        await socket.accept()
        with prints.page(page):
            try:
                hearing = _hear(socket, PageOfPrints(page, session, prints, benches))
                await until_either_ends(tell(prints, prints.snapshot, socket), hearing)
            except ExceptionGroup as bugs:
                log_bug(bugs.exceptions[0], ())

    return talk


def print_log(prints: Prints) -> Callable[[Request], Awaitable[Response]]:
    """Handler of requests for the log of a print, as far as it is written."""

    async def answer(request: Request) -> Response:
        for job in prints.prints:
            log = job.state.log
            if job.number == request.path_params["print"] and log and Path(log).is_file():
                return FileResponse(log, media_type="text/plain")
        return Response("there is no log of this print\n", 404)

    return answer


def print_webcam(prints: Prints) -> Callable[[Request], Awaitable[Response]]:
    """Handler of requests for a camera picture of a print, because the page may load nothing from other servers."""

    async def answer(request: Request) -> Response:
        for job in prints.prints:
            if job.number == request.path_params["print"] and job.state.webcam:
                try:
                    picture, kind = await asyncio.to_thread(fetch_picture, job.state.webcam)
                except ServerError as error:
                    return Response(f"{error!s}\n", 502)
                return Response(picture, media_type=kind, headers={"cache-control": "no-store"})
        return Response("there is no camera at this print\n", 404)

    return answer


async def _hear(socket: WebSocket, page: PageOfPrints) -> None:
    """Receive commands. One that waits for a busy bench does not block later ones, so an emergency stop is executed at once."""
    async with asyncio.TaskGroup() as tasks:
        ordering: asyncio.Task[None] | None = None
        while True:
            text = await receive(socket)
            asked = dict[str, Any]()
            async with _refusals(socket):
                asked |= parsed(text, MOST_COMMAND)
                if DEVICE in socket.scope:
                    check_print_command(asked, page.prints.ports_known, page.prints.journals_known)
                with_bench = obey(page, asked)
                if with_bench is not None and ordering is not None and not ordering.done():
                    with_bench.close()
                    raise PrinterError("the previous command of this page still waits for its bench: wait for that first")
                if with_bench is not None:
                    ordering = tasks.create_task(_order(socket, with_bench))


async def _order(socket: WebSocket, with_bench: Work) -> None:
    async with _refusals(socket):
        await with_bench


@asynccontextmanager
async def _refusals(socket: WebSocket) -> AsyncIterator[None]:
    """Report errors of the block to the page."""
    try:
        yield
    except UserError as error:
        await send(socket, json.dumps({"problem": page_words(f"{error}"), "forcible": error.forcible}))
    except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the prints continue
        await send(socket, json.dumps({"problem": page_words(bug_in_words(error, ()))}))
