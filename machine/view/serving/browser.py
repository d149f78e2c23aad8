"""Opens a page of this computer in the user's browser through a redirecting file.

All users of a computer can read the arguments of a process, and the address contains the token. Jupyter does the same
(jupyter_server/serverapp.py, write_browser_open_file).
"""

import os
import tempfile
import webbrowser
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from html import escape
from pathlib import Path
from threading import Thread

from machine.notices import say
from profiles.files import remove_older
from profiles.folders import state_folder

PREFIX, SUFFIX = "workbench-", ".html"
OLD_S = 24 * 3600.0  # files of killed programs are deleted after this time, long after any browser has started
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>tiltprint</title><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={address}"></head>
<body><p><a href="{address}">tiltprint</a></p></body></html>
"""


@contextmanager
def redirecting(address: str) -> Iterator[Path]:
    """Write a redirecting page that only this user can read, and delete it at the end. Raises OSError."""
    folder = state_folder()
    remove_older(folder.glob(f"{PREFIX}*{SUFFIX}"), OLD_S)
    opened, name = tempfile.mkstemp(prefix=PREFIX, suffix=SUFFIX, dir=folder)  # with mode 0600
    path = Path(name)
    try:
        with os.fdopen(opened, "w", encoding="utf-8") as file:
            file.write(PAGE.format(address=escape(address)))
        yield path
    finally:
        path.unlink(missing_ok=True)


def lead_browser(address: str, until_end: ExitStack) -> None:
    """Open a browser in the background, through a file that is deleted at the end of the program."""
    try:
        file = until_end.enter_context(redirecting(address))
    except OSError as error:
        say(f"no browser is opened, because its redirect file cannot be written: {error.strerror}; open the address yourself")
        return
    Thread(target=_show_in_browser, args=(file.as_uri(),), name="browser", daemon=True).start()


def _show_in_browser(address: str) -> None:
    if not webbrowser.open(address):
        say("no browser could be opened: open the address in one")
