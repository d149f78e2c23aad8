"""Workers: fresh interpreters that run one call after another for this process, and the pipe protocol between two processes.

Messages are pickles preceded by their length. While it works, a worker can report progress; then it answers with the call's
return value or error message. It leads a session of its own: Ctrl-C at the terminal does not reach it, and one signal ends it
with all that it has started. It ends by itself when no process can call it, or when it has been idle too long.

multiprocessing, concurrent.futures and pebble have no such worker: theirs run the main module of this process again, stay in its
session, report no progress, and continue their work when this process is killed.
"""

import os
import pickle
import signal
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pkgutil import resolve_name
from queue import Empty, SimpleQueue
from threading import Thread, Timer
from time import monotonic
from typing import IO, Any, BinaryIO, NoReturn

from mdp.kernels import threads

Tell = Callable[[Any], None]  # function by which a long task reports progress to its caller
Task = Callable[..., Any] | str  # a module-level function, or "module:function" that the caller need not import

LENGTH = struct.Struct("<Q")
TELLS, DONE, FAILED = "tells", "done", "failed"
SPARE_S = 1.0  # a worker waits this much longer than its parent would call it
ONE_CORE = {"OPENBLAS_NUM_THREADS": "1"}  # numpy's library for products would take all cores
OOM_SCORE = "/proc/self/oom_score_adj", "500"  # when memory runs out, Linux kills a worker rather than its parent


class CallError(Exception):
    """A call failed; str() gives the reason."""


class KilledError(CallError):
    """The worker died during the call; a retry may succeed."""


def frame(value: Any) -> bytes:
    """A value as a message: its length and its pickle."""
    content = pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
    return LENGTH.pack(len(content)) + content


def read_frames(pipe: IO[bytes]) -> Iterator[Any]:
    """The values received through a pipe until it ends; an incomplete message also ends it. Raises what pickle raises for a
    complete but unreadable message.
    """
    while head := _read(pipe, LENGTH.size):
        content = _read(pipe, *LENGTH.unpack(head))
        if not content:
            return
        yield pickle.loads(content)


def _read(pipe: IO[bytes], size: int) -> bytearray:
    """Exactly `size` bytes; empty if the pipe ends before."""
    content = bytearray()
    while len(content) < size:
        more = pipe.read(size - len(content))
        if not more:
            return bytearray()
        content += more
    return content


def listen(pipe: IO[bytes], take: Callable[[Any], None], end: Callable[[], None]) -> None:
    """Pass each value received through a pipe to take(); call end() when no more can come, however the other side ended.

    An unreadable message also calls end(): no process can reach this one again.
    """
    try:
        for value in read_frames(pipe):
            take(value)
    except OSError:
        pass
    finally:
        end()


class Interpreter:
    """A fresh interpreter with this process's import path that runs some code and exchanges messages through pipes. leads:
    whether it leads a session of its own; otherwise it ends with this process's session, whatever it is doing.
    """

    def __init__(self, code: str, environment: dict[str, str] | None = None, *, leads: bool = True) -> None:
        command = [sys.executable, "-c", f"import sys; sys.path[:] = {sys.path!r}\n{code}"]
        pipe, nowhere = subprocess.PIPE, subprocess.DEVNULL
        self.process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=nowhere, env=os.environ | (environment or {}), start_new_session=leads
        )
        self._leads = leads
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self._in, self._out = self.process.stdin, self.process.stdout

    def say(self, value: Any) -> None:
        """Send a value to the process; ignored if it has already ended."""
        with suppress(OSError, ValueError):  # the process has ended, or we have ended it
            self._in.write(frame(value))
            self._in.flush()

    def hear(self) -> Iterator[Any]:
        """Yields the values that the process sends, until it ends."""
        yield from read_frames(self._out)
        self.process.wait()

    def end(self) -> None:
        """Kill the process, with everything it started if it leads a session, and wait until it is gone."""
        if self.process.poll() is None:
            with suppress(ProcessLookupError, PermissionError):
                if self._leads and hasattr(os, "killpg"):
                    os.killpg(self.process.pid, signal.SIGKILL)
                else:
                    self.process.kill()
            self.process.wait()
        with suppress(OSError):
            self._in.close()


class Worker(Interpreter):
    """A process that runs calls, one at a time. one_core: it is one of many on its machine; idle_s: time without a call after
    which it ends to free its memory.
    """

    def __init__(self, *, one_core: bool = False, idle_s: float = 60.0) -> None:
        code = f"from mdp.kernels.workers import serve; serve({one_core}, {idle_s + SPARE_S})"
        super().__init__(code, ONE_CORE if one_core else None)
        self._idle_s, self._rests_since_s = idle_s, monotonic()

    @property
    def ready(self) -> bool:
        """Whether the worker can be called; one that has been idle too long ends and must be replaced."""
        return self.process.poll() is None and monotonic() - self._rests_since_s < self._idle_s

    def ask(self, task: Task, *given: Any) -> Iterator[tuple[bool, Any]]:
        """Yields (False, value) for each progress report of a call, then (True, result). Raises CallError like call()."""
        self.say(pickle.dumps((task, given), pickle.HIGHEST_PROTOCOL))
        for kind, value in self.hear():
            if kind == TELLS:
                yield False, value
                continue
            self._rests_since_s = monotonic()
            if kind == FAILED:
                raise CallError(value)
            yield True, value
            return
        code = self.process.wait()
        name = signal.Signals(-code).name if -code in signal.valid_signals() else f"signal {-code}"
        raise KilledError(f"its process was ended by {name}" if code < 0 else "its process ended")

    def call(self, task: Task, *given: Any, limit_s: float | None = None) -> Any:
        """The result of a call. limit_s: timeout after which the worker is ended.

        Raises CallError, also for exceptions of the task; KilledError if the worker ends during the call.
        """
        timer, began_s = Timer(limit_s or 0.0, self.end), monotonic()
        timer.daemon = True
        if limit_s is not None:
            timer.start()
        try:
            return next(value for done, value in self.ask(task, *given) if done)
        except KilledError:
            if limit_s is not None and monotonic() - began_s >= limit_s:
                raise CallError(f"it took longer than {limit_s:g} s") from None
            raise
        finally:
            timer.cancel()
            if limit_s is not None:
                timer.join()  # it may be ending the worker, which must not be called again then


def redirect_stdio() -> tuple[BinaryIO, BinaryIO]:
    """This process's pipes from and to its caller; output printed by tasks does not reach them."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    with open(os.devnull, "r+b") as nowhere:
        os.dup2(nowhere.fileno(), 0)
        os.dup2(nowhere.fileno(), 1)
    return requests, answers


_answers: list[BinaryIO] = []  # pipe to the caller, if this process is a worker


def tell(value: Any) -> None:
    """In a worker: report progress to the caller of the running call."""
    _send(frame((TELLS, value)))


def _send(message: bytes) -> None:
    _answers[0].write(message)
    _answers[0].flush()


def serve(one_core: bool, idle_s: float) -> None:
    """In a worker: answer calls until no process can call it or the idle time is over."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what Ctrl-C does
    requests, answers = redirect_stdio()
    _answers.append(answers)
    with suppress(OSError), open(OOM_SCORE[0], "w") as score:
        score.write(OOM_SCORE[1])
    if one_core:
        threads.use_threads(1)
    calls: SimpleQueue[bytes] = SimpleQueue()
    threads.harmless(Thread(target=listen, args=(requests, calls.put, _end_all), daemon=True)).start()
    while True:
        try:
            call = calls.get(timeout=idle_s)
        except Empty:
            _end_all()
        _send(_result(call))


def _result(call: bytes) -> bytes:
    try:
        task, given = pickle.loads(call)
        work = resolve_name(task) if isinstance(task, str) else task
        return frame((DONE, work(*given)))
    except Exception as error:  # noqa: BLE001 - the caller gets its message
        return frame((FAILED, f"{type(error).__name__}: {error}"))


def _end_all() -> NoReturn:
    """End this process and all that it has started."""
    if hasattr(os, "killpg"):
        os.killpg(0, signal.SIGKILL)  # it leads a group of its own
    os._exit(1)
