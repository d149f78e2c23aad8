"""Output: files appear whole or not at all, and stdout carries results only."""

import json
import os
import sys
from collections.abc import Iterable
from os.path import exists, isdir, isfile, islink, splitext  # pathlib's raise for a name that is too long
from pathlib import Path
from typing import Any
from unicodedata import normalize

from machine.pipeline.requests import STDOUT, Outputs
from mdp.decomposition import Decomposition
from mdp.save import FOLDER_FILES, HEADING, PART_FILES, glb, part_file, stl, threemf
from profiles.errors import OutputError, reason
from profiles.files import PRIVATE, SHARED, write_whole
from profiles.messages import option

LONGEST_NAME, LONGEST_SUFFIX = 150, 20  # bytes, which a disk counts


def plain_name(name: str) -> str:
    """A name that a file has on any system: letters and digits of any script stay.

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
    """Refuse early what could not be written at the end of long work."""
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
    """The same for all files and the folder that a command was asked for."""
    if outputs.folder is not None:
        check_folder(outputs.folder)
    if STDOUT in (outputs.gcode, outputs.json) and getattr(sys.stdout, "name", "") == os.devnull:  # see machine.cli.start
        raise OutputError("output -: standard output is closed")
    streams = (None if file == STDOUT else file for file in (outputs.gcode, outputs.json))
    files = (outputs.png, outputs.sheet, outputs.front, outputs.record, outputs.html, outputs.svg, outputs.plan)
    for file in (*files, *streams):
        if file is not None:
            check_writable(file)


def make_folder(path: Path) -> None:
    """The folder, with those above it. Raises OutputError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _not_written(path, error) from None


def _check_name(path: Path) -> None:
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:  # too long, a link to itself, a folder that may not be looked into
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
    """Refuse early a folder that cannot be made or written."""
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
    """Write a file whole or not at all, through a link that stands in its place; private: for this user only.

    Raises OutputError.
    """
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
    """Write a profile of the user's own, the file before beside it. Raises OutputError."""
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
    """Write text lines, whole or not at all; the path - stands for standard output."""
    _write_text(path, "\n".join(lines) + "\n", private)


def write_json(path: Path, value: Any) -> None:
    """Write a value as JSON; the path - stands for standard output."""
    _write_text(path, json.dumps(value, indent=2) + "\n")


def _write_text(path: Path, text: str, private: bool = False) -> None:
    if path == STDOUT:
        sys.stdout.write(text)
    else:
        write_bytes(path, text.encode(), private)


def _is_device(path: Path) -> bool:
    """Whether a name stands for a device or a pipe (/dev/null, /dev/stdout), which must not be replaced by a file."""
    return exists(path) and not isfile(path) and not isdir(path)


MODEL, FIGURES, PLAN, SCENE = FOLDER_FILES


def save_parts(folder: Path, decomposition: Decomposition, figures: dict[str, Any]) -> None:
    """Write the parts, the scenes that hold them all, and the figures. Raises OutputError."""
    make_folder(folder)
    for part in decomposition.parts:
        write_bytes(folder / part_file(part.index), stl(part.mesh))
    _drop_earlier_parts(folder, len(decomposition.parts))
    write_bytes(folder / MODEL, threemf(decomposition))
    write_bytes(folder / SCENE, glb(decomposition))
    write_json(folder / FIGURES, figures)


def _drop_earlier_parts(folder: Path, parts: int) -> None:
    """Delete the parts that an earlier run has left beside the new ones; files of other programs stay."""
    now = {part_file(index) for index in range(1, parts + 1)}
    for file in folder.glob(PART_FILES):
        if file.name not in now and file.is_file() and file.open("rb").read(len(HEADING)) == HEADING:
            delete(file)
