"""Isolation: calls worked out in processes of their own, so that one that kills its process or takes too long harms no other.

Such a process is a fresh interpreter on one core, which stays for the next call. It ends as soon as nobody can ask it any more,
whatever ended those who could.
"""

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from queue import SimpleQueue
from typing import Any, BinaryIO

START = "import sys; sys.path[:] = {path!r}; from mdp.batch.isolation import serve; serve()"
IDLE_S = 60.0  # then its memory is given back
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}  # of numpy's library for products, which would take all cores
OOM_SCORE = "/proc/self/oom_score_adj", "500"  # where memory ends, Linux kills such a process and not the one that asks


class CallError(Exception):
    """A call without a result; str() says why."""


class KilledError(CallError):
    """The process of a call ended under it, which need not happen again."""


class Isolation:
    """For every thread that calls a process of its own; all end together."""

    def __init__(self) -> None:
        self._of_thread = threading.local()
        self._processes: list[_Process] = []
        self._ended = False

    def call(self, task: Callable[..., Any], arguments: tuple[Any, ...], retries: int = 0, limit_s: float | None = None) -> Any:
        """What the task returns. task: of a module; retries: how often a call whose process was killed is tried again; limit_s:
        after so many seconds a call is given up.

        Raises CallError for what the task raises, too.
        """
        process: _Process | None = getattr(self._of_thread, "process", None)
        if process is None:
            process = self._of_thread.process = _Process()
            self._processes.append(process)
        attempts = 0
        while not self._ended:
            try:
                return process.call(task, arguments, limit_s)
            except KilledError as error:
                attempts += 1
                if attempts > retries:
                    raise KilledError(f"{error}, {attempts} times" if retries else str(error)) from None
        raise KilledError("it was ended with all others")

    def end(self) -> None:
        """Kill all processes, whatever they do."""
        self._ended = True
        for process in list(self._processes):  # a thread may add its own meanwhile, and looks then whether all have ended
            process.end()


class _Process:
    """One process, begun anew when it has ended. Its lock keeps idle time from ending it under a call."""

    def __init__(self) -> None:
        self._child: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        self._idle = threading.Timer(0.0, self._end_idle)
        self._ended = False

    def call(self, task: Callable[..., Any], arguments: tuple[Any, ...], limit_s: float | None) -> Any:
        self._idle.cancel()
        with self._lock:
            child = self._running()
            with _limited(child, limit_s) as late:
                try:
                    worked, answer = _ask(child, pickle.dumps((task, arguments)))
                except (OSError, EOFError, pickle.UnpicklingError):
                    child.kill()
                    code = child.wait()
                    if late.is_set():
                        raise CallError(f"it took longer than {limit_s:g} s") from None
                    raise KilledError(
                        f"its process was ended by {_signal_name(-code)}" if code < 0 else "its process ended"
                    ) from None
        self._idle = threading.Timer(IDLE_S, self._end_idle)
        self._idle.daemon = True
        self._idle.start()
        if not worked:
            raise CallError(answer)
        return answer

    def end(self) -> None:
        self._ended = True
        self._idle.cancel()
        if self._child is not None:
            self._child.kill()
            self._child.wait()

    def _running(self) -> "subprocess.Popen[bytes]":
        if self._child is None or self._child.poll() is not None:
            pipe, nowhere = subprocess.PIPE, subprocess.DEVNULL
            command = [sys.executable, "-c", START.format(path=sys.path)]
            environment = os.environ | ONE_THREAD
            self._child = subprocess.Popen(
                command, stdin=pipe, stdout=pipe, stderr=nowhere, env=environment, start_new_session=True
            )
        if self._ended:
            self._child.kill()
        return self._child

    def _end_idle(self) -> None:
        with self._lock:
            if self._child is not None:
                self._child.kill()
                self._child.wait()


def _ask(child: "subprocess.Popen[bytes]", call: bytes) -> tuple[bool, Any]:
    """Whether a call worked, and its result or what it raised. Raises OSError or EOFError when the process has ended."""
    assert child.stdin is not None
    assert child.stdout is not None
    pickle.dump(call, child.stdin)
    child.stdin.flush()
    worked, answer = pickle.load(child.stdout)
    return worked, pickle.loads(answer)


@contextmanager
def _limited(child: "subprocess.Popen[bytes]", limit_s: float | None) -> Iterator[threading.Event]:
    """Kill a process that is at work for too long; the event tells of it."""
    late = threading.Event()
    if limit_s is None:
        yield late
        return

    def give_up() -> None:
        late.set()
        child.kill()

    timer = threading.Timer(limit_s, give_up)
    timer.daemon = True
    timer.start()
    try:
        yield late
    finally:
        timer.cancel()
        timer.join()
        if late.is_set():
            child.wait()


def _signal_name(number: int) -> str:
    return signal.Signals(number).name if number in signal.valid_signals() else f"signal {number}"


def serve() -> None:
    """In such a process: work off what is asked until nobody can ask any more. Only answers go to standard output."""
    from mdp.kernels.threads import use_threads

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who asks decides
    nowhere = os.open(os.devnull, os.O_RDWR)
    asked, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(nowhere, 0)
    os.dup2(nowhere, 1)
    with suppress(OSError), open(OOM_SCORE[0], "w") as score:
        score.write(OOM_SCORE[1])
    use_threads(1)
    calls: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_listen, args=(asked, calls), daemon=True).start()
    while True:
        pickle.dump(_work(calls.get()), answers)
        answers.flush()


def _listen(asked: BinaryIO, calls: "SimpleQueue[bytes]") -> None:
    """In a thread, so that the end of those who ask ends the work in hand, too."""
    try:
        while True:
            calls.put(pickle.load(asked))
    finally:
        os._exit(1)


def _work(call: bytes) -> tuple[bool, bytes]:
    try:
        task, arguments = pickle.loads(call)
        return True, pickle.dumps(task(*arguments))
    except Exception as error:  # noqa: BLE001 - it is told to who asked
        return False, pickle.dumps(f"{type(error).__name__}: {error}")
