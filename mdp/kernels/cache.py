"""Cache: the folders of the compiled kernels, one a source file, a new one whenever the sources of its kernels change.

numba looks only at the file that a kernel stands in: of parts and constants from other files it would go on to use the old ones.
"""

import os
import re
from functools import cache
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from time import time

from platformdirs import user_cache_path

PACKAGES = Path(__file__).resolve().parents[2]
IMPORTED = re.compile(rb"^from ((?:profiles|mdp|slicer|machine)(?:\.\w+)+) import", re.MULTILINE)
HAS_KERNELS = b"from mdp.kernels.kernel import"
UNUSED_S = 60 * 86400.0  # folders of older versions go after this time: a program that still runs may be using them


def home() -> Path:
    """The folder of all kernels: what NUMBA_CACHE_DIR names, else the user's cache folder."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    if named:
        return Path(named)
    return user_cache_path("tiltprint", appauthor=False) / "kernels"


_loaded: set[str] = set()  # names of the folders of the files whose kernels are loaded


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


def folder(file: Path) -> Path:
    """The folder of a file's kernels; those of its older versions go when they are old enough."""
    own = home() / f"{file.parent.name}.{file.stem}-{digest(sources(file))}"
    if not own.exists():
        _clear(own.parent, f"{file.parent.name}.{file.stem}-*")
    _loaded.add(own.name)
    return own


def mark(purpose: str) -> Path:
    """The file that, where it exists, says that the loaded modules' kernels for a purpose are all cached."""
    return home() / f"{purpose}-{sha256(' '.join(sorted(_loaded)).encode()).hexdigest()[:16]}"


def _clear(parent: Path, names: str) -> None:
    """Remove what has not been changed for long."""
    for old in parent.glob(names):
        try:
            if old.stat().st_mtime < time() - UNUSED_S:
                rmtree(old, ignore_errors=True)
        except FileNotFoundError:  # another process was faster
            continue
