"""Store: where the compiled kernels of a source file are kept, in a new folder whenever what they are made of changes.

numba looks only at the file that a kernel stands in: of parts and constants from other files it would go on to use the old ones.
"""

import os
import re
import sys
from functools import cache
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from time import time

PACKAGES = Path(__file__).resolve().parents[1]
IMPORTED = re.compile(rb"^from ((?:profiles|mdp|slicer|machine)(?:\.\w+)+) import", re.MULTILINE)
HAS_KERNELS = b"from mdp.kernel import"
UNUSED_S = 60 * 86400.0  # folders of older versions go after this time: a program that still runs may be using them


def home() -> Path:
    """The folder for all kernels: what NUMBA_CACHE_DIR names, else where the platform keeps what can be made again."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    if named:
        return Path(named)
    caches = os.environ.get("XDG_CACHE_HOME") or {
        "win32": os.environ.get("LOCALAPPDATA", ""),
        "darwin": str(Path.home() / "Library" / "Caches"),
    }.get(sys.platform)
    return Path(caches or Path.home() / ".cache") / "tiltprint" / "kernels"


_kept: set[str] = set()  # names of the folders asked for


@cache
def _text(file: Path) -> bytes:
    return file.read_bytes() if file.is_file() else b""


def sources(file: Path) -> list[Path]:
    """What the kernels of a file are made of: the file, those it imports from, those that kernels among these import from."""
    found, ahead = {file}, [file]
    while ahead:
        for module in IMPORTED.findall(_text(ahead.pop())):
            named = PACKAGES / (module.decode().replace(".", "/") + ".py")
            if named not in found and _text(named):
                found.add(named)
                if HAS_KERNELS in _text(named):
                    ahead.append(named)
    return sorted(found)


def state(files: list[Path]) -> str:
    """A word that changes with the text of the files."""
    whole = sha256()
    for file in files:
        whole.update(f"{file}\n".encode() + sha256(_text(file)).digest())
    return whole.hexdigest()[:16]


def folder(file: Path) -> Path:
    """The folder for the kernels of a file."""
    own = home() / f"{file.parent.name}.{file.stem}-{state(sources(file))}"
    if not own.exists():
        _clear(own.parent, f"{file.parent.name}.{file.stem}-*")
    _kept.add(own.name)
    return own


def all_kept(what: str) -> Path:
    """A file that stands for the work that leaves all kernels of the loaded modules for something in their folders."""
    return home() / f"{what}-{sha256(' '.join(sorted(_kept)).encode()).hexdigest()[:16]}"


def _clear(parent: Path, names: str) -> None:
    """Remove what has not been changed for long."""
    for old in parent.glob(names):
        try:
            if old.stat().st_mtime < time() - UNUSED_S:
                rmtree(old, ignore_errors=True)
        except FileNotFoundError:  # another process was faster
            continue
