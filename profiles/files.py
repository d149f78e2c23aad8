"""Files: written whole or not at all, locked for one process at a time on every system that Python runs on, only the newest
kept; and damaged zips.
"""

import errno
import lzma
import os
import shutil
import struct
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import BadZipFile, is_zipfile

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]
if sys.platform == "win32":
    import msvcrt

LOCKED_BYTE = 1 << 30  # on Windows, where nobody else can read what is locked: far behind the end, which LockFileEx allows
LOCK = ".lock"  # the file in a folder that is locked for it, where a folder cannot be opened
DAMAGED_ZIP: tuple[type[Exception], ...] = (  # what zipfile raises for one, beside OSError
    BadZipFile,
    EOFError,
    LookupError,  # there is no such member
    NotImplementedError,  # a compression that is not known
    RuntimeError,  # a password
    ValueError,
    lzma.LZMAError,
    struct.error,  # a mangled directory
    zlib.error,
)
PRIVATE, SHARED = 0o600, 0o666  # modes: for this user alone, for all whom the umask does not exclude


def is_zip(file: Path) -> bool:
    """Whether a file is a zip, or was one before it was damaged."""
    try:
        return is_zipfile(file)
    except BadZipFile:  # of its 64-bit directory; for all else that is wrong with it is_zipfile has an answer
        return True


@contextmanager
def whole_file(path: Path, mode: int = PRIVATE) -> Iterator[BinaryIO]:
    """A binary file that gets its name only when the block ends without an error: a half-written one is never seen.

    Each writer has a temporary file of its own, in the same folder. mode: less what the umask takes away. Raises OSError.
    """
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=".tiltprint-")
    beside = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as file:
            yield file
        beside.chmod(mode & ~_umask())
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def write_whole(path: Path, content: bytes, mode: int = PRIVATE) -> None:
    """Write a file whole or not at all. Raises OSError, then what was there before is there still."""
    with whole_file(path, mode) as file:
        file.write(content)


def modified_s(path: Path) -> float:
    """When a file was written last, seconds since 1970."""
    return path.stat().st_mtime


def dated_name() -> str:
    """Begin of a file's name that no other has, and by which names are sorted as their files were begun."""
    return f"{datetime.now():%Y%m%d-%H%M%S-%f}-{os.getpid()}"


def keep_newest(
    paths: Iterable[Path],
    count: int,
    when: Callable[[Path], Any] = modified_s,
    in_use: Callable[[Path], bool] = lambda path: False,
) -> list[Path]:
    """Delete all but the newest `count` files or folders; those that stay, the newest first. when: what they are sorted by: their
    date, or a name that begins with it. in_use: which older ones stay, too.

    Raises OSError.
    """
    newest = sorted(paths, key=when, reverse=True)
    kept = [*newest[:count], *(path for path in newest[count:] if in_use(path))]
    for path in newest[count:]:
        if path in kept:
            continue
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
    return kept


def remove_older(paths: Iterable[Path], seconds: float) -> None:
    """Delete the files that were written longer ago, as far as possible."""
    for path in paths:
        with suppress(OSError):
            if time.time() - modified_s(path) > seconds:
                path.unlink()


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current


def lock(descriptor: int, shared: bool = False) -> bool:
    """Lock an open file until it is closed; False when another process holds it. shared: with others who only read.

    Where the system or the disk has no locks nothing is known of other processes: True.
    """
    return _try_lock(descriptor, shared) is not False


def _try_lock(descriptor: int, shared: bool) -> bool | None:
    """Whether it could be locked; None where there are no locks."""
    try:
        if sys.platform == "win32":
            os.lseek(descriptor, LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        elif fcntl is not None:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        else:
            return None
    except OSError as error:
        return False if error.errno in (errno.EAGAIN, errno.EACCES) else None
    return True


def lock_folder(folder: Path, surely: bool = False) -> int | None:
    """Lock a folder of this user's until the descriptor is closed; None when another process holds it, or it is somebody else's.

    surely: None also where there are no locks, so that nothing is known of other processes. Raises OSError.
    """
    if hasattr(os, "O_DIRECTORY"):
        opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    else:  # Windows opens no folder, and keeps each user's own apart itself
        opened = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT)
    own = not hasattr(os, "geteuid") or os.fstat(opened).st_uid == os.geteuid()
    locked = _try_lock(opened, False) if own else False
    if locked or (locked is None and not surely):
        return opened
    os.close(opened)
    return None


def remove_locked(folder: Path, descriptor: int) -> None:
    """Remove a folder that lock_folder() has locked, as far as possible; the lock goes last. Windows removes no open file."""
    for path in folder.iterdir() if folder.is_dir() else ():
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        elif path.name != LOCK:
            with suppress(OSError):
                path.unlink()
    os.close(descriptor)
    shutil.rmtree(folder, ignore_errors=True)
