"""Websockets of a page: to its session, state out and commands in; on this computer another one for pairing devices."""

import asyncio
import json
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any
from weakref import WeakKeyDictionary

from starlette.websockets import WebSocket, WebSocketDisconnect

from machine.workbench.access.limits import DEVICE, check_bench_command
from machine.workbench.access.pairing import Door
from machine.workbench.bench.page_words import in_page_words, page_words
from machine.workbench.bench.values import arguments_of, read_command
from machine.workbench.session.base import Observable, hear_from
from machine.workbench.session.commands import obey
from machine.workbench.session.session import Session
from machine.workbench.web.snapshot import snapshot
from profiles.errors import PlanError, UserError
from profiles.messages import check_text

MOST_COMMAND = 100_000  # characters
BEAT_S = 0.5
_states: WeakKeyDictionary[Observable, tuple[int, str]] = WeakKeyDictionary()
CLOSED = "this bench is no longer open"
CLOSED_CODE = 4404  # sent on a websocket of a closed bench
GONE_CODE = 1006  # code of a websocket that ended without a close frame, RFC 6455
MOST_OF_DEVICES = 1_000  # characters
DEVICE_FUNCTIONS: dict[str, Callable[..., None]] = {"unpair": Door.unpair, "reopen": Door.reopen}
DEVICE_COMMANDS = {name: arguments_of(function) for name, function in DEVICE_FUNCTIONS.items()}


async def talk(session: Session, socket: WebSocket) -> None:
    """Send states and receive commands until either side ends. A page that does not read only blocks itself."""
    await socket.accept()
    beat_s = BEAT_S if "beats" in socket.query_params else None
    try:
        await until_either_ends(tell(session, lambda: snapshot(session), socket, beat_s), _hear(session, socket))
    finally:
        if not session.closed:
            session.trials.settle()  # trials of a plane that the page was dragging


async def refuse_closed(socket: WebSocket) -> None:
    """Close the websocket of a bench that does not exist."""
    await socket.accept()
    await socket.close(CLOSED_CODE, CLOSED)


async def until_either_ends(tell: Coroutine[Any, Any, None], hear: Coroutine[Any, Any, None]) -> None:
    """Run both directions of a websocket until either ends; a page that has disconnected is not an error."""
    try:
        async with asyncio.TaskGroup() as group:
            hearing = group.create_task(hear)
            group.create_task(tell).add_done_callback(lambda _: hearing.cancel())
    except* WebSocketDisconnect:
        pass


async def send(socket: WebSocket, text: str) -> None:
    """Send text to a page. Raises WebSocketDisconnect if it has gone."""
    try:
        await socket.send_text(text)
    except RuntimeError as error:  # uvicorn raises it for a connection that it has closed but not reported yet
        raise WebSocketDisconnect(GONE_CODE) from error


async def receive(socket: WebSocket) -> str:
    """The next text of a page, "" for bytes, which are not a command. Raises WebSocketDisconnect if it has gone."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message["code"])
    return message.get("text") or ""


async def tell(source: Observable, state: Callable[[], dict[str, Any]], socket: WebSocket, beat_s: float | None = None) -> None:
    """The newest state whenever there is one, in the page's words and encoded once for all pages; what came in between while a
    slow page was reading is left out. beat_s: without news for so long it is sent an empty message, from which it knows that its
    server is there; None: never."""
    while not source.closed:
        seen, text = _states.get(source, (-1, ""))
        if seen != source.version:
            seen, text = _states[source] = source.version, json.dumps(in_page_words(state()))
        await send(socket, text)
        while source.version == seen:
            try:
                async with asyncio.timeout(beat_s):
                    await source.changed(seen)
            except TimeoutError:
                await send(socket, "")
    await socket.close(CLOSED_CODE, CLOSED)


async def _hear(session: Session, socket: WebSocket) -> None:
    while True:
        text, asked = await receive(socket), dict[str, Any]()
        try:
            asked = parsed(text, MOST_COMMAND)
            hear_from(asked.get("page"))
            if DEVICE in socket.scope:
                check_bench_command(asked)
            obey(session, asked)
        except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench continues
            session.answer(asked.get("ask"), session.refuse(error))


def parsed(text: str, most: int) -> dict[str, Any]:
    """Parse a page's command of at most `most` characters. Raises PlanError."""
    try:
        asked = json.loads(text) if len(text) <= most else None
    except (ValueError, RecursionError):
        asked = None
    if not isinstance(asked, dict):
        raise PlanError("the page has sent something that is not a command of the workbench")
    try:
        check_text(json.dumps(asked, ensure_ascii=False))
    except ValueError as error:
        reason = "a part of a surrogate pair is not allowed" if isinstance(error, UnicodeEncodeError) else error
        raise PlanError(f"what the page has sent is not plain text: {reason}") from None
    return asked


def devices_line(door: Door) -> Callable[[WebSocket], Awaitable[None]]:
    """Handler of the websocket for pairing devices, for pages of this computer only."""

    async def talk(socket: WebSocket) -> None:
        await socket.accept()
        await until_either_ends(tell(door, door.snapshot, socket), _hear_devices(door, socket))

    return talk


async def _hear_devices(door: Door, socket: WebSocket) -> None:
    while True:
        text = await receive(socket)
        try:
            name, arguments = read_command(parsed(text, MOST_OF_DEVICES), DEVICE_COMMANDS)
            DEVICE_FUNCTIONS[name](door, **dict(arguments))
        except UserError as error:
            await send(socket, json.dumps({"problem": page_words(f"{error}")}))
