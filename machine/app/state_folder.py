"""State folder: where logs and other traces of runs are left for the user to look at later."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from platformdirs import user_state_path


def state_folder() -> Path:
    """An existing folder that can be written: in $XDG_STATE_HOME, else where the platform keeps such files.

    Where neither can be had (no home, a full or read-only disk) it is the folder for temporary files.
    """
    for folder in _candidates():
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.gettempdir())


def _candidates() -> Iterator[Path]:
    with suppress(RuntimeError):  # a user without a home
        yield user_state_path("tiltprint", appauthor=False)
    yield Path(tempfile.gettempdir()) / "tiltprint"
