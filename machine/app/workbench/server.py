"""Server: the workbench's page, its model and files, and the line over which state and commands go."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from machine.app.workbench.guard import Guard
from machine.app.workbench.page import workbench_page
from machine.app.workbench.session import Session
from machine.app.workbench.settings import settings_list
from machine.app.workbench.snapshot import model_key, snapshot, triangles
from machine.app.workbench.tasks import Sliced
from mdp.read import MOST_BYTES
from profiles.errors import PlanError
from profiles.places import KINDS, known

MOST_COMMAND = 100_000  # characters
PLAN_SUFFIX = ".toml"
Answer = Callable[[Request], Awaitable[Response]]


def application(session: Session, token: str, port: int) -> ASGIApp:
    """The whole server, below `/TOKEN/`."""
    routes = [
        Route("/{token}/", _page(port)),
        Route("/{token}/model/{key}", _answering(session, _model)),
        Route("/{token}/file", _answering(session, _take_file), methods=["POST"]),
        Route("/{token}/plan.toml", _answering(session, _plan)),
        Route("/{token}/parts.zip", _answering(session, _folder)),
        Route("/{token}/print/{key}", _answering(session, _print_page)),
        Route("/{token}/print.html", _answering(session, _shared_page)),
        Route("/{token}/print.gcode", _answering(session, _gcode)),
        Route("/{token}/settings.json", _answering(session, _settings)),
        WebSocketRoute("/{token}/line", _line(session)),
    ]
    return Guard(Starlette(routes=routes), token, port)


def _page(port: int) -> Answer:
    content, policy = workbench_page(port)

    async def answer(request: Request) -> Response:
        return Response(content, media_type="text/html", headers={"content-security-policy": policy})

    return answer


def _answering(session: Session, act: Callable[[Session, Request], Awaitable[Response]]) -> Answer:
    async def answer(request: Request) -> Response:
        try:
            return await act(session, request)
        except ClientDisconnect:  # the page has gone while it sent a file
            return Response(status_code=400)
        except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench goes on
            return JSONResponse({"problem": session.refuse(error)}, status_code=422)

    return answer


async def _model(session: Session, request: Request) -> Response:
    model = session.bench.model
    if model is None or model_key(model) != request.path_params["key"]:
        return Response("this model is not on the workbench any more\n", 404)
    return Response(await asyncio.to_thread(triangles, model), media_type="application/octet-stream")


async def _take_file(session: Session, request: Request) -> Response:
    """A model or a plan that the person has chosen or dropped, into the session's own folder."""
    name = Path(request.query_params.get("name", "")).name
    path = session.new_file(name)
    await _receive(request, path, name)
    if path.suffix.lower() == PLAN_SUFFIX:
        await session.open_plan(path)
    else:
        await session.open_model(path, name)
    return JSONResponse({})


async def _receive(request: Request, path: Path, name: str) -> None:
    size = 0
    with path.open("wb") as file:
        async for piece in request.stream():
            size += len(piece)
            if size > MOST_BYTES:
                raise PlanError(
                    f"{name}: has more than {MOST_BYTES} bytes, at most so many are read: a model of fewer faces is needed"
                )
            file.write(piece)


async def _plan(session: Session, request: Request) -> Response:
    files = await session.files()
    return _download(files.plan.encode(), "application/toml", f"{_stem(session)}-plan.toml")


async def _folder(session: Session, request: Request) -> Response:
    files = await session.files()
    return _download(files.folder, "application/zip", f"{_stem(session)}-parts.zip")


async def _print_page(session: Session, request: Request) -> Response:
    """The page of the print as `view` writes it, with its own content security policy in it."""
    return Response(_slices(session).page, media_type="text/html")


async def _shared_page(session: Session, request: Request) -> Response:
    return _download(_slices(session).page, "text/html", f"{_stem(session)}.html")


async def _settings(session: Session, request: Request) -> Response:
    bench = session.bench
    names = {
        kind: {"names": sorted({*known(kind), getattr(bench.given, kind)}), "name": getattr(bench.given, kind)} for kind in KINDS
    }
    return JSONResponse({"profiles": names, "settings": settings_list(bench.profile, bench.given)})


async def _gcode(session: Session, request: Request) -> Response:
    sliced = _slices(session)
    if sliced.errors:
        raise PlanError(
            f"the dry run found {sliced.errors} errors: no G-code is saved; tiltprint export --force does so all the same"
        )
    return _download(sliced.gcode, "text/plain", f"{_stem(session)}.gcode")


def _slices(session: Session) -> Sliced:
    sliced = session.shown_slices()
    if sliced is None:
        raise PlanError("what is on the workbench is not sliced yet: slice it first")
    return sliced


def _download(content: bytes, kind: str, name: str) -> Response:
    return Response(content, media_type=kind, headers={"content-disposition": f'attachment; filename="{name}"'})


def _stem(session: Session) -> str:
    """The model's name for a file's: plain letters only, for it goes into a header."""
    name = "" if session.bench.model is None else Path(session.bench.model.name.removeprefix("demo:")).stem
    return "".join(letter if letter.isascii() and (letter.isalnum() or letter in "-_.") else "_" for letter in name) or "model"


def _line(session: Session) -> Callable[[WebSocket], Awaitable[None]]:
    async def talk(socket: WebSocket) -> None:
        """State out, commands in, until either side goes. A page that reads nothing holds up nobody but itself."""
        await socket.accept()
        told = asyncio.create_task(_tell(session, socket))
        heard = asyncio.create_task(_hear(session, socket))
        done, left = await asyncio.wait((told, heard), return_when=asyncio.FIRST_COMPLETED)
        for task in left:
            task.cancel()
        for task in done:
            if not isinstance(task.exception(), WebSocketDisconnect | RuntimeError | None):
                task.result()

    return talk


async def _tell(session: Session, socket: WebSocket) -> None:
    """The newest state whenever there is one; what came in between while a slow page was reading is left out."""
    while True:
        seen = session.version
        await socket.send_text(json.dumps(snapshot(session)))
        await session.changed(seen)


async def _hear(session: Session, socket: WebSocket) -> None:
    while True:
        text = await socket.receive_text()
        try:
            session.command(_parsed(text))
        except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench goes on
            session.refuse(error)


def _parsed(text: str) -> dict[str, Any]:
    try:
        asked = json.loads(text) if len(text) <= MOST_COMMAND else None
    except (ValueError, RecursionError):
        asked = None
    if not isinstance(asked, dict):
        raise PlanError("what the page has sent is no command of the workbench")
    return asked
