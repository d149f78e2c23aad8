"""CAD files: solids of planes and curves become triangles in mm."""

import sys
from pathlib import Path

import numpy as np
import pytest

from mdp.read import read_mesh
from tests.mdp.files import refusal, save
from tests.mdp.step_file import Corner, painted, step_box, step_cylinder, step_prism


@pytest.mark.parametrize(("prefix", "scale"), [(".MILLI.", 1.0), (".CENTI.", 10.0), ("$", 1000.0)])
def test_a_step_file_is_read_in_the_unit_that_it_names_with_z_up(tmp_path: Path, prefix: str, scale: float) -> None:
    pytest.importorskip("cascadio")
    sides = (20 / scale, 30 / scale, 40 / scale)
    mesh, notes = read_mesh(save(tmp_path / "box.step", step_box(sides, prefix).encode()))
    assert notes == ()
    assert mesh.bounds_mm == pytest.approx(np.array([[-10, -15, 0], [10, 15, 40]]), abs=1e-5)
    assert mesh.volume_mm3 == pytest.approx(24_000, rel=1e-6)


def ring(corners: int, outer: float, inner: float | None = None) -> list[Corner]:
    """A polygon with so many corners, or a star where every second one lies nearer."""
    radii = [outer, outer if inner is None else inner]
    angles = np.arange(corners) * 2.0 * np.pi / corners
    return [(float(radii[k % 2] * np.cos(a)), float(radii[k % 2] * np.sin(a))) for k, a in enumerate(angles)]


def area(base: list[Corner]) -> float:
    x, y = np.array(base).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0


ELL: list[Corner] = [(-9, -9), (9, -9), (9, -3), (-3, -3), (-3, 9), (-9, 9)]
CHANNEL: list[Corner] = [(-9, -9), (9, -9), (9, 9), (5, 9), (5, -5), (-5, -5), (-5, 9), (-9, 9)]
BASES = [*(ring(count, 10.0) for count in range(3, 9)), *(ring(2 * count, 10.0, 5.0) for count in (3, 4, 6)), ELL, CHANNEL]


@pytest.mark.parametrize("base", BASES)
def test_a_prism_has_its_volume(tmp_path: Path, base: list[Corner]) -> None:
    pytest.importorskip("cascadio")
    mesh, _ = read_mesh(save(tmp_path / "prism.step", step_prism(base, 12.0).encode()))
    assert mesh.volume_mm3 == pytest.approx(12.0 * area(base), rel=1e-6)


@pytest.mark.parametrize("base", BASES[:6])
def test_a_frustum_has_its_volume(tmp_path: Path, base: list[Corner]) -> None:
    pytest.importorskip("cascadio")
    mesh, _ = read_mesh(save(tmp_path / "frustum.stp", step_prism(base, 12.0, top=0.5).encode()))
    assert mesh.volume_mm3 == pytest.approx(12.0 / 3.0 * area(base) * (1.0 + 0.5 + 0.25), rel=1e-6)


def test_colours_of_faces_and_of_the_solid_are_kept(tmp_path: Path) -> None:
    pytest.importorskip("cascadio")
    file = painted(step_box((20, 30, 40)), {1: (1.0, 0.0, 0.0), -1: (0.5, 0.5, 0.5)})
    mesh, notes = read_mesh(save(tmp_path / "box.step", file.encode()))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(24_000, rel=1e-6)
    assert mesh.colours is not None
    top = mesh.normals[:, 2] > 0.99
    assert set(mesh.colours[top].tolist()) == {0xFF0000}
    assert set(mesh.colours[~top].tolist()) == {0x808080}


def test_the_colour_of_a_whole_solid_marks_nothing(tmp_path: Path) -> None:
    pytest.importorskip("cascadio")
    assert (
        read_mesh(save(tmp_path / "box.step", painted(step_box((20, 30, 40)), {-1: (1.0, 0.0, 0.0)}).encode()))[0].colours is None
    )


@pytest.mark.parametrize("radius", [1.0, 10.0, 60.0])
def test_a_cylinder_has_its_volume_but_for_its_corners(tmp_path: Path, radius: float) -> None:
    pytest.importorskip("cascadio")
    mesh, _ = read_mesh(save(tmp_path / "cylinder.step", step_cylinder(radius, 20.0).encode()))
    whole_mm3 = np.pi * radius**2 * 20.0
    assert (1.0 - 0.17**2 / 6.0) * whole_mm3 < mesh.volume_mm3 < whole_mm3


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 0.95])
def test_a_step_file_that_was_cut_off_is_refused(tmp_path: Path, share: float) -> None:
    pytest.importorskip("cascadio")
    whole = step_cylinder(10.0, 20.0).encode()
    assert "STEP" in refusal(save(tmp_path / "cut.step", whole[: int(share * len(whole))]))


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
