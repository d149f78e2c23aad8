"""Isolation: the results of calls, and calls that kill their process or take too long."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mdp.batch import pool
from mdp.batch.pool import Isolation
from mdp.kernels.workers import CallError
from tests.mdp.batch.calls import begin, die, greet, process, refuse, sleep, unspeakable

NOISY = "from tests.mdp.batch.calls import noise; from mdp.batch.pool import Isolation; print(Isolation().call(noise, ()))"


@pytest.fixture
def calls() -> Isolation:
    return Isolation()


def test_calls_of_a_thread_run_in_its_own_process(calls: Isolation) -> None:
    assert calls.call(greet, ("world",)) == "hello world"
    assert calls.call(process, ()) == calls.call(process, ()) != os.getpid()


def test_an_error_of_a_call_is_reported_once_in_one_sentence(calls: Isolation, tmp_path: Path) -> None:
    with pytest.raises(CallError, match=r"^ValueError: not this one$"):
        calls.call(refuse, (tmp_path / "begun",), retries=3)
    assert (tmp_path / "begun").read_text() == "begun "


def test_a_result_that_cannot_be_sent_is_a_sentence_too(calls: Isolation) -> None:
    with pytest.raises(CallError, match="pickle"):
        calls.call(unspeakable, ())


def test_a_call_whose_process_is_killed_is_repeated_a_limited_number_of_times(calls: Isolation, tmp_path: Path) -> None:
    with pytest.raises(CallError, match=r"^its process was ended by SIGKILL, 3 times$"):
        calls.call(die, (tmp_path / "begun", 9), retries=2)
    assert (tmp_path / "begun").read_text() == "begun begun begun "
    assert calls.call(greet, ("again",)) == "hello again"


def test_a_call_that_survives_the_second_time_has_a_result(calls: Isolation, tmp_path: Path) -> None:
    assert calls.call(die, (tmp_path / "begun", 1), retries=1) == "alive"


def test_a_call_that_takes_too_long_is_given_up_at_once_and_not_tried_again(calls: Isolation, tmp_path: Path) -> None:
    with pytest.raises(CallError, match=r"^it took longer than 1.5 s$"):
        calls.call(sleep, (tmp_path / "begun",), retries=2, limit_s=1.5)
    assert (tmp_path / "begun").read_text() == "begun "
    assert calls.call(greet, ("next",), limit_s=60.0) == "hello next"


def test_a_process_that_has_nothing_to_do_gives_its_memory_back(calls: Isolation, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pool, "IDLE_S", 0.0)
    first = calls.call(process, ())
    until_gone(first)
    assert calls.call(process, ()) != first


def test_output_of_a_call_is_not_part_of_its_result() -> None:
    run = subprocess.run([sys.executable, "-c", NOISY], capture_output=True, text=True, check=True, cwd=Path(__file__).parents[3])
    assert (run.stdout, run.stderr) == ("quiet\n", "")


def test_a_working_process_ends_when_its_caller_is_killed(tmp_path: Path) -> None:
    script = f"from tests.mdp.batch.test_isolation import *; Isolation().call(sleep, (Path({str(tmp_path / 'begun')!r}),))"
    asker = subprocess.Popen([sys.executable, "-c", script], cwd=Path(__file__).parents[3])
    worker = int(begin(tmp_path / "begun.pid"))
    asker.send_signal(signal.SIGKILL)
    asker.wait()
    until_gone(worker)


def is_at_work(pid: int) -> bool:
    """Whether a process exists and has not ended; its parent may not have waited for it yet."""
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True).stdout
    return state[:1] not in ("", "Z")


def until_gone(pid: int) -> None:
    for _ in range(200):
        if not is_at_work(pid):
            return
        time.sleep(0.05)
    raise AssertionError(f"process {pid} is still there")
