"""Interrupts: Ctrl-C, a termination request and a closed terminal, turned into a safe end."""

import atexit
import os
import signal
import socket
import stat
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from mdp.kernels.threads import harmless

HANGUP: tuple[signal.Signals, ...] = (signal.SIGHUP,) if hasattr(signal, "SIGHUP") else ()
ALL: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM, *HANGUP)
AGAIN_S = 0.1
PATIENCE_S = 1.2  # how long work may go on after Ctrl-C: native code hears of it only when it is done
SHOW_CURSOR = "\r\x1b[K\x1b[?25h"
END = b"\0"  # no signal has this number
COMPILER = f"{os.sep}llvmlite{os.sep}", f"{os.sep}numba{os.sep}"  # folders of its files


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
    """Every interrupt raises KeyboardInterrupt in the main thread, also one that comes just before that begins to wait.

    Python's own handlers run between two of its instructions: a signal that comes after the last one before select() or read()
    is noted, but ends no waiting. So another signal wakes the main thread until it has heard of the first.
    """
    heard, over = threading.Event(), threading.Event()

    def act() -> None:
        heard.set()
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGUSR2"):
        with _handled(act):
            yield
        return
    main = threading.get_ident()

    def wake(number: int) -> None:
        while number in ALL and not over.is_set() and not heard.wait(AGAIN_S):
            signal.pthread_kill(main, signal.SIGUSR2)
        heard.clear()

    before = signal.signal(signal.SIGUSR2, lambda number, frame: heard.set())
    try:
        with _overheard(wake), _handled(act):
            try:
                yield
            finally:
                over.set()
                heard.set()
    finally:
        signal.signal(signal.SIGUSR2, before)


@contextmanager
def calling(act: Callable[[], None]) -> Iterator[None]:
    """Every interrupt calls act in the main thread instead, for code that must not be left at any of its instructions.

    An event loop is such code: what is raised in the midst of its work leaves others waiting for that work for ever. It also
    takes away what wakes the main thread, which is given back here.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    wakeup = signal.set_wakeup_fd(-1)
    if wakeup >= 0:
        signal.set_wakeup_fd(wakeup, warn_on_full_buffer=False)
    try:
        with _handled(act):
            yield
    finally:
        signal.set_wakeup_fd(wakeup, warn_on_full_buffer=False)


@contextmanager
def outside_compiler() -> Iterator[None]:
    """Ctrl-C raises KeyboardInterrupt, but never beneath the compiler, which would lose it or take it for an error of its own.
    Where it comes while Python clears up, which loses it too, it comes again.

    Work that goes on all the same, in native code or waiting for threads, is ended with the process.
    """
    main, here = threading.main_thread(), threading.current_thread()
    if here is not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    if not hasattr(signal, "pthread_kill"):  # Windows
        with _hurried(lambda: signal.getsignal(signal.SIGINT) is signal.default_int_handler):
            yield
        return

    def again() -> None:
        later = threading.Timer(AGAIN_S, signal.pthread_kill, (main.ident, signal.SIGINT))
        later.daemon = True
        later.start()

    def handle(number: int, frame: FrameType | None) -> None:
        del number
        while frame is not None:
            if any(folder in frame.f_code.co_filename for folder in COMPILER):
                return again()
            frame = frame.f_back
        raise KeyboardInterrupt

    def unraisable(lost: "sys.UnraisableHookArgs") -> None:
        if lost.exc_type is KeyboardInterrupt:
            again()
        else:
            tell_unraisable(lost)

    before, tell_unraisable = signal.signal(signal.SIGINT, handle), sys.unraisablehook
    sys.unraisablehook = unraisable
    try:
        with _hurried(lambda: signal.getsignal(signal.SIGINT) is handle):
            yield
    finally:
        sys.unraisablehook = tell_unraisable
        signal.signal(signal.SIGINT, before)


@contextmanager
def _hurried(wanted: Callable[[], bool]) -> Iterator[None]:
    """End the process when what is inside still runs PATIENCE_S after an interrupt that is wanted to end it."""
    over = threading.Event()

    def hurry(number: int) -> None:
        if number == signal.SIGINT and wanted() and not over.wait(PATIENCE_S) and wanted():
            end_at_once()

    with _overheard(hurry):
        try:
            yield
        finally:
            over.set()


@contextmanager
def _overheard(act: Callable[[int], None]) -> Iterator[None]:
    """A thread acts on every signal by its number, whatever the main thread does: Python writes it at once to a socket."""
    heard, noted = socket.socketpair()
    noted.setblocking(False)

    def serve() -> None:
        while END not in (numbers := heard.recv(64)):
            for number in numbers:
                act(number)

    wakeup = signal.set_wakeup_fd(noted.fileno(), warn_on_full_buffer=False)
    thread = harmless(threading.Thread(target=serve, name="signals", daemon=True))
    thread.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(wakeup)
        noted.send(END)
        thread.join()
        heard.close()
        noted.close()


def end_at_once() -> None:
    """End this process as interrupted, whatever its threads do; its helpers end with it."""
    with suppress(OSError, ValueError):  # the terminal, or who reads the pipe, has gone away
        if sys.stderr.isatty():
            sys.stderr.write(SHOW_CURSOR)
        sys.stderr.write("tiltprint: interrupted\n")
        sys.stderr.flush()
    leave(130)


def leave(code: int) -> None:
    """End this process without waiting for its threads, which have nothing to do any more; those that help it end with it."""
    atexit._run_exitfuncs()
    with suppress(OSError, ValueError):
        sys.stdout.flush()
    os._exit(code)


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
