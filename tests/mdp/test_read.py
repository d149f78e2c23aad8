"""Reading model files: every format, its damages, units, scale and rotation, and what is said about them."""

import struct
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mdp.formats import READERS
from mdp.mesh import Mesh
from mdp.read import locate, read_mesh
from profiles.errors import MeshError
from tests.checks import assert_closed
from tests.mdp import files
from tests.shapes import ball, tee

FORMATS = tuple(READERS)
SIZES = st.floats(1.0, 500.0, width=32)


def save(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def refusal(path: Path, **arguments: float) -> str:
    """The sentence that reading the file ends in; it names the file."""
    with pytest.raises(MeshError) as caught:
        read_mesh(path, **arguments)
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}: ")
    assert not sentence.endswith(".")
    assert "\n" not in sentence
    return sentence.removeprefix(f"{path}: ")


def outcome(path: Path) -> Mesh | None:
    """The mesh of a file, or None when it is refused; anything else that is raised fails the test."""
    try:
        return read_mesh(path)[0]
    except MeshError:
        return None


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(suffix=st.sampled_from(FORMATS), x=SIZES, y=SIZES, z=SIZES)
def test_a_box_in_any_format_comes_back_with_its_volume_standing_on_the_platform(tmp_path, suffix, x, y, z):
    mesh, notes = read_mesh(files.written(tmp_path / f"box{suffix}", files.placed(x, y, z, (3.0, -4.0, 5.0))))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(x * y * z, rel=1e-4)
    assert mesh.bounds_mm == pytest.approx(np.array([[-x / 2, -y / 2, 0], [x / 2, y / 2, z]]), abs=1e-4)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_sound_mesh_keeps_its_faces_and_places(tmp_path, suffix):
    mesh, notes = read_mesh(files.written(tmp_path / f"tee{suffix}", tee()))
    assert notes == ()
    assert_closed(mesh)
    assert np.allclose(mesh.vertices[mesh.faces], tee().vertices[tee().faces], atol=1e-6)


@pytest.mark.parametrize("suffix", FORMATS)
def test_files_of_an_independent_writer_read_alike(tmp_path, suffix):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / f"ball{suffix}"
    trimesh.Trimesh(ball().vertices, ball().faces, process=False).export(path)
    mesh, notes = read_mesh(path)
    assert (notes, len(mesh.faces)) == ((), len(ball().faces))
    assert mesh.volume_mm3 == pytest.approx(ball().volume_mm3, rel=1e-4)


@pytest.mark.parametrize("order", ["binary_little_endian", "binary_big_endian"])
def test_binary_ply_reads_like_ascii(tmp_path, order):
    mesh, _ = read_mesh(save(tmp_path / "a.ply", files.ply(tee(), order)))
    plain, _ = read_mesh(save(tmp_path / "b.ply", files.ply(tee())))
    assert np.array_equal(mesh.vertices, plain.vertices)
    assert np.array_equal(mesh.faces, plain.faces)


def test_ascii_stl_ignores_normals_and_the_words_in_a_name(tmp_path):
    mesh, notes = read_mesh(save(tmp_path / "a.stl", files.ascii_stl(tee())))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(tee().volume_mm3)


def test_binary_stl_may_begin_with_solid(tmp_path):
    mesh, _ = read_mesh(save(tmp_path / "a.stl", files.stl(tee(), b"solid facet normal")))
    assert len(mesh.faces) == len(tee().faces)


def test_the_same_file_gives_the_same_bytes_twice(tmp_path):
    path = files.written(tmp_path / "two.stl", files.both(files.placed(10, 10, 10), files.placed(10, 10, 10, (5, 5, 5))))
    one, other = read_mesh(path)[0], read_mesh(path)[0]
    assert one.vertices.tobytes() + one.faces.tobytes() == other.vertices.tobytes() + other.faces.tobytes()


def test_scale_comes_before_rotation_and_rotation_about_x_before_z(tmp_path):
    path = files.written(tmp_path / "box.off", files.placed(1, 2, 3))
    assert read_mesh(path, 10.0)[0].bounds_mm[1] == pytest.approx([5, 10, 30])
    assert read_mesh(path, 10.0, (90, 0, 0))[0].bounds_mm[1] == pytest.approx([5, 15, 20])
    assert read_mesh(path, 10.0, (90, 0, 90))[0].bounds_mm[1] == pytest.approx([15, 5, 20])
    assert read_mesh(path, 10.0, (0, 0, 45))[0].volume_mm3 == pytest.approx(6000)


def test_a_quarter_turn_is_exact(tmp_path):
    mesh, _ = read_mesh(files.written(tmp_path / "box.off", files.placed(10, 20, 30)), 1.0, (0, 90, 0))
    assert sorted(set(mesh.vertices[:, 2].tolist())) == [0.0, 10.0]


@pytest.mark.parametrize(("unit", "factor"), [("inch", 25.4), ("meter", 1000.0), ("centimeter", 10.0), ("foot", 304.8)])
def test_3mf_brings_its_own_unit(tmp_path, unit, factor):
    box = files.threemf_mesh(files.placed(0.5, 1, 2))
    mesh, _ = read_mesh(files.threemf(tmp_path / "a.3mf", {1: box}, '<item objectid="1"/>', unit))
    assert np.ptp(mesh.bounds_mm, axis=0) == pytest.approx(np.array([0.5, 1, 2]) * factor)


def test_3mf_places_objects_and_components_with_their_transforms(tmp_path):
    box = files.threemf_mesh(files.placed(10, 10, 10))
    pair = '<components><component objectid="1"/><component objectid="1" transform="1 0 0 0 1 0 0 0 2 20 0 0"/></components>'
    items = '<item objectid="2"/><item objectid="1" transform="-1 0 0 0 1 0 0 0 1 60 0 0"/>'
    mesh, notes = read_mesh(files.threemf(tmp_path / "a.3mf", {1: box, 2: pair}, items))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(1000 + 2000 + 1000)
    assert np.ptp(mesh.bounds_mm, axis=0) == pytest.approx([60, 10, 20])


def test_glb_nodes_are_placed_and_coordinates_are_taken_as_mm_with_z_up(tmp_path):
    node = {"translation": [1, 2, 3], "rotation": [0, 0, 0.5**0.5, 0.5**0.5], "scale": [1, 2, 3]}
    mesh, _ = read_mesh(save(tmp_path / "a.glb", files.glb(files.placed(10, 10, 10), node)))
    assert np.ptp(mesh.bounds_mm, axis=0) == pytest.approx([20, 10, 30])


def test_polygons_become_triangles_also_where_they_are_not_convex(tmp_path):
    ell = [(0, 0), (30, 0), (30, 10), (10, 10), (10, 30), (0, 30)]
    rows = [f"v {x} {y} {z}" for z in (0, 10) for x, y in ell]
    sides = [f"f {k + 1}//1 {(k + 1) % 6 + 1}//1 {(k + 1) % 6 + 7}//1 {k + 7}//1" for k in range(6)]
    caps = ["f -9 -10 -11 -12 -7 -8", "f 10 11 12 7 8 9"]
    mesh, notes = read_mesh(save(tmp_path / "ell.obj", "\n".join([*rows, *sides, *caps]).encode()))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(5000)
    assert mesh.areas_mm2.sum() == pytest.approx(2 * 500 + 1200)


@pytest.mark.parametrize(
    ("size_mm", "hint"),
    [(0.3, "metres, give --set process.scale=1000"), (0.9, "inches, give --set process.scale=25.4"), (5e4, "0.001")],
)
def test_an_absurd_size_is_refused_with_the_scale_that_fits(tmp_path, size_mm, hint):
    sentence = refusal(files.written(tmp_path / "box.off", files.placed(size_mm, size_mm / 2, size_mm / 2)))
    assert f"largest extent is {size_mm:.4g} mm" in sentence
    assert hint in sentence


def test_a_scale_brings_a_model_in_metres_to_size(tmp_path):
    mesh, _ = read_mesh(files.written(tmp_path / "box.off", files.placed(0.3, 0.1, 0.1)), scale=1000.0)
    assert mesh.volume_mm3 == pytest.approx(3e6)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan")])
def test_a_scale_that_is_not_positive_is_refused(tmp_path, scale):
    assert "process.scale must be above 0" in refusal(files.written(tmp_path / "box.off", tee()), scale=scale)


def test_files_that_cannot_be_opened_are_named(tmp_path):
    assert "no such file" in refusal(tmp_path / "none.stl")
    (tmp_path / "folder.stl").mkdir()
    assert "is a folder" in refusal(tmp_path / "folder.stl")
    assert "is empty" in refusal(save(tmp_path / "empty.stl", b""))
    assert "allowed are .stl, .obj, .off, .ply, .3mf, .glb" in refusal(save(tmp_path / "a.step", b"x"))


def test_a_file_without_permission_is_named(tmp_path, monkeypatch):
    def denied(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    path = files.written(tmp_path / "a.stl", tee())
    monkeypatch.setattr(Path, "read_bytes", denied)
    assert "cannot be read: Permission denied" in refusal(path)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_cut_anywhere_ends_in_a_sentence_or_in_the_whole_solid(tmp_path, suffix):
    content = files.written(tmp_path / f"a{suffix}", tee()).read_bytes()
    for end in range(1, len(content) - 2, 61):
        mesh = outcome(save(tmp_path / f"cut{suffix}", content[:end]))
        assert mesh is None or mesh.volume_mm3 == pytest.approx(tee().volume_mm3, rel=1e-4)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(suffix=st.sampled_from(FORMATS), place=st.floats(0, 0.999), value=st.integers(0, 255))
def test_a_file_with_one_wrong_byte_never_ends_in_a_traceback(tmp_path, suffix, place, value):
    content = bytearray(files.written(tmp_path / f"a{suffix}", tee()).read_bytes())
    content[int(place * len(content))] = value
    mesh = outcome(save(tmp_path / f"wrong{suffix}", bytes(content)))
    if mesh is not None:
        assert_closed(mesh)


def test_a_truncated_stl_says_how_many_facets_it_holds(tmp_path):
    content = files.stl(tee())
    assert "holds 3 of the 28 facets" in refusal(save(tmp_path / "a.stl", content[: 84 + 3 * 50 + 20]))


def test_a_text_file_called_stl_is_refused(tmp_path):
    assert "is not an STL file" in refusal(save(tmp_path / "a.stl", b"This is a letter about something solid.\n" * 5))


def test_an_ascii_facet_without_three_vertices_is_named_with_its_line(tmp_path):
    lines = files.ascii_stl(tee()).splitlines()
    four = [*lines[:12], lines[11], *lines[12:]]
    assert refusal(save(tmp_path / "a.stl", b"\n".join(four))) == "facet 2 of 28 (line 9) has 4 vertices instead of 3"


def test_a_coordinate_that_is_no_number_is_refused(tmp_path):
    vertices = tee().vertices.copy()
    vertices[2, 1] = np.nan
    assert "vertex 3 of 16 has a coordinate that is not a finite number" in refusal(
        files.written(tmp_path / "a.off", Mesh(vertices, tee().faces))
    )
    assert "not a number" in refusal(save(tmp_path / "b.off", b"OFF\n1 0 0\n1 2 three\n"))


@pytest.mark.parametrize("suffix", [".off", ".obj", ".ply", ".3mf", ".glb"])
def test_an_index_out_of_range_is_refused(tmp_path, suffix):
    wrong = Mesh(tee().vertices, np.where(tee().faces == 5, 99, tee().faces))
    assert "vert" in refusal(files.written(tmp_path / f"a{suffix}", wrong))


def test_absurd_counts_are_refused_before_anything_is_allocated(tmp_path):
    assert "announces 900000000000 vertices" in refusal(save(tmp_path / "a.off", b"OFF\n900000000000 6 0\n0 0 0\n"))
    header = files.ply(tee(), "binary_little_endian").replace(b"vertex 16", b"vertex 99999999999999")
    assert "more than the file can hold" in refusal(save(tmp_path / "a.ply", header))
    content = files.glb(tee()).replace(b'"count": 16', b'"count": 99')
    assert "an accessor of 99 rows lies outside" in refusal(save(tmp_path / "a.glb", content))
    huge = bytearray(files.stl(tee()))
    huge[80:84] = struct.pack("<I", 2**32 - 1)
    assert "of the 4294967295 facets" in refusal(save(tmp_path / "a.stl", bytes(huge)))


def test_a_ply_without_a_list_of_corners_is_refused(tmp_path):
    content = files.ply(tee()).replace(b"property list uchar int vertex_indices", b"property int vertex_indices")
    assert "`face` with a list vertex_indices" in refusal(save(tmp_path / "a.ply", content))


def test_a_3mf_that_contains_itself_is_refused(tmp_path):
    ring = '<components><component objectid="1"/></components>'
    assert "contain each other" in refusal(files.threemf(tmp_path / "a.3mf", {1: ring}, '<item objectid="1"/>'))


def test_a_3mf_with_an_unknown_unit_or_object_is_refused(tmp_path):
    box = {1: files.threemf_mesh(tee())}
    assert "unit 'ell' is unknown; allowed are micron" in refusal(
        files.threemf(tmp_path / "a.3mf", box, '<item objectid="1"/>', "ell")
    )
    assert "object '7' cannot be placed" in refusal(files.threemf(tmp_path / "b.3mf", box, '<item objectid="7"/>'))
    assert "places no mesh" in refusal(files.threemf(tmp_path / "c.3mf", box, ""))


def test_locate_knows_paths_and_names_the_demos_there_are(tmp_path):
    assert locate("a/b.stl") == Path("a/b.stl")
    with pytest.raises(MeshError, match="no demo model 'none-such'; allowed are"):
        locate("demo:none-such")


def test_every_demo_reads_without_repair():
    folder = Path(__file__).parents[2] / "mdp" / "demos"
    for name in sorted(path.stem for path in folder.glob("*.ply")):
        mesh, notes = read_mesh(locate(f"demo:{name}"))
        assert notes == (), name
        assert mesh.bounds_mm[0, 2] == 0


def test_shared_models_read_as_they_are():
    if not files.SHARED.exists():
        pytest.skip("no shared models here")
    kitten, notes = read_mesh(files.SHARED / "models" / "kitten.off")
    assert (len(kitten.faces), notes) == (10_000, ())
    camel, notes = read_mesh(files.SHARED / "models" / "camelhead.glb")
    assert np.ptp(camel.bounds_mm, axis=0) == pytest.approx([41.89, 80.0, 41.90], abs=0.01)
    solid = m3.Manifold(m3.Mesh64(kitten.vertices.copy(), kitten.faces.astype(np.uint64)))
    assert solid.volume() == pytest.approx(198_875, rel=1e-4)
