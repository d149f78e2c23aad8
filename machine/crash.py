"""Log files of bugs."""

import platform
import tempfile
import traceback
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import distributions
from pathlib import Path

from profiles.errors import OutputError, notes, reason
from profiles.files import keep_newest
from profiles.folders import state_folder

KEPT = 20  # log files
LIBRARIES = {"tiltprint", "numpy", "numba", "manifold3d", "pyserial", "pydantic", "typer", "rich"}


def log_bug(error: BaseException, arguments: Sequence[str]) -> Path:
    """Write the traceback and the versions to a new file of the state folder and return its path."""
    with suppress(OSError):  # another run may have deleted them
        keep_newest(state_folder().glob("bug-*.log"), KEPT - 1)
    versions = sorted(f"{d.name} {d.version}" for d in distributions() if d.name in LIBRARIES)
    with tempfile.NamedTemporaryFile(
        "w", prefix="bug-", suffix=".log", dir=state_folder(), delete=False, encoding="utf-8", errors="backslashreplace"
    ) as file:
        file.write(f"arguments: {list(arguments)}\npython {platform.python_version()} on {platform.platform()}\n")
        file.write("\n".join(versions) + "\n\n" + "".join(traceback.format_exception(error)))
    return Path(file.name)


def bug_in_words(error: BaseException, arguments: Sequence[str]) -> str:
    """Sentence that reports a bug, with the error's notes and the path of its log, or why that could not be written."""
    try:
        details = f"the details are in {log_bug(error, arguments)}"
    except (OSError, OutputError) as unwritten:
        why = reason(unwritten) if isinstance(unwritten, OSError) else str(unwritten)
        details = f"the details could not be written: {why}"
    return f"a bug in tiltprint: {type(error).__name__}: {error}{notes(error)}; {details}"
