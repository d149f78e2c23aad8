"""The print campaign: its models, its random settings, its table, and a small run."""

from pathlib import Path

import numpy as np
import pytest

from mdp.read import read_mesh
from profiles.profile import load
from tests.shapes import box, tee
from tools.campaigns import prints
from tools.campaigns.prints import DEMOS, drawn_options, lay_out, report


def test_meshes_of_arrays_are_60_mm_long_and_files_stay_what_they_are(tmp_path: Path) -> None:
    folder, out = tmp_path / "meshes", tmp_path / "models"
    folder.mkdir()
    np.savez(folder / "tee.npz", vertices=tee().vertices.astype(np.float32), faces=tee().faces)
    (folder / "broken.stl").write_text("no mesh")
    lay_out([folder], 1, out)
    assert sorted(file.stem for file in out.iterdir()) == sorted([*DEMOS, "broken", "tee"])
    assert np.ptp(read_mesh(out / "tee.stl")[0].vertices, axis=0).max() == pytest.approx(60.0, rel=1e-5)
    assert (out / "broken.stl").read_text() == "no mesh"


@pytest.mark.parametrize("number", range(25))
def test_settings_that_are_drawn_follow_from_their_number_and_make_a_profile(number: int) -> None:
    options = drawn_options(number)
    assert options == drawn_options(number)
    words = dict(zip(options[0:4:2], options[1:4:2], strict=True))
    settings = [options[k + 1] for k, word in enumerate(options) if word == "--set"]
    profile = load(machine=words["--machine"], material=words["--material"], settings=settings)
    assert 0.2 <= profile.process.scale <= 2.0


def test_the_table_counts_every_row_once_and_names_what_was_not_printed() -> None:
    rows = [
        {"run": "default", "model": name, "status": status, "core_s": "2", "sentence": sentence, "findings": findings}
        for name, status, sentence, findings in (
            ("a.stl", "done", "", "overhang uncalibrated"),
            ("b.stl", "refused", "b.stl is empty", ""),
        )
    ]
    lines = report(rows).splitlines()
    assert lines[2].startswith("| default | 1 | 1 | 0 |")
    assert "- default/b.stl: refused: b.stl is empty" in lines
    assert lines[-1] == "findings: overhang 1, uncalibrated 1"


@pytest.mark.slow
def test_a_campaign_prints_what_it_can_and_refuses_the_rest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, out = tmp_path / "models", tmp_path / "out"
    folder.mkdir()
    np.savez(folder / "box.npz", vertices=box(8, 8, 2).vertices, faces=box(8, 8, 2).faces)
    (folder / "broken.stl").write_text("no mesh")
    monkeypatch.setattr(prints, "DEMOS", ())
    arguments = [str(out), str(folder), "--varied", "0", "--parts", "1", "--set", "process.scale=0.15"]
    monkeypatch.setattr("sys.argv", ["prints.py", *arguments])
    prints.main()
    text = (out / "table.md").read_text()
    assert "| default | 1 | 1 | 0 |" in text
    assert "- default/broken.stl: refused: " in text
