"""Redirect: a file that leads a browser to a page of this computer. What a browser is started with every user of the computer can
read, and the address holds the token; Jupyter does it so, too (jupyter_server/serverapp.py, write_browser_open_file)."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from html import escape
from pathlib import Path

from profiles.folders import state_folder

PREFIX, SUFFIX = "workbench-", ".html"
OLD_S = 24 * 3600.0  # no browser takes so long to start: what a program that was killed has left goes
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>tiltprint</title><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={address}"></head>
<body><p><a href="{address}">tiltprint</a></p></body></html>
"""


@contextmanager
def redirecting(address: str) -> Iterator[Path]:
    """A file that this user alone can read, as long as the program goes on. Raises OSError where none can be written."""
    folder = state_folder()
    _remove_old(folder)
    opened, name = tempfile.mkstemp(prefix=PREFIX, suffix=SUFFIX, dir=folder)  # of mode 0600
    path = Path(name)
    try:
        with os.fdopen(opened, "w", encoding="utf-8") as file:
            file.write(PAGE.format(address=escape(address)))
        yield path
    finally:
        path.unlink(missing_ok=True)


def _remove_old(folder: Path) -> None:
    for file in folder.glob(f"{PREFIX}*{SUFFIX}"):
        with suppress(OSError):
            if time.time() - file.stat().st_mtime > OLD_S:
                file.unlink()
