"""Copies: they stand apart on the plate, are printed together, and what does not fit is refused."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest
import shapely

from machine.app.pipeline.copies import in_copies
from machine.app.pipeline.pipeline import build
from machine.planning.fit import places_on_plate
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Mesh
from mdp.zone import Grown, Marked, MeshVolume, Modifier, Zone
from profiles.errors import PlanError
from profiles.profile import Profile, load
from tests.shapes import box, standing, tee
from tests.slicer.hand import cut, whole

COARSE = ["process.layer_height_mm=0.3", "process.first_layer_height_mm=0.3"]


def decomposed(*parts: Part) -> Decomposition:
    mesh = parts[0].mesh if len(parts) == 1 else box()
    return Decomposition("box", mesh, parts, 1, "classic", 0.0, 0.0, 0, 0, 0.0)


def plate(*settings: str) -> Profile:
    return load(settings=[*COARSE, *settings])


@pytest.mark.parametrize(("count", "reach_mm"), [(1, 0.0), (2, 12.5), (4, 17.7), (5, 25.0), (9, 35.4)])
def test_copies_stand_in_rows_near_the_middle(count: int, reach_mm: float) -> None:
    places = np.array(places_on_plate((20.0, 20.0), 5.0, count, plate().machine))
    assert np.hypot(*places.T).max() == pytest.approx(reach_mm, abs=0.1)
    apart = np.abs(places[:, None] - places[None]).max(axis=2) + 99.0 * np.eye(count)
    assert apart.min() >= 25.0 - 1e-9


def test_as_many_copies_stand_on_an_oblong_plate_as_have_room_in_rows() -> None:
    machine = load(settings=["machine.table.size_mm=[196, 99]"]).machine
    places = places_on_plate((20.0, 20.0), 5.0, 1000, machine)
    assert len(places) == int((196 - 4 + 5) / 25) * int((99 - 4 + 5) / 25)  # 2 mm are kept free to every edge


def test_copies_on_a_round_plate_keep_to_its_edge_and_apart() -> None:
    machine = plate().machine
    disc = shapely.Point(0.0, 0.0).buffer(machine.table.radius_mm, quad_segs=1000)
    boxes = [shapely.box(x - 15, y - 6, x + 15, y + 6) for x, y in places_on_plate((30.0, 12.0), 5.0, 1000, machine)]
    assert len(boxes) > 20
    assert all(disc.covers(box.buffer(2.0, join_style="mitre")) for box in boxes)
    assert min(a.distance(b) for a, b in combinations(boxes, 2)) == pytest.approx(5.0)


def test_every_copy_has_the_settings_of_its_modifiers() -> None:
    half = Modifier(Zone((-99.0, 0.0, -1.0), (99.0, 5.0, 99.0)), {"infill_density": 1.0})
    insert = Modifier(MeshVolume(Path("insert.stl"), box(4.0, 4.0, 4.0)), {"walls": 5})
    (many,) = in_copies(decomposed(replace(whole(box(10, 10, 9)), modifiers=(half, insert))), 2, plate())[0].parts
    volumes = [(modifier.volume, modifier.process) for modifier in many.modifiers]
    assert [own for _, own in volumes] == [half.process] * 2 + [insert.process] * 2
    boxes = [volume.min_mm[1] for volume, _ in volumes if isinstance(volume, Zone)]
    meshes = [float(volume.mesh.bounds_mm[0, 1]) for volume, _ in volumes if isinstance(volume, MeshVolume)]
    assert sorted(boxes) == [-7.5, 7.5]  # 10 mm deep, 5 mm apart
    assert sorted(meshes) == [-9.5, 5.5]


def test_every_copy_is_printed_and_a_layer_of_all_comes_before_the_next() -> None:
    many, profile = in_copies(decomposed(whole(box(10, 10, 0.9))), 3, plate())
    program = build(many, profile)
    assert [finding.code for finding in program.run.findings if finding.code != "uncalibrated"] == []
    single = build(decomposed(whole(box(10, 10, 0.9))), profile)
    own = [float(printed.run.segment_mm3[_own(printed.run)].sum()) for printed in (single, program)]
    assert own[1] == pytest.approx(3.0 * own[0], rel=1e-3)
    assert program.run.program.layers == single.run.program.layers == 3


def _own(run) -> np.ndarray:  # type: ignore[no-untyped-def]
    return np.array([name not in ("Custom", "Skirt/Brim") for name in run.segment_type])


def test_marks_go_along_with_every_copy() -> None:
    part = whole(tee().transform(np.eye(3), (3.0, 1.0, 0.0)))
    for zone in (Zone((4.0, -9.0, 29.0), (9.0, 9.0, 31.0)), Grown((12.0, 0.0, 30.0), 1.0)):
        marked = Marked.of(part.mesh, (zone,))
        (many,) = in_copies(decomposed(replace(part, no_support=marked, no_seam=marked)), 3, plate())[0].parts
        alone = marked.touched(part.mesh)
        assert 0 < alone.sum() < len(alone)
        for copies in (many.no_support, many.no_seam):
            assert copies.touched(many.mesh).tolist() == 3 * alone.tolist()


def test_slender_copies_have_the_brim_that_one_alone_would_have() -> None:
    tower = standing(m3.Manifold.cube((3, 3, 60)))
    assert in_copies(decomposed(whole(tower)), 4, plate())[1].process.brim_mm == 5.0
    assert in_copies(decomposed(whole(box())), 4, plate())[1].process.brim_mm == 0.0


@pytest.mark.parametrize(
    ("parts", "count", "sentence"),
    [
        ([whole(box())], 100, "measures 20.0 x 20.0 mm, the plate of generic A/C table has room for 37 with 5 mm between them"),
        (cut(box(), ((0.0, 0.0, 1.0), 8.0)), 2, "box is cut into 2 parts, copies are printed in one piece each: --parts 1"),
    ],
)
def test_copies_that_cannot_be_are_refused(parts: list[Part], count: int, sentence: str) -> None:
    with pytest.raises(PlanError) as refused:
        in_copies(decomposed(*parts), count, plate())
    assert sentence in str(refused.value)


def test_a_repeated_mesh_is_closed_and_as_large_as_all_copies() -> None:
    mesh: Mesh = in_copies(decomposed(whole(box())), 4, plate())[0].mesh
    assert mesh.volume_mm3 == pytest.approx(4 * 8000.0)
    assert len(mesh.faces) == 48
