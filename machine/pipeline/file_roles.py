"""File roles: what a command's files are for. None is written over one that is read, and none is written twice."""

import os
from collections.abc import Iterable
from os.path import isfile
from pathlib import Path

from machine.pipeline.requests import STDOUT, ModelRequest, Outputs
from mdp.model_file import DEMO
from mdp.ranking import SUFFIX
from profiles.errors import OutputError
from profiles.messages import option
from profiles.places import is_file_name

PROGRAM = ".gcode"  # ends the name of a program that is kept beside its journal
Role = tuple[str, Path | None]  # what the file is for, as a message says it, and its path; None: not asked for


def check_model_files(request: ModelRequest, written: Iterable[Role], *also_read: Role) -> None:
    """Raise OutputError where a command would write over what it reads, its own outputs included, or one file twice."""
    read = [*_read_by(request), *also_read]
    check_roles(read, (*_written(request.outputs), *written))
    if request.outputs.folder is not None:
        _check_folder(request.outputs.folder, read)


def printing_files(log: Path | None, journal: Path | None) -> tuple[Role, ...]:
    """The files that a print writes."""
    program = None if journal is None else program_beside(journal)
    return (option("log"), log), (option("journal"), journal), (f"the program beside {option('journal')}", program)


def program_beside(journal: Path) -> Path:
    """Where the program of a journal is kept when it is no file of its own."""
    return journal.with_name(journal.name + PROGRAM)


def check_roles(read: Iterable[Role], written: Iterable[Role]) -> None:
    """The same for any files. Two names of one file, by links or another folder's name, are one file."""
    known: dict[object, str] = {}
    for role, path in read:
        if path is not None and (same := _identity(path)) is not None:
            known.setdefault(same, f"{role}, which is read")
    for role, path in written:
        if path is None or path == STDOUT or (same := _identity(path)) is None:
            continue
        if same in known:
            raise OutputError(f"{role} {path} is the same file as {known[same]}: another name is expected")
        known[same] = f"{role}, which is written too"


def _identity(path: Path) -> object:
    """What is the same for all names of a file; None for a device or a pipe, which keeps nothing."""
    try:
        status = os.stat(path)
    except OSError:
        return os.path.realpath(path)
    return (status.st_dev, status.st_ino) if isfile(path) else None


def _read_by(request: ModelRequest) -> list[Role]:
    models = [("the model", Path(name)) for name in (request.model, *request.beside) if not name.startswith(DEMO)]
    profiles = zip(("machine", "material", "process"), request.profile_names, strict=False)
    ranker = Path(request.ranker) if request.ranker.endswith(SUFFIX) else None
    own = [(option(kind), Path(name)) for kind, name in profiles if name is not None and is_file_name(name)]
    plans = [(option("plan"), plan) for plan in request.plans]
    return [
        *models,
        ("the project", request.project),
        *plans,
        (option("planes"), request.planes),
        (option("ranker"), ranker),
        *own,
    ]


def _written(outputs: Outputs) -> list[Role]:
    names = ("gcode", "json", "html", "png", "sheet", "front", "svg", "record", "plan")
    label = {"gcode": "output", "html": "page"}
    return [(label.get(name, option(name)), getattr(outputs, name)) for name in names]


def _check_folder(folder: Path, read: Iterable[Role]) -> None:
    """A folder's own files have fixed names: none of them may be one that is read."""
    from mdp.save import FOLDER_FILES, PART_FILES

    own = {_identity(folder / name): name for name in FOLDER_FILES}
    own |= {_identity(file): file.name for file in folder.glob(PART_FILES)} if folder.is_dir() else {}
    for role, path in read:
        if role != option("plan") and path is not None and (name := own.get(_identity(path))) is not None:
            raise OutputError(
                f"output folder {folder} gets a file {name}, but that is {role}, which is read: another is expected"
            )
