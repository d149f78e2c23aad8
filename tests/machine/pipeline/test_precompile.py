"""A process that compiles in the background does not outlive its command."""

import pickle
from pathlib import Path

import pytest

from machine.pipeline.compilers import COMPILE
from mdp.kernels.workers import Worker, frame


def test_the_compiling_process_exits_when_its_pipe_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # so that it would compile for a minute
    answers, _ = Worker(one_core=True).process.communicate(frame(pickle.dumps((COMPILE, ("slice",)))), timeout=60.0)
    assert b"done" not in answers
