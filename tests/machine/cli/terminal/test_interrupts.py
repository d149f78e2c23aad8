"""Interrupts: none is lost, at whatever moment it arrives."""

import io
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import pytest

from machine.cli.terminal import interrupts
from machine.cli.terminal.interrupts import COMPILER, GRACE_S, calling, interrupting, outside_compiler, stopping

BUSY_S = 30.0


def wait_for_nothing() -> None:
    """Wait like input() without any input."""
    never, end = os.pipe()
    try:
        select.select([never], [], [], 30.0)
    finally:
        os.close(never)
        os.close(end)


def test_an_interrupt_that_does_not_end_a_wait_is_still_handled() -> None:
    # A signal that arrives in another thread does not end this thread's select(), like one just before select().
    elsewhere = threading.Timer(0.2, lambda: signal.pthread_kill(threading.get_ident(), signal.SIGINT))
    late: list[str] = []
    alarm = threading.Timer(20.0, lambda: late.append("nobody heard it"))
    elsewhere.start()
    alarm.start()
    with pytest.raises(KeyboardInterrupt), interrupting():
        wait_for_nothing()
    alarm.cancel()
    assert not late


def test_waiting_continues_after_unrelated_signals() -> None:
    noted: list[int] = []
    before = signal.signal(signal.SIGUSR1, lambda number, frame: noted.append(number))
    with interrupting():
        for _ in range(3):
            signal.raise_signal(signal.SIGUSR1)
        assert select.select([], [], [], 0.3) == ([], [], [])
    signal.signal(signal.SIGUSR1, before)
    assert noted == [signal.SIGUSR1] * 3


def test_uninterruptible_work_is_notified_of_an_interrupt_and_continues() -> None:
    calls: list[str] = []
    with interrupting():
        with calling(lambda: calls.append("interrupted")):
            signal.raise_signal(signal.SIGTERM)
            signal.set_wakeup_fd(-1)  # as an event loop leaves it
        assert calls == ["interrupted"]
        wakeup = signal.set_wakeup_fd(-1)
        signal.set_wakeup_fd(wakeup)
        assert wakeup >= 0
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)


def test_everything_is_as_before_afterwards() -> None:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR2)
    before, threads = [signal.getsignal(number) for number in numbers], threading.active_count()
    with interrupting():
        pass
    assert [signal.getsignal(number) for number in numbers] == before
    assert threading.active_count() == threads


def test_the_first_interrupt_sets_the_flag_and_the_second_raises() -> None:
    stop = threading.Event()
    with stopping(stop):
        signal.raise_signal(signal.SIGTERM)
        assert stop.is_set()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("folder", COMPILER)
def test_an_interrupt_beneath_the_compiler_waits_until_it_is_back(folder: str) -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    beneath: dict[str, Callable[[], str]] = {}
    exec(
        compile("def told(): signal.raise_signal(signal.SIGINT); return 'compiled'", f"{folder}x.py", "exec"),
        globals(),
        beneath,
    )
    finished: list[str] = []

    def work() -> None:
        finished.append(beneath["told"]())
        wait_for_nothing()

    with pytest.raises(KeyboardInterrupt), outside_compiler():
        work()
    signal.signal(signal.SIGINT, before)
    assert finished == ["compiled"]


def test_an_interrupt_that_is_lost_while_python_clears_up_comes_again(capfd: pytest.CaptureFixture[str]) -> None:
    class Dropped:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)

    def work() -> None:
        Dropped()
        cleared.append(True)
        wait_for_nothing()

    before, cleared = signal.signal(signal.SIGINT, signal.default_int_handler), list[bool]()
    with pytest.raises(KeyboardInterrupt), outside_compiler():
        work()
    signal.signal(signal.SIGINT, before)
    assert (cleared, capfd.readouterr().err) == ([True], "")


NATIVE = """
import hashlib
from machine.cli.terminal.interrupts import outside_compiler
with outside_compiler():
    for _ in range(2):  # the signal may come before the first call
        try:
            print("ready", flush=True)
            hashlib.pbkdf2_hmac("sha256", b"", b"", 10**9)  # native code for minutes
        except KeyboardInterrupt:
            pass
"""


def test_work_in_native_code_is_ended_with_the_process() -> None:
    with subprocess.Popen([sys.executable, "-c", NATIVE], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        began_s = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.communicate()[1] == "tiltprint: interrupted\n"
    assert process.returncode == 130
    assert GRACE_S < 2.0  # how long a user waits at most
    assert time.monotonic() - began_s < BUSY_S  # a bound for a busy machine; without the interrupt it would take minutes


def test_work_that_ends_by_itself_is_not_ended_again(capfd: pytest.CaptureFixture[str]) -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    threads = threading.active_count()
    with pytest.raises(KeyboardInterrupt), outside_compiler():
        signal.raise_signal(signal.SIGINT)
    signal.signal(signal.SIGINT, before)
    assert (threading.active_count(), capfd.readouterr().err) == (threads, "")


def test_the_process_exits_even_if_stderr_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    class Gone(io.StringIO):
        def write(self, text: str) -> int:
            raise BrokenPipeError

    codes: list[int] = []
    monkeypatch.setattr(sys, "stderr", Gone())
    monkeypatch.setattr(interrupts, "leave", codes.append)
    interrupts.end_at_once()
    assert codes == [130]
