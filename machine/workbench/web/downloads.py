"""Downloads: what a page saves and looks at: profiles, the plan, the parts, the G-code and the page of the print."""

from pathlib import Path
from urllib.parse import quote

from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from machine.pipeline.output import plain_name
from machine.pipeline.profile_file import profile_text
from machine.workbench.bench.settings import file_stem, settings_of
from machine.workbench.session.session import Session
from machine.workbench.session.slicing import Slices
from profiles.errors import PlanError
from profiles.places import KINDS


async def profile(session: Session, request: Request) -> Response:
    """The machine, the material or the process with what is changed of it, as a profile file."""
    given, kind = session.bench.given, request.path_params["kind"]
    if kind not in KINDS:
        return Response("there is no such profile\n", 404)
    name = getattr(given, kind)
    text = profile_text(kind, name, settings_of(given, kind))
    own = _saved_as(f"{plain_name(Path(name).stem) or kind}-own.toml")
    return Response(text, headers=own, media_type="application/toml")


async def project(session: Session, request: Request) -> Response:
    """The project file."""
    out = session.new_file()
    await session.make("saving the project", "make_project", out)
    return _once(out, "model/3mf", f"{file_stem(session.bench)}.3mf")


async def plan(session: Session, request: Request) -> Response:
    """The plan's file."""
    text: str = await session.make("cutting the parts", "make_plan")
    return Response(text, headers=_saved_as(f"{file_stem(session.bench)}-plan.toml"), media_type="application/toml")


async def folder(session: Session, request: Request) -> Response:
    """The folder of the parts as a zip."""
    out = session.new_file()
    await session.make("cutting the parts", "make_folder", out)
    return _once(out, "application/zip", f"{file_stem(session.bench)}-parts.zip")


async def pictures(session: Session, request: Request) -> Response:
    """The drawings of the parts as a zip."""
    out = session.new_file()
    await session.make("drawing the parts", "make_pictures", out)
    return _once(out, "application/zip", f"{file_stem(session.bench)}-pictures.zip")


async def print_page(session: Session, request: Request) -> Response:
    """The page of the last slices as `view` writes it, with its own content security policy in it."""
    slices = _slices(session, request)
    return _gone() if slices is None else FileResponse(slices.sliced.page, media_type="text/html")


async def print_text(session: Session, request: Request) -> Response:
    """The G-code of the last slices to look at, whatever the dry run found."""
    slices = _slices(session, request)
    return _gone() if slices is None else FileResponse(slices.sliced.gcode, media_type="text/plain")


async def print_walls(session: Session, request: Request) -> Response:
    """What is seen of a part that is sliced, as `work.walls` gives it."""
    drawn = session.slicing.walls_of(request.path_params["number"], request.path_params["part"])
    return _gone() if drawn is None else Response(drawn, media_type="application/octet-stream")


async def shared_page(session: Session, request: Request) -> Response:
    """The same as a file to save, with the comparison with one piece where that has been worked out."""
    page, alternatives, name = session.slicing.needed().sliced.page, session.comparing.rows(), f"{file_stem(session.bench)}.html"
    if not alternatives:
        return FileResponse(page, headers=_saved_as(name), media_type="text/html")
    out = session.new_file()
    await session.quick.run("share_page", page, alternatives, out)
    return _once(out, "text/html", name)


async def gcode(session: Session, request: Request) -> Response:
    """The G-code; with errors only for who has said that he wants it all the same."""
    sliced = session.slicing.needed().sliced
    if (errors := sliced.errors) and request.query_params.get("force") != "yes":
        count = f"{len(errors)} error{'s' * (len(errors) > 1)}"
        raise PlanError(
            f"the dry run found {count}, the first: {errors[0].message}: no G-code is saved unless you say that you want it all"
            " the same"
        )
    return FileResponse(sliced.gcode, headers=_saved_as(f"{file_stem(session.bench)}.gcode"), media_type="text/plain")


def _slices(session: Session, request: Request) -> Slices | None:
    """The last slices, where they are those that are asked for."""
    slices = session.slicing.latest()
    return slices if slices is not None and slices.sliced.key == request.path_params["key"] else None


def _gone() -> Response:
    return Response("these slices are not there any more\n", 404)


def _once(file: Path, kind: str, name: str) -> Response:
    """A file that goes when it has been sent."""
    remove = BackgroundTask(file.unlink, missing_ok=True)
    return FileResponse(file, headers=_saved_as(name), media_type=kind, background=remove)


def _saved_as(name: str) -> dict[str, str]:
    """How a browser is told a file's name, letters of all scripts as RFC 6266 has them."""
    plain = name.encode("ascii", "replace").decode().replace("?", "_")
    return {"content-disposition": f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quote(name)}"}
