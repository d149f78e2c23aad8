"""Printed solids of a slicer file: negative volumes and everything below the build plate are subtracted."""

from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from mdp.read import read_model
from tests.mdp import files
from tests.mdp.slicer_files import (
    AT_ORIGIN,
    BLOCK,
    BOX,
    CYLINDER,
    DIALECTS,
    Made,
    Object,
    Placed,
    affine,
    change,
    check,
    paint,
    printed,
    prusaslicer,
    written,
)
from tests.shapes import from_manifold


def drawn(rng: np.random.Generator, plates: int) -> list[Object]:
    """Objects with randomly overlapping parts, negatives and marks, far apart from each other on their plates."""
    objects = []
    for k in range(rng.integers(1, 4)):
        kinds = ["part", *rng.choice(["part", "negative", "modifier", "support", "no_support"], rng.integers(0, 5))]
        volumes = [Made(BLOCK)]
        for kind in kinds[1:]:
            solid = (BOX, CYLINDER, m3.Manifold.sphere(8.0, 16))[rng.integers(3)]
            volumes.append(Made(solid.translate(rng.uniform(-15.0, 15.0, 3)), str(kind)))
        instances = []
        for j in range(rng.integers(1, 3)):
            transform = affine(rng)
            transform[3] += (300.0 * k, 300.0 * j, 200.0)
            instances.append(Placed(transform, int(rng.integers(1, plates + 1)), j == 0 or bool(rng.integers(2))))
        objects.append(Object(volumes, instances))
    return objects


@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize("seed", range(30))
def test_the_model_read_equals_the_contents_of_the_slicer_file(tmp_path: Path, dialect: str, seed: int) -> None:
    rng = np.random.default_rng([seed, len(dialect)])
    plates = int(rng.integers(1, 4)) if dialect == "bambu" else 1
    objects = drawn(rng, plates)
    path = written(tmp_path / "a.3mf", dialect, objects, seed)
    held = [plate for plate in range(1, plates + 1) if not printed(objects, plate).is_empty()]
    for plate in held:
        asked = None if plate == held[0] else plate
        check(read_model(path, plate=asked).mesh, printed(objects, plate))


def test_a_negative_volume_inside_leaves_a_void(tmp_path: Path) -> None:
    ball = m3.Manifold.sphere(5.0, 24)
    mesh = read_model(prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(ball, "negative")], [AT_ORIGIN])])).mesh
    check(mesh, BLOCK - ball)
    assert mesh.volume_mm3 < BLOCK.volume() - 480.0


def test_a_negative_volume_takes_nothing_out_of_another_object(tmp_path: Path) -> None:
    long = m3.Manifold.cube((200.0, 5.0, 5.0), True)
    beside = Placed(np.vstack([np.eye(3), [40.0, 0.0, 10.0]]))
    objects = [Object([Made(BLOCK), Made(long, "negative")], [AT_ORIGIN]), Object([Made(BLOCK)], [beside])]
    assert read_model(prusaslicer(tmp_path / "a.3mf", objects)).mesh.volume_mm3 == pytest.approx(36000.0 - 30.0 * 25.0)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_bodies_below_the_plate_of_a_slicer_file_are_not_printed(tmp_path: Path, dialect: str) -> None:
    sunk = Placed(np.vstack([np.eye(3), [0.0, 0.0, 6.0]]))
    model = read_model(written(tmp_path / "a.3mf", dialect, [Object([Made(BLOCK), Made(BOX, "support")], [sunk])]))
    check(model.mesh, BLOCK.trim_by_plane((0.0, 0.0, 1.0), -6.0))
    np.testing.assert_allclose(model.zones.support[0].corners[:, 2].min(), -15.0 + 6.0, atol=1e-9)
    assert model.notes[0] == "leaves out what lies below the plate, 4 mm deep"


@pytest.mark.parametrize(("second", "deep_mm"), [("negative", 0.0), ("part", 4.0), ("part", 0.0)])
def test_colours_follow_what_negative_volumes_and_the_plate_leave_of_their_faces(
    tmp_path: Path, second: str, deep_mm: float
) -> None:
    pole = m3.Manifold.cube((10.0, 8.0, 40.0), True).translate((3.1, 2.3, 20.0))
    at = Placed(np.vstack([np.eye(3), [0.0, 0.0, 10.0 - deep_mm]]))
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(pole, second)], [at])])
    top = np.flatnonzero(from_manifold(BLOCK).normals[:, 2] > 0.9)
    paint(path, top, 'pid="9" p1="0"')
    group = '<basematerials id="9"><base name="red" displaycolor="#FF0000"/></basematerials>'
    change(path, "3D/3dmodel.model", "<resources>", f"<resources>{group}")
    mesh = read_model(path).mesh
    assert mesh.colours is not None
    assert mesh.areas_mm2[mesh.colours == 0xFF0000].sum() == pytest.approx(30.0 * 30.0 - 10.0 * 8.0)


def test_a_slicer_file_that_prints_nothing_is_refused(tmp_path: Path) -> None:
    hidden = Placed(AT_ORIGIN.transform, printable=False)
    assert files.refusal(prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK)], [hidden])])) == (
        "its build places no mesh that is printed: it leaves out object b, which is switched off in its slicer"
    )
    nothing = Object([Made(BOX), Made(BLOCK.scale((2.0, 2.0, 4.0)), "negative")], [AT_ORIGIN])
    assert files.refusal(prusaslicer(tmp_path / "b.3mf", [nothing])) == (
        "nothing is left of it: negative volumes or the plate cut all of it away"
    )
