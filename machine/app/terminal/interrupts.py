"""Interrupts: Ctrl-C, a termination request and a closed terminal, turned into a safe end."""

import atexit
import os
import select
import signal
import socket
import stat
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

HANGUP: tuple[signal.Signals, ...] = (signal.SIGHUP,) if hasattr(signal, "SIGHUP") else ()
ALL: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM, *HANGUP)
AGAIN_S = 0.1
PATIENCE_S = 1.2  # how long work may go on after Ctrl-C: native code hears of it only when it is done
SHOW_CURSOR = "\r\x1b[K\x1b[?25h"
COMPILER = f"{os.sep}llvmlite{os.sep}"


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
    """Every interrupt raises KeyboardInterrupt in the main thread, also one that comes just before that begins to wait."""
    with _woken() as hear:

        def act() -> None:
            hear()
            raise KeyboardInterrupt

        with _handled(act):
            yield


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

    def handle(number: int, frame: FrameType | None) -> None:
        while frame is not None:
            if COMPILER in frame.f_code.co_filename:
                later = threading.Timer(AGAIN_S, signal.pthread_kill, (main.ident, number))
                later.daemon = True
                later.start()
                return
            frame = frame.f_back
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, handle)
    try:
        with _hurried(lambda: signal.getsignal(signal.SIGINT) is handle):
            yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _hurried(wanted: Callable[[], bool]) -> Iterator[None]:
    """End the process when what is inside still runs PATIENCE_S after an interrupt that is wanted to end it.

    A thread hears of the signal by what Python writes at once, whatever the main thread does.
    """
    heard, noted = socket.socketpair()
    heard.settimeout(None)
    noted.setblocking(False)
    over = threading.Event()

    def serve() -> None:
        while not over.is_set():
            if signal.SIGINT in heard.recv(64) and wanted() and not over.wait(PATIENCE_S) and wanted():
                end_at_once()

    wakeup = signal.set_wakeup_fd(noted.fileno(), warn_on_full_buffer=False)
    thread = threading.Thread(target=serve, name="hurry", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        signal.set_wakeup_fd(wakeup)
        noted.send(b"\0")
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
    """End this process without waiting for its threads and the processes that help it, which have nothing to do any more."""
    processes = sys.modules.get("multiprocessing.process")
    for helper in processes.active_children() if processes is not None else ():
        helper.kill()
    atexit._run_exitfuncs()
    with suppress(OSError, ValueError):
        sys.stdout.flush()
    os._exit(code)


@contextmanager
def _woken() -> Iterator[Callable[[], None]]:
    """Wake the main thread until it has heard an interrupt, which it tells by the function given.

    Python's own handlers run between two of its instructions: a signal that comes after the last one before select() or read()
    is noted, but ends no waiting.
    """
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGUSR2"):
        yield lambda: None
        return
    main, over = threading.get_ident(), threading.Event()
    noted, write = os.pipe()  # what is in it has not been heard yet
    for descriptor in (noted, write):
        os.set_blocking(descriptor, False)

    def hear() -> None:
        with suppress(BlockingIOError):
            os.read(noted, 4096)

    def serve() -> None:
        while not over.is_set():
            select.select([noted], [], [])
            if not over.wait(AGAIN_S) and select.select([noted], [], [], 0.0)[0]:
                signal.pthread_kill(main, signal.SIGUSR2)

    before = signal.signal(signal.SIGUSR2, lambda number, frame: hear())
    wakeup = signal.set_wakeup_fd(write, warn_on_full_buffer=False)
    thread = threading.Thread(target=serve, name="interrupts", daemon=True)
    thread.start()
    try:
        yield hear
    finally:
        over.set()
        signal.set_wakeup_fd(wakeup)
        os.write(write, b"x")
        thread.join()
        signal.signal(signal.SIGUSR2, before)
        os.close(noted)
        os.close(write)


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
