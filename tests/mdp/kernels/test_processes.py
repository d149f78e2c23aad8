"""Parallel tasks in processes."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from mdp.kernels import threads
from mdp.kernels.processes import parallel_map

HERE = os.getpid()


@pytest.fixture(autouse=True)
def _three_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", 3)


def square(number: int) -> int:
    return number * number


def fail(number: int) -> int:
    raise ValueError(f"piece {number}")


def pid(number: int) -> int:
    return os.getpid()


def killed_elsewhere(number: int) -> int:
    if os.getpid() != HERE:
        os.kill(os.getpid(), signal.SIGKILL)
    return square(number)


@pytest.mark.parametrize("count", [0, 1, 2, 700, 9000])
def test_results_come_in_the_order_of_the_pieces(count: int) -> None:
    assert list(parallel_map(square, count)) == [k * k for k in range(count)]


def test_two_pieces_are_done_in_two_processes_at_once() -> None:
    (here, to_there), (there, to_here) = os.pipe(), os.pipe()

    def meet(own_end: int, other_end: int) -> int:
        os.write(own_end, b"x")
        os.read(other_end, 1)
        return os.getpid()

    ends = (to_there, there), (to_here, here)
    assert len(set(parallel_map(lambda k: meet(*ends[k]), 2))) == 2


def test_the_first_error_in_order_is_raised_whichever_process_meets_it() -> None:
    with pytest.raises(ValueError, match=r"^piece 1$"):
        list(parallel_map(lambda k: fail(k) if k else square(k), 30))


def test_the_work_of_a_killed_process_is_done_by_its_parent() -> None:
    assert list(parallel_map(killed_elsewhere, 20)) == [k * k for k in range(20)]


def test_results_are_there_while_later_pieces_are_still_worked_on() -> None:
    first_used, told = os.pipe()

    def wait_from_the_third_on(number: int) -> int:
        if number > 1 and os.getpid() != HERE:
            os.read(first_used, 1)  # not written before the first result is used
        return number

    results = parallel_map(wait_from_the_third_on, 5)
    first = next(results)
    os.write(told, b"xxxxx")
    assert [first, *results] == [0, 1, 2, 3, 4]


def test_results_larger_than_any_pipe_arrive_whole() -> None:
    sizes = [len(result) for result in parallel_map(lambda k: bytes(3_000_000 + k), 9)]
    assert sizes == [3_000_000 + k for k in range(9)]


def test_a_process_that_only_receives_has_all_pieces_done_elsewhere() -> None:
    assert HERE not in set(parallel_map(pid, 9, helps=False))


def test_within_a_piece_there_are_no_further_copies() -> None:
    def inner(number: int) -> bool:
        own = os.getpid()
        return all(there == own for there in parallel_map(pid, 8))

    assert all(parallel_map(inner, 12))


def test_few_pieces_are_not_worth_a_copy() -> None:
    assert set(parallel_map(pid, 9, fewest=10)) == {HERE}


def test_without_other_processes_this_one_does_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> int:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(os, "fork", refuse)
    assert list(parallel_map(pid, 2)) == [HERE, HERE]


def test_one_core_forks_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", 1)
    assert list(parallel_map(pid, 2)) == [HERE, HERE]


def test_next_to_a_thread_that_is_not_known_to_be_harmless_nothing_is_forked() -> None:
    over = threading.Event()
    other = threading.Thread(target=over.wait)
    other.start()
    assert set(parallel_map(pid, 9)) == {HERE}
    threads.harmless(other)
    assert set(parallel_map(pid, 9, helps=False)) != {HERE}
    over.set()
    other.join()
    assert set(parallel_map(pid, 9, helps=False)) != {HERE}


def test_a_thread_that_is_not_the_main_one_forks_nothing() -> None:
    with ThreadPoolExecutor(1) as executor:
        assert executor.submit(lambda: set(parallel_map(pid, 9))).result() == {HERE}
    assert threads.ahead(lambda: set(parallel_map(pid, 9))).result() == {HERE}


def test_own_threads_have_finished_before_a_fork() -> None:
    finished: list[int] = []
    slow = threads.ahead(lambda: (time.sleep(0.3), threads.in_threads(lambda begin, end: finished.append(begin), 12)))
    alive = set(parallel_map(lambda number: (len(finished), threading.active_count()), 3, helps=False))
    assert slow.done()
    assert alive == {(3, 2)}  # a forked copy also has the thread that watches for its parent's end
    assert threads.ahead(pow, 2, 5).result() == 32  # other threads begin with the next task


def test_a_copy_says_what_it_says_although_a_thread_held_the_stream_when_it_was_made() -> None:
    done = subprocess.run([sys.executable, "-c", HOLDING], capture_output=True, text=True, timeout=60.0, check=True)
    assert sorted(done.stderr.split()) == ["0", "1"]


HOLDING = """
import sys, threading
from mdp.kernels import threads
from mdp.kernels.processes import parallel_map

class Console:
    def __init__(self):
        self.lock = threading.RLock()

    def write(self, text):
        with self.lock:
            sys.__stderr__.write(text)

    def flush(self):
        sys.__stderr__.flush()

sys.stderr, held, over = Console(), threading.Event(), threading.Event()

def hold():
    with sys.stderr.lock:
        held.set()
        over.wait()

threads.use_threads(2)
threads.harmless(threading.Thread(target=hold)).start()
held.wait()
list(parallel_map(lambda number: print(number, file=sys.stderr), 2, helps=False))
over.set()
"""


def test_neither_processes_nor_pipes_are_left() -> None:
    folder = Path("/proc/self")
    if not folder.is_dir():
        pytest.skip("only Linux tells what a process has open")

    def held() -> tuple[list[str], str]:
        children = ""
        for task in folder.joinpath("task").iterdir():
            with suppress(FileNotFoundError):  # a thread of another test ends meanwhile
                children += task.joinpath("children").read_text()
        return os.listdir(folder / "fd"), children

    before = held()
    list(parallel_map(square, 5))
    assert held() == before
    with pytest.raises(ValueError, match=r"^piece 3$"):
        list(parallel_map(lambda k: fail(k) if k == 3 else square(k), 30))
    assert held() == before
    unfinished = parallel_map(square, 5)
    next(unfinished)
    unfinished.close()
    assert held() == before


WORKING = """
import os
from mdp.kernels import threads
from mdp.kernels.processes import parallel_map

def work(number):
    os.write(1, f"{os.getpid()}\\n".encode())
    while True:
        pass

threads.use_threads(2)
list(parallel_map(work, 2))
"""


@pytest.mark.parametrize("ended_by", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_any_end_of_the_parent_ends_its_forks(ended_by: signal.Signals) -> None:
    with subprocess.Popen([sys.executable, "-c", WORKING], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        working = [int(parent.stdout.readline()) for _ in range(2)]
        parent.send_signal(ended_by)
        try:
            parent.communicate(timeout=10.0)  # until no process holds the other end of the pipe
        except BaseException:
            for process in working:
                os.kill(process, signal.SIGKILL)
            raise
        assert parent.returncode == -ended_by


LOCKED = """
import os, threading, time
import numpy as np
from numba.core.compiler_lock import global_compiler_lock
from mdp.kernels import threads
from mdp.kernels.processes import parallel_map
from slicer.geometry.polygons import area_mm2

held = threading.Event()

def hold():
    with global_compiler_lock:
        held.set()
        time.sleep(0.5)

threads.use_threads(2)
threads.harmless(threading.Thread(target=hold)).start()  # else nothing is forked beside it
held.wait()
areas, processes = zip(*parallel_map(lambda number: (area_mm2(np.eye(3)[:, :2]), os.getpid()), 8, helps=False), strict=True)
assert os.getpid() not in processes
print(sum(areas))
"""


def test_a_copy_loads_kernels_although_another_thread_was_compiling_when_it_was_made() -> None:
    done = subprocess.run([sys.executable, "-c", LOCKED], capture_output=True, text=True, timeout=120.0, check=True)
    assert float(done.stdout) == pytest.approx(8 * 0.5)
