"""Folders for the user's settings, compiled kernels and logs, also without a home folder.

The user of a container often has no name, no home, or a home that cannot be written. Then a private folder among the temporary
files is used; if that belongs to another user, this run creates its own and removes it at the end.
"""

import atexit
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

from platformdirs import user_cache_path, user_config_path, user_state_path

from profiles.errors import OutputError

PRIVATE = 0o700


def settings_folder() -> Path:
    """The folder of the user's own settings, in $XDG_CONFIG_HOME or the system's usual place; it may not exist."""
    with suppress(RuntimeError):  # a user without a home
        return user_config_path("tiltprint", appauthor=False, roaming=True)
    return _writable(iter((_temporary() / "settings",)))


def cache_folder() -> Path:
    """An existing, writable folder for caches, in $XDG_CACHE_HOME or the system's usual place."""
    return _writable(_candidates("cache"))


def state_folder() -> Path:
    """An existing, writable folder for logs and journals, in $XDG_STATE_HOME or the system's usual place; private to the user."""
    folder = _writable(_candidates("state"))
    if stat.S_IMODE(folder.stat().st_mode) & ~PRIVATE:
        with suppress(OSError):  # another user's: what is written there is private itself
            folder.chmod(PRIVATE)
    return folder


def state_folders() -> tuple[Path, ...]:
    """The folders that state_folder() chooses from, best first, whether or not they exist or can be written."""
    folders = []
    with suppress(OutputError):
        for folder in _candidates("state"):
            folders.append(folder)
    return tuple(folders)


def lost_at_end() -> Path | None:
    """The folder that this run removes at its end, if it has one."""
    return _of_this_run() if _of_this_run.cache_info().currsize else None


def _candidates(kind: str) -> Iterator[Path]:
    with suppress(RuntimeError):
        yield {"cache": user_cache_path, "state": user_state_path}[kind]("tiltprint", appauthor=False)
    yield _temporary() / kind


def _writable(folders: Iterator[Path]) -> Path:
    for folder in folders:
        if _is_ours(folder):
            return folder
    return _of_this_run()


def _is_ours(folder: Path) -> bool:
    """Whether the folder can be written; it is created if missing. A folder for temporary files must be private to this user."""
    try:
        if folder.parent == _temporary():
            folder.parent.mkdir(PRIVATE, exist_ok=True)
            if not _is_private(folder.parent):
                return False
        folder.mkdir(PRIVATE, parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _is_private(folder: Path) -> bool:
    status = folder.lstat()
    if not hasattr(os, "geteuid"):  # Windows: each user has a folder for temporary files
        return stat.S_ISDIR(status.st_mode)
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid() and not stat.S_IMODE(status.st_mode) & ~PRIVATE


def _temporary() -> Path:
    """This user's folder among the temporary files. Raises OutputError if none can be created."""
    try:
        folder = Path(tempfile.gettempdir())
    except FileNotFoundError:
        raise OutputError("no folder for temporary files can be written: set the variable TMPDIR to one") from None
    return folder / (f"tiltprint-{os.geteuid()}" if hasattr(os, "geteuid") else "tiltprint")


@cache
def _of_this_run() -> Path:
    folder, owner = Path(tempfile.mkdtemp(prefix="tiltprint-")), os.getpid()

    def remove() -> None:
        if os.getpid() == owner:  # and not a process forked from it
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    return folder
