"""Fixture: the small program of these tests."""

from pathlib import Path

import pytest

from tests.mdp.kernels.small_program import write_program


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The package of a program with its own cache."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cached"))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # Python knows an edited file by its size and whole seconds of its date
    return write_program(tmp_path / "program")
