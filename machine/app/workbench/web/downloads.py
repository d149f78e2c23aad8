"""Downloads: what a page saves and looks at: profiles, the plan, the parts, the G-code and the page of the print."""

import asyncio
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response

from machine.app.profile_file import profile_text
from machine.app.workbench.bench.command_line import file_stem, plain_name
from machine.app.workbench.bench.settings import settings_of
from machine.app.workbench.session.session import Session
from machine.app.workbench.session.slicing import Slices
from machine.view.page import with_comparison
from profiles.errors import PlanError
from profiles.places import KINDS


async def profile(session: Session, request: Request) -> Response:
    """The machine, the material or the process with what is changed of it, as a profile file."""
    given, kind = session.bench.given, request.path_params["kind"]
    if kind not in KINDS:
        return Response("there is no such profile\n", 404)
    name = getattr(given, kind)
    text = profile_text(kind, name, settings_of(given, kind))
    return _download(text.encode(), "application/toml", f"{plain_name(Path(name).stem) or kind}-own.toml")


async def plan(session: Session, request: Request) -> Response:
    """The plan's file."""
    files = await session.files()
    return _download(files.plan.encode(), "application/toml", f"{file_stem(session.bench)}-plan.toml")


async def folder(session: Session, request: Request) -> Response:
    """The folder of the parts as a zip."""
    files = await session.files()
    return _download(files.folder, "application/zip", f"{file_stem(session.bench)}-parts.zip")


async def pictures(session: Session, request: Request) -> Response:
    """The drawings of the parts as a zip."""
    return _download(await session.pictures(), "application/zip", f"{file_stem(session.bench)}-pictures.zip")


async def print_page(session: Session, request: Request) -> Response:
    """The page of the last slices as `view` writes it, with its own content security policy in it."""
    slices = _slices(session, request)
    return _gone() if slices is None else Response(slices.sliced.page, media_type="text/html")


async def print_text(session: Session, request: Request) -> Response:
    """The G-code of the last slices to look at, whatever the dry run found."""
    slices = _slices(session, request)
    return _gone() if slices is None else Response(slices.sliced.gcode, media_type="text/plain")


async def print_walls(session: Session, request: Request) -> Response:
    """What is seen of a part that is sliced, as `work.walls` gives it."""
    drawn = session.slicing.walls_of(request.path_params["number"], request.path_params["part"])
    return _gone() if drawn is None else Response(drawn, media_type="application/octet-stream")


async def shared_page(session: Session, request: Request) -> Response:
    """The same as a file to save, with the comparison with one piece where that has been worked out."""
    content, alternatives = session.slicing.needed().page, session.comparing.rows()
    if alternatives:
        content = await asyncio.to_thread(with_comparison, content, alternatives)
    return _download(content, "text/html", f"{file_stem(session.bench)}.html")


async def gcode(session: Session, request: Request) -> Response:
    """The G-code; with errors only for who has said that he wants it all the same, as with `export --force`."""
    sliced = session.slicing.needed()
    if (errors := sliced.errors) and request.query_params.get("force") != "yes":
        raise PlanError(
            f"the dry run found {len(errors)} errors, the first: {errors[0].message}: no G-code is saved unless you say that you"
            " want it all the same (--force)"
        )
    return _download(sliced.gcode, "text/plain", f"{file_stem(session.bench)}.gcode")


def _slices(session: Session, request: Request) -> Slices | None:
    """The last slices, where they are those that are asked for."""
    slices = session.slicing.latest()
    return slices if slices is not None and slices.sliced.key == request.path_params["key"] else None


def _gone() -> Response:
    return Response("these slices are not there any more\n", 404)


def _download(content: bytes, kind: str, name: str) -> Response:
    return Response(content, media_type=kind, headers={"content-disposition": f'attachment; filename="{name}"'})
