"""Watch page: serves the page and the state of a running print to this computer while the print lasts.

Its buttons give the same commands as keys at the terminal. `machine.view.serving.guard` decides which requests are answered.
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

LAST_WORD_S = 2.0  # an open page polls twice in this time, so it sees how the print ended
GRACE_S = 1  # for pending answers when the print ends
FRAMED = {"Content-Security-Policy": "frame-ancestors 'none'"}
ORDERS = {"pause": Command.PAUSE, "resume": Command.RESUME, "cancel": Command.CANCEL, "emergency": Command.EMERGENCY_STOP}


class Watched:
    """State of a running print for its page. The printing thread calls follow(); any thread may call state()."""

    def __init__(self, page: bytes = b"") -> None:
        self.page = page
        self.address = ""
        self.token = secrets.token_urlsafe(16)
        self._status = PrintStatus(PrintState.CHECKING)
        self._ended: PrintState | None = None
        self._asked, self._end_reported = Event(), Event()

    def follow(self, status: PrintStatus) -> None:
        self._status = status

    def state(self) -> bytes:
        self._asked.set()
        if self._ended:
            self._end_reported.set()
        status = replace(self._status, state=self._ended) if self._ended else self._status
        return json.dumps(status.json() | {"told": _in_words(status)}).encode()

    def end(self, state: PrintState) -> None:
        """Set the final state once, and wait briefly until a page that has polled before receives it."""
        self._ended = self._ended or state
        if self._asked.is_set():
            self._end_reported.wait(LAST_WORD_S)


def _in_words(status: PrintStatus) -> str:
    """How the print is, in one line."""
    heat = status.temperature
    temperatures = [
        f"{name} {now_c:.0f}" + (f" of {target_c:.0f}" if target_c else "") + " °C"
        for name, now_c, target_c in (("nozzle", heat.nozzle_c, heat.nozzle_target_c), ("bed", heat.bed_c, heat.bed_target_c))
        if now_c is not None
    ]
    old = ["as last known"] if status.heat_is_old and temperatures else []
    return status.in_words(f"line {status.file_line}" if status.file_line else "", *temperatures, *old)


@contextmanager
def serve_watch_page(loaded: LoadedProgram, port: int | None, control: Control, browser: bool = True) -> Iterator[Watched]:
    """Serve the page of a print on a local port, 0: any free one, None: no page. control: receives the commands of the page's
    buttons; browser: open the page. Raises OutputError."""
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
    """Serve the page on a local port, 0: any free one, until the block ends. control: receives its commands, None: it has none.
    Raises OutputError for a port in use."""
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
    """Routes of the page, the state and the commands, below the token."""
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
