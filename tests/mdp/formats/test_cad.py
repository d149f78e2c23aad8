"""CAD files: solids of planes and curves become triangles in mm."""

import sys
from pathlib import Path

import numpy as np
import pytest

from mdp.read import read_mesh
from tests.mdp.files import refusal, save
from tests.mdp.step_file import step_box


@pytest.mark.parametrize(("prefix", "scale"), [(".MILLI.", 1.0), (".CENTI.", 10.0), ("$", 1000.0)])
def test_a_step_file_is_read_in_the_unit_that_it_names_with_z_up(tmp_path: Path, prefix: str, scale: float) -> None:
    pytest.importorskip("cascadio")
    sides = (20 / scale, 30 / scale, 40 / scale)
    mesh, notes = read_mesh(save(tmp_path / "box.step", step_box(sides, prefix).encode()))
    assert notes == ()
    assert mesh.bounds_mm == pytest.approx(np.array([[-10, -15, 0], [10, 15, 40]]), abs=1e-5)
    assert mesh.volume_mm3 == pytest.approx(24_000, rel=1e-6)


def test_a_damaged_step_file_ends_in_a_sentence_and_nothing_is_said_beside_it(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("cascadio")
    half = step_box((20, 30, 40)).encode()[:3000]
    assert refusal(save(tmp_path / "half.stp", half)) == "is no STEP file, or damaged"
    assert refusal(save(tmp_path / "box.iges", b"x")) == "is no IGES file, or damaged"
    assert capfd.readouterr() == ("", "")


def test_without_the_extra_the_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cascadio", None)
    sentence = refusal(save(tmp_path / "box.step", step_box((20, 30, 40)).encode()))
    assert sentence == "reading CAD files needs cascadio: pip install 'tiltprint[step]'"
