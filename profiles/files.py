"""Files: written completely or not at all, locked between processes on every system that Python supports, and limited to the
newest; errors of damaged zips.
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

LOCKED_BYTE = 1 << 30  # on Windows, where others cannot read a locked byte: far beyond the end, which LockFileEx allows
LOCK = ".lock"  # the file that is locked in place of its folder where a folder cannot be opened
DAMAGED_ZIP: tuple[type[Exception], ...] = (  # what zipfile raises for a damaged file, besides OSError
    BadZipFile,
    EOFError,
    LookupError,  # there is no such member
    NotImplementedError,  # an unknown compression
    RuntimeError,  # a password
    ValueError,
    lzma.LZMAError,
    struct.error,  # a damaged directory
    zlib.error,
)
PRIVATE, SHARED = 0o600, 0o666  # modes: for this user only, for everybody whom the umask does not exclude


def is_zip(file: Path) -> bool:
    """Whether a file is a zip, or was one before it was damaged."""
    try:
        return is_zipfile(file)
    except BadZipFile:  # a damaged 64-bit directory; is_zipfile detects everything else
        return True


@contextmanager
def whole_file(path: Path, mode: int = PRIVATE) -> Iterator[BinaryIO]:
    """A binary file that gets its name only when the block ends without an error, so that no incomplete file is ever visible.

    Each writer has its own temporary file in the final folder. mode: reduced by the umask. Raises OSError.
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
    """Write a file completely or not at all. Raises OSError, which leaves an existing file unchanged."""
    with whole_file(path, mode) as file:
        file.write(content)


def modified_s(path: Path) -> float:
    """Time of a file's last change, seconds since 1970."""
    return path.stat().st_mtime


def dated_name() -> str:
    """A unique beginning of a file name; names sort by the time at which they were made."""
    return f"{datetime.now():%Y%m%d-%H%M%S-%f}-{os.getpid()}"


def keep_newest(
    paths: Iterable[Path],
    count: int,
    when: Callable[[Path], Any] = modified_s,
    in_use: Callable[[Path], bool] = lambda path: False,
) -> list[Path]:
    """Delete all but the newest `count` files or folders, and return those kept, newest first. when: the key they are sorted by,
    a date or a name that begins with it. in_use: whether an older one is kept too.

    Raises OSError.
    """
    dates = dict[Path, Any]()
    for path in paths:
        with suppress(FileNotFoundError):  # another process has deleted it
            dates[path] = when(path)
    newest = sorted(dates, key=dates.__getitem__, reverse=True)
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
    """Delete the files last written before a time, as far as possible."""
    for path in paths:
        with suppress(OSError):
            if time.time() - modified_s(path) > seconds:
                path.unlink()


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current


def lock(descriptor: int, shared: bool = False) -> bool:
    """Lock an open file until it is closed; False if another process holds it. shared: together with other readers.

    Returns True where the system or the disk has no locks, since other processes are then unknown.
    """
    return _try_lock(descriptor, shared) is not False


def _try_lock(descriptor: int, shared: bool) -> bool | None:
    """Whether the file could be locked; None where there are no locks."""
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
    """Lock a folder of this user until the descriptor is closed; None if another process holds it or it belongs to another user.

    surely: None also where there are no locks. Raises OSError.
    """
    if hasattr(os, "O_DIRECTORY"):
        opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    else:  # Windows opens no folder, and separates users itself
        opened = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT)
    own = not hasattr(os, "geteuid") or os.fstat(opened).st_uid == os.geteuid()
    locked = _try_lock(opened, False) if own else False
    if locked or (locked is None and not surely):
        return opened
    os.close(opened)
    return None


def remove_locked(folder: Path, descriptor: int) -> None:
    """Remove a folder locked by lock_folder(), as far as possible, its lock last. Windows removes no open file."""
    for path in folder.iterdir() if folder.is_dir() else ():
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        elif path.name != LOCK:
            with suppress(OSError):
                path.unlink()
    os.close(descriptor)
    shutil.rmtree(folder, ignore_errors=True)
