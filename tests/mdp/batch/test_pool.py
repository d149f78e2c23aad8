"""Pool: many calls on the cores of this machine and on the workers of a dask cluster."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mdp.batch import pool
from mdp.batch.pool import Workers, connected
from mdp.kernels.workers import CallError
from profiles.errors import UserError
from tests.mdp.batch.calls import begin, die, greet, process, refuse, sleep

NOTHING = lambda: None  # noqa: E731


def test_every_call_has_its_result_or_its_reason(tmp_path: Path) -> None:
    with connected(Workers(None, 2, retries=1)) as queue:
        greetings = dict(queue.completed(greet, {"a": ("a",), "b": ("b",)}, NOTHING))
        failures = dict(queue.completed(refuse, {"c": (tmp_path / "c",)}, NOTHING))
    assert greetings == {"a": "hello a", "b": "hello b"}
    assert str(failures["c"]) == "ValueError: not this one"


def test_one_call_that_dies_each_time_leaves_the_others_alone(tmp_path: Path) -> None:
    with connected(Workers(None, 2, retries=1)) as queue:
        results = dict(queue.completed(die, {times: (tmp_path / str(times), times) for times in (9, 0, 1)}, NOTHING))
    assert (results[0], results[1], str(results[9])) == ("alive", "alive", "its process was ended by SIGKILL, 2 times")


def test_running_tasks_are_killed_when_the_pool_is_closed(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), connected(Workers(None, 1, retries=9)) as queue:
        list(queue.completed(sleep, {"long": (tmp_path / "long",)}, lambda: interrupt_after(tmp_path / "long.pid")))
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "long.pid").read_text()), 0)


def interrupt_after(note: Path) -> None:
    begin(note)
    raise KeyboardInterrupt


def test_without_dask_a_scheduler_is_refused_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UserError, match=r"^a scheduler needs dask, which is not installed: pip install 'tiltprint\[batch\]'$"):
        run_on("tcp://127.0.0.1:9")


@pytest.mark.train
def test_a_scheduler_that_is_not_there_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(pool, "REACHED_WITHIN_S", 0.3)
    with pytest.raises(UserError, match=r"^scheduler tcp://127.0.0.1:9 cannot be reached \("):
        run_on("tcp://127.0.0.1:9")


@pytest.mark.train
def test_a_scheduler_that_dies_is_one_sentence() -> None:
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0")
    with (
        pytest.raises(UserError, match="is gone; started again, the work continues where it stopped"),
        connected(Workers(cluster.scheduler_address, 1, 0)) as queue,
    ):
        list(queue.completed(time.sleep, {"long": (2.0,)}, cluster.close))


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[str]:
    """The address of a scheduler that has no workers yet."""
    pytest.importorskip("distributed")
    file = tmp_path / "scheduler.json"
    command = [
        sys.executable,
        "-m",
        "distributed.cli.dask_scheduler",
        "--port",
        "0",
        "--scheduler-file",
        str(file),
        "--no-dashboard",
    ]
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    text = begin(file)
    yield text.split('"address": "')[1].split('"')[0]
    run.kill()
    run.wait()


def worker(address: str, folder: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny", "--nthreads", "1", "--no-dashboard"]
    quiet: Any = subprocess.DEVNULL
    return subprocess.Popen([*command, "--local-directory", str(folder)], stdout=quiet, stderr=quiet)


def run_on(address: str, folders: tuple[Path, ...] = ()) -> None:
    with connected(Workers(address, 1, 0, folders=folders)) as queue:
        list(queue.completed(process, {"a": ()}, NOTHING))


@pytest.mark.train
@pytest.mark.slow
def test_tasks_of_a_killed_machine_are_done_by_another(scheduler: str, tmp_path: Path) -> None:
    first = worker(scheduler, tmp_path)
    killed: list[subprocess.Popen[bytes]] = []

    def kill_first() -> None:
        if not killed and (tmp_path / "0").exists():
            first.send_signal(signal.SIGKILL)
            killed.append(worker(scheduler, tmp_path))

    with connected(Workers(scheduler, 1, retries=0)) as queue:
        results = dict(queue.completed(slow_at_first, {k: (tmp_path / str(k), k) for k in range(4)}, kill_first))
    killed[0].kill()
    assert results == {0: 0, 1: 1, 2: 2, 3: 3}


def slow_at_first(note: Path, result: int) -> int:
    """Take long in the first run, on a worker that will be killed meanwhile."""
    if not note.exists() and result == 0:
        sleep(note)
    return result


@pytest.mark.train
@pytest.mark.slow
def test_a_worker_without_access_to_a_folder_is_reported(scheduler: str, tmp_path: Path) -> None:
    run = worker(scheduler, tmp_path)
    nowhere = tmp_path / "nowhere"
    with pytest.raises(UserError, match=f"cannot work: it does not see {nowhere}$"):
        until_refused(scheduler, nowhere)
    run.kill()


def until_refused(scheduler: str, folder: Path) -> None:
    """Retry until the scheduler knows the worker, which may take a moment."""
    for _ in range(100):
        with connected(Workers(scheduler, 1, 0, folders=(folder,))):
            time.sleep(0.1)


def test_a_failure_keeps_its_sentence_when_it_travels() -> None:
    import pickle

    assert str(pickle.loads(pickle.dumps(CallError("why")))) == "why"
