"""Cache of compiled kernels, one folder per source file: those shipped with the program and those compiled here.

A folder's name is a hash of everything that its kernels depend on, so a match is always valid: the text of the file and of the
files that its helpers and constants come from (numba checks the file alone), and the target. Where the program is installed does
not matter.

The target is one processor model for all machines of a kind, so that compiled kernels can be shipped. x86-64-v3 is what
processors of PCs have since 2013 (Intel) and 2015 (AMD); older ones and other kinds compile for themselves. NUMBA_CPU_NAME names
another one.

Machine code is loaded without numba's preparations for compiling. Whenever numba loads it, it imports everything that it can
compile, compiles its runtime, parses the kernel's LLVM code and lists its symbols: .4 s for the 58 kernels of an export, and 28
MB of LLVM. That waits until a kernel is compiled, which most runs never do.
"""

import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from pickle import UnpicklingError
from shutil import rmtree
from time import time
from typing import Any

import llvmlite
import numba
from llvmlite import binding
from numba import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target
from numba.core.runtime import _nrt_python

from profiles.folders import cache_folder, lost_at_end

PACKAGES = Path(__file__).resolve().parents[2]
SHIPPED = Path(__file__).resolve().parent / "compiled"  # made by .ci/ship_kernels.py; not there in a checkout
IMPORTED = re.compile(rb"^from ((?:profiles|mdp|slicer|machine)(?:\.\w+)+) import", re.MULTILINE)
HAS_KERNELS = b"from mdp.kernels.kernel import"
UNREADABLE = (OSError, EOFError, ValueError, UnpicklingError)  # raised for a file that is unreadable or cut short
UNUSED_S = 60 * 86400.0  # folders of older versions are removed after this time: a running program may still use them

COMMON = "x86-64-v3"
INSTRUCTIONS = {
    *("cx16", "sahf", "popcnt", "sse3", "ssse3", "sse4.1", "sse4.2"),
    *("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave"),
}

_loaded: set[str] = set()  # names of the folders of the files whose kernels are loaded and were not shipped
_troubles: list[str] = []


def _choose() -> None:
    """Make numba compile for the common target if this processor can run it, unless the environment names another."""
    try:
        known = binding.get_host_cpu_features()
    except RuntimeError:  # a kind of processor unknown to LLVM
        return
    named = {"NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"} & os.environ.keys()
    in_use = "_toplevel_target_context" in vars(cpu_target)  # other code has kernels in this process
    if not named and not in_use and all(known.get(name) for name in INSTRUCTIONS):
        # numba reads the variables again when one of them changes
        os.environ.update(NUMBA_CPU_NAME=COMMON, NUMBA_CPU_FEATURES="")
        config.reload_config()


_choose()
# Everything that machine code depends on besides its sources.
TARGET = " ".join(
    [
        f"{sys.implementation.cache_tag}{getattr(sys, 'abiflags', '')} numba {numba.__version__} llvmlite {llvmlite.__version__}",
        *("SVML" * config.USING_SVML, *cpu_target.target_context.codegen().magic_tuple()),
    ]
)


def home() -> Path:
    """The folder of the kernels compiled here: NUMBA_CACHE_DIR if set, else the user's cache folder."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    if named:
        return Path(named)
    kernels = cache_folder() / "kernels"
    if kernels.parent == lost_at_end():
        os.environ["NUMBA_CACHE_DIR"] = str(kernels)  # for the processes that help to compile
    return kernels


def trouble() -> str:
    """Why compiled kernels will be lost at the end of the process; "" if they are cached."""
    return _troubles[0] if _troubles else ""


@contextmanager
def _writing() -> Iterator[None]:
    """Context for writing to the folder of the kernels compiled here; records why the next run will not find what is written."""
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
    """The files from which a file's kernels are compiled: the file, the files it imports from, and the files that kernels among
    these import from.
    """
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
    """The name of the folder of a file's kernels; a different one whenever they would compile to something else."""
    whole = sha256(TARGET.encode())
    for source in sources(file):
        whole.update(f"{os.path.relpath(source, PACKAGES)}\n".replace(os.sep, "/").encode() + sha256(_text(source)).digest())
    return f"{file.parent.name}.{file.stem}-{whole.hexdigest()[:16]}"


class _Entries(CompileResultCacheImpl):
    """numba's cache entries of a kernel, with a locator for our folder alone.

    NUMBA_CACHE_LOCATOR_CLASSES would point to places without our source hashes; the stamp of a source needs no more than the
    folder's name.
    """

    def __init__(self, function: Any) -> None:
        file = Path(function.__code__.co_filename).resolve()
        self._py_file = str(file)  # numba's warnings name it
        self._path = home() / folder_name(file)
        self._lineno = function.__code__.co_firstlineno
        self._locator = self
        self._filename_base = f"{function.__name__}-{self._lineno}"

    def get_cache_path(self) -> str:
        return str(self._path)

    def get_source_stamp(self) -> str:
        return self._path.name

    def ensure_cache_path(self) -> None:
        """Create the folder, and remove those of older versions when they are old."""
        if not self._path.exists():
            _clear(self._path.parent, f"{self._path.name.rpartition('-')[0]}-*")
        self._path.mkdir(parents=True, exist_ok=True)


class LoadedLibrary(JITCodeLibrary):
    """A library of machine code; one that comes from the cache parses its LLVM code only when another kernel is compiled with
    it.
    """

    _bitcode = b""
    _shared_module: Any

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple[str, str, Any]) -> Any:
        name, kind, data = state
        if kind != "object":
            return super()._unserialize(codegen, state)
        library = cls(codegen, name)
        machine_code, library._bitcode = data
        library.enable_object_caching()
        library._set_compiled_object(machine_code)
        library._finalize_final_module()
        return library

    def _get_module_for_linking(self) -> Any:
        if self._bitcode and self._shared_module is None:
            self._shared_module = binding.parse_bitcode(self._bitcode)
        return super()._get_module_for_linking()

    def get_pointer_to_function(self, name: str) -> int:
        """Address of a function of the library."""
        if self._bitcode:
            address: int = self._codegen._engine.get_function_address(name)
            return address
        return int(super().get_pointer_to_function(name))


def prepare_loading(context: Any) -> None:
    """Prepare numba's target context for loading machine code, which calls the functions of numba's runtime by name."""
    if context.codegen()._library_class is not LoadedLibrary:
        for name, address in _nrt_python.c_helpers.items():
            binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)
        context.codegen()._library_class = LoadedLibrary


class KernelCache(FunctionCache):
    """The cache of one kernel: first the shipped code, then code compiled here; a kernel that cannot be cached is used all the
    same.
    """

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
    """Marker file: it exists if the loaded modules' kernels for a purpose are all cached."""
    return home() / f"{purpose}-{sha256(' '.join(sorted(_loaded)).encode()).hexdigest()[:16]}"


def is_cached(purpose: str) -> bool:
    """Whether the loaded modules' kernels for a purpose are all cached; shipped ones are."""
    return not _loaded or mark(purpose).exists()


def keep(purpose: str) -> None:
    """Note for later runs that the kernels for a purpose are all cached, unless they could not be written."""
    if not trouble():
        with _writing():
            home().mkdir(parents=True, exist_ok=True)
            mark(purpose).touch()


def _clear(parent: Path, names: str) -> None:
    """Remove folders that have not changed for UNUSED_S."""
    for old in parent.glob(names):
        try:
            if old.stat().st_mtime < time() - UNUSED_S:
                rmtree(old, ignore_errors=True)
        except FileNotFoundError:  # another process was faster
            continue
