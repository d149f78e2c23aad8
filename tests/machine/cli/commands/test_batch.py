"""The batch command: the rows and files of a folder's models, which models are processed again, and refusals."""

import csv
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from machine.cli.cli import main
from machine.cli.commands.batch import reasons, same_files, summary
from machine.pipeline.batch_model import DONE, FAILED, REFUSED, Row
from mdp.formats.readers import READERS
from mdp.mesh import Mesh
from mdp.save import stl
from tests import shapes

FAST = ("--set", "process.layer_height_mm=0.3", "--as-is", "--beam-width", "1", "--set", "search.directions=20")
FAST += ("--set", "process.scale=0.4", "--set", "process.infill_density=0.05")


def models(folder: Path, **meshes: Mesh) -> Path:
    folder.mkdir(exist_ok=True)
    for name, mesh in meshes.items():
        (folder / f"{name}.stl").write_bytes(stl(mesh))
    return folder


class ThisProcess:
    """Runs in this process the calls of a batch, because each worker takes a second to start."""

    def completed(self, task: Callable[..., Any], calls: Mapping[str, Any], _: Any) -> Iterator[tuple[str, Any]]:
        return ((name, task(*given)) for name, given in calls.items())


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.cli.commands.batch.connected", lambda _: nullcontext(ThisProcess()))


def rows_of(table: Path) -> dict[str, dict[str, str]]:
    with table.open() as file:
        return {row["model"]: row for row in csv.DictReader(file)}


def without_seconds(table: Path) -> list[dict[str, str]]:
    return [row | {"core_s": ""} for row in rows_of(table).values()]


def test_every_model_has_a_row_and_its_gcode_is_that_of_export(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, out = models(tmp_path / "models", box=shapes.box(), tee=shapes.tee()), tmp_path / "out"
    (folder / "broken.stl").write_text("no mesh")
    (folder / "notes.txt").write_text("no model")
    assert main(["batch", str(folder), "-o", str(out), *FAST]) == 1
    rows = rows_of(out / "export.csv")
    assert {name: row["status"] for name, row in rows.items()} == {"box.stl": DONE, "broken.stl": REFUSED, "tee.stl": DONE}
    assert (
        rows["broken.stl"]["sentence"] == "broken.stl is not an STL file: neither binary nor ASCII with `solid` and `facet` in it"
    )
    assert (rows["box.stl"]["files"], rows["box.stl"]["parts"]) == ("box.gcode", "1")
    assert capsys.readouterr().out.startswith("3 models: 2 done, 1 refused; to print: ")
    assert main(["export", str(folder / "tee.stl"), "-o", str(tmp_path / "tee.gcode"), *FAST]) == 0
    assert (out / "tee.gcode").read_bytes() == (tmp_path / "tee.gcode").read_bytes()
    assert sorted(file.name for file in out.iterdir()) == ["batch.lock", "box.gcode", "export.csv", "tee.gcode"]


def test_only_what_has_changed_or_is_gone_is_done_again_and_workers_do_not_change_the_table(tmp_path: Path) -> None:
    folder = models(tmp_path / "models", a=shapes.box(), b=shapes.box(), c=shapes.box())
    command = ["batch", str(folder), "-o", str(tmp_path / "out"), "--do", "decompose", *FAST]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("machine.cli.commands.batch.connected", lambda _: nullcontext(ThisProcess()))
        assert main(command) == 0
        table, first = tmp_path / "out" / "decompose.csv", {}
        for part in (tmp_path / "out").glob("*/part-01.stl"):
            first[part.parent.name] = part.stat().st_mtime_ns
        models(folder, b=shapes.tee())
        (tmp_path / "out" / "c" / "part-01.stl").unlink()
        assert main(command) == 0
    again = {part.parent.name: part.stat().st_mtime_ns for part in (tmp_path / "out").glob("*/part-01.stl")}
    assert {name for name in again if again[name] != first[name]} == {"b", "c"}
    assert main([*command[:3], str(tmp_path / "workers"), *command[4:]]) == 0
    assert without_seconds(table) == without_seconds(tmp_path / "workers" / "decompose.csv")


@pytest.mark.usefixtures("in_this_process")
def test_other_options_do_everything_again_and_leave_no_file_of_the_ones_before(tmp_path: Path) -> None:
    folder, out = models(tmp_path / "models", box=shapes.box()), tmp_path / "out"
    command = ["batch", str(folder), "-o", str(out), *FAST]
    assert main(command) == 0
    before = rows_of(out / "export.csv")["box.stl"]
    assert main([*command, "--set", "process.scale=100"]) == 1  # larger than the machine
    after = rows_of(out / "export.csv")["box.stl"]
    assert (before["status"], after["status"], after["files"]) == (DONE, REFUSED, "")
    assert not (out / "box.gcode").exists()


@pytest.mark.usefixtures("in_this_process")
def test_rows_of_models_that_are_gone_stay(tmp_path: Path) -> None:
    folder, out = models(tmp_path / "models", a=shapes.box(), b=shapes.box()), tmp_path / "out"
    command = ["batch", str(folder), "-o", str(out), "--do", "estimate", *FAST]
    assert main(command) == 0
    (folder / "a.stl").unlink()
    assert main(command) == 0
    assert list(rows_of(out / "estimate.csv")) == ["a.stl", "b.stl"]


def test_a_model_that_takes_too_long_is_a_row_and_is_tried_again_by_the_next_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, out = models(tmp_path / "models", ball=shapes.ball(30.0, 256)), tmp_path / "out"
    command = ["batch", str(folder), "-o", str(out), "--do", "estimate", "--beam-width", "50"]
    assert main([*command, "--limit-s", "1"]) == 1
    row = rows_of(out / "estimate.csv")["ball.stl"]
    assert (row["status"], row["sentence"]) == (FAILED, "ball.stl: it took longer than 1 s")
    in_time = SimpleNamespace(completed=lambda task, calls, _: [(name, Row(name)) for name in calls])
    monkeypatch.setattr("machine.cli.commands.batch.connected", lambda _: nullcontext(in_time))
    assert main(command) == 0


def test_after_ctrl_c_no_process_remains_and_the_batch_can_continue(tmp_path: Path) -> None:
    folder, out = models(tmp_path / "models", a=shapes.box(), b=shapes.ball(30.0, 256)), tmp_path / "out"
    command = ["batch", str(folder), "-o", str(out), "--do", "estimate", "--workers", "1"]
    run = subprocess.Popen(
        [sys.executable, "-m", "machine.cli.cli", *command, "--beam-width", "50"], stderr=subprocess.PIPE, text=True
    )
    while not (out / "estimate.csv").exists() or not rows_of(out / "estimate.csv"):
        time.sleep(0.02)
    (worker,) = children_of(run.pid)
    run.send_signal(signal.SIGINT)
    said = run.communicate()[1].splitlines()
    assert said[-2:] == [
        f"1 of 2 models have a row in {out / 'estimate.csv'}; a repeated run continues there",
        "tiltprint: interrupted",
    ]
    assert run.returncode == 130
    assert list(rows_of(out / "estimate.csv")) == ["a.stl"]
    assert not worker.exists()


def children_of(pid: int) -> list[Path]:
    """Folders in /proc of a process's children."""
    threads = Path(f"/proc/{pid}/task").glob("*/children")
    return [Path("/proc") / child for thread in threads for child in thread.read_text().split()]


@pytest.mark.usefixtures("in_this_process")
def test_two_models_of_one_name_do_not_write_over_each_other(tmp_path: Path) -> None:
    assert same_files(["b.stl", "a.stl", "A.obj", "a.ply"]) == {"a.ply": "A.obj", "a.stl": "A.obj"}
    folder, out = models(tmp_path / "models", tee=shapes.box()), tmp_path / "out"
    command = ["batch", str(folder), "-o", str(out), *FAST]
    assert main(command) == 0
    (folder / "tee.ply").write_text("no mesh")
    assert main(command) == 1
    names = {name: row["sentence"].partition(" is not")[0].partition(":")[0] for name, row in rows_of(out / "export.csv").items()}
    assert names == {
        "tee.ply": "tee.ply",
        "tee.stl": "tee.stl would have the files of tee.ply",
    }
    assert not (out / "tee.gcode").exists()
    (folder / "tee.ply").unlink()
    assert main(command) == 0
    assert (out / "tee.gcode").exists()


def test_reasons_are_counted_regardless_of_the_models_and_numbers_in_them(tmp_path: Path) -> None:
    rows = [
        Row("a.stl", REFUSED, sentence="a.stl is not closed: 188 open edges"),
        Row("b.stl", REFUSED, sentence="b.stl is not closed: 3 open edges"),
        Row("c.stl", FAILED, sentence="c.stl: it took longer than 1 s"),
        Row("d.stl", time_s=3600.0, filament_mm=2500.0),
    ]
    assert reasons(rows) == [("is not closed: 188 open edges", 2), ("it took longer than 1 s", 1)]
    assert summary(rows, tmp_path / "t.csv").splitlines() == [
        "4 models: 1 done, 2 refused, 1 failed; to print: 1h 0m 0s, 2.5 m of filament",
        "     2 is not closed: 188 open edges",
        "     1 it took longer than 1 s",
        f"a row for each is in {tmp_path / 't.csv'}",
    ]
    assert reasons([replace(rows[0], status=DONE)]) == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("none",), "none: there is no such folder; models are expected in it"),
        (("empty",), f"folder empty holds no model; {', '.join(READERS)} are read"),
        (("models", "--do", "print"), "--do print: decompose, export, estimate is expected"),
        (("models", "-o", "models/box.stl"), "output models/box.stl is a file: a folder is expected"),
        (("models", "--ranker", "luck"), "--ranker luck: classic, learned or the name of an .onnx file is allowed"),
        (("models", "--set", "search.luck=1"), "search.luck is not a key of a profile (`profiles show` lists them)"),
        (("models", "--workers", "0"), "--workers is '0': it must be at least 1; see tiltprint batch --help"),
    ],
)
def test_an_error_of_the_whole_batch_is_one_line_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    models(Path("models"), box=shapes.box())
    Path("empty").mkdir()
    assert main(["batch", "-o", "out", *words]) == 1
    assert capsys.readouterr().err == f"tiltprint: {message}\n"
    assert not Path("out").exists()
