"""Autosaved work and files sent by pages: written to folders, opened again, refused with a sentence or removed."""

import asyncio
import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Event

import pytest

from machine.pipeline.project import read_folder
from machine.pipeline.project_record import RECORD, VERSION
from machine.pipeline.requests import Given
from machine.planning.stops import parse_stops
from machine.workbench.bench.bench import Bench
from machine.workbench.bench.model import Model
from machine.workbench.session import keeping
from machine.workbench.session.commands import undo
from machine.workbench.session.keeping import Keeping
from machine.workbench.session.session import Session
from machine.workbench.work import folders as kept_work
from machine.workbench.work.folders import (
    BEGUN_S,
    FOUND,
    KEPT_S,
    MOST_KEPT,
    Received,
    files_in,
    folders_kept,
    new_folder,
    tidy_left,
    write_work,
)
from machine.workbench.work.worker_pool import WorkerPools
from mdp.model_file import locate
from mdp.save import stl
from mdp.search.plan_file import PlannedPart
from mdp.search.plan_reading import read_plan
from profiles import files
from profiles.errors import PlanError
from profiles.files import lock_folder
from profiles.profile import load
from tests.machine.running_workbench import workbench
from tests.machine.workbench.models import model
from tests.shapes import tee

LOW, HIGH = PlannedPart((0.0, 0.0, 1.0), 10.0), PlannedPart((0.0, 0.0, 1.0), 30.0)
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
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    file = tmp_path / "tee \u732b.stl"
    file.write_bytes(stl(tee()))
    return Bench(
        load(settings=["process.walls=4"]),
        replace(model(), path=file, name=file.name),
        cuts=(LOW, HIGH),
        locked=frozenset({HIGH}),
        given=Given(settings=("process.walls=4",)),
        stops=parse_stops(["1:3"], ["2:1.5mm"]),
        copies=1,
    )


def test_an_autosaved_bench_is_read_as_it_was_written(bench: Bench) -> None:
    folder = new_folder()
    write_work(folder, bench)
    write_work(folder, bench)
    work = read_folder(folder)
    assert (work.name, work.given, work.rotation) == ("tee \u732b.stl", bench.given, bench.rotation)
    assert (work.locked, work.stops, work.parts) == ((1,), bench.stops, 3)
    assert work.model is not None
    assert work.model.read_bytes() == stl(tee())
    assert work.plan is not None
    assert read_plan(work.plan).parts == (LOW, HIGH)
    assert len(list(folder.iterdir())) == 3  # record, plan, model


def test_profile_files_are_saved_with_their_names(bench: Bench, tmp_path: Path) -> None:
    own = tmp_path / "mine.toml"
    own.write_text('inherits = "pla"\n[material]\nname = "mine"\nbed_c = 55.0\n')
    folder = new_folder()
    write_work(folder, replace(bench, given=Given(material=str(own))))
    own.unlink()
    work = read_folder(folder)
    assert work.own_names == {"material": "mine.toml"}
    assert load(material=work.given.material).material == load(settings=["material.name=mine", "material.bed_c=55"]).material


def test_work_of_a_newer_version_is_refused_and_stays(bench: Bench) -> None:
    folder = new_folder()
    write_work(folder, bench)
    (folder / RECORD).write_text(json.dumps({"version": VERSION + 1}))
    with pytest.raises(PlanError, match="kept by a newer tiltprint, which can open it; it stays in"):
        read_folder(folder)
    (folder / RECORD).write_text('{"version": 1, "name"')
    with pytest.raises(PlanError, match="is not of a workbench, or damaged"):
        read_folder(folder)
    assert folders_kept() == [folder]


def test_the_newest_ten_autosaves_are_kept_and_each_folder_has_one_writer(bench: Bench) -> None:
    folders = [new_folder() for _ in range(MOST_KEPT + 2)]
    for folder in folders:
        write_work(folder, bench)
    lock = lock_folder(folders[0])
    assert lock is not None
    assert len(folders_kept()) == MOST_KEPT
    assert folders[0] not in folders_kept()
    assert sum(folder.exists() for folder in folders) == MOST_KEPT + 1


def test_a_full_disk_is_reported_once_and_the_previous_autosave_remains(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(keeping, "AFTER_S", 0.0)

    async def change_twice() -> tuple[list[str], Path]:
        session = Session(bench.profile, bench.given, WorkerPools())
        told = []
        session.do("open", bench)
        await _settled(session.keeping)
        (kept,) = kept_work.kept_folder().iterdir()
        monkeypatch.setattr(shutil, "copyfileobj", _full)
        for copies in (2, 3):
            for file in kept.glob("model-*"):
                file.rename(file.with_suffix(".gone"))
            session.do("copies", replace(session.bench, copies=copies))
            await _settled(session.keeping)
            told.append(session.problem)
        await session.close()
        return told, kept

    told, kept = asyncio.run(change_twice())
    assert told == ["this work cannot be kept for after a crash: no space left on device; Save > Project keeps it", ""]
    assert read_folder(kept).copies == 1


class Slow:
    """Writes of work that wait for `go_on`; the benches written, in order, and the greatest number of simultaneous writes."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.go_on, self.begun = Event(), Event()
        self.written: list[int] = []
        self.most = self._now = 0
        monkeypatch.setattr(keeping, "write_work", self._write)

    def _write(self, folder: Path, bench: Bench) -> None:
        self._now += 1
        self.most = max(self.most, self._now)
        self.begun.set()
        assert self.go_on.wait(20.0)
        write_work(folder, bench)
        self.written.append(bench.copies)
        self._now -= 1


def test_a_closing_bench_finishes_its_write_saves_newer_changes_then_removes_its_files(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keeping, "AFTER_S", 0.0)
    slow = Slow(monkeypatch)

    async def close() -> Path:
        session = Session(bench.profile, bench.given, WorkerPools())
        sent = session.received.new_file("tee.stl")
        sent.write_bytes(stl(tee()))
        assert bench.model is not None
        on_bench = replace(bench, model=replace(bench.model, path=sent))
        session.do("open", on_bench)
        assert await asyncio.to_thread(slow.begun.wait, 20.0)
        session.do("copies", replace(on_bench, copies=2))
        closing = asyncio.create_task(session.close())
        await asyncio.sleep(0.05)  # it would end in this time if it did not wait
        assert not closing.done()
        assert sent.is_file()
        slow.go_on.set()
        assert await closing == ""
        return sent

    sent = asyncio.run(close())
    assert (slow.written, slow.most) == ([1, 2], 1)
    (kept,) = folders_kept()
    work = read_folder(kept)
    assert work.copies == 2
    assert work.model is not None
    assert work.model.read_bytes() == stl(tee())
    assert not sent.parents[1].exists()


def test_uploads_stay_for_the_next_start_when_the_work_cannot_be_saved(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(shutil, "copyfileobj", _full)

    async def close() -> tuple[str, Path]:
        session = Session(bench.profile, bench.given, WorkerPools())
        sent = session.received.new_file("tee.stl")
        sent.write_bytes(stl(tee()))
        assert bench.model is not None
        session.do("open", replace(bench, model=replace(bench.model, path=sent)))
        return await session.close(), sent

    told, sent = asyncio.run(close())
    assert told.startswith("the work on a bench could not be kept: no space left on device; the files of its pages stay in ")
    assert tidy_left() == (sent.parents[1],)
    assert sent.read_bytes() == stl(tee())


def test_kept_work_is_opened_on_one_bench_at_a_time(bench: Bench) -> None:
    folder = new_folder()
    write_work(folder, bench)

    async def open_twice() -> None:
        first, second = (Session(bench.profile, bench.given, WorkerPools()) for _ in range(2))
        async with first.keeping.opening(folder):
            with pytest.raises(PlanError, match="is no longer kept, or another page has opened it"):
                async with second.keeping.opening(folder):
                    raise AssertionError("it is open already")
        assert folders_kept() == []  # it belongs to the first session now
        await first.close()
        await second.close()

    asyncio.run(open_twice())
    assert folders_kept() == [folder]


@pytest.mark.parametrize("before", ["demo:bracket", "", "tee.stl"])
def test_earlier_work_that_was_opened_is_there_as_it_was_after_undo(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, before: str, tmp_path: Path
) -> None:
    monkeypatch.setattr(keeping, "AFTER_S", 0.0)
    folder = new_folder()
    write_work(folder, Bench(load(), replace(model("demo:bracket"), path=locate("demo:bracket")), copies=3))

    async def open_and_undo() -> int:
        session = Session(load(), Given(), WorkerPools())
        session._read = read  # type: ignore[method-assign]
        if before.startswith("demo:"):
            await session.open_demo(name=before)
        elif before:
            await session.open_model(tmp_path / "tee.stl", before)
        await session.open_folder(folder, read_folder(folder), "open it")
        assert folders_kept() == []
        await _settled(session.keeping)
        version = session.keeping.released
        undo(session)
        await _settled(session.keeping)
        assert folders_kept() == [folder]
        await session.close()
        return session.keeping.released - version

    async def read(path: Path, name: str, *given: object, **more: object) -> Model:
        return replace(model(name), path=path)

    (tmp_path / "tee.stl").write_bytes(stl(tee()))
    assert asyncio.run(open_and_undo()) > 0
    assert read_folder(folder).copies == 3


def test_a_folder_removed_while_earlier_work_is_listed_is_left_out(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    stays, goes = new_folder(), new_folder()
    for folder in (stays, goes):
        write_work(folder, bench)

    def locked(folder: Path) -> int | None:
        lock = lock_folder(folder)
        if folder == goes:
            shutil.rmtree(goes)
        return lock

    monkeypatch.setattr(kept_work, "lock_folder", locked)
    assert folders_kept() == [stays]


def test_without_file_locks_earlier_work_is_listed_and_files_of_others_are_left_alone(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(files, "fcntl", None)
    folder = new_folder()
    write_work(folder, bench)
    received = Received()  # of a running program
    received.new_file("tee.stl").touch()
    assert folders_kept() == [folder]
    assert tidy_left() == ()
    received.remove()


def _full(*_: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


async def _settled(kept: Keeping) -> None:
    while kept.behind:
        await asyncio.sleep(0.01)


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for temporary files of this process and its children."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def names_in(folder: Path) -> list[str]:
    """Names of the files in a folder, without those that a bench has derived from received files."""
    return sorted(path.name for path in folder.rglob("*") if path.is_file() and not path.name.startswith("made-"))


def left_by_a_killed_one(*names: str) -> Path:
    """The folder of a program that had received these files when it was killed."""
    with subprocess.Popen([sys.executable, "-c", HOLDS, *names], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        folder = Path(process.stdout.readline().strip())
        process.send_signal(signal.SIGKILL)
    return folder


def test_a_refused_upload_is_deleted_at_once_and_an_open_one_when_the_program_ends(temporary: Path) -> None:
    sent = temporary / "sent"
    sent.mkdir()
    (sent / "large.stl").write_bytes(bytes(2**20 + 1))
    broken = "infill_density--copies_3.stl"
    (sent / broken).write_bytes(stl(tee())[:400])
    (sent / "tee.stl").write_bytes(stl(tee()))
    (sent / "plan.toml").write_text("nothing = [")
    with workbench("--upload-mib", "1") as bench, bench.line() as page:
        with suppress(OSError):  # the server does not read it to its end
            bench.send(sent / "large.stl")
        problem = page.until(lambda state: state["problem"])["problem"]
        assert problem.startswith("large.stl: has more than the 1 MiB that a page may send:")
        assert [bench.send(sent / name)[0] for name in (broken, "tee.stl", "plan.toml")] == [422, 200, 422]
        assert json.loads(bench.send(sent / broken)[1])["problem"].startswith(f"{broken} is ")  # not in words of the page
        assert [names_in(folder) for folder in temporary.glob("tiltprint-edit-*") if names_in(folder)] == [["tee.stl"]]
    assert list(temporary.glob("tiltprint-edit-*")) == []


def test_uploads_of_a_killed_program_are_listed_for_a_day_and_then_removed(temporary: Path) -> None:
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
    assert empty.exists()  # it may belong to a program that is starting
    past_s = empty.stat().st_mtime - BEGUN_S
    os.utime(empty, (past_s, past_s))
    assert tidy_left() == ()
    assert not empty.exists()
    assert names_in(received.path) == ["tee.stl"]
    received.remove()
    assert list(temporary.iterdir()) == []


def test_files_left_in_several_folders_are_listed_together_newest_first(temporary: Path) -> None:
    older, newer = left_by_a_killed_one("old.stl", "newest.stl"), left_by_a_killed_one("newer.stl")
    for age_s, name in enumerate(("newest.stl", "newer.stl", "old.stl")):
        (path,) = temporary.glob(f"*/*/{name}")
        os.utime(path, (1e9 - age_s, 1e9 - age_s))
    assert [path.name for path in files_in(*tidy_left())] == ["newest.stl", "newer.stl", "old.stl"]
    assert {path.parents[1] for path in files_in(*tidy_left())} == {older, newer}
