"""Folders of settings, compiled kernels, logs and journals, for users with and without a home."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from profiles import folders
from profiles.folders import cache_folder, settings_folder, state_folder


@pytest.fixture(autouse=True)
def temporary(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder for temporary files."""
    folder = tmp_path_factory.mktemp("temporary")
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder / f"tiltprint-{os.geteuid()}"


def forget_home(monkeypatch: pytest.MonkeyPatch) -> None:
    """A container's user without a name: no HOME and no passwd entry."""
    for variable in ("HOME", "XDG_STATE_HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr("os.path.expanduser", lambda path: path)


def mode(path: Path) -> str:
    return oct(path.stat().st_mode & 0o777)


def test_a_folder_that_cannot_be_made_is_replaced_by_one_of_this_user_among_the_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, temporary: Path
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert (state_folder(), cache_folder()) == (temporary / "state", temporary / "cache")
    assert mode(temporary) == "0o700"


def test_the_state_folder_is_below_the_home_and_private(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    older = tmp_path / ".local" / "state" / "tiltprint"
    older.mkdir(parents=True, mode=0o755)
    assert state_folder() == older
    assert mode(older) == "0o700"


def test_without_a_home_folder_nothing_is_created_in_the_current_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, temporary: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    forget_home(monkeypatch)
    assert (state_folder(), settings_folder()) == (temporary / "state", temporary / "settings")
    assert list(tmp_path.iterdir()) == []


def test_a_temporary_folder_that_others_may_write_is_not_used_but_one_of_this_run(
    monkeypatch: pytest.MonkeyPatch, temporary: Path
) -> None:
    folders._of_this_run.cache_clear()
    forget_home(monkeypatch)
    temporary.mkdir()
    temporary.chmod(0o777)
    own = cache_folder()
    assert own.parent == temporary.parent
    assert own not in (temporary, temporary / "cache")
    assert (mode(own), folders.lost_at_end()) == ("0o700", own)
    folders._of_this_run.cache_clear()
    shutil.rmtree(own)


def test_the_folder_of_a_run_is_gone_at_its_end_and_what_is_lost_is_said_once(temporary: Path) -> None:
    temporary.mkdir()
    temporary.chmod(0o777)
    (temporary.parent / "a.gcode").write_text("G28\n")
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": os.getcwd(), "TMPDIR": str(temporary.parent), "HOME": "/dev/null"}
    code = "import sys; from machine.cli.cli import main; raise SystemExit(main(['profiles', 'list']))"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    code = code.replace(
        "import sys", "import sys; import numpy; from slicer.geometry.polygons import area_mm2; area_mm2(numpy.eye(3))"
    )
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    sentence = "tiltprint: the next run compiles the kernels again: no folder of this user can be written: set XDG_CACHE_HOME"
    assert (done.stderr.count("\n"), done.stderr.startswith(sentence)) == (1, True)
    assert sorted(path.name for path in temporary.parent.iterdir()) == ["a.gcode", temporary.name]
