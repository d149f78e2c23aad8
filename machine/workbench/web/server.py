"""Server: the page, and the routes for models, files and websockets of its sessions, and for the benches."""

import asyncio
import base64
import re
from collections.abc import Awaitable, Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route, Router, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from machine.notices import say
from machine.pipeline.output import plain_name
from machine.pipeline.profile_file import profile_text
from machine.view.page import TEMPLATE, bundle, hash_source
from machine.view.serving.guard import NAMES, guarded
from machine.workbench.access.gate import Gate
from machine.workbench.access.network import Lan
from machine.workbench.access.pairing import Door
from machine.workbench.bench.page_words import page_words
from machine.workbench.bench.settings import export_command, file_stem, profile_labels, settings_list, settings_of
from machine.workbench.printing.prints import Prints
from machine.workbench.session.base import hear_from, in_loop
from machine.workbench.session.commands import Need, check_need, lacking
from machine.workbench.session.planes import pedestal_key
from machine.workbench.session.session import Session, Workbench
from machine.workbench.web.line import CLOSED, devices_line, refuse_closed, talk
from machine.workbench.web.prints_line import print_log, print_webcam, prints_line
from machine.workbench.web.snapshot import marks_key
from machine.workbench.web.uploads import Uploads
from machine.workbench.work.cutting import make_folder, make_pictures, make_plan, make_project
from machine.workbench.work.models import mark_faces, rest_facets
from machine.workbench.work.slices import Sliced, share_page
from profiles.errors import PlanError
from profiles.places import KINDS

Act = Callable[[Session, Request], Awaitable[Response]]
OWN = Path(__file__).parent / "page"
MARKER = re.compile(r"/\*(STYLE|SCRIPT|NETWORK|DEMO)(?: (\w+))?\*/")
ZIP, BYTES = "application/zip", "application/octet-stream"
BELOW = "/{token}/{session:int}/"


async def profile(session: Session, request: Request) -> Response:
    """A profile file of the machine, the material or the process with its changes."""
    given, kind = session.bench.given, request.path_params["kind"]
    if kind not in KINDS:
        return Response("there is no such profile\n", 404)
    name = getattr(given, kind)
    text = profile_text(kind, name, settings_of(given, kind))
    own = _saved_as(f"{plain_name(Path(name).stem) or kind}-own.toml")
    return Response(text, headers=own, media_type="application/toml")


async def plan(session: Session, request: Request) -> Response:
    text = await session.make("cutting the parts", make_plan)
    return Response(text, headers=_saved_as(f"{file_stem(session.bench)}-plan.toml"), media_type="application/toml")


def _made_file(word: str, task: Callable[..., None], kind: str, ending: str) -> Act:
    """Handler that returns a file made from the parts by a task; word: what the pages wait for; ending: of the file's name."""

    async def answer(session: Session, request: Request) -> Response:
        out = session.new_file()
        await session.make(word, task, out)
        return _once(out, kind, f"{file_stem(session.bench)}{ending}")

    return answer


def _sliced_file(file_of: Callable[[Sliced], Path], kind: str) -> Act:
    """Handler that returns a file of the last slices, or of the open G-code file, whichever has the requested key."""

    async def answer(session: Session, request: Request) -> Response:
        slices = session.slicing.latest()
        for sliced in (session.gcode, None if slices is None else slices.sliced):
            if sliced is not None and sliced.key == request.path_params["key"]:
                return FileResponse(file_of(sliced), media_type=kind)
        return _gone()

    return answer


async def print_walls(session: Session, request: Request) -> Response:
    """The visible walls of a sliced part, from `work.walls`."""
    drawn = session.slicing.walls_of(request.path_params["number"], request.path_params["part"])
    return _gone() if drawn is None else Response(drawn, media_type=BYTES)


async def shared_page(session: Session, request: Request) -> Response:
    """The page of the last slices as a file, with the comparison with one piece if that has been computed."""
    page, alternatives, name = session.slicing.needed().sliced.page, session.comparing.rows(), f"{file_stem(session.bench)}.html"
    if not alternatives:
        return FileResponse(page, headers=_saved_as(name), media_type="text/html")
    out = session.new_file()
    await session.quick.run(share_page, page, alternatives, out)
    return _once(out, "text/html", name)


async def gcode(session: Session, request: Request) -> Response:
    """The G-code; with errors only if the user has confirmed."""
    sliced = session.slicing.needed().sliced
    if (errors := sliced.errors) and request.query_params.get("force") != "yes":
        count = f"{len(errors)} error{'s' * (len(errors) > 1)}"
        raise PlanError(
            f"the dry run found {count}, the first: {errors[0].message}: no G-code is saved unless you say that you want it all"
            " the same"
        )
    return FileResponse(sliced.gcode, headers=_saved_as(f"{file_stem(session.bench)}.gcode"), media_type="text/plain")


def _gone() -> Response:
    return Response("these slices no longer exist\n", 404)


def _once(file: Path, kind: str, name: str) -> Response:
    """A response with a file that is deleted after sending."""
    remove = BackgroundTask(file.unlink, missing_ok=True)
    return FileResponse(file, headers=_saved_as(name), media_type=kind, background=remove)


def _number(text: str) -> int:
    """The number in an address, 0 if it is invalid."""
    return int(text) if text.isascii() and text.isdigit() and len(text) < 6 else 0


def _saved_as(name: str) -> dict[str, str]:
    """Header that gives a download its name, in any script (RFC 6266)."""
    plain = name.encode("ascii", "replace").decode().replace("?", "_")
    return {"content-disposition": f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(name)}"}


def workbench_page(lines: Iterable[str], network: str = "") -> tuple[bytes, str]:
    """The page and its content security policy. lines: websocket origins of the server; network: "open" for this computer's page
    if the network is open, "paired" for the page of a device."""
    style, script = "".join((folder / "style.css").read_text("utf-8") for folder in (TEMPLATE, OWN)), bundle(OWN / "main.js")
    put = {"STYLE": style, "SCRIPT": script, "NETWORK": network}
    page = (OWN / "page.html").read_text("utf-8")
    body = MARKER.sub(lambda match: _demo_picture(match[2]) if match[2] else put[match[1]], page)
    return body.encode(), policy(style, script, lines)


def _demo_picture(name: str) -> str:
    """The small picture of a demo model as an address."""
    return f"data:image/png;base64,{base64.b64encode((files('mdp.demos') / f'{name}.png').read_bytes()).decode()}"


def policy(style: str, script: str, lines: Iterable[str]) -> str:
    """Content security policy: own script and style, images that the page creates, and images and connections of its server."""
    server = " ".join(("'self'", *lines))
    own = f"script-src {hash_source(script)}; style-src {hash_source(style)}; connect-src {server}"
    rest = "frame-src 'self'; img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    return f"default-src 'none'; {own}; {rest}"


def bench_routes(workbench: Workbench) -> list[Route]:
    """Routes for all benches: `benches` (POST: open one with the settings of `like`), `benches/N` (DELETE), and the address
    without a number, which redirects to the first."""

    async def first(request: Request) -> Response:
        number = min(workbench.sessions, default=0) or workbench.open()
        return RedirectResponse(f"{number}/")

    async def opened(request: Request) -> Response:
        like = workbench.sessions.get(_number(request.query_params.get("like", "")))
        try:
            number = workbench.open(like)
        except PlanError as error:
            return JSONResponse({"problem": page_words(f"{error}")}, status_code=422)
        return JSONResponse({"number": number})

    async def closed(request: Request) -> Response:
        trouble = await workbench.close(request.path_params["number"])
        if trouble:  # its page is gone
            say(trouble)
        return JSONResponse({})

    return [
        Route("/{token}/", first),
        Route("/{token}/benches", opened, methods=["POST"]),
        Route("/{token}/benches/{number:int}", closed, methods=["DELETE"]),
    ]


@dataclass(frozen=True)
class Served:
    """Shared objects of all pages: the benches, their event loop, the prints, the uploads."""

    workbench: Workbench
    benches: asyncio.AbstractEventLoop
    prints: Prints
    uploads: Uploads


def application(served: Served, token: str, port: int, door: Door | None = None) -> ASGIApp:
    """The application for this computer, below `/TOKEN/SESSION/`. door: pairing, if the network is open."""
    page = workbench_page((f"ws://{name}:{port}" for name in NAMES), "open" if door else "")
    of_door = [WebSocketRoute(BELOW + "devices", devices_line(door))] if door else []
    return guarded(_router(served, page, of_door), token, port)


def lan_application(served: Served, door: Door, lan: Lan, port: int) -> ASGIApp:
    """The application for paired devices, with the same routes below `/paired/`."""
    scheme = lan.scheme.replace("http", "ws")
    page = workbench_page((f"{scheme}://{host}" for host in lan.hosts(port)), "paired")
    return Gate(_router(served, page), door, lan, port)


def _router(served: Served, page: tuple[bytes, str], further: Sequence[BaseRoute] = ()) -> ASGIApp:
    """Routes of the prints, and further ones, run in the server's own event loop, all others in that of the benches, so that an
    emergency stop never waits for a busy bench."""
    workbench, prints = served.workbench, served.prints
    of_prints = [
        Route(BELOW + "prints/{print:int}/log", print_log(prints)),
        Route(BELOW + "prints/{print:int}/webcam", print_webcam(prints)),
        WebSocketRoute(BELOW + "prints", prints_line(prints, workbench, served.benches)),
    ]
    others = answered_in(served.benches, _of_sessions(workbench, page, served.uploads))
    return Router([*of_prints, *further], redirect_slashes=False, default=others)


def answered_in(loop: asyncio.AbstractEventLoop, app: ASGIApp) -> ASGIApp:
    """Run an application in another event loop than its server's."""

    async def answer(scope: Scope, receive: Receive, send: Send) -> None:
        server = asyncio.get_running_loop()

        async def received() -> Message:
            return await in_loop(server, receive())  # type: ignore[arg-type]

        async def sent(message: Message) -> None:
            await in_loop(server, send(message))  # type: ignore[arg-type]

        await in_loop(loop, app(scope, received, sent))  # type: ignore[arg-type]

    return answer


def _of_sessions(workbench: Workbench, page: tuple[bytes, str], uploads: Uploads) -> ASGIApp:

    def route(path: str, act: Act, method: str = "GET", need: Need = Need.NOTHING) -> Route:
        return Route(BELOW + path, _answering(workbench, act, need), methods=[method])

    routes = [
        route("", _page(*page)),
        route("model/{key}", _of_key(_model_key, _model)),
        route("marks/{key}", _of_key(lambda session: marks_key(session.bench), _marks)),
        route("pedestal/{key}", _of_key(lambda session: pedestal_key(session.bench, session.standing.result), _pedestal)),
        route("others/{key}", _of_key(lambda session: getattr(session.plated.result, "others_key", ""), _others)),
        route("facets/{key}", _of_key(_model_key, _facets)),
        route("file", uploads.take, "POST"),
        route("left", uploads.list_left),
        route("left/{number:int}", uploads.open_left, "POST"),
        route("left/{number:int}", uploads.remove_left, "DELETE"),
        route("kept", uploads.list_kept),
        route("kept/{name}/picture", uploads.kept_picture),
        route("kept/{name}", uploads.open_kept, "POST"),
        route("kept/{name}", uploads.remove_kept, "DELETE"),
        route("project.3mf", _made_file("saving the project", make_project, "model/3mf", ".3mf"), need=Need.MODEL),
        route("plan.toml", plan, need=Need.PARTS),
        route("profile/{kind}.toml", profile),
        route("pieces", _pieces),
        route("parts.zip", _made_file("cutting the parts", make_folder, ZIP, "-parts.zip"), need=Need.CUT),
        route("pictures.zip", _made_file("drawing the parts", make_pictures, ZIP, "-pictures.zip"), need=Need.CUT),
        route("print/{key}", _sliced_file(lambda sliced: sliced.page, "text/html")),  # has its own content security policy
        route("print/{key}/text", _sliced_file(lambda sliced: sliced.gcode, "text/plain")),  # whatever the dry run found
        route("walls/{number:int}/{part:int}", print_walls),
        route("print.html", shared_page),
        route("print.gcode", gcode),
        route("settings.json", _settings(uploads)),
        WebSocketRoute(BELOW + "line", _line(workbench)),
    ]
    return Starlette(routes=[*bench_routes(workbench), *routes])


def _page(content: bytes, policy: str) -> Act:
    async def answer(session: Session, request: Request) -> Response:
        return Response(content, media_type="text/html", headers={"content-security-policy": policy})

    return answer


def _answering(workbench: Workbench, act: Act, need: Need) -> Callable[[Request], Awaitable[Response]]:
    async def answer(request: Request) -> Response:
        session = workbench.sessions.get(request.path_params["session"])
        if session is None:
            return Response(f"{CLOSED}\n", 404)
        hear_from(request.query_params.get("page"))
        try:
            check_need(session, need)
            return await act(session, request)
        except ClientDisconnect:  # the page disconnected during an upload
            return Response(status_code=400)
        except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench continues
            return JSONResponse({"problem": page_words(session.refuse(error))}, status_code=422)

    return answer


def _line(workbench: Workbench) -> Callable[[WebSocket], Awaitable[None]]:
    async def connect(socket: WebSocket) -> None:
        session = workbench.sessions.get(socket.path_params["session"])
        if session is None:
            await refuse_closed(socket)
            return
        try:
            await talk(session, socket)
        except ExceptionGroup as bugs:  # each becomes a sentence for the other websockets, and a log
            session.refuse(bugs.exceptions[0])

    return connect


def _of_key(current: Callable[[Session], str], act: Act) -> Act:
    """Handler that answers requests for the current key; a page with an outdated key will request the new one."""

    async def answer(session: Session, request: Request) -> Response:
        key = current(session)
        return await act(session, request) if key and key == request.path_params["key"] else Response(status_code=204)

    return answer


def _model_key(session: Session) -> str:
    return "" if session.bench.model is None else session.bench.model.key


async def _model(session: Session, request: Request) -> Response:
    assert session.bench.model is not None
    return FileResponse(session.bench.model.mesh_file, media_type=BYTES)


async def _pedestal(session: Session, request: Request) -> Response:
    assert session.standing.result is not None
    return Response(session.standing.result.pedestal, media_type=BYTES)


async def _others(session: Session, request: Request) -> Response:
    plated = session.plated.result  # its file exists as long as it
    assert plated is not None
    assert plated.others is not None
    return Response(await asyncio.to_thread(plated.others.read_bytes), media_type=BYTES)


async def _facets(session: Session, request: Request) -> Response:
    return Response(await session.quick.run(rest_facets, session.bench.model), media_type="application/json")


async def _pieces(session: Session, request: Request) -> Response:
    """The parts as separate bodies; nothing if they cannot be cut, or are no longer there."""
    if lacking(session, Need.PARTS):
        return Response(status_code=204)
    path = await session.pieces.get()
    return FileResponse(path, media_type=BYTES) if path.stat().st_size else Response(status_code=204)


async def _marks(session: Session, request: Request) -> Response:
    return Response(await session.quick.run(mark_faces, session.bench), media_type=BYTES)


def _settings(uploads: Uploads) -> Act:
    async def answer(session: Session, request: Request) -> Response:
        given = uploads.as_shown(session.bench.given)
        bench = replace(session.bench, given=given)
        names = {kind: {"labels": profile_labels(kind, getattr(given, kind)), "name": getattr(given, kind)} for kind in KINDS}
        rows = settings_list(bench.profile, session.bench.given, _number(request.query_params.get("part", "")))
        return JSONResponse({"profiles": names, "settings": rows, "command": export_command(bench)})

    return answer
