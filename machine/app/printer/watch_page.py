"""Watch page: the page and the state of a running print, served to this computer alone while the print lasts.

Nothing can be ordered through it. The address holds a token, for other users of this computer reach its ports too. Only requests
for the local host by name are answered, or a page from elsewhere could try by letting its own name point here (DNS rebinding).
"""

import json
import secrets
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

from machine.app.pipeline.programs import LoadedProgram
from machine.app.terminal.progress import say
from machine.link.progress import Progress
from machine.view.page import print_page
from profiles.errors import OutputError, reason

if TYPE_CHECKING:
    from starlette.types import ASGIApp

HOST = "127.0.0.1"
LAST_WORD_S = 2.0  # a page that is open asks twice in this time, so it sees how the print ended
GRACE_S = 1  # for answers under way when the print ends
TOLD = ("acknowledged", "total", "share", "elapsed_s", "left_s", "part", "layer", "message")
UNKNOWN = "this page is at the address that the print has told\n"
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "frame-ancestors 'none'",
}


def state_of(progress: Progress | None, state: str = "") -> dict[str, Any]:
    """What the page asks for; progress: None before the first. state: how it ended, else what the progress says."""
    if progress is None:
        return {"state": state or "waiting"}
    return {
        "state": state or progress.state,
        "line": progress.file_line,
        **{key: getattr(progress, key) for key in TOLD},
        **asdict(progress.temperature),
        "heat_is_old": bool(state) or progress.heat_is_old,
    }


class Watched:
    """A running print as it is told to those who watch. follow() from the thread that prints, state() from any."""

    def __init__(self, page: bytes = b"") -> None:
        self.page = page
        self.address = ""
        self.token = secrets.token_urlsafe(16)
        self._progress: Progress | None = None
        self._ended = ""
        self._asked, self._end_reported = Event(), Event()

    def follow(self, progress: Progress) -> None:
        """Take note of where the print stands."""
        self._progress = progress

    def state(self) -> bytes:
        """The state as JSON."""
        self._asked.set()
        if self._ended:
            self._end_reported.set()
        return json.dumps(state_of(self._progress, self._ended)).encode()

    def end(self, state: str) -> None:
        """Say once how the print ended, and wait a moment for those who have asked before to hear it."""
        self._ended = self._ended or state
        if self._asked.is_set():
            self._end_reported.wait(LAST_WORD_S)


@contextmanager
def serve_watch_page(job: LoadedProgram, port: int | None) -> Iterator[Watched]:
    """Serve the page of a print on a port of this computer, 0: on any free one; None: nobody watches. Raises OutputError."""
    if port is None:
        yield Watched()
        return
    with serve(print_page(job.name, job.program, job.profile, live=True), port) as watched:
        say(f"watch the print at {watched.address}")
        yield watched


@contextmanager
def serve(page: bytes, port: int = 0) -> Iterator[Watched]:
    """Serve the page on a port of this computer, 0: any free one, until the block ends. Raises OutputError for a port in use."""
    from uvicorn import Config, Server

    watched = Watched(page)
    try:
        own = socket.create_server((HOST, port))
    except OSError as error:
        raise OutputError(f"--watch-port {port} cannot be used: {reason(error)}") from None
    watched.address = f"http://{HOST}:{own.getsockname()[1]}/{watched.token}/"
    config = Config(
        _application(watched), log_config=None, access_log=False, lifespan="off", ws="none", timeout_graceful_shutdown=GRACE_S
    )
    server = Server(config)
    thread = Thread(target=server.run, args=([own],), daemon=True)
    thread.start()
    try:
        yield watched
    except BaseException:
        watched.end("stopped")
        raise
    else:
        watched.end("done")
    finally:
        server.should_exit = True
        thread.join()
        own.close()


def _application(watched: Watched) -> "ASGIApp":
    """The page and the state below the token."""
    from starlette.applications import Starlette
    from starlette.middleware import Middleware
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.routing import Route

    async def unknown(request: Request, error: Exception) -> Response:
        return Response(UNKNOWN, 404, HEADERS)

    def route(path: str, content: Callable[[], bytes], media_type: str) -> Route:
        async def answer(request: Request) -> Response:
            if not secrets.compare_digest(request.path_params["token"].encode(), watched.token.encode()):
                return Response(UNKNOWN, 404, HEADERS)
            return Response(content(), 200, HEADERS, media_type)

        return Route("/{token}/" + path, answer)

    app = Starlette(
        routes=[route("", lambda: watched.page, "text/html"), route("state", watched.state, "application/json")],
        middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=[HOST, "localhost"])],
        exception_handlers={404: unknown},
    )
    app.router.redirect_slashes = False
    return app
