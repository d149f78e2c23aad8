"""Cache: where compiled kernels are kept, in a folder a source file: those shipped with the program and those compiled here.

A folder's name tells all that its kernels depend on, so a match is always valid: the text of the file and of those that its
helpers and constants come from (numba looks at the file alone), and the target. Where the program is installed does not matter.
"""

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from pickle import UnpicklingError
from shutil import rmtree
from time import time
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile

from mdp.kernels.loading import prepare_loading
from mdp.kernels.target import TARGET
from profiles.folders import cache_folder, lost_at_end

PACKAGES = Path(__file__).resolve().parents[2]
SHIPPED = Path(__file__).resolve().parent / "compiled"  # made by tools/ship_kernels.py; not there in a checkout
IMPORTED = re.compile(rb"^from ((?:profiles|mdp|slicer|machine)(?:\.\w+)+) import", re.MULTILINE)
HAS_KERNELS = b"from mdp.kernels.kernel import"
UNREADABLE = (OSError, EOFError, ValueError, UnpicklingError)  # what a file raises that may not be read or is cut short
UNUSED_S = 60 * 86400.0  # folders of older versions go after this time: a program that still runs may be using them

_loaded: set[str] = set()  # names of the folders of the files whose kernels are loaded and were not shipped
_troubles: list[str] = []


def home() -> Path:
    """The folder of the kernels compiled here: what NUMBA_CACHE_DIR names, else the user's cache folder."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    if named:
        return Path(named)
    kernels = cache_folder() / "kernels"
    if kernels.parent == lost_at_end():
        os.environ["NUMBA_CACHE_DIR"] = str(kernels)  # for the processes that help to compile
    return kernels


def trouble() -> str:
    """Why what was compiled is lost, "" where it is not."""
    return _troubles[0] if _troubles else ""


@contextmanager
def _writing() -> Iterator[None]:
    """Write to the folder of the kernels compiled here; note why what is written is not there for the next run."""
    try:
        yield
    except OSError as error:
        _troubles.append(f"{home()} cannot be written: {(error.strerror or str(error)).lower()}")
    if home().parent == lost_at_end():
        _troubles.append(f"no folder of this user can be written: set XDG_CACHE_HOME, or NUMBA_CACHE_DIR in place of {home()}")


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


@cache
def folder_name(file: Path) -> str:
    """The name of the folder of a file's kernels; another one whenever they would be compiled to something else."""
    whole = sha256(TARGET.encode())
    for source in sources(file):
        whole.update(f"{os.path.relpath(source, PACKAGES)}\n".replace(os.sep, "/").encode() + sha256(_text(source)).digest())
    return f"{file.parent.name}.{file.stem}-{whole.hexdigest()[:16]}"


class _Folder:
    """Where numba keeps a kernel that is compiled here; the stamp of a source needs to tell nothing that the name does not."""

    def __init__(self, file: Path) -> None:
        self._py_file = str(file)  # numba's warnings name it
        self._path = home() / folder_name(file)

    def get_cache_path(self) -> str:
        return str(self._path)

    def get_source_stamp(self) -> str:
        return self._path.name

    def ensure_cache_path(self) -> None:
        """Make the folder; those of older versions go when they are old."""
        if not self._path.exists():
            _clear(self._path.parent, f"{self._path.name.rpartition('-')[0]}-*")
        self._path.mkdir(parents=True, exist_ok=True)


class _Entries(CompileResultCacheImpl):
    """numba's entries of a kernel, in our folder and no other: where NUMBA_CACHE_LOCATOR_CLASSES points it knows no sources."""

    def __init__(self, function: Any) -> None:
        self._lineno = function.__code__.co_firstlineno
        self._locator = _Folder(Path(function.__code__.co_filename).resolve())
        self._filename_base = f"{function.__name__}-{self._lineno}"


class KernelCache(FunctionCache):
    """The cache of one kernel: what was shipped, else what was compiled here; what cannot be kept is used all the same."""

    _impl_class = _Entries

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        name = self._impl.locator.get_source_stamp()
        self._shipped = IndexDataCacheFile(str(SHIPPED / name), self._impl.filename_base, name)
        if not (SHIPPED / name).exists():
            _loaded.add(name)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        prepare_loading(target_context)
        with suppress(*UNREADABLE):
            shipped = self._shipped.load(self._index_key(sig, target_context.codegen()))
            if shipped is not None:
                return self._impl.rebuild(target_context, shipped)
        with suppress(*UNREADABLE):
            return self._load_overload(sig, target_context)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with _writing():
            super().save_overload(sig, data)


def mark(purpose: str) -> Path:
    """The file that, where it exists, says that the loaded modules' kernels for a purpose are all cached."""
    return home() / f"{purpose}-{sha256(' '.join(sorted(_loaded)).encode()).hexdigest()[:16]}"


def is_cached(purpose: str) -> bool:
    """Whether the loaded modules' kernels for a purpose are all cached, as those that were shipped are."""
    return not _loaded or mark(purpose).exists()


def keep(purpose: str) -> None:
    """Note for later runs that the kernels for a purpose are all cached, where they are."""
    if not trouble():
        with _writing():
            home().mkdir(parents=True, exist_ok=True)
            mark(purpose).touch()


def _clear(parent: Path, names: str) -> None:
    """Remove what has not been changed for long."""
    for old in parent.glob(names):
        try:
            if old.stat().st_mtime < time() - UNUSED_S:
                rmtree(old, ignore_errors=True)
        except FileNotFoundError:  # another process was faster
            continue
