"""Live: the page and the state of a running print, served to this computer alone while the print lasts.

Nothing can be ordered through it. The address holds a token, for other users of this computer reach its ports too. Only requests
for the local host by name are answered, or a page from elsewhere could try by letting its own name point here (DNS rebinding).
"""

import json
import os
import secrets
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Event, Thread
from typing import Any

from machine.link.progress import Progress
from profiles.errors import OutputError

HOST = "127.0.0.1"
NAMES = {HOST, "localhost"}
IDLE_S = 10.0  # a connection that says nothing is let go
LAST_WORD_S = 2.0  # a page that is open asks twice in this time, so it sees how the print ended
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
    heat = progress.temperature
    return {
        "state": state or progress.state,
        "line": progress.file_line,
        "acknowledged": progress.acknowledged,
        "total": progress.total,
        "share": progress.share,
        "elapsed_s": progress.elapsed_s,
        "left_s": progress.left_s,
        "part": progress.part,
        "layer": progress.layer,
        "nozzle_c": heat.nozzle_c,
        "nozzle_target_c": heat.nozzle_target_c,
        "bed_c": heat.bed_c,
        "bed_target_c": heat.bed_target_c,
        "heat_is_old": bool(state) or progress.heat_is_old,
        "message": progress.message,
    }


class Watched:
    """A running print as it is told to those who watch. follow() from the thread that prints, state() from any."""

    def __init__(self, page: bytes) -> None:
        self.page = page
        self.address = ""
        self.place = f"/{secrets.token_urlsafe(16)}/"
        self._progress: Progress | None = None
        self._ended = ""
        self._asked, self._told = Event(), Event()

    def follow(self, progress: Progress) -> None:
        """Take note of where the print stands."""
        self._progress = progress

    def state(self) -> bytes:
        """The state as JSON."""
        self._asked.set()
        if self._ended:
            self._told.set()
        return json.dumps(state_of(self._progress, self._ended)).encode()

    def end(self, state: str) -> None:
        """Say once how the print ended, and wait a moment for those who have asked before to hear it."""
        self._ended = self._ended or state
        if self._asked.is_set():
            self._told.wait(LAST_WORD_S)


@contextmanager
def serve(page: bytes, port: int = 0) -> Iterator[Watched]:
    """Serve the page on a port of this computer, 0: any free one, until the block ends. Raises OutputError for a port in use."""
    watched = Watched(page)
    try:
        server = _Server((HOST, port), _handler(watched))
    except OSError as error:
        raise OutputError(f"--watch-port {port} cannot be used: {(error.strerror or str(error)).lower()}") from None
    watched.address = f"http://{HOST}:{server.server_port}{watched.place}"
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True)
    thread.start()
    try:
        yield watched
    except BaseException:
        watched.end("stopped")
        raise
    else:
        watched.end("done")
    finally:
        server.shutdown()
        server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    allow_reuse_address = os.name == "posix"  # Windows would let a second program listen at the port

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Who asked has gone: nothing to tell. Anything else is told as the library does."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


def _handler(watched: Watched) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        """Two paths, one method."""

        timeout = IDLE_S
        server_version, sys_version = "tiltprint", ""

        def do_GET(self) -> None:
            if self.headers.get("Host", "").rpartition(":")[0] not in NAMES and self.headers.get("Host") not in NAMES:
                self._answer(HTTPStatus.FORBIDDEN, "text/plain", b"this page is for this computer only\n")
            elif secrets.compare_digest(self.path.encode(), watched.place.encode()):
                self._answer(HTTPStatus.OK, "text/html; charset=utf-8", watched.page)
            elif secrets.compare_digest(self.path.encode(), f"{watched.place}state".encode()):
                self._answer(HTTPStatus.OK, "application/json", watched.state())
            else:
                self._answer(HTTPStatus.NOT_FOUND, "text/plain", b"this page is at the address that the print has told\n")

        def _answer(self, status: HTTPStatus, kind: str, content: bytes) -> None:
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            for name, value in HEADERS.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *words: Any) -> None:
            """Nothing: the terminal belongs to the print."""

    return Handler
