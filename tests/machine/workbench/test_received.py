"""Files that pages send: how large, what is refused is not kept, and what a workbench that is killed leaves."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import pytest

from machine.workbench.work.folders import BEGUN_S, FOUND, KEPT_S, Received, files_in, tidy_left
from mdp.save import stl
from tests.machine.running_workbench import workbench
from tests.shapes import tee

HOLDS = """
import sys, time
from machine.workbench.work.folders import Received
received = Received()
for name in sys.argv[1:]:
    received.new_file(name).write_text("solid")
print(received.path, flush=True)
time.sleep(60)
"""


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for temporary files, of this process and of those that it starts."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def names_in(folder: Path) -> list[str]:
    """Its files, without those that a bench has made of what it has received."""
    return sorted(path.name for path in folder.rglob("*") if path.is_file() and not path.name.startswith("made-"))


def left_by_a_killed_one(*names: str) -> Path:
    """The folder of a program that had received such files when it was killed."""
    with subprocess.Popen([sys.executable, "-c", HOLDS, *names], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        folder = Path(process.stdout.readline().strip())
        process.send_signal(signal.SIGKILL)
    return folder


def test_a_file_that_is_too_large_or_refused_is_not_kept_and_one_on_the_bench_goes_with_the_program(temporary: Path) -> None:
    sent = temporary / "sent"
    sent.mkdir()
    (sent / "large.stl").write_bytes(bytes(2**20 + 1))
    broken = "infill_density--copies_3.stl"
    (sent / broken).write_bytes(stl(tee())[:400])
    (sent / "tee.stl").write_bytes(stl(tee()))
    (sent / "plan.toml").write_text("nothing = [")
    with workbench("--upload-mib", "1") as bench, bench.line() as page:
        with suppress(OSError):  # it is not heard to its end
            bench.send(sent / "large.stl")
        problem = page.until(lambda state: state["problem"])["problem"]
        assert problem.startswith("large.stl: has more than the 1 MiB that a page may send:")
        assert [bench.send(sent / name)[0] for name in (broken, "tee.stl", "plan.toml")] == [422, 200, 422]
        assert json.loads(bench.send(sent / broken)[1])["problem"].startswith(f"{broken}: ")  # in no words of the page's
        assert [names_in(folder) for folder in temporary.glob("tiltprint-edit-*") if names_in(folder)] == [["tee.stl"]]
    assert list(temporary.glob("tiltprint-edit-*")) == []


def test_what_a_killed_program_has_received_is_told_for_a_day_and_then_removed(temporary: Path) -> None:
    folder = left_by_a_killed_one("tee.stl")
    assert tidy_left() == tidy_left() == (folder,)
    assert names_in(folder) == [FOUND, "tee.stl"]
    past_s = (folder / FOUND).stat().st_mtime - KEPT_S - 1.0
    os.utime(folder / FOUND, (past_s, past_s))
    assert tidy_left() == ()
    assert not folder.exists()


def test_a_folder_without_a_file_is_removed_when_it_is_not_new_and_that_of_one_that_runs_is_not_touched(temporary: Path) -> None:
    received = Received()
    received.new_file("tee.stl").write_text("solid")
    empty = left_by_a_killed_one()
    assert tidy_left() == ()
    assert empty.exists()  # it may be of a program that starts now
    past_s = empty.stat().st_mtime - BEGUN_S
    os.utime(empty, (past_s, past_s))
    assert tidy_left() == ()
    assert not empty.exists()
    assert names_in(received.path) == ["tee.stl"]
    received.remove()
    assert list(temporary.iterdir()) == []


def test_what_was_left_in_several_folders_is_listed_together_the_newest_first(temporary: Path) -> None:
    older, newer = left_by_a_killed_one("old.stl", "newest.stl"), left_by_a_killed_one("newer.stl")
    for age_s, name in enumerate(("newest.stl", "newer.stl", "old.stl")):
        (path,) = temporary.glob(f"*/*/{name}")
        os.utime(path, (1e9 - age_s, 1e9 - age_s))
    assert [path.name for path in files_in(*tidy_left())] == ["newest.stl", "newer.stl", "old.stl"]
    assert {path.parents[1] for path in files_in(*tidy_left())} == {older, newer}
