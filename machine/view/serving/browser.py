"""Browser: the person's own one, led to a page of this computer."""

import webbrowser
from contextlib import ExitStack
from threading import Thread

from machine.notices import say
from machine.view.serving.redirect import redirecting


def lead_browser(address: str, until_end: ExitStack) -> None:
    """Open a browser beside all else, by a file that is there until the program ends."""
    try:
        file = until_end.enter_context(redirecting(address))
    except OSError as error:
        say(f"no browser is opened, for no file can be written that leads it: {error.strerror}; open the address in one")
        return
    Thread(target=_show_in_browser, args=(file.as_uri(),), name="browser", daemon=True).start()


def _show_in_browser(address: str) -> None:
    if not webbrowser.open(address):
        say("no browser could be opened: open the address in one")
