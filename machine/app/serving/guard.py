"""Guard: who is answered. Only pages of this server, under a name of this computer, by an address that holds the token.

Other users of this computer reach its ports too, so the address is secret. A page from elsewhere could reach the server by the
person's own browser: its Origin is refused, and a name of its own that points here (DNS rebinding) is no name of this computer.
"""

import re
import secrets
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")
HEADERS = {
    "cache-control": "no-store",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
}
SAFE = ("GET", "HEAD")
REFUSED_SOCKET = 1008  # policy violation, RFC 6455
FOREIGN = "this page is for this computer only\n"
LONG_NUMBER = re.compile(r"/\d{10}\d*(/|$)")  # nothing here has such a one
UNKNOWN = "this page is at the address that tiltprint has told, which is another one with each start\n"


def refusal(headers: Iterable[tuple[bytes, bytes]], method: str, path: str, token: str, port: int) -> tuple[int, str] | None:
    """Status and sentence for a request that gets no answer, None for one that does. method: WEBSOCKET for a websocket."""
    given = [(name.lower(), value.decode("latin-1")) for name, value in headers]
    hosts, origins = ([value for name, value in given if name == wanted] for wanted in (b"host", b"origin"))
    own = [f"{name}:{port}" for name in NAMES]
    if len(hosts) != 1 or hosts[0].lower() not in own:
        return 403, FOREIGN
    if (origins or method not in SAFE) and origins != [f"http://{hosts[0].lower()}"]:
        return 403, FOREIGN
    first = path.removeprefix("/").partition("/")[0]
    if not secrets.compare_digest(first.encode(), token.encode()) or LONG_NUMBER.search(path):
        return 404, UNKNOWN
    return None


class Guard:
    """An ASGI application that lets through to another one what may pass, with headers that keep its answers to its pages."""

    def __init__(self, app: "ASGIApp", token: str, port: int) -> None:
        self._app, self._token, self._port = app, token, port

    async def __call__(self, scope: "Scope", receive: "Receive", send: "Send") -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        method = "WEBSOCKET" if scope["type"] == "websocket" else scope["method"]
        refused = refusal(scope["headers"], method, scope["path"], self._token, self._port)
        if refused is None:
            await self._app(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": REFUSED_SOCKET})
        else:
            status, sentence = refused
            start = {
                "type": "http.response.start",
                "status": status,
                "headers": [(b"content-type", b"text/plain; charset=utf-8")],
            }
            await _with_headers(send)(start)
            await send({"type": "http.response.body", "body": sentence.encode()})


def _with_headers(send: "Send") -> "Send":
    async def wrapped(message: "Message") -> None:
        if message["type"] == "http.response.start":
            own = [(name.encode(), value.encode()) for name, value in HEADERS.items()]
            message = {**message, "headers": [*message.get("headers", ()), *own]}
        await send(message)

    return wrapped
