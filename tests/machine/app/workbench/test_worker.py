"""Worker: its process ends when nobody can ask it any more, wherever the server that asks has died."""

import pickle
import subprocess
from io import BytesIO

import pytest

from machine.app.workbench.work.worker import LENGTH, frame, listen
from machine.app.workbench.work.worker_pool import COMMAND
from machine.link.pending_commands import Command

WHOLE, LATER = ("load_kernels", ()), ("slice_bench", (Command.PAUSE, "a file"))


def heard(content: bytes) -> list[object]:
    """What comes through a pipe that ends after some bytes, and then the end."""
    told: list[object] = []
    listen(BytesIO(content), told.append, lambda: told.append("the end"))
    return told


def test_a_pipe_that_ends_at_any_byte_of_a_frame_is_at_its_end() -> None:
    for sent in range(len(frame(LATER))):
        assert heard(frame(WHOLE) + frame(LATER)[:sent]) == [WHOLE, "the end"]
    assert heard(frame(WHOLE) + frame(LATER)) == [WHOLE, LATER, "the end"]


@pytest.mark.parametrize("content", [b"rubbish", pickle.dumps(1)[:-1], b"cno_such_module\nthing\n."])
def test_a_frame_that_cannot_be_read_is_the_end_for_nobody_speaks_to_the_process_any_more(content: bytes) -> None:
    told: list[object] = []
    with pytest.raises((pickle.UnpicklingError, EOFError, ImportError)):
        listen(BytesIO(LENGTH.pack(len(content)) + content + frame(WHOLE)), told.append, lambda: told.append("the end"))
    assert told == ["the end"]


def test_a_worker_whose_server_dies_in_the_middle_of_a_frame_ends_at_once() -> None:
    sent = [frame(WHOLE)[:count] for count in (0, LENGTH.size, LENGTH.size + 1, len(frame(WHOLE)) - 1)]
    workers = [subprocess.Popen(COMMAND, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True) for _ in sent]
    try:
        for worker, content in zip(workers, sent, strict=True):
            worker.communicate(content, timeout=20.0)
    finally:
        for worker in workers:
            worker.kill()
            worker.wait()
