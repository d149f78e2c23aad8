"""Output: files are written completely or not at all, never over an input; stdout carries only results."""

import json
import os
import sys
from collections.abc import Iterable
from os.path import exists, isdir, isfile, islink, splitext  # pathlib raises for names that are too long
from pathlib import Path
from typing import Any
from unicodedata import normalize

from machine.pipeline.requests import STDOUT, ModelRequest, Outputs
from mdp.decomposition import Decomposition
from mdp.model_file import DEMO
from mdp.ranking import SUFFIX
from mdp.save import FOLDER_FILES, HEADING, PART_FILES, glb, part_file, stl, threemf
from profiles.errors import OutputError, reason
from profiles.files import PRIVATE, SHARED, write_whole
from profiles.messages import option
from profiles.places import is_file_name

STREAMED = ("gcode", "json")  # outputs that can go to standard output
PROGRAM = ".gcode"  # suffix of a program kept beside its journal
Role = tuple[str, Path | None]  # the file's purpose, for messages, and its path; None: not requested
LONGEST_NAME, LONGEST_SUFFIX = 150, 20  # bytes, as disks count


def plain_name(name: str) -> str:
    """A file name valid on any system, with letters and digits of any script.

    >>> plain_name("Kätzchen 猫/2")
    'Kätzchen_猫_2'
    >>> plain_name(200 * "a" + ".stl")[-6:]
    'aa.stl'
    """
    plain = "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in normalize("NFC", name))
    stem, suffix = splitext(plain)
    kept = suffix if len(suffix.encode()) <= LONGEST_SUFFIX else ""
    return (stem if kept else plain).encode()[: LONGEST_NAME - len(kept.encode())].decode(errors="ignore") + kept


def check_writable(path: Path) -> None:
    """Refuse a file that could not be written, before long work. Raises OutputError."""
    if path == STDOUT:
        raise OutputError(f"output -: a file name is expected; {option('json')}, and -o of export, can go to standard output")
    if isdir(path):
        raise OutputError(f"output {path} is a folder: a file name is expected")
    _check_name(path)
    if exists(path) and not os.access(path, os.W_OK):
        raise OutputError(f"output {path} exists and is not writable")
    if not _is_device(path):
        _check_parent(path, (path.resolve() if islink(path) else path).parent)


def check_outputs(outputs: Outputs) -> None:
    """Refuse files and a folder of a command that could not be written. Raises OutputError."""
    if outputs.folder is not None:
        check_folder(outputs.folder)
    if STDOUT in (outputs.gcode, outputs.json) and getattr(sys.stdout, "name", "") == os.devnull:  # see machine.cli.start
        raise OutputError("output -: standard output is closed")
    for name, file in outputs.files.items():
        if file is not None and (file != STDOUT or name not in STREAMED):
            check_writable(file)


def make_folder(path: Path) -> None:
    """Create a folder with its parents. Raises OutputError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _not_written(path, error) from None


def _check_name(path: Path) -> None:
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:  # too long, a link to itself, or an inaccessible folder
        raise _not_written(path, error) from None


def _not_written(path: Path, error: OSError) -> OutputError:
    return OutputError(f"output {path} cannot be written: {reason(error)}")


def _check_parent(path: Path, folder: Path) -> None:
    if isfile(folder):
        raise OutputError(f"output {path}: {folder} is a file, not a folder")
    if not isdir(folder):
        raise OutputError(f"output {path}: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK):
        raise OutputError(f"output {path}: the folder {folder} is not writable")


def check_folder(path: Path) -> None:
    """Refuse a folder that could not be created or written, before long work. Raises OutputError."""
    if path == STDOUT:
        raise OutputError(f"output -: a folder is expected; only {option('json')} can go to standard output")
    _check_name(path)
    if exists(path) and not isdir(path):
        raise OutputError(f"output {path} is a file: a folder is expected")
    nearest = next(folder for folder in (path, *path.absolute().parents) if exists(folder))
    if isfile(nearest):
        raise OutputError(f"output {path}: {nearest} is a file, not a folder")
    if not os.access(nearest, os.W_OK):
        raise OutputError(f"output {path}: {nearest} is not writable")


def write_bytes(path: Path, content: bytes, private: bool = False) -> None:
    """Write a file completely or not at all, following a link; private: readable for this user only. Raises OutputError."""
    check_writable(path)
    try:
        if _is_device(path):
            path.write_bytes(content)
        else:
            write_whole(path.resolve(), content, PRIVATE if private else SHARED)
    except OSError as error:
        raise _not_written(path, error) from None


def refuse_to_overwrite(file: Path, replace: bool) -> None:
    """Raise OutputError for a file that exists, unless it may be replaced."""
    if file.exists() and not replace:
        raise OutputError(f"{file} exists: {option('replace')} writes over it, another name leaves it")


def write_own(file: Path, text: str, replace: bool) -> None:
    """Write a profile of the user, keeping the previous one beside it. Raises OutputError."""
    refuse_to_overwrite(file, replace)
    make_folder(file.parent)
    if file.exists():
        write_bytes(file.with_suffix(".toml.before"), file.read_bytes())
    write_bytes(file, text.encode())


def delete(path: Path) -> None:
    """Delete a file. Raises OutputError."""
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"output {path} cannot be deleted: {reason(error)}") from None


def write_lines(path: Path, lines: Iterable[str], private: bool = False) -> None:
    """Write text lines, completely or not at all; the path - is standard output."""
    _write_text(path, "\n".join(lines) + "\n", private)


def write_json(path: Path, value: Any) -> None:
    """Write a value as JSON; the path - is standard output."""
    _write_text(path, json.dumps(value, indent=2) + "\n")


def _write_text(path: Path, text: str, private: bool = False) -> None:
    if path == STDOUT:
        sys.stdout.write(text)
    else:
        write_bytes(path, text.encode(), private)


def _is_device(path: Path) -> bool:
    """Whether a path is a device or a pipe (/dev/null, /dev/stdout), which must not be replaced by a file."""
    return exists(path) and not isfile(path) and not isdir(path)


MODEL, FIGURES, PLAN, SCENE = FOLDER_FILES


def save_parts(folder: Path, decomposition: Decomposition, figures: dict[str, Any]) -> None:
    """Write the parts, the scenes with all of them, and the figures. Raises OutputError."""
    make_folder(folder)
    for part in decomposition.parts:
        write_bytes(folder / part_file(part.index), stl(part.mesh))
    _drop_earlier_parts(folder, len(decomposition.parts))
    write_bytes(folder / MODEL, threemf(decomposition))
    write_bytes(folder / SCENE, glb(decomposition))
    write_json(folder / FIGURES, figures)


def _drop_earlier_parts(folder: Path, parts: int) -> None:
    """Delete the parts of an earlier run; files of other programs stay."""
    now = {part_file(index) for index in range(1, parts + 1)}
    for file in folder.glob(PART_FILES):
        if file.name not in now and file.is_file() and file.open("rb").read(len(HEADING)) == HEADING:
            delete(file)


def check_model_files(request: ModelRequest, written: Iterable[Role], *also_read: Role) -> None:
    """Raise OutputError for an output that cannot be written, is also an input, or is named twice. written: files beside the
    request's outputs."""
    check_outputs(request.outputs)
    read = [*_read_by(request), *also_read]
    check_roles(read, (*_written(request.outputs), *written))
    if request.outputs.folder is not None:
        _check_folder(request.outputs.folder, read)


def printing_files(log: Path | None, journal: Path | None) -> tuple[Role, ...]:
    """The files that a print writes."""
    program = None if journal is None else program_beside(journal)
    return (option("log"), log), (option("journal"), journal), (f"the program beside {option('journal')}", program)


def program_beside(journal: Path) -> Path:
    """Path of a journal's program that is not a file of its own."""
    return journal.with_name(journal.name + PROGRAM)


def check_roles(read: Iterable[Role], written: Iterable[Role]) -> None:
    """Raise OutputError for a file that is read and written, or written twice. Links to one file are the same file."""
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
    """Key that is equal for all names of a file; None for a device or a pipe, which stores nothing."""
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
    label = {"gcode": "output", "html": "page"}
    return [(label.get(name, option(name)), file) for name, file in outputs.files.items()]


def _check_folder(folder: Path, read: Iterable[Role]) -> None:
    """Raise OutputError for an input with one of the fixed names in the output folder."""
    own = {_identity(folder / name): name for name in FOLDER_FILES}
    own |= {_identity(file): file.name for file in folder.glob(PART_FILES)} if folder.is_dir() else {}
    for role, path in read:
        if role != option("plan") and path is not None and (name := own.get(_identity(path))) is not None:
            raise OutputError(
                f"output folder {folder} gets a file {name}, but that is {role}, which is read: another is expected"
            )
