"""Broken files from practice: each gives a valid solid of a known size, or a message that names the defect."""

import csv

import manifold3d as m3
import numpy as np
import pytest

from mdp.read import read_mesh
from profiles.errors import MeshError
from tests.checks import assert_closed
from tests.mdp.files import SHARED

SOLID = {  # file: (scale, volume in mm3, words of a note or "")
    "bunny_holes.ply": (1000.0, 752_663, "filled 5 small holes"),
    "castle_wall_doubled.stl": (1.0, 9_645.6, "left out 10008 duplicate faces"),
    "chair_model.obj": (100.0, 6_463.9, "duplicate faces"),
    "durga_chest.stl": (1.0, 21_928, "turned 36 faces over"),
    "f18_jet.stl": (1.0, 27_693.8, "left out 99 shells"),
    "lutyens_garden_set.stl": (1.0, 22_868.9, "united 211 bodies"),
    "npm_notANumberNormal.ascii.stl": (1.0, 1 / 6, "its longest side is 1 mm"),
    "slicer_double_slit_experiment.stl": (1.0, 6_282.9, "filled 2 small holes"),
    "slicer_extra_surface.stl": (1.0, 10_239.5, "loose sheets"),
    "slicer_extra_vertices.obj": (1.0, 20**3, ""),
    "slicer_missing_triangle_hi.stl": (1.0, 2_555.1, "filled 1 small hole"),
    "slicer_self_overlapping_cubes.stl": (1.0, 2 * 20**3 - 10**3, "united 2 bodies"),
    "slicer_tetrahedra.stl": (1.0, 16_970.6, ""),
    "toothbrush_holder.stl": (1.0, 37_293.6, "loose sheets"),
    "unit_meters.3mf": (1.0, 10 * 20 * 30, ""),
    "z_lower_right.stl": (1.0, 72_517.6, "turned 2 faces over"),
}
REFUSED = {  # file: (scale, words of the message)
    "chair_model.obj": (1.0, "largest extent is 0.6638 mm"),
    "ferrari_458_part.stl": (1.0, "not orientable"),
    "filament_guide_dup_faces.stl": (1.0, "open edges"),
    "invalid.off": (1.0, "the face in line 6 is malformed"),
    "malformed2.obj": (1.0, "the face in line 23 has 0 corners"),
    "malformed_index_oob.3mf": (1.0, "3 open edges"),
    "npm_fourVertices.ascii.stl": (1.0, "facet 1 of 4 (line 2) has 4 vertices"),
    "npm_missingFace.ascii.stl": (1.0, "3 open edges"),
    "off_out_of_memory.off": (1.0, "announces 353535235358 vertices"),
    "open_vase_surface.stl": (1.0, "188 open edges around 2 holes"),
    "slicer_cube_and_plane.stl": (1.0, "facet 13 of 13 (line 86) has 4 vertices"),
    "slicer_empty_file.stl": (1.0, "is empty"),
    "slicer_invalid_stl_ascii.stl": (1.0, "not an STL file"),
    "slicer_zero_size_cube.stl": (1.0, "encloses no volume"),
    "synthetic_truncated_mid_facet.stl": (1.0, "holds 1000 of the 2802 facets"),
    "thorax_bones.stl": (1.0, "if its coordinates are metres, give --set process.scale=1000"),
    "triangle_soup.stl": (100.0, "300 open edges"),
}
BROKEN = SHARED / "broken"

needs_shared = pytest.mark.skipif(not BROKEN.exists(), reason="the collection of broken files is not here")


@needs_shared
def test_the_tables_name_every_broken_file() -> None:
    listed = {row["file"] for row in csv.DictReader((BROKEN / "broken.csv").open())}
    assert listed == SOLID.keys() | REFUSED.keys()


@needs_shared
@pytest.mark.parametrize("name", SOLID)
def test_a_broken_file_becomes_a_valid_solid(name: str) -> None:
    scale, volume_mm3, note = SOLID[name]
    mesh, notes = read_mesh(BROKEN / name, scale)
    assert_closed(mesh)
    assert m3.Manifold(m3.Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64))).status() == m3.Error.NoError
    assert mesh.volume_mm3 == pytest.approx(volume_mm3, rel=1e-3)
    assert note in "; ".join(notes)
    assert bool(note) == bool(notes)


@needs_shared
@pytest.mark.parametrize("name", REFUSED)
def test_a_broken_file_is_refused_with_a_sentence(name: str) -> None:
    scale, words = REFUSED[name]
    with pytest.raises(MeshError) as caught:
        read_mesh(BROKEN / name, scale)
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(BROKEN / name))
