"""Cache: the folders of the compiled kernels, one a source file, a new one whenever the sources of its kernels change.

numba looks only at the file that a kernel stands in: of parts and constants from other files it would go on to use the old ones.
"""

import os
import re
from functools import cache
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryFile
from time import time

from profiles.folders import cache_folder, lost_at_end

PACKAGES = Path(__file__).resolve().parents[2]
IMPORTED = re.compile(rb"^from ((?:profiles|mdp|slicer|machine)(?:\.\w+)+) import", re.MULTILINE)
HAS_KERNELS = b"from mdp.kernels.kernel import"
UNUSED_S = 60 * 86400.0  # folders of older versions go after this time: a program that still runs may be using them


def home() -> Path:
    """The folder of all kernels: what NUMBA_CACHE_DIR names, else the user's cache folder."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    if named:
        return Path(named)
    kernels = cache_folder() / "kernels"
    if kernels.parent == lost_at_end():
        os.environ["NUMBA_CACHE_DIR"] = str(kernels)  # for the processes that help to compile
        note_trouble(f"no folder of this user can be written: set XDG_CACHE_HOME, or NUMBA_CACHE_DIR in place of {kernels}")
    return kernels


_loaded: set[str] = set()  # names of the folders of the files whose kernels are loaded
_troubles: list[str] = []


def note_trouble(reason: str) -> None:
    """Note why kernels that are compiled now are not there for the next run."""
    if reason not in _troubles:
        _troubles.append(reason)


def note_unwritten(folder: Path, error: OSError) -> None:
    """The same for a folder that cannot be written."""
    note_trouble(f"{folder} cannot be written: {(error.strerror or str(error)).lower()}")


def trouble() -> str:
    """Why what was compiled is lost, "" where it is not."""
    return _troubles[0] if _troubles else ""


@cache
def _text(file: Path) -> bytes:
    return file.read_bytes() if file.is_file() else b""


def sources(file: Path) -> list[Path]:
    """The files that make a file's kernels: it, those it imports from, and those that kernels among these import from."""
    files, unread = {file}, [file]
    while unread:
        for module in IMPORTED.findall(_text(unread.pop())):
            imported = PACKAGES / (module.decode().replace(".", "/") + ".py")
            if imported not in files and _text(imported):
                files.add(imported)
                if HAS_KERNELS in _text(imported):
                    unread.append(imported)
    return sorted(files)


def digest(files: list[Path]) -> str:
    """A word that changes with the text of the files."""
    whole = sha256()
    for file in files:
        whole.update(f"{file}\n".encode() + sha256(_text(file)).digest())
    return whole.hexdigest()[:16]


def folder(file: Path) -> Path | None:
    """The folder of a file's kernels, None where it cannot be written; folders of older versions go when they are old."""
    own = home() / f"{file.parent.name}.{file.stem}-{digest(sources(file))}"
    if not own.exists():
        _clear(own.parent, f"{file.parent.name}.{file.stem}-*")
    _loaded.add(own.name)
    return own if _can_be_written(own) else None


@cache
def _can_be_written(own: Path) -> bool:
    try:
        own.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=own).close()
    except OSError as error:
        note_unwritten(own.parent, error)
        return False
    return True


def mark(purpose: str) -> Path:
    """The file that, where it exists, says that the loaded modules' kernels for a purpose are all cached."""
    return home() / f"{purpose}-{sha256(' '.join(sorted(_loaded)).encode()).hexdigest()[:16]}"


def keep(purpose: str) -> None:
    """Note for later runs that the kernels for a purpose are all cached, where they are."""
    cached = mark(purpose)
    if trouble():
        return
    try:
        cached.parent.mkdir(parents=True, exist_ok=True)
        cached.touch()
    except OSError as error:
        note_unwritten(cached.parent, error)


def _clear(parent: Path, names: str) -> None:
    """Remove what has not been changed for long."""
    for old in parent.glob(names):
        try:
            if old.stat().st_mtime < time() - UNUSED_S:
                rmtree(old, ignore_errors=True)
        except FileNotFoundError:  # another process was faster
            continue
