"""Gate to the local network: paired devices, known by their cookies, pass; others only get the pairing page."""

import asyncio
from contextlib import suppress
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from starlette.requests import ClientDisconnect, Request
from starlette.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from machine.view.serving.guard import HEADERS, LONG_NUMBER, SAFE, is_foreign, method_of, refuse, values_of, with_headers
from machine.workbench.access.limits import DEVICE
from machine.workbench.access.network import Lan
from machine.workbench.access.pairing import Device, Door, Verdict, pairing_page

PAIRED = "/paired/"  # prefix of the paths that this computer's page has below its token
UNPAIRED_CODE = 4403  # closes the websocket of an unpaired device
UNPAIRED = "this device is not paired"
FOREIGN = "the workbench answers only at an address or name of its computer, and only its own pages\n"
NOTHING = f"the workbench is below {PAIRED}\n"
MOST_TYPED = 200  # bytes of a submitted code
TIMEOUT_S = 10.0  # for receiving a code


class Gate:
    """An ASGI application that passes the requests of paired devices to another one."""

    def __init__(self, app: ASGIApp, door: Door, lan: Lan, port: int) -> None:
        self._app, self._door, self._scheme = app, door, lan.scheme
        unheeded = "" if lan.certificate else "cross-origin-opener-policy"  # browsers log that an unencrypted page cannot use it
        self._headers = {name: value for name, value in HEADERS.items() if name != unheeded}
        self._own, self._cookie = lan.hosts(port), f"tiltprint-{port}"  # browsers share the cookies of a host among its ports

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if is_foreign(scope["headers"], method_of(scope), self._own, self._scheme):
            await refuse(scope, send, 403, FOREIGN)
            return
        device = next(filter(None, map(self._door.device_of, self._cookies(scope))), None)
        if device is None:
            await self._answer_stranger(scope, receive, send)
        elif scope["path"] in ("/", "/pair"):
            await _leading_to(PAIRED)(scope, receive, with_headers(send, self._headers))
        elif not scope["path"].startswith(PAIRED) or LONG_NUMBER.search(scope["path"]):
            await refuse(scope, send, 404, NOTHING)
        else:
            receive = _until_gone(device, scope["type"], receive, send)
            await self._app({**scope, DEVICE: device.number}, receive, with_headers(send, self._headers))

    def _cookies(self, scope: Scope) -> list[str]:
        found = []
        for header in values_of(scope["headers"], b"cookie"):
            with suppress(CookieError):
                jar = SimpleCookie(header)
                found += [jar[self._cookie].value] if self._cookie in jar else []
        return found

    async def _answer_stranger(self, scope: Scope, receive: Receive, send: Send) -> None:
        method, path = method_of(scope), scope["path"]
        answer: Response
        if method in SAFE and path == "/":
            answer = pairing_page(self._door)
        elif method == "POST" and path == "/pair":
            answer = await self._pair(Request(scope, receive))
        elif method == "GET" and "text/html" in ",".join(values_of(scope["headers"], b"accept")):
            answer = _leading_to("/")
        else:
            await refuse(scope, send, 403, f"{UNPAIRED}\n")
            return
        await answer(scope, receive, with_headers(send, self._headers))

    async def _pair(self, request: Request) -> Response:
        """Answer a device that sends a code."""
        try:
            async with asyncio.timeout(TIMEOUT_S):
                typed = await _typed(request)
        except (ClientDisconnect, TimeoutError, ValueError):
            return Response("no code has come\n", 400)
        verdict, cookie = self._door.attempt(typed, request.headers.get("user-agent", ""))
        if verdict != Verdict.PAIRED:
            return pairing_page(self._door, verdict)
        answer = _leading_to(PAIRED)
        answer.set_cookie(self._cookie, cookie, path="/", secure=self._scheme == "https", httponly=True, samesite="strict")
        return answer


def _leading_to(path: str) -> Response:
    return RedirectResponse(path, 303)


async def _typed(request: Request) -> str:
    """The code in a form. Raises ValueError for other content."""
    content = b""
    async for piece in request.stream():
        content += piece
        if len(content) > MOST_TYPED:
            raise ValueError
    return parse_qs(content.decode("ascii")).get("code", [""])[0]


def _until_gone(device: Device, kind: str, receive: Receive, send: Send) -> Receive:
    """Receive a device's messages until it is unpaired, which ends its connection and aborts what it is sending."""

    async def received() -> Message:
        hearing, going = asyncio.ensure_future(receive()), asyncio.ensure_future(device.gone.wait())
        try:
            await asyncio.wait((hearing, going), return_when=asyncio.FIRST_COMPLETED)
            if not device.gone.is_set():
                return await hearing
        finally:
            hearing.cancel()
            going.cancel()
        if kind == "http":
            return {"type": "http.disconnect"}
        await send({"type": "websocket.close", "code": UNPAIRED_CODE, "reason": UNPAIRED})
        return {"type": "websocket.disconnect", "code": UNPAIRED_CODE}

    return received
