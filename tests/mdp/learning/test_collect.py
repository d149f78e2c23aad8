"""Collecting records: runs on workers, continuation after an end, and refusals."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from mdp.formats.readers import READERS
from mdp.learning.collect import main
from mdp.learning.collection import INDEX, read_index
from mdp.mesh import Mesh
from tests import shapes

QUICK = ("--terms", "paper", "--beam-width", "3")


def _models(folder: Path, **meshes: Mesh) -> Path:
    folder.mkdir()
    for name, mesh in meshes.items():
        np.savez(folder / f"{name}.npz", vertices=mesh.vertices, faces=mesh.faces)
    return folder


def test_only_missing_records_are_collected_with_the_same_result_on_fewer_workers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    models, out = _models(tmp_path / "models", tee=shapes.tee(), flat=shapes.box()), tmp_path / "out"
    (models / "broken.stl").write_text("no mesh")
    assert main([str(models), "-o", str(out), *QUICK, "--orientations", "2", "--workers", "2"]) == 0
    first = {file.name: (file.stat().st_mtime_ns, file.read_bytes()) for file in out.glob("*.npz")}
    assert sorted(first) == ["tee.0.paper.npz", "tee.1.paper.npz"]
    reasons = {row.id: row.excluded for row in read_index(out) if row.orientation == 0}
    assert (reasons["tee"], reasons["flat"]) == ("", "nothing feasible")
    assert reasons["broken"].startswith("failed: ")
    assert f"- broken.0.paper.npz: {models}/broken.stl is not an STL file" in capsys.readouterr().out

    (out / "tee.1.paper.npz").unlink()
    (models / "broken.stl").unlink()
    assert main([str(models), "-o", str(out), *QUICK, "--orientations", "2", "--workers", "1"]) == 0
    again = {file.name: (file.stat().st_mtime_ns, file.read_bytes()) for file in out.glob("*.npz")}
    assert {name for name in first if again[name][0] != first[name][0]} == {"tee.1.paper.npz"}
    assert again["tee.1.paper.npz"][1] == first["tee.1.paper.npz"][1]


def test_an_interrupt_ends_all_processes_at_once(tmp_path: Path) -> None:
    models, out = _models(tmp_path / "models", ball=shapes.ball(30.0, 128)), tmp_path / "out"
    command = [sys.executable, "-m", "mdp.learning.collect", str(models), "-o", str(out), "--orientations", "9"]
    run = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    while not (out / INDEX).exists():
        time.sleep(0.05)
    time.sleep(1.0)
    os.killpg(run.pid, signal.SIGINT)
    assert run.stderr is not None
    assert run.stderr.read() == "interrupted; started again, the collection continues where it stopped\n"
    assert run.wait() == 130
    with pytest.raises(ProcessLookupError):  # the group is empty
        _until_gone(run.pid)


def _until_gone(group: int) -> None:
    for _ in range(100):
        os.killpg(group, 0)
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--beam-width", "wide"), "argument --beam-width: invalid int value: 'wide'; --help shows what is allowed"),
        (("--beam-width", "0"), "--beam-width is 0: 1 to 1000 is allowed"),
        (("--workers", "0"), "--workers is 0: 1 to 1000 is allowed"),
        (("--time-limit", "-1"), "--time-limit is -1: 0 or more is allowed"),
        (("--terms", "ours,mine"), "--terms has 'mine': paper, best, ours are allowed"),
        (
            ("--only", "tea"),
            "folder {models} holds no model with 'tea' in its name; .npz, {readers} are read",
        ),
        (("--set", "search.luck=1"), "search.luck is not a key of a profile (`profiles show` lists them)"),
        (("--luck",), "unrecognized arguments: --luck; --help shows what is allowed"),
        (
            ("--out", "{models}/tee.npz"),
            "folder {models}/tee.npz cannot be written ([Errno 17] File exists: '{models}/tee.npz')",
        ),
    ],
)
def test_a_wrong_option_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], message: str
) -> None:
    models = _models(tmp_path / "models", tee=shapes.tee())
    given = [str(models), "-o", str(tmp_path / "out"), *(word.format(models=models) for word in words)]
    assert main(given) == 1
    assert capsys.readouterr().err == f"error: {message.format(models=models, readers=', '.join(READERS))}\n"
