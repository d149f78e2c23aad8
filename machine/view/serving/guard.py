"""Guard: answers only requests from the server's own pages, to a name of this computer, at an address with the token.

Other users of this computer can reach its ports, so the address is secret. A page from elsewhere could reach the server through
the user's browser: its Origin is refused, and so is a host name of its own that resolves to this computer (DNS rebinding).
"""

import re
import secrets
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")
DEFAULT_PORTS = {"http": 80, "https": 443}
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
LONG_NUMBER = re.compile(r"/\d{17}\d*(/|$)")  # not in any path here: keys are 16 hexadecimal digits, sometimes all decimal
UNKNOWN = "open the address that tiltprint printed at its start: it changes each time\n"

Headers = Iterable[tuple[bytes, bytes]]


def values_of(headers: Headers, wanted: bytes) -> list[str]:
    """Values of all headers with a name (lower case)."""
    return [value.decode("latin-1") for name, value in headers if name.lower() == wanted]


def method_of(scope: "Scope") -> str:
    """The method of a request; WEBSOCKET for a websocket."""
    return "WEBSOCKET" if scope["type"] == "websocket" else scope["method"]


def own_hosts(names: Iterable[str], port: int, scheme: str = "http") -> tuple[str, ...]:
    """Allowed values of the Host header. Browsers leave out the default port of a scheme (RFC 9110, 4.2.3).

    >>> own_hosts(["localhost"], 8123), own_hosts(["localhost"], 80)
    (('localhost:8123',), ('localhost:80', 'localhost'))
    """
    names = tuple(names)
    return (*(f"{name}:{port}" for name in names), *(names if port == DEFAULT_PORTS[scheme] else ()))


def is_foreign(headers: Headers, method: str, own: Collection[str], scheme: str = "http") -> bool:
    """Whether a request has a host name other than the server's, or comes from another server's page.

    own: result of own_hosts(), lower case; scheme: of the server's pages.
    """
    headers = list(headers)
    hosts, origins = values_of(headers, b"host"), values_of(headers, b"origin")
    if len(hosts) != 1 or hosts[0].lower() not in own:
        return True
    origin = f"{scheme}://{hosts[0].lower().removesuffix(f':{DEFAULT_PORTS[scheme]}')}"  # Origin has no default port either
    return bool(origins or method not in SAFE) and origins != [origin]


def refusal(headers: Headers, method: str, path: str, token: str, port: int) -> tuple[int, str] | None:
    """Status and message for a refused request, None for a permitted one. method: WEBSOCKET for a websocket."""
    if is_foreign(headers, method, own_hosts(NAMES, port)):
        return 403, FOREIGN
    first = path.removeprefix("/").partition("/")[0]
    if not secrets.compare_digest(first.encode(), token.encode()) or LONG_NUMBER.search(path):
        return 404, UNKNOWN
    return None


def guarded(app: "ASGIApp", token: str, port: int) -> "ASGIApp":
    """Wrap an ASGI application: refuse foreign requests, and add security headers to its answers."""

    async def guard(scope: "Scope", receive: "Receive", send: "Send") -> None:
        if scope["type"] == "lifespan":
            await app(scope, receive, send)
            return
        refused = refusal(scope["headers"], method_of(scope), scope["path"], token, port)
        if refused is None:
            await app(scope, receive, with_headers(send))
        else:
            await refuse(scope, send, *refused)

    return guard


async def refuse(scope: "Scope", send: "Send", status: int, sentence: str) -> None:
    """Answer a request with a message; close a websocket before it is open."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": REFUSED_SOCKET})
        return
    start = {"type": "http.response.start", "status": status, "headers": [(b"content-type", b"text/plain; charset=utf-8")]}
    await with_headers(send)(start)
    await send({"type": "http.response.body", "body": sentence.encode()})


def with_headers(send: "Send", headers: Mapping[str, str] = HEADERS) -> "Send":
    """Add these headers to answers that lack them."""

    async def wrapped(message: "Message") -> None:
        if message["type"] == "http.response.start":
            given = list(message.get("headers", ()))
            there = {name.lower() for name, _ in given}
            own = [(name.encode(), value.encode()) for name, value in headers.items() if name.encode() not in there]
            message = {**message, "headers": [*given, *own]}
        await send(message)

    return wrapped
