"""Devices line: what the page of this computer is told of the network, and asks for: a device let go, pairing opened again."""

import json
from collections.abc import Awaitable, Callable

from starlette.websockets import WebSocket

from machine.workbench.access.door import Door
from machine.workbench.bench.values import Asked
from machine.workbench.web.line import parsed, receive, send, tell, until_either_ends
from profiles.errors import PlanError, UserError

MOST_COMMAND = 1_000  # characters
COMMANDS: dict[str, Callable[[Door, Asked], None]] = {
    "unpair": lambda door, asked: door.unpair(asked.get("device")),
    "reopen": lambda door, asked: door.reopen(),
}


def devices_line(door: Door) -> Callable[[WebSocket], Awaitable[None]]:
    """What answers the websocket of a page of this computer; no address of the network leads to it."""

    async def talk(socket: WebSocket) -> None:
        await socket.accept()
        await until_either_ends(tell(door, door.snapshot, socket), _hear(door, socket))

    return talk


async def _hear(door: Door, socket: WebSocket) -> None:
    while True:
        text = await receive(socket)
        try:
            _obey(door, parsed(text, MOST_COMMAND))
        except UserError as error:
            await send(socket, json.dumps({"problem": str(error)}))


def _obey(door: Door, asked: Asked) -> None:
    name = asked.get("do")
    command = COMMANDS.get(name) if isinstance(name, str) else None
    if command is None:
        raise PlanError("what the page has sent is no command of the paired devices")
    command(door, asked)
