"""Downloads: what a page saves and looks at: the plan, the parts, the G-code and the page of the print."""

from starlette.requests import Request
from starlette.responses import Response

from machine.app.workbench.bench.command_line import file_stem
from machine.app.workbench.session.session import Session
from profiles.errors import PlanError


async def plan(session: Session, request: Request) -> Response:
    """The plan's file."""
    files = await session.files()
    return _download(files.plan.encode(), "application/toml", f"{file_stem(session.bench)}-plan.toml")


async def folder(session: Session, request: Request) -> Response:
    """The folder of the parts as a zip."""
    files = await session.files()
    return _download(files.folder, "application/zip", f"{file_stem(session.bench)}-parts.zip")


async def print_page(session: Session, request: Request) -> Response:
    """The page of the print as `view` writes it, with its own content security policy in it."""
    return Response(session.slicing.needed().page, media_type="text/html")


async def shared_page(session: Session, request: Request) -> Response:
    """The same as a file to save."""
    return _download(session.slicing.needed().page, "text/html", f"{file_stem(session.bench)}.html")


async def gcode(session: Session, request: Request) -> Response:
    """The G-code, unless the dry run found errors."""
    sliced = session.slicing.needed()
    if sliced.errors:
        raise PlanError(
            f"the dry run found {sliced.errors} errors: no G-code is saved; tiltprint export --force does so all the same"
        )
    return _download(sliced.gcode, "text/plain", f"{file_stem(session.bench)}.gcode")


def _download(content: bytes, kind: str, name: str) -> Response:
    return Response(content, media_type=kind, headers={"content-disposition": f'attachment; filename="{name}"'})
