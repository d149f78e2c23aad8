"""Uploads: models, plans and profiles from pages, kept while they are on a bench (profiles until the program ends, because
benches may share them), and files left behind by killed workbenches."""

import asyncio
import os
import shutil
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from time import localtime, strftime

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from machine.pipeline.project import Project, is_project, read_folder
from machine.pipeline.project_record import RECORD
from machine.pipeline.requests import GCODE_SUFFIXES, Given
from machine.workbench.access.limits import DEVICE, check_model_name, check_plan, check_profile
from machine.workbench.bench.values import with_value
from machine.workbench.session.keeping import OPEN_ELSEWHERE
from machine.workbench.session.session import Session
from machine.workbench.work.cutting import draw_kept
from machine.workbench.work.folders import Received, folders_kept, remove_file
from mdp.formats.readers import READERS
from profiles.errors import PlanError, ProfileError, UserError, reason
from profiles.files import lock_folder, modified_s, remove_locked
from profiles.messages import check_text, option
from profiles.places import KINDS, kind_in

PICTURE = "picture.png"  # in the folder of kept work
TEXT_SUFFIX = ".toml"  # suffix of plans and profiles
MIB = 2**20


class Uploads:
    """most_mib: size limit; left: files of a killed workbench, identified by their indices."""

    def __init__(self, most_mib: int, left: Sequence[Path] = ()) -> None:
        self._most_mib, self._left = most_mib, left
        self._profiles = Received()

    def as_shown(self, given: Given) -> Given:
        """Names and settings for display: uploaded files by their own names."""
        for kind in KINDS:
            file = Path(getattr(given, kind))
            if file.parent.parent == self._profiles.path:
                given = with_value(given, kind, file.name)
        return given

    async def take(self, session: Session, request: Request) -> Response:
        """Open a file that the user has chosen or dropped; a refused file is deleted."""
        name = Path(request.query_params.get("name", "")).name
        try:
            check_text(name)
        except ValueError as error:
            raise PlanError(f"file name {name!r}: {error}") from None

        async def receive(path: Path) -> None:
            await _receive(request, path, name, self._most_mib)
            if DEVICE in request.scope and path.suffix.lower() == TEXT_SUFFIX:
                check_profile(path)
                check_plan(path)

        if DEVICE in request.scope:
            check_model_name(name)
        return await self._open(session, name, receive, DEVICE in request.scope, "add" in request.query_params)

    async def list_left(self, session: Session, request: Request) -> Response:
        """The files left behind that still exist."""
        rows = []
        for number, path in enumerate(self._left):
            with suppress(OSError):
                status = path.stat()
                rows.append({"key": number, "name": path.name, "bytes": status.st_size, "written_s": status.st_mtime})
        return JSONResponse(rows)

    async def open_left(self, session: Session, request: Request) -> Response:
        """Open a copy of a file left behind, which itself stays for its day."""
        path = self._left_file(request)

        async def copy_to(copy: Path) -> None:
            try:
                await asyncio.to_thread(shutil.copyfile, path, copy)
            except OSError as error:
                raise PlanError(f"{path.name}, left by a workbench that was killed, cannot be read: {reason(error)}") from None

        return await self._open(session, path.name, copy_to)

    async def remove_left(self, session: Session, request: Request) -> Response:
        await asyncio.to_thread(remove_file, self._left_file(request))
        return JSONResponse({})

    def _left_file(self, request: Request) -> Path:
        number: int = request.path_params["number"]
        if number >= len(self._left):
            raise PlanError("no such file has been left by a workbench that was killed")
        return self._left[number]

    async def list_kept(self, session: Session, request: Request) -> Response:
        """The autosaved work of other benches, newest first; work of a newer version is refused when it is opened."""
        rows = []
        for folder in folders_kept():
            try:
                project = read_folder(folder)
            except PlanError:
                with suppress(FileNotFoundError):  # another page has removed it meanwhile
                    rows.append({"key": folder.name, "name": "", "parts": 0, "written_s": modified_s(folder)})
            else:
                name = ", ".join(project.names)
                rows.append({"key": folder.name, "name": name, "parts": project.parts, "written_s": project.written_s})
        return JSONResponse(rows)

    async def kept_picture(self, session: Session, request: Request) -> Response:
        """The small picture of autosaved work, drawn when it is first requested after a change of the work."""
        with suppress(UserError, OSError):  # without a picture a page shows the name alone
            folder = _kept_folder(request)
            picture = folder / PICTURE
            if not picture.is_file() or modified_s(picture) < modified_s(folder / RECORD):
                await session.aside.run(draw_kept, folder, picture)
            return Response(await asyncio.to_thread(picture.read_bytes), media_type="image/png")
        return Response(status_code=204)  # no error: the list on the page may be older than the work

    async def open_kept(self, session: Session, request: Request) -> Response:
        folder = _kept_folder(request)
        project = read_folder(folder)
        word = f"open the work of {strftime('%H:%M', localtime(project.written_s))}"
        try:
            async with session.turn:
                await session.open_folder(folder, self._with_copies(project), word)
        except OSError as error:
            raise PlanError(f"the work in {folder} cannot be read: {reason(error)}") from None
        return JSONResponse({})

    async def remove_kept(self, session: Session, request: Request) -> Response:
        folder = _kept_folder(request)
        lock = None
        with suppress(FileNotFoundError):
            lock = lock_folder(folder)
        if lock is None:
            raise PlanError(OPEN_ELSEWHERE)
        await asyncio.to_thread(remove_locked, folder, lock)
        return JSONResponse({})

    def _with_copies(self, project: Project) -> Project:
        """The project with copies of its profile files, which benches may share. Raises OSError."""
        given = project.given
        for kind, name in project.own_names.items():
            given = with_value(given, kind, str(shutil.copy(getattr(given, kind), self._profiles.new_file(name))))
        return replace(project, given=given)

    async def _take_profile(self, path: Path, session: Session) -> bool:
        """Apply an uploaded file if it is a profile; returns whether it is. Raises ProfileError if it is invalid."""
        try:
            kind = kind_in(path)
        except ProfileError:
            return False
        copy = str(shutil.copy(path, self._profiles.new_file(path.name)))
        try:
            await session.take_profile(f"take {path.name}", kind, copy)
        except ProfileError as error:
            remove_file(Path(copy))
            raise ProfileError(f"{error}".replace(f"{Path(copy).parent}{os.sep}", "")) from None
        return True

    async def _open(
        self, session: Session, name: str, fill: Callable[[Path], Awaitable[object]], of_device: bool = False, add: bool = False
    ) -> Response:
        """add: put a model beside that on the bench."""
        path, taken = session.received.new_file(name), False
        try:
            await fill(path)

            def taken_over(project: Project) -> Project:
                if of_device:
                    for model in project.names:
                        check_model_name(model)
                return self._with_copies(project)

            async with session.turn:
                add = add and session.bench.model is not None and path.suffix.lower() != TEXT_SUFFIX
                if add and (is_project(path) or path.suffix.lower() in GCODE_SUFFIXES):
                    raise PlanError(f"{name} is a plate of its own, so it is opened alone: no model goes beside it")
                if add:
                    await session.add_model(path, name)
                    taken = True
                elif is_project(path):
                    await session.open_project(path, name, taken_over)
                elif path.suffix.lower() in GCODE_SUFFIXES:
                    await session.open_gcode(path, name)
                elif path.suffix.lower() not in (TEXT_SUFFIX, *READERS):
                    kinds = f"models ({', '.join(READERS)}), G-code ({', '.join(sorted(GCODE_SUFFIXES))})"
                    raise PlanError(f"{name}: {kinds}, plans and profiles ({TEXT_SUFFIX}) can be opened")
                elif path.suffix.lower() != TEXT_SUFFIX:
                    await session.open_model(path, name)
                    taken = True
                elif not await self._take_profile(path, session):
                    await session.open_plan(path)
        finally:
            waits = session.unscaled is not None and session.unscaled.path == path
            if not taken and not waits:  # refused, or text that has been read completely
                remove_file(path)
        return JSONResponse({})


def _kept_folder(request: Request) -> Path:
    """The requested folder of kept work. Raises PlanError."""
    name = request.path_params["name"]
    folder = next((folder for folder in folders_kept() if folder.name == name), None)
    if folder is None:
        raise PlanError(OPEN_ELSEWHERE)
    return folder


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
            f" tiltprint edit with the file's name, or with a larger {option('upload-mib')}"
        )
