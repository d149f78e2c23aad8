"""State folder: where logs and other traces of runs are kept for the user to look at later."""

import os
import sys
import tempfile
from pathlib import Path


def state_folder() -> Path:
    """An existing folder that can be written: in $XDG_STATE_HOME, else where the platform keeps such files.

    Where neither can be had (no home, a full or read-only disk) it is the folder for temporary files.
    """
    for folder in (_own(), Path(tempfile.gettempdir()) / "tiltprint"):
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.gettempdir())


def _own() -> Path:
    try:
        home = Path.home()
    except RuntimeError:  # a user without a home
        home = Path(tempfile.gettempdir())
    given = os.environ.get("XDG_STATE_HOME") or {
        "win32": os.environ.get("LOCALAPPDATA", ""),
        "darwin": str(home / "Library" / "Application Support"),
    }.get(sys.platform)
    return Path(given or home / ".local" / "state") / "tiltprint"
