"""Prints line: a page's line to the prints: one of its own, so that a print's news, five a second, carry nothing else."""

import json
import secrets
from collections.abc import Awaitable, Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.websockets import WebSocket

from machine.app.crash import log_bug
from machine.app.requests import FORCE_GOES_ON, PrintRequest
from machine.app.workbench.bench.planes import is_number
from machine.app.workbench.printing.order import FollowOrder, Order, ResumeOrder
from machine.app.workbench.printing.ordering import order_of
from machine.app.workbench.printing.prints import Prints
from machine.app.workbench.session.session import Session
from machine.app.workbench.session.workbench import Workbench
from machine.app.workbench.web.line import parsed, receive, refuse_closed, send, until_either_ends
from machine.network.address import is_server_address, parse_server_address
from profiles.errors import JournalError, PrinterError, UserError

MOST_COMMAND = 10_000  # characters
LONGEST_PORT = 300


def prints_line(prints: Prints, workbench: Workbench) -> Callable[[WebSocket], Awaitable[None]]:
    """What answers the websocket of a page of a session: state out, commands in. `?page=` names the page, so that a line that
    comes back is known.

    Each line has a task of its own that sends the newest state: one that reads nothing holds up itself alone. The session lives
    in another event loop: of it only what lies there finished is read.
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
                await until_either_ends(_tell(prints, socket), _hear(prints, session, socket, page))
            except ExceptionGroup as bugs:
                log_bug(bugs.exceptions[0], ())

    return talk


def print_log(prints: Prints) -> Callable[[Request], Awaitable[Response]]:
    """What answers a request for the log of a print, as far as it is written."""

    async def answer(request: Request) -> Response:
        for each in prints.prints:
            log = each.state["log"]
            if each.number == request.path_params["print"] and log and Path(log).is_file():
                return FileResponse(log, media_type="text/plain")
        return Response("there is no log of this print\n", 404)

    return answer


async def _tell(prints: Prints, socket: WebSocket) -> None:
    while True:
        seen = prints.version
        await send(socket, _text(prints, seen))
        await prints.changed(seen)


@lru_cache(maxsize=1)
def _text(prints: Prints, version: int) -> str:
    """The state as all pages get it: put into words once a version."""
    return json.dumps(prints.snapshot())


async def _hear(prints: Prints, session: Session, socket: WebSocket, page: str) -> None:
    while True:
        text = await receive(socket)
        try:
            asked = parsed(text, MOST_COMMAND)
            prints.command(page, asked, lambda given: _order(session, given))
        except UserError as error:
            await send(socket, json.dumps({"problem": str(error), "forcible": FORCE_GOES_ON in str(error)}))
        except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the prints go on
            log = log_bug(error, ())
            told = f"a bug in tiltprint: {type(error).__name__}: {error}; the details are in {log}"
            await send(socket, json.dumps({"problem": told}))


def _order(session: Session, asked: dict[str, Any]) -> Order:
    """What a page wants: what lies on its bench printed, the rest of a print that was cut off, or to follow what a server prints.

    Raises UserError.
    """
    if asked.get("do") == "follow":
        return FollowOrder(_server(asked))
    if asked.get("do") != "go_on":
        sends_only = asked.get("send_only") is True
        printing = _server(asked) if sends_only else _printing(asked)
        return order_of(session, printing, asked.get("force") is True, not sends_only)
    journal, machine = (str(asked.get(each) or "").strip() for each in ("journal", "machine"))
    if not journal:
        raise JournalError("no journal is chosen: choose the print that is to go on, or name the journal's file")
    for name in (journal, machine):
        if "\0" in name:
            raise JournalError(f"{name!r:.100} is no file's name: it has a character that no name has")
    return ResumeOrder(Path(journal).absolute(), _printing(asked), machine)


def _server(asked: dict[str, Any]) -> PrintRequest:
    printing = _printing(asked)
    parse_server_address(printing.port)
    return printing


def _printing(asked: dict[str, Any]) -> PrintRequest:
    """Where to print, as the options --port, --baud and --sim-speed say. Raises PrinterError."""
    port = str(asked.get("port") or "").strip()
    if not port or len(port) > LONGEST_PORT:
        raise PrinterError("no printer is chosen: choose a port, or sim for the simulated one")
    if is_server_address(port):
        parse_server_address(port)  # here, for all pages are told of a print's port: a password in it must not come so far
    baud, speed = asked.get("baud", 115200), asked.get("sim_speed", 0.0)
    if not is_number(baud) or not is_number(speed) or baud != int(baud):
        raise PrinterError(f"baud {str(baud)[:40]}, sim_speed {str(speed)[:40]}: numbers are expected, a whole one for the rate")
    return PrintRequest(port, int(baud), float(speed))
