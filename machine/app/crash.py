"""Crash: the log file of a bug, with what is needed to find it."""

import platform
import tempfile
import traceback
from collections.abc import Sequence
from importlib.metadata import distributions
from pathlib import Path

from machine.app.state_folder import state_folder

TOLD = {"tiltprint", "numpy", "numba", "manifold3d", "pyserial", "pydantic", "typer", "rich"}


def log_bug(error: BaseException, arguments: Sequence[str]) -> Path:
    """Write the traceback and the versions to a new file of the state folder and return its path."""
    versions = sorted(f"{d.name} {d.version}" for d in distributions() if d.name in TOLD)
    with tempfile.NamedTemporaryFile(
        "w", prefix="bug-", suffix=".log", dir=state_folder(), delete=False, encoding="utf-8", errors="backslashreplace"
    ) as file:
        file.write(f"arguments: {list(arguments)}\npython {platform.python_version()} on {platform.platform()}\n")
        file.write("\n".join(versions) + "\n\n" + "".join(traceback.format_exception(error)))
    return Path(file.name)
