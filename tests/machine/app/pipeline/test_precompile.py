"""The process that compiles beside the work does not outlive it."""

import subprocess
import sys
from pathlib import Path

import pytest


def test_the_process_that_compiles_ends_when_nobody_holds_its_pipe_any_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # so that it would compile for a minute
    command = [sys.executable, "-m", "machine.app.pipeline.precompile"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        answers, _ = process.communicate(b"slice\n", timeout=60.0)
    assert b"done" not in answers
