"""Uploads: a model, a plan or a profile that a page sends, kept as long as it lies on its bench."""

from collections.abc import Awaitable, Callable
from pathlib import Path

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from machine.app.workbench.session.session import Session
from machine.app.workbench.web.profile_files import ProfileFiles
from machine.app.workbench.work.received import remove_file
from profiles.errors import PlanError

TEXT_SUFFIX = ".toml"  # of plans and profiles
MIB = 2**20


def take_file(files: ProfileFiles, most_mib: int) -> Callable[[Session, Request], Awaitable[Response]]:
    """What answers a file that the person has chosen or dropped; what is refused is not kept."""

    async def answer(session: Session, request: Request) -> Response:
        name = Path(request.query_params.get("name", "")).name
        path, taken = session.received.new_file(name), False
        try:
            await _receive(request, path, name, most_mib)
            if path.suffix.lower() != TEXT_SUFFIX:
                await session.open_model(path, name)
                taken = True
            elif not files.take(path, session):
                await session.open_plan(path)
        finally:
            if not taken:  # refused, or a text, of which nothing more is read
                remove_file(path)
        return JSONResponse({})

    return answer


async def _receive(request: Request, path: Path, name: str, most_mib: int) -> None:
    told, size = request.headers.get("content-length", ""), 0
    _check_size(name, int(told) if told.isascii() and told.isdigit() and len(told) < 20 else 0, most_mib)
    with path.open("wb") as file:
        async for piece in request.stream():
            size += len(piece)
            _check_size(name, size, most_mib)
            file.write(piece)


def _check_size(name: str, size: int, most_mib: int) -> None:
    if size > most_mib * MIB:
        raise PlanError(
            f"{name}: has more than {most_mib} MiB, at most so many are taken from a page: a model of fewer faces is needed, or"
            " tiltprint edit with the file's name, or with a larger --upload-mib"
        )
