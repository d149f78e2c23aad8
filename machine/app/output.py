"""Output: files appear whole or not at all, and stdout carries results only."""

import json
import os
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from profiles.errors import OutputError


def check_writable(path: Path) -> None:
    """Refuse early what could not be written at the end of long work."""
    if path.is_dir():
        raise OutputError(f"output {path} is a folder: a file name is expected")
    folder = path.parent
    if folder.is_file():
        raise OutputError(f"output {path}: {folder} is a file, not a folder")
    if not folder.is_dir():
        raise OutputError(f"output {path}: the folder {folder} does not exist")
    if not os.access(folder, os.W_OK):
        raise OutputError(f"output {path}: the folder {folder} is not writable")


def check_folder(path: Path) -> None:
    """Refuse early a folder that cannot be made or written."""
    if path.exists() and not path.is_dir():
        raise OutputError(f"output {path} is a file: a folder is expected")
    nearest = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if nearest.is_file():
        raise OutputError(f"output {path}: {nearest} is a file, not a folder")
    if not os.access(nearest, os.W_OK):
        raise OutputError(f"output {path}: {nearest} is not writable")


def write_bytes(path: Path, content: bytes) -> None:
    """Write beside the target, then rename, so that no half-written file is ever seen. Raises OutputError."""
    check_writable(path)
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
            beside = Path(file.name)
            try:
                file.write(content)
                file.flush()
                beside.chmod(0o666 & ~_umask())
            except BaseException:
                beside.unlink()
                raise
        beside.replace(path)
    except OSError as error:
        raise OutputError(f"output {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def write_lines(path: Path, lines: Iterable[str]) -> None:
    """Write text lines, whole or not at all."""
    write_bytes(path, ("\n".join(lines) + "\n").encode())


def write_json(path: Path, value: Any) -> None:
    """Write a value as JSON; the path - stands for standard output."""
    text = json.dumps(value, indent=2) + "\n"
    if str(path) == "-":
        sys.stdout.write(text)
    else:
        write_bytes(path, text.encode())


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
