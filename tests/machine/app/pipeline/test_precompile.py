"""The process that compiles beside the work does not outlive it."""

import subprocess
from pathlib import Path

import pytest

from machine.app.pipeline.compilers import command


def test_the_process_that_compiles_ends_when_nobody_holds_its_pipe_any_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # so that it would compile for a minute
    with subprocess.Popen(command(), stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        answers, _ = process.communicate(b"slice\n", timeout=60.0)
    assert b"done" not in answers


def test_what_lies_in_the_working_folder_is_not_imported(tmp_path: Path) -> None:
    (tmp_path / "queue.py").write_text("print('imported')\n")
    done = subprocess.run(command(), cwd=tmp_path, input="", capture_output=True, text=True, timeout=60.0, check=True)
    assert done.stdout == ""
