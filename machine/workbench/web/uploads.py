"""Uploads: a model, a plan or a profile that a page sends, kept as long as it lies on its bench, and those that a workbench which
was killed has left, to be opened again."""

import asyncio
import shutil
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from time import localtime, strftime

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from machine.pipeline.project import Project, is_project, read_folder
from machine.workbench.access.limits import DEVICE, check_model_name, check_profile
from machine.workbench.session.session import Session
from machine.workbench.web.profile_files import ProfileFiles
from machine.workbench.work.kept_work import folders_kept
from machine.workbench.work.received import remove_file
from profiles.errors import PlanError, reason

TEXT_SUFFIX = ".toml"  # of plans and profiles
MIB = 2**20


class Uploads:
    """profiles: the profile files among them; most_mib: the largest file that is taken; left: files of a workbench that was
    killed, each known to the pages by its place."""

    def __init__(self, most_mib: int, left: Sequence[Path] = ()) -> None:
        self.profiles = ProfileFiles()
        self._most_mib, self._left = most_mib, left

    async def take(self, session: Session, request: Request) -> Response:
        """A file that the person has chosen or dropped; what is refused is not kept."""
        name = Path(request.query_params.get("name", "")).name

        async def receive(path: Path) -> None:
            await _receive(request, path, name, self._most_mib)
            if DEVICE in request.scope and path.suffix.lower() == TEXT_SUFFIX:
                check_profile(path)

        if DEVICE in request.scope:
            check_model_name(name)
        return await self._open(session, name, receive, DEVICE in request.scope)

    async def list_left(self, session: Session, request: Request) -> Response:
        """What has been left and is still there."""
        rows = []
        for number, path in enumerate(self._left):
            with suppress(OSError):
                status = path.stat()
                rows.append({"number": number, "name": path.name, "bytes": status.st_size, "written_s": status.st_mtime})
        return JSONResponse(rows)

    async def open_left(self, session: Session, request: Request) -> Response:
        """The same opened on a bench, which gets a copy: what was left stays until its day is over."""
        number = request.path_params["number"]
        if number >= len(self._left):
            raise PlanError("no such file has been left by a workbench that was killed")
        path = self._left[number]

        async def copy_to(copy: Path) -> None:
            try:
                await asyncio.to_thread(shutil.copyfile, path, copy)
            except OSError as error:
                raise PlanError(f"{path.name}, left by a workbench that was killed, cannot be read: {reason(error)}") from None

        return await self._open(session, path.name, copy_to)

    async def list_kept(self, session: Session, request: Request) -> Response:
        """The work that was kept of other benches, the newest first; that of a newer version says so when it is opened."""
        rows = []
        for folder in folders_kept():
            try:
                project = read_folder(folder)
            except PlanError:
                rows.append({"kept": folder.name, "name": "", "parts": 0, "written_s": folder.stat().st_mtime})
            else:
                rows.append({"kept": folder.name, "name": project.name, "parts": project.parts, "written_s": project.written_s})
        return JSONResponse(rows)

    async def open_kept(self, session: Session, request: Request) -> Response:
        """The same put on a bench."""
        name = request.path_params["name"]
        folder = next((folder for folder in folders_kept() if folder.name == name), None)
        if folder is None:
            raise PlanError("this work is not kept any more, or another page has opened it")
        project = read_folder(folder)
        word = f"open the work of {strftime('%H:%M', localtime(project.written_s))}"
        try:
            await session.open_folder(folder, self._with_copies(project), word)
        except OSError as error:
            raise PlanError(f"the work in {folder} cannot be read: {reason(error)}") from None
        return JSONResponse({})

    def _with_copies(self, project: Project) -> Project:
        """The project with copies of its profiles, which benches may share. Raises OSError."""
        return replace(project, given=self.profiles.copied(project.given, project.own_names))

    async def _open(
        self, session: Session, name: str, fill: Callable[[Path], Awaitable[object]], of_device: bool = False
    ) -> Response:
        path, taken = session.received.new_file(name), False
        try:
            await fill(path)
            if is_project(path):

                def taken_over(project: Project) -> Project:
                    if of_device:
                        check_model_name(project.name)
                    return self._with_copies(project)

                await session.open_project(path, name, taken_over)
            elif path.suffix.lower() != TEXT_SUFFIX:
                await session.open_model(path, name)
                taken = True
            elif not self.profiles.take(path, session):
                await session.open_plan(path)
        finally:
            waits = session.unscaled is not None and session.unscaled.path == path
            if not taken and not waits:  # refused, or a text, of which nothing more is read
                remove_file(path)
        return JSONResponse({})


async def _receive(request: Request, path: Path, name: str, most_mib: int) -> None:
    length, size = request.headers.get("content-length", ""), 0
    _check_size(name, int(length) if length.isascii() and length.isdigit() and len(length) < 20 else 0, most_mib)
    with path.open("wb") as file:
        async for piece in request.stream():
            size += len(piece)
            _check_size(name, size, most_mib)
            file.write(piece)


def _check_size(name: str, size: int, most_mib: int) -> None:
    if size > most_mib * MIB:
        raise PlanError(
            f"{name}: has more than the {most_mib} MiB that a page may send: a model of fewer faces is needed, or"
            " tiltprint edit with the file's name, or with a larger --upload-mib"
        )
