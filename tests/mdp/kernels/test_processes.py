"""Pieces of work side by side."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from mdp.kernels import threads
from mdp.kernels.processes import side_by_side

HERE = os.getpid()


@pytest.fixture(autouse=True)
def _three_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", 3)


def square(number: int) -> int:
    return number * number


def fail(number: int) -> int:
    raise ValueError(f"piece {number}")


def killed_elsewhere(number: int) -> int:
    if os.getpid() != HERE:
        os.kill(os.getpid(), signal.SIGKILL)
    return square(number)


@pytest.mark.parametrize("count", [0, 1, 2, 700])
def test_results_come_in_the_order_of_the_pieces(count: int) -> None:
    assert side_by_side([partial(square, k) for k in range(count)]) == [k * k for k in range(count)]


def test_two_pieces_are_done_in_two_processes_at_once() -> None:
    (here, to_there), (there, to_here) = os.pipe(), os.pipe()

    def meet(own_end: int, other_end: int) -> int:
        os.write(own_end, b"x")
        os.read(other_end, 1)
        return os.getpid()

    pieces: list[Callable[[], int]] = [partial(meet, to_there, there), partial(meet, to_here, here)]
    assert len(set(side_by_side(pieces))) == 2


def test_the_first_error_in_order_is_raised_whoever_meets_it() -> None:
    pieces = [partial(square, 1), *(partial(fail, k) for k in range(1, 30))]
    with pytest.raises(ValueError, match=r"^piece 1$"):
        side_by_side(pieces)


def test_what_a_killed_process_leaves_undone_is_done_here() -> None:
    assert side_by_side([partial(killed_elsewhere, k) for k in range(20)]) == [k * k for k in range(20)]


def test_where_no_process_can_be_had_this_one_does_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> int:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(os, "fork", refuse)
    assert side_by_side([os.getpid, os.getpid]) == [HERE, HERE]


def test_one_core_forks_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", 1)
    assert side_by_side([os.getpid, os.getpid]) == [HERE, HERE]


def test_neither_processes_nor_pipes_are_left() -> None:
    folder = Path("/proc/self")
    if not folder.is_dir():
        pytest.skip("only Linux tells what a process has open")

    def held() -> tuple[list[str], list[str]]:
        return os.listdir(folder / "fd"), [task.joinpath("children").read_text() for task in folder.joinpath("task").iterdir()]

    before = held()
    side_by_side([partial(square, k) for k in range(5)])
    assert held() == before


WORKING = """
import os
from mdp.kernels import threads
from mdp.kernels.processes import side_by_side

def work():
    os.write(1, f"{os.getpid()}\\n".encode())
    while True:
        pass

threads.use_threads(2)
side_by_side([work, work])
"""


@pytest.mark.parametrize("ended_by", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_whatever_ends_the_parent_ends_its_copies(ended_by: signal.Signals) -> None:
    with subprocess.Popen([sys.executable, "-c", WORKING], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        working = [int(parent.stdout.readline()) for _ in range(2)]
        parent.send_signal(ended_by)
        try:
            parent.communicate(timeout=10.0)  # until nobody holds the other end of the pipe
        except BaseException:
            for process in working:
                os.kill(process, signal.SIGKILL)
            raise
        assert parent.returncode == -ended_by
