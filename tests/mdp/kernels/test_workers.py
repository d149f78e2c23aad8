"""Workers: messages and results of a call, and a worker that ends with its parent however the parent died."""

import os
import pickle
import signal
import time
from io import BytesIO
from pathlib import Path

import pytest

from mdp.kernels.workers import LENGTH, CallError, Interpreter, KilledError, Worker, frame, listen
from tests.mdp.batch.calls import greet, process, sleep, squares, wait_for_another
from tests.mdp.batch.test_isolation import until_gone

WHOLE, LATER = ("load_kernels", ()), ("slice_bench", (Path("here"), "a file"))


def heard(content: bytes) -> list[object]:
    """The messages received through a pipe that ends after some bytes, then the end."""
    told: list[object] = []
    listen(BytesIO(content), told.append, lambda: told.append("the end"))
    return told


def test_a_pipe_that_ends_at_any_byte_of_a_frame_is_at_its_end() -> None:
    for sent in range(len(frame(LATER))):
        assert heard(frame(WHOLE) + frame(LATER)[:sent]) == [WHOLE, "the end"]
    assert heard(frame(WHOLE) + frame(LATER)) == [WHOLE, LATER, "the end"]


@pytest.mark.parametrize("content", [b"rubbish", pickle.dumps(1)[:-1], b"cno_such_module\nthing\n."])
def test_an_unreadable_frame_ends_the_worker(content: bytes) -> None:
    told: list[object] = []
    with pytest.raises((pickle.UnpicklingError, EOFError, ImportError)):
        listen(BytesIO(LENGTH.pack(len(content)) + content + frame(WHOLE)), told.append, lambda: told.append("the end"))
    assert told == ["the end"]


def test_a_worker_ends_at_once_if_its_caller_dies_while_sending() -> None:
    call = frame(pickle.dumps((greet, ("world",))))
    workers = [Worker() for _ in range(4)]
    for worker, sent in zip(workers, (0, LENGTH.size, LENGTH.size + 1, len(call) - 1), strict=True):
        worker.process.communicate(call[:sent], timeout=20.0)
        assert worker.process.returncode == -signal.SIGKILL


def test_progress_of_a_call_arrives_before_its_result() -> None:
    worker = Worker()
    assert list(worker.ask(squares, 3)) == [(False, 0), (False, 1), (False, 4), (True, "all")]
    assert list(worker.ask("tests.mdp.batch.calls:greet", "world")) == [(True, "hello world")]
    worker.end()


def test_a_worker_that_is_ended_is_gone_and_its_call_without_a_result(tmp_path: Path) -> None:
    worker = Worker()
    with pytest.raises(CallError, match=r"^it took longer than 2 s$"):
        worker.call(sleep, tmp_path / "begun", limit_s=2.0)
    with pytest.raises(ProcessLookupError):
        os.kill(worker.process.pid, 0)
    assert not worker.ready
    with pytest.raises(KilledError, match=r"^its process was ended by SIGKILL$"):
        worker.call(process)


def test_child_processes_of_a_worker_end_with_it() -> None:
    started = Interpreter("import os, time; from mdp.kernels.workers import frame; copy = os.fork()\n"
                          "if copy: os.write(1, frame(copy))\ntime.sleep(60)")  # fmt: skip
    copy = next(started.hear())
    started.end()
    until_gone(copy)


def test_a_process_that_leads_no_session_ends_with_the_worker_that_waits_for_it() -> None:
    worker = Worker()
    _, other = next(worker.ask(wait_for_another))
    worker.end()
    until_gone(other)


def test_a_process_that_leads_no_session_is_ended_without_the_one_that_has_started_it() -> None:
    alone = Interpreter("import time; time.sleep(60.0)", leads=False)
    alone.end()
    assert alone.process.returncode == -signal.SIGKILL


def test_an_idle_worker_ends_and_is_not_used_again() -> None:
    worker = Worker(idle_s=0.2)
    assert worker.call(greet, "world") == "hello world"
    assert worker.ready
    time.sleep(0.2)
    assert not worker.ready
    assert worker.process.wait(timeout=20.0) == -signal.SIGKILL


def test_files_in_the_working_folder_are_not_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "queue.py").write_text("raise ValueError")
    monkeypatch.chdir(tmp_path)
    assert Worker().call(greet, "world") == "hello world"
