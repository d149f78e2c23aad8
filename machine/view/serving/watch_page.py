"""Watch page: the page and the state of a running print, served to this computer alone while the print lasts.

Its buttons ask of the print what keys in the terminal do. Who is answered: see `machine.view.serving.guard`.
"""

import json
import secrets
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from threading import Event, Thread
from typing import TYPE_CHECKING

from machine.link.pending_commands import Command, Control
from machine.link.print_state import PrintState, PrintStatus
from machine.notices import say
from machine.pipeline.programs import LoadedProgram
from machine.view.page import print_page
from machine.view.serving.browser import lead_browser
from machine.view.serving.guard import HOST, UNKNOWN, guarded
from profiles.errors import OutputError, reason
from profiles.messages import option

if TYPE_CHECKING:
    from starlette.types import ASGIApp

LAST_WORD_S = 2.0  # a page that is open asks twice in this time, so it sees how the print ended
GRACE_S = 1  # for answers under way when the print ends
FRAMED = {"Content-Security-Policy": "frame-ancestors 'none'"}
ORDERS = {
    "pause": Command.PAUSE,
    "resume": Command.RESUME,
    "cancel": Command.CANCEL,
    "emergency": Command.EMERGENCY_STOP,
}


class Watched:
    """A running print as watchers see it. follow() is called from the printing thread, state() from any."""

    def __init__(self, page: bytes = b"") -> None:
        self.page = page
        self.address = ""
        self.token = secrets.token_urlsafe(16)
        self._status: PrintStatus | None = None
        self._ended: PrintState | None = None
        self._asked, self._end_reported = Event(), Event()

    def follow(self, status: PrintStatus) -> None:
        """Take note of where the print stands."""
        self._status = status

    def state(self) -> bytes:
        """The state as JSON."""
        self._asked.set()
        if self._ended:
            self._end_reported.set()
        status, ended = self._status, self._ended
        if status is None:
            return json.dumps({"state": ended or "waiting"}).encode()
        return json.dumps((replace(status, state=ended) if ended else status).json()).encode()

    def end(self, state: PrintState) -> None:
        """Say once how the print ended, and wait a moment for those who have asked before to hear it."""
        self._ended = self._ended or state
        if self._asked.is_set():
            self._end_reported.wait(LAST_WORD_S)


@contextmanager
def serve_watch_page(loaded: LoadedProgram, port: int | None, control: Control, browser: bool = True) -> Iterator[Watched]:
    """Serve the page of a print on a port of this computer, 0: on any free one; None: nobody watches. control: of the print,
    asked by the page's buttons; browser: open it there. Raises OutputError."""
    if port is None:
        yield Watched()
        return
    page = print_page(loaded.name, loaded.program, loaded.profile, live=True)
    with serve(page, port, control) as watched, ExitStack() as until_end:
        say(f"watch the print at {watched.address}")
        if browser:
            lead_browser(watched.address, until_end)
        yield watched


@contextmanager
def serve(page: bytes, port: int = 0, control: Control | None = None) -> Iterator[Watched]:
    """Serve the page on a port of this computer, 0: any free one, until the block ends. control: of the print; None: nothing can
    be asked of it. Raises OutputError for a port in use."""
    from uvicorn import Config, Server

    watched = Watched(page)
    try:
        own = socket.create_server((HOST, port))
    except OSError as error:
        raise OutputError(f"{option('watch-port', port)} cannot be used: {reason(error)}") from None
    there = own.getsockname()[1]
    watched.address = f"http://{HOST}:{there}/{watched.token}/"
    app = guarded(_application(watched, control), watched.token, there)
    config = Config(app, log_config=None, access_log=False, lifespan="off", ws="none", timeout_graceful_shutdown=GRACE_S)
    server = Server(config)
    thread = Thread(target=server.run, args=([own],), daemon=True)
    thread.start()
    try:
        yield watched
    except BaseException:
        watched.end(PrintState.FAILED)
        raise
    else:
        watched.end(PrintState.DONE)
    finally:
        server.should_exit = True
        thread.join()
        own.close()


def _application(watched: Watched, control: Control | None) -> "ASGIApp":
    """The page, the state and what may be asked of the print, below the token."""
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import Route

    async def page(request: Request) -> Response:
        return Response(watched.page, 200, FRAMED, "text/html")

    async def state(request: Request) -> Response:
        return Response(watched.state(), 200, FRAMED, "application/json")

    async def order(request: Request) -> Response:
        command = ORDERS.get(request.path_params["name"])
        if command is None or control is None:
            return Response(UNKNOWN, 404)
        control.ask(command)
        return Response(status_code=204)

    asked = [] if control is None else [Route("/{token}/order/{name}", order, methods=["POST"])]
    app = Starlette(routes=[Route("/{token}/", page), Route("/{token}/state", state), *asked])
    app.router.redirect_slashes = False
    return app
