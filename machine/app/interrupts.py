"""Interrupts: Ctrl-C, a termination request and a closed terminal, turned into a safe end."""

import os
import signal
import stat
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

HANGUP: tuple[signal.Signals, ...] = (signal.SIGHUP,) if hasattr(signal, "SIGHUP") else ()
ALL: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM, *HANGUP)


@contextmanager
def stopping(stop: threading.Event) -> Iterator[None]:
    """The first interrupt sets a flag, so that the work ends by itself; a second one raises KeyboardInterrupt at once."""

    def act() -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    with _handled(act):
        yield


@contextmanager
def interrupting() -> Iterator[None]:
    """Every interrupt raises KeyboardInterrupt in the main thread."""

    def act() -> None:
        raise KeyboardInterrupt

    with _handled(act):
        yield


@contextmanager
def _handled(act: Callable[[], None]) -> Iterator[None]:
    def handle(number: int, frame: FrameType | None) -> None:
        del frame
        if number in HANGUP:
            leave_terminal()
        act()

    signals = ALL if threading.current_thread() is threading.main_thread() else ()
    # What is ignored stays ignored: that is what nohup asks for.
    before = {number: signal.signal(number, handle) for number in signals if signal.getsignal(number) is not signal.SIG_IGN}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def leave_terminal() -> None:
    """The window is closed: what is still said must not end in an error before the heaters are off."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        with suppress(OSError):
            if stat.S_ISCHR(os.fstat(descriptor).st_mode):
                os.dup2(nowhere, descriptor)
    os.close(nowhere)
