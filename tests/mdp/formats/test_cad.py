"""CAD files: solids of planes and curves become triangles in mm."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mdp.formats.cad import _assembly
from mdp.formats.surface import Surface
from mdp.mesh import Mesh
from mdp.read import read_mesh
from mdp.repair.repair import repair
from profiles.errors import MeshError
from tests.checks import assert_closed
from tests.mdp import files
from tests.mdp.files import refusal, save
from tests.mdp.iges_file import iges_cylinder
from tests.mdp.step_file import Corner, painted, step_assembly, step_box, step_cylinder, step_prism

DAMAGED = "is damaged: the CAD library (OpenCASCADE) cannot read it"


@pytest.mark.parametrize(("prefix", "scale"), [(".MILLI.", 1.0), (".CENTI.", 10.0), ("$", 1000.0)])
def test_a_step_file_is_read_in_the_unit_that_it_names_with_z_up(tmp_path: Path, prefix: str, scale: float) -> None:
    pytest.importorskip("cascadio")
    sides = (20 / scale, 30 / scale, 40 / scale)
    mesh, notes = read_mesh(save(tmp_path / "box.step", step_box(sides, prefix).encode()))
    assert notes == ()
    assert mesh.bounds_mm == pytest.approx(np.array([[-10, -15, 0], [10, 15, 40]]), abs=1e-5)
    assert mesh.volume_mm3 == pytest.approx(24_000, rel=1e-6)


def boxed(mesh: Mesh) -> Surface:
    return Surface(mesh.vertices, mesh.faces.astype(np.int64))


def ring(corners: int, outer: float, inner: float | None = None) -> list[Corner]:
    """A polygon with a number of corners, or a star in which every second corner is nearer."""
    radii = [outer, outer if inner is None else inner]
    angles = np.arange(corners) * 2.0 * np.pi / corners
    return [(float(radii[k % 2] * np.cos(a)), float(radii[k % 2] * np.sin(a))) for k, a in enumerate(angles)]


def area(base: list[Corner]) -> float:
    x, y = np.array(base).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0


ELL: list[Corner] = [(-9, -9), (9, -9), (9, -3), (-3, -3), (-3, 9), (-9, 9)]
CHANNEL: list[Corner] = [(-9, -9), (9, -9), (9, 9), (5, 9), (5, -5), (-5, -5), (-5, 9), (-9, 9)]
BASES = [ring(3, 10.0), ring(8, 10.0), ring(8, 10.0, 5.0), ELL, CHANNEL]


@pytest.mark.parametrize("base", BASES)
def test_a_prism_has_its_volume(tmp_path: Path, base: list[Corner]) -> None:
    pytest.importorskip("cascadio")
    mesh, _ = read_mesh(save(tmp_path / "prism.step", step_prism(base, 12.0).encode()))
    assert mesh.volume_mm3 == pytest.approx(12.0 * area(base), rel=1e-6)


@pytest.mark.parametrize("base", BASES[:2])
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


@pytest.mark.parametrize("radius", [1.0, 60.0])
def test_a_cylinder_has_its_volume_but_for_its_corners(tmp_path: Path, radius: float) -> None:
    pytest.importorskip("cascadio")
    mesh, _ = read_mesh(save(tmp_path / "cylinder.step", step_cylinder(radius, 20.0).encode()))
    whole_mm3 = np.pi * radius**2 * 20.0
    assert (1.0 - 0.17**2 / 6.0) * whole_mm3 < mesh.volume_mm3 < whole_mm3


@pytest.mark.parametrize(("unit", "unit_mm", "scale"), [("MM", 1.0, 2.0), ("IN", 25.4, 1.0)])
def test_the_faces_of_an_iges_solid_are_sewn_and_read_in_mm(tmp_path: Path, unit: str, unit_mm: float, scale: float) -> None:
    pytest.importorskip("cascadio")
    file = save(tmp_path / "cylinder.igs", iges_cylinder(10.0 / unit_mm, 20.0 / unit_mm, unit).encode())
    mesh, _ = read_mesh(file, scale)
    assert np.ptp(mesh.bounds_mm, axis=0) / scale == pytest.approx([20.0, 20.0, 20.0], abs=0.02)
    assert mesh.volume_mm3 / scale**3 == pytest.approx(np.pi * 100.0 * 20.0, rel=0.17**2 / 6.0)
    assert_closed(mesh)


def test_an_assembly_is_reported_with_the_names_of_its_parts() -> None:
    boxes = [
        replace(boxed(files.placed(10, 10, 10, (20.0 * k, 0, 0))), name=name) for k, name in enumerate(("nut", "nut", "rod"))
    ]
    assert _assembly(boxes) == ("is an assembly of 3 parts, printed as one model: 2 x nut, rod",)
    open_one = boxed(files.without(files.placed(10, 10, 10, (90.0, 0, 0)), 0, 1, 2, 3))
    with pytest.raises(MeshError, match=r"^its part 'lid' is not closed"):
        repair([*boxes, replace(open_one, name="lid")])


@pytest.mark.parametrize("share", [0.2, 0.95])
def test_a_step_file_that_was_cut_off_is_refused(tmp_path: Path, share: float) -> None:
    pytest.importorskip("cascadio")
    whole = step_cylinder(10.0, 20.0).encode()
    assert "STEP" in refusal(save(tmp_path / "cut.step", whole[: int(share * len(whole))]))


def test_a_damaged_step_file_is_refused_in_one_sentence(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("cascadio")
    half = step_box((20, 30, 40)).encode()[:3000]
    assert refusal(save(tmp_path / "half.stp", half)) == "is not a valid STEP file"
    assert refusal(save(tmp_path / "box.iges", b"x")) == "is not a valid IGES file"
    assert capfd.readouterr() == ("", "")


def test_a_step_file_that_crashes_the_cad_library_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("cascadio")
    damaged = step_box((20, 30, 40)).replace("=DIRECTION(", "=DIRECTOR(")
    assert refusal(save(tmp_path / "box.step", damaged.encode())) == DAMAGED


def test_a_part_of_an_assembly_that_has_lost_its_surface_is_named(tmp_path: Path) -> None:
    pytest.importorskip("cascadio")
    whole = step_assembly(("lid", (20, 20, 5)), ("base", (30, 30, 10)))
    _, notes = read_mesh(save(tmp_path / "whole.step", whole.encode()))
    assert notes[0] == "is an assembly of 2 parts, printed as one model: lid, base"
    mesh, notes = read_mesh(save(tmp_path / "lost.step", whole.replace("=CLOSED_SHELL", "=CLOSED_SHELF", 1).encode()))
    assert (mesh.volume_mm3, notes) == (pytest.approx(9_000), ("leaves out lid: it has no surface that can be read",))


@pytest.mark.parametrize("number", ["1.E400", "-2.5E+0309"])
def test_a_number_that_is_not_finite_is_refused_before_the_library_loses_its_part_or_itself(tmp_path: Path, number: str) -> None:
    pytest.importorskip("cascadio")
    file = step_box((20, 30, 40)).replace("(20.0,", f"({number},")
    assert refusal(save(tmp_path / "box.step", file.encode())) == f"is damaged: it holds the number {number}, which is not finite"


def test_the_number_of_a_line_in_an_iges_file_is_no_exponent(tmp_path: Path) -> None:
    pytest.importorskip("cascadio")
    numbered = re.sub(
        r"00000000D +(\d+)$",
        lambda found: f"00010000D{int(found[1]):07}",
        iges_cylinder(10.0, 20.0, points=160),
        flags=re.MULTILINE,
    )
    assert "00010000D0000311" in numbered
    mesh, _ = read_mesh(save(tmp_path / "cylinder.igs", numbered.encode()))
    assert np.ptp(mesh.bounds_mm, axis=0) == pytest.approx([20.0, 20.0, 20.0], abs=0.02)


def test_an_iges_file_that_was_cut_off_is_said_to_be_cut_short(tmp_path: Path) -> None:
    pytest.importorskip("cascadio")
    lines = iges_cylinder(10.0, 20.0).splitlines(keepends=True)
    sentence = refusal(save(tmp_path / "cut.igs", "".join(lines[:-1]).encode()))
    assert sentence == "is cut short: its last section (T, terminate) is missing"


def test_a_missing_cad_library_is_reported_with_the_install_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cascadio", None)
    sentence = refusal(save(tmp_path / "box.step", step_box((20, 30, 40)).encode()))
    assert sentence == "reading CAD files needs cascadio: pip install 'tiltprint[step]'"
