"""Line: the websocket between a session and a page: state out, commands in."""

import asyncio
import json
from collections.abc import Coroutine
from typing import Any
from weakref import WeakKeyDictionary

from starlette.websockets import WebSocket, WebSocketDisconnect

from machine.app.workbench.session.session import Session
from machine.app.workbench.web.snapshot import snapshot
from profiles.errors import PlanError

MOST_COMMAND = 100_000  # characters
_states: WeakKeyDictionary[Session, tuple[int, str]] = WeakKeyDictionary()
CLOSED = "this bench is not open any more"
CLOSED_CODE = 4404  # of a websocket that is closed for that


async def talk(session: Session, socket: WebSocket) -> None:
    """State out, commands in, until either side goes. A page that reads nothing holds up nobody but itself."""
    await socket.accept()
    await until_either_ends(_tell(session, socket), _hear(session, socket))


async def until_either_ends(tell: Coroutine[Any, Any, None], hear: Coroutine[Any, Any, None]) -> None:
    """The two directions of a line beside each other; that a page has gone is no fault."""
    told, heard = asyncio.create_task(tell), asyncio.create_task(hear)
    done, left = await asyncio.wait((told, heard), return_when=asyncio.FIRST_COMPLETED)
    for task in left:
        task.cancel()
    for task in done:
        if not isinstance(task.exception(), WebSocketDisconnect | RuntimeError | None):
            task.result()


async def _tell(session: Session, socket: WebSocket) -> None:
    """The newest state whenever there is one; what came in between while a slow page was reading is left out."""
    while not session.closed:
        seen = session.version
        await socket.send_text(_state(session))
        await session.changed(seen)
    await socket.close(CLOSED_CODE, CLOSED)


def _state(session: Session) -> str:
    """The state as it goes over the line, made once for all pages."""
    version, text = _states.get(session, (-1, ""))
    if version != session.version:
        text = json.dumps(snapshot(session))
        _states[session] = session.version, text
    return text


async def _hear(session: Session, socket: WebSocket) -> None:
    while True:
        text, asked = await socket.receive_text(), dict[str, Any]()
        try:
            asked = parsed(text, MOST_COMMAND)
            session.command(asked)
        except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench goes on
            session.answer(asked.get("ask"), session.refuse(error))


def parsed(text: str, most: int) -> dict[str, Any]:
    """A command of a page, of so many characters at most. Raises PlanError for what is none."""
    try:
        asked = json.loads(text) if len(text) <= most else None
    except (ValueError, RecursionError):
        asked = None
    if not isinstance(asked, dict):
        raise PlanError("what the page has sent is no command of the workbench")
    return asked
