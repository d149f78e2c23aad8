"""Handling of Ctrl-C, termination requests and a closed terminal."""

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
GRACE_S = 1.2  # grace period after Ctrl-C: native code notices it only when it has finished
SHOW_CURSOR = "\r\x1b[K\x1b[?25h"
END = b"\0"  # not a signal number
COMPILER = f"{os.sep}llvmlite{os.sep}", f"{os.sep}numba{os.sep}"  # path components of their files


@contextmanager
def stopping(stop: threading.Event) -> Iterator[None]:
    """Set a flag at the first interrupt, so that the work can end cleanly; the second one raises KeyboardInterrupt at once."""

    def act() -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    with _handled(act):
        yield


@contextmanager
def interrupting() -> Iterator[None]:
    """Raise KeyboardInterrupt in the main thread at every interrupt, even at one just before a blocking call.

    Python runs signal handlers between instructions: a signal that comes after the last one before select() or read() is noted,
    but does not end the wait. A second signal therefore wakes the main thread until it has handled the first.
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
    """Call act in the main thread at every interrupt, for code that must not be left at an arbitrary instruction.

    An event loop is such code: an exception inside it leaves others waiting forever. A loop also replaces the file descriptor
    that wakes the main thread, so it is restored here.
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
    """Raise KeyboardInterrupt at Ctrl-C, but never inside the compiler, which would lose it or take it for an error of its own.

    Inside the compiler, and where Python ignores exceptions, the signal is sent again. The process ends despite native code.
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
    """End the process if the block still runs GRACE_S after an interrupt for which wanted() is true."""
    over = threading.Event()

    def hurry(number: int) -> None:
        if number == signal.SIGINT and wanted() and not over.wait(GRACE_S) and wanted():
            end_at_once()

    with _overheard(hurry):
        try:
            yield
        finally:
            over.set()


@contextmanager
def _overheard(act: Callable[[int], None]) -> Iterator[None]:
    """Call act with the number of each signal in a thread of its own, even while the main thread is busy."""
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
    """End this process as interrupted, whatever its threads do; its child processes end, too."""
    with suppress(OSError, ValueError):  # the terminal, or the reader of the pipe, has gone
        if sys.stderr.isatty():
            sys.stderr.write(SHOW_CURSOR)
        sys.stderr.write("tiltprint: interrupted\n")
        sys.stderr.flush()
    leave(130)


def leave(code: int) -> None:
    """End this process without waiting for its idle threads; exit handlers end its child processes."""
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
    # Ignored signals stay ignored, which is the purpose of nohup.
    before = {number: signal.signal(number, handle) for number in signals if signal.getsignal(number) is not signal.SIG_IGN}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def leave_terminal() -> None:
    """Redirect the closed terminal's descriptors to nowhere, so that output fails nowhere before the heaters are off."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        with suppress(OSError):
            if stat.S_ISCHR(os.fstat(descriptor).st_mode):
                os.dup2(nowhere, descriptor)
    os.close(nowhere)
