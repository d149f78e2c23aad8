"""Slicer files: what is printed of them, on which plate, and what their other volumes become."""

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from mdp.formats.readers import READERS
from mdp.mesh import Floats, Mesh
from mdp.read import read_model
from mdp.zone import MeshVolume, Zone
from profiles.errors import MeshError
from tests.mdp import files
from tests.mdp.slicer_files import AT_ORIGIN, Made, Object, Placed, affine, bambu, printed, prusaslicer
from tests.shapes import from_manifold

BLOCK = m3.Manifold.cube((30.0, 30.0, 20.0), True)
BOX = m3.Manifold.cube((10.0, 8.0, 30.0), True)
CYLINDER = m3.Manifold.cylinder(40.0, 5.0, circular_segments=24, center=True)
DIALECTS = ("prusaslicer", "bambu")


def written(path: Path, dialect: str, objects: Sequence[Object], seed: int = 0, further: Mapping[str, str] | None = None) -> Path:
    if dialect == "bambu":
        return bambu(path, objects, np.random.default_rng(seed), further)
    return prusaslicer(path, objects, further)


def check(mesh: Mesh, expected: m3.Manifold) -> None:
    box = np.array(expected.bounding_box()).reshape(2, 3)
    assert mesh.volume_mm3 == pytest.approx(expected.volume(), rel=1e-6)
    np.testing.assert_allclose(np.ptp(mesh.bounds_mm, axis=0), np.ptp(box, axis=0), rtol=1e-6)


def drawn(rng: np.random.Generator, plates: int) -> list[Object]:
    """Objects with parts, negatives and marks that overlap at random, far apart from each other on their plates."""
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
def test_what_is_read_is_what_the_slicer_file_was_made_of(tmp_path: Path, dialect: str, seed: int) -> None:
    rng = np.random.default_rng([seed, len(dialect)])
    plates = int(rng.integers(1, 4)) if dialect == "bambu" else 1
    objects = drawn(rng, plates)
    path = written(tmp_path / "a.3mf", dialect, objects, seed)
    held = [plate for plate in range(1, plates + 1) if not printed(objects, plate).is_empty()]
    for plate in held:
        asked = None if plate == held[0] else plate
        check(read_model(path, plate=asked).mesh, printed(objects, plate))


def change(path: Path, part: str, old: str, new: str) -> None:
    """Write a part of a package otherwise."""
    with zipfile.ZipFile(path) as archive:
        texts = {name: archive.read(name).decode() for name in archive.namelist()}
    assert old in texts[part]
    texts[part] = texts[part].replace(old, new)
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in texts.items():
            archive.writestr(name, text)


def moved(solid: m3.Manifold, linear: Floats) -> Mesh:
    """A solid of the file where it lies after reading, by what brings the block of the same file there."""
    block = from_manifold(BLOCK)
    places = block.vertices @ linear.T
    low, high = places.min(axis=0), places.max(axis=0)
    return from_manifold(solid).transform(linear, -np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]))


@pytest.mark.parametrize("dialect", DIALECTS)
def test_volumes_that_are_not_printed_become_marks_where_they_lie_in_the_model(tmp_path: Path, dialect: str) -> None:
    leaning = BOX.rotate((20.0, 30.0, 40.0)).translate((4.0, 5.0, 6.0))
    volumes = [Made(BLOCK), Made(leaning, "support"), Made(CYLINDER, "no_support"), Made(BOX, "support")]
    model = read_model(written(tmp_path / "a.3mf", dialect, [Object(volumes, [AT_ORIGIN])]), 2.0, (90.0, 0.0, 0.0))
    linear = 2.0 * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    check(model.mesh, BLOCK.scale((2.0, 2.0, 2.0)).rotate((90.0, 0.0, 0.0)))
    slanted, straight = model.zones.support
    (round_one,) = model.zones.no_support
    assert isinstance(slanted, Zone)
    assert isinstance(straight, Zone)
    assert isinstance(round_one, MeshVolume)
    for zone, solid in ((slanted, leaning), (straight, BOX)):
        wanted = moved(solid, linear).vertices
        apart = np.linalg.norm(zone.corners[:, None] - wanted[None], axis=2)
        assert apart.min(axis=1).max() < 1e-9
        assert apart.min(axis=0).max() < 1e-9
    assert straight.axes is None
    wanted = moved(CYLINDER, linear)
    np.testing.assert_allclose(round_one.mesh.bounds_mm, wanted.bounds_mm, atol=1e-9)
    assert round_one.mesh.volume_mm3 == pytest.approx(8.0 * CYLINDER.volume())
    assert model.notes == (
        "support enforcer 'support' and 1 more are taken as [[support]]",
        "support blocker 'no_support' is taken as [[no_support]]",
    )


@pytest.mark.parametrize(
    ("dialect", "settings"),
    [
        ("prusaslicer", {"fill_density": "60%", "perimeters": "4", "layer_height": "0.1", "extruder": "0"}),
        ("bambu", {"sparse_infill_density": "60%", "wall_loops": "4", "layer_height": "0.1", "extruder": "1"}),
    ],
)
def test_a_modifier_brings_those_of_its_settings_that_may_change_within_a_layer(
    tmp_path: Path, dialect: str, settings: dict[str, str]
) -> None:
    model = read_model(
        written(tmp_path / "a.3mf", dialect, [Object([Made(BLOCK), Made(BOX, "modifier", settings)], [AT_ORIGIN])])
    )
    (modifier,) = model.zones.modifiers
    assert modifier.process == {"walls": 4, "infill_density": 0.6}
    assert isinstance(modifier.volume, Zone)
    np.testing.assert_allclose([modifier.volume.min_mm, modifier.volume.max_mm], [(-5, -4, -5), (5, 4, 25)], atol=1e-9)
    assert model.notes == (
        "modifier 'modifier' is taken as [[modifier]]: walls = 4, infill_density = 0.6; not taken: layer_height = 0.1",
    )


def test_settings_of_an_object_hold_in_a_box_around_it_and_those_of_a_part_in_the_part(tmp_path: Path) -> None:
    volumes = [Made(BLOCK), Made(CYLINDER.translate((0.0, 0.0, 20.0)), "part", {"fill_pattern": "gyroid"})]
    path = written(tmp_path / "a.3mf", "prusaslicer", [Object(volumes, [AT_ORIGIN], {"perimeters": "5", "brim_width": "3"})])
    of_object, of_part = read_model(path).zones.modifiers
    assert of_object.process == {"walls": 5}
    assert of_object.volume == Zone((-16.0, -16.0, -1.0), (16.0, 16.0, 51.0))
    assert (of_part.process, type(of_part.volume)) == ({"infill_pattern": "gyroid"}, MeshVolume)


@pytest.mark.parametrize(
    ("dialect", "part", "key"),
    [
        ("prusaslicer", "Metadata/Prusa_Slicer_layer_config_ranges.xml", "perimeters"),
        ("bambu", "Metadata/layer_config_ranges.xml", "wall_loops"),
    ],
)
def test_settings_between_two_heights_count_from_the_lowest_point_of_their_object(
    tmp_path: Path, dialect: str, part: str, key: str
) -> None:
    ranges = (
        f'<objects><object id="2"><range min_z="5" max_z="8"><option opt_key="{key}">6</option>'
        '<option opt_key="extruder">0</option></range></object></objects>'
    )
    low, high = (Placed(np.vstack([np.eye(3), [x, 0.0, z]])) for x, z in ((0.0, 10.0), (100.0, 17.0)))
    objects = [Object([Made(BLOCK)], [low]), Object([Made(BLOCK), Made(BOX)], [high])]
    (modifier,) = read_model(written(tmp_path / "a.3mf", dialect, objects, further={part: ranges})).zones.modifiers
    assert modifier.process == {"walls": 6}
    assert isinstance(modifier.volume, Zone)
    corners = [modifier.volume.min_mm, modifier.volume.max_mm]
    np.testing.assert_allclose(corners, [(34.0, -16.0, 7.0), (66.0, 16.0, 10.0)], atol=1e-9)


@pytest.mark.parametrize("rotate_deg", [(0.0, 0.0, 0.0), (30.0, 20.0, 10.0)])
@pytest.mark.parametrize(
    ("between", "span_mm"),
    [
        (("0", "1e200"), (0.0, 21.0)),
        (("-1e200", "5"), (0.0, 5.0)),
        (("0", "1e-10"), None),
        (("8", "5"), None),
        (("-5", "0"), None),
        (("20", "1e200"), None),
        (("0", "1e-300"), None),
    ],
)
def test_a_height_range_ends_just_above_its_object_and_one_that_holds_nothing_is_left_out(
    tmp_path: Path, between: tuple[str, str], span_mm: tuple[float, float] | None, rotate_deg: tuple[float, float, float]
) -> None:
    option = '<option opt_key="perimeters">6</option>'
    ranges = f'<objects><object id="1"><range min_z="{between[0]}" max_z="{between[1]}">{option}</range></object></objects>'
    further = {"Metadata/Prusa_Slicer_layer_config_ranges.xml": ranges}
    model = read_model(prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK)], [AT_ORIGIN])], further), rotate_deg=rotate_deg)
    if span_mm is None:
        assert model.zones.modifiers == ()
        assert "is left out: it holds nothing of its object, which is 20 mm tall" in model.notes[0]
        return
    (modifier,) = model.zones.modifiers
    assert isinstance(modifier.volume, Zone)
    sizes = np.sort(np.subtract(modifier.volume.max_mm, modifier.volume.min_mm))
    np.testing.assert_allclose(sizes, np.sort([32.0, 32.0, span_mm[1] - span_mm[0]]), atol=1e-9)


def test_a_height_range_of_an_object_that_does_not_exist_is_left_out_with_a_note(tmp_path: Path) -> None:
    option = '<option opt_key="perimeters">6</option>'
    ranges = f'<objects><object id="77"><range min_z="1" max_z="2">{option}</range></object></objects>'
    further = {"Metadata/Prusa_Slicer_layer_config_ranges.xml": ranges}
    model = read_model(prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK)], [AT_ORIGIN])], further))
    assert model.notes == ("the height ranges of object 77 are left out: there is no such object",)


def test_a_modifier_holds_for_its_own_object_alone(tmp_path: Path) -> None:
    beside = Placed(np.vstack([np.eye(3), [40.0, 0.0, 10.0]]))
    wide = m3.Manifold.cube((100.0, 5.0, 5.0), True)
    objects = [Object([Made(BLOCK), Made(wide, "modifier", {"perimeters": "4"})], [AT_ORIGIN]), Object([Made(BLOCK)], [beside])]
    (modifier,) = read_model(prusaslicer(tmp_path / "a.3mf", objects)).zones.modifiers
    assert (modifier.volume.min_mm[0], modifier.volume.max_mm[0]) == (-35.0, -5.0)  # no farther than its own object


def test_older_slicer_files_name_a_modifier_by_a_key(tmp_path: Path) -> None:
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(BOX, "modifier", {"perimeters": "4"})], [AT_ORIGIN])])
    change(path, "Metadata/Slic3r_PE_model.config", 'key="volume_type" value="ParameterModifier"', 'key="modifier" value="1"')
    model = read_model(path)
    check(model.mesh, BLOCK)
    assert model.zones.modifiers[0].process == {"walls": 4}


@pytest.mark.parametrize(
    ("mesh", "kind"),
    [
        ("infill_mesh", "modifiers"),
        ("cutting_mesh", "modifiers"),
        ("support_mesh", "support"),
        ("anti_overhang_mesh", "no_support"),
    ],
)
def test_cura_says_in_an_object_s_metadata_what_it_is(tmp_path: Path, mesh: str, kind: str) -> None:
    entries = {mesh: "True", "infill_sparse_density": "45", "drop_to_buildplate": "False"}
    metadata = "".join(
        f'<metadata name="cura:{key}" preserve="true" type="xs:string">{text}</metadata>' for key, text in entries.items()
    )
    group = f"<metadatagroup>{metadata}</metadatagroup>"
    objects = {1: files.threemf_mesh(from_manifold(BLOCK)), 2: group + files.threemf_mesh(from_manifold(BOX))}
    model = read_model(files.threemf(tmp_path / "a.3mf", objects, '<item objectid="1"/><item objectid="2"/>'))
    check(model.mesh, BLOCK)
    (zone,) = getattr(model.zones, kind)
    assert (zone.volume if kind == "modifiers" else zone) == Zone((-5.0, -4.0, -5.0), (5.0, 4.0, 25.0))
    assert kind != "modifiers" or zone.process == {"infill_density": 0.45}


def test_a_negative_volume_inside_leaves_a_void(tmp_path: Path) -> None:
    ball = m3.Manifold.sphere(5.0, 24)
    mesh = read_model(prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(ball, "negative")], [AT_ORIGIN])])).mesh
    check(mesh, BLOCK - ball)
    assert mesh.volume_mm3 < BLOCK.volume() - 480.0


def test_the_family_of_readers_tells_parts_of_a_slicer_file_from_negative_volumes(tmp_path: Path) -> None:
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(BOX, "negative")], [AT_ORIGIN])])
    (built,) = READERS[".3mf"](path, None).objects
    assert [role.kind for _, role in built.volumes] == ["part", "negative volume"]


def test_a_negative_volume_takes_nothing_out_of_another_object(tmp_path: Path) -> None:
    long = m3.Manifold.cube((200.0, 5.0, 5.0), True)
    beside = Placed(np.vstack([np.eye(3), [40.0, 0.0, 10.0]]))
    objects = [Object([Made(BLOCK), Made(long, "negative")], [AT_ORIGIN]), Object([Made(BLOCK)], [beside])]
    assert read_model(prusaslicer(tmp_path / "a.3mf", objects)).mesh.volume_mm3 == pytest.approx(36000.0 - 30.0 * 25.0)


def test_a_slicer_file_says_which_plate_is_taken_and_refuses_one_that_is_not_there(tmp_path: Path) -> None:
    at = [Placed(np.vstack([np.eye(3), [100.0 * plate, 0.0, 20.0]]), plate, plate != 1) for plate in (1, 2, 3)]
    objects = [Object([Made(BLOCK)], at[:2]), Object([Made(BOX)], at[2:])]
    path = bambu(tmp_path / "a.3mf", objects, np.random.default_rng(0))
    assert read_model(path).notes == (
        "prints plate 2; --plate prints another: 3",
        "leaves out object b, which is switched off in its slicer",
    )
    with pytest.raises(MeshError, match="--plate 1: that plate is empty; plates with objects: 2, 3"):
        read_model(path, plate=1)
    with pytest.raises(MeshError, match="--plate 4: that plate does not exist; plates with objects: 2, 3"):
        read_model(path, plate=4)
    check(read_model(path, plate=3).mesh, BOX)
    change(path, "Metadata/model_settings.config", '"instance_id" value="1"', '"instance_id" value="7"')
    assert read_model(path).notes == (
        "leaves out object b, which is switched off in its slicer",
        "leaves out object b, which stands on none of its plates",
    )
    for other in (prusaslicer(tmp_path / "b.3mf", objects), files.written(tmp_path / "b.stl", from_manifold(BLOCK))):
        with pytest.raises(MeshError, match="has no plates: --plate 1 goes with a file of Bambu Studio or OrcaSlicer"):
            read_model(other, plate=1)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_what_lies_below_the_plate_of_a_slicer_file_is_not_printed(tmp_path: Path, dialect: str) -> None:
    sunk = Placed(np.vstack([np.eye(3), [0.0, 0.0, 6.0]]))
    model = read_model(written(tmp_path / "a.3mf", dialect, [Object([Made(BLOCK), Made(BOX, "support")], [sunk])]))
    check(model.mesh, BLOCK.trim_by_plane((0.0, 0.0, 1.0), -6.0))
    np.testing.assert_allclose(model.zones.support[0].corners[:, 2].min(), -15.0 + 6.0, atol=1e-9)
    assert model.notes[0] == "leaves out what lies below the plate, 4 mm deep"


@pytest.mark.parametrize("kind", ["support", "solidsupport", "other"])
def test_objects_that_are_no_models_are_left_out(tmp_path: Path, kind: str) -> None:
    objects = {1: files.threemf_mesh(from_manifold(BLOCK)), 2: files.threemf_mesh(from_manifold(CYLINDER))}
    path = files.threemf(tmp_path / "a.3mf", objects, '<item objectid="1"/><item objectid="2"/>')
    change(path, "3D/a.model", 'id="2" type="model"', f'id="2" name="pole" type="{kind}"')
    model = read_model(path)
    check(model.mesh, BLOCK)
    assert model.notes == (f"leaves out object pole, an object of type {kind}, which is not printed",)


def test_a_slicer_file_that_prints_nothing_is_refused(tmp_path: Path) -> None:
    hidden = Placed(AT_ORIGIN.transform, printable=False)
    assert files.refusal(prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK)], [hidden])])) == (
        "its build places no mesh that is printed: it leaves out object b, which is switched off in its slicer"
    )
    nothing = Object([Made(BOX), Made(BLOCK.scale((2.0, 2.0, 4.0)), "negative")], [AT_ORIGIN])
    assert files.refusal(prusaslicer(tmp_path / "b.3mf", [nothing])) == (
        "nothing is left of it: negative volumes or the plate cut all of it away"
    )


CONFIG = "Metadata/Slic3r_PE_model.config"


@pytest.mark.parametrize(
    ("part", "old", "new", "words"),
    [
        (CONFIG, 'lastid="23"', 'lastid="24"', "volume 'negative' has triangles 12 to 24 of object 1, which has 24"),
        (CONFIG, 'firstid="12"', 'firstid="-1"', "volume 'negative' has triangles -1 to 23 of object 1"),
        (
            CONFIG,
            'lastid="23"',
            'lastid="many"',
            "its part Metadata/Slic3r_PE_model.config is malformed: lastid is 'many': a whole",
        ),
        (CONFIG, "</config>", "", "its part metadata/slic3r_pe_model.config is missing or malformed"),
        (CONFIG, 'firstid="12"', 'firstid="13"', "is not closed"),
        ("3D/3dmodel.model", '<triangle v1="1"', '<triangle v1="99"', "face 1 of 24 names vertex [99"),
        ("3D/3dmodel.model", "<mesh>", '<mesh><beamlattice xmlns="b"/>', "its mesh is a lattice of beams, which is not read"),
        ("3D/3dmodel.model", "mesh>", "booleanshape>", "object '1' is a booleanshape, which is not read"),
        ("_rels/.rels", "3dmodel.model", "other.model", "its part 3D/other.model is missing or malformed"),
    ],
)
def test_a_damaged_slicer_file_is_refused_with_a_sentence(tmp_path: Path, part: str, old: str, new: str, words: str) -> None:
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(BOX, "negative")], [AT_ORIGIN])])
    change(path, part, old, new)
    assert words in files.refusal(path)


@pytest.mark.parametrize("text", ["", "[", "[" * 100_000, "[1]"])
def test_damaged_settings_leave_a_sound_mesh_readable_with_a_note(tmp_path: Path, text: str) -> None:
    objects = [Object([Made(BLOCK), Made(BOX, "modifier", {"wall_loops": "4"})], [AT_ORIGIN], {"wall_loops": "3"})]
    model = read_model(written(tmp_path / "a.3mf", "bambu", objects, further={"Metadata/project_settings.config": text}))
    check(model.mesh, BLOCK)
    assert model.zones.modifiers == ()
    (note,) = model.notes
    assert note.startswith("the settings inside it are damaged (")
    assert note.endswith("): those of its objects, modifiers and height ranges are left out")


@pytest.mark.filterwarnings("error")
def test_a_mark_farther_than_any_number_is_left_out_without_warnings(tmp_path: Path) -> None:
    far = from_manifold(BOX).vertices[0, 0]
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(BOX, "support")], [AT_ORIGIN])])
    change(path, "3D/3dmodel.model", f'x="{float(far)!r}"', 'x="1e200"')
    model = read_model(path)
    assert model.zones.support == ()
    assert "it is left out" in model.notes[0]


def test_a_mark_that_is_no_solid_is_left_out_with_a_note(tmp_path: Path) -> None:
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(BOX, "support")], [AT_ORIGIN])])
    change(path, "3D/3dmodel.model", "</triangles>", '<triangle v1="0" v2="1" v3="2"/></triangles>')
    change(path, CONFIG, 'firstid="12" lastid="23"', 'firstid="24" lastid="24"')
    change(path, CONFIG, "</volume></object>", '</volume><volume firstid="12" lastid="23"/></object>')
    model = read_model(path)
    assert model.zones.support == ()
    assert any("it is left out" in note for note in model.notes)


@pytest.mark.parametrize(
    ("dialect", "supports", "seams"),
    [("prusaslicer", "slic3rpe:custom_supports", "slic3rpe:custom_seam"), ("bambu", "paint_supports", "paint_seam")],
)
def test_triangles_that_are_painted_on_more_than_half_are_marked_wherever_the_model_lies(
    tmp_path: Path, dialect: str, supports: str, seams: str
) -> None:
    path = written(tmp_path / "a.3mf", dialect, [Object([Made(BLOCK)], [AT_ORIGIN])])
    part = "3D/3dmodel.model" if dialect == "prusaslicer" else "3D/Objects/object_1.model"
    with zipfile.ZipFile(path) as archive:
        pieces = archive.read(part).decode().split("<triangle ")
    painted = {
        0: f'{supports}="4"',
        1: f'{supports}="8"',
        2: f'{seams}="8"',
        3: f'{seams}="4"',
        4: f'{supports}="0442"',
        5: f'{supports}="041"',
    }
    text = "<triangle ".join(pieces[:1] + [f"{painted.get(k, '')} {piece}" for k, piece in enumerate(pieces[1:])])
    change(path, part, "<triangle ".join(pieces), text)
    model = read_model(path, 1.7, (30.0, 20.0, 10.0))
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turned, zones = model.mesh.transform(turn, (1.0, 2.0, 3.0)), model.zones.transform(turn, np.array([1.0, 2.0, 3.0]))
    for mesh, marks in ((model.mesh, model.zones), (turned, zones)):
        faces = [zone.faces(mesh).nonzero()[0].tolist() for (zone,) in (marks.support, marks.no_support, marks.no_seam)]
        assert faces == [[0, 4], [1], [2]]
    unpainted = "is not taken: only paints for and against support and against seams are, on more than half of a triangle"
    assert sorted(model.notes) == [
        "1 triangle is painted in part, more than half of the area, and taken as a whole",
        f"1 triangle painted for seams {unpainted}",
        f"1 triangle painted for support {unpainted}",
        "paint against seams on 1 of its triangles is taken as [[no_seam]]",
        "paint against support on 1 of its triangles is taken as [[no_support]]",
        "paint for support on 2 of its triangles is taken as [[support]]",
    ]


def paint(path: Path, rows: Sequence[int], attributes: str) -> None:
    """Give some triangles of the model part attributes."""
    part = "3D/3dmodel.model"
    with zipfile.ZipFile(path) as archive:
        text = archive.read(part).decode()
    pieces = text.split("<triangle ")
    change(
        path, part, text, "<triangle ".join(f"{attributes} {piece}" if k - 1 in rows else piece for k, piece in enumerate(pieces))
    )


@pytest.mark.parametrize("rotate_deg", [(0.0, 0.0, 0.0), (30.0, 20.0, 10.0)])
@pytest.mark.parametrize("second", ["part", "negative"])
def test_paint_follows_what_is_left_of_a_face_and_a_note_counts_what_is_lost(
    tmp_path: Path, second: str, rotate_deg: tuple[float, float, float]
) -> None:
    pole, seed = (
        m3.Manifold.cube((10.0, 8.0, 40.0), True).translate((3.1, 2.3, 0.0)),
        BOX.scale((0.1, 0.1, 0.1)).translate((-9, 0, 0)),
    )
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(seed), Made(pole, second)], [AT_ORIGIN])])
    top = np.flatnonzero(from_manifold(BLOCK).normals[:, 2] > 0.9)
    paint(path, [*top, *range(12, 24)], 'slic3rpe:custom_supports="4"')
    model = read_model(path, rotate_deg=rotate_deg)
    (zone,) = model.zones.support
    assert not isinstance(zone, Zone)
    assert model.mesh.areas_mm2[zone.faces(model.mesh)].sum() == pytest.approx(30.0 * 30.0 - 10.0 * 8.0)
    lost = "12 others are not on the surface of what is printed"
    assert f"paint for support on 2 of its triangles is taken as [[support]]; {lost}" in model.notes


def test_paint_on_nothing_that_is_printed_is_left_out_with_a_note(tmp_path: Path) -> None:
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(BOX.scale((0.1, 0.1, 0.1)))], [AT_ORIGIN])])
    paint(path, [12], 'paint_seam="8"')
    model = read_model(path)
    assert model.zones.no_seam == ()
    assert "paint against seams is left out: its 1 triangle is not on the surface of what is printed" in model.notes


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


def test_colours_painted_on_triangles_are_told(tmp_path: Path) -> None:
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK)], [AT_ORIGIN])])
    change(path, "3D/3dmodel.model", "<triangle ", '<triangle slic3rpe:mmu_segmentation="4" paint_seam="8" ')
    model = read_model(path)
    check(model.mesh, BLOCK)
    assert model.notes == (
        "12 triangles painted for filaments are not taken",
        "paint against seams on 12 of its triangles is taken as [[no_seam]]",
    )


def test_what_is_said_of_many_volumes_is_said_once(tmp_path: Path) -> None:
    volumes = [Made(BLOCK), *(Made(BOX.translate((0.0, 0.0, 4.0 * k)), "negative") for k in range(3))]
    blockers = [Made(BOX, "no_support")] * 3
    objects = [Object([*volumes, *blockers], [AT_ORIGIN], {"wall_generator": "arachne"})]
    assert read_model(bambu(tmp_path / "a.3mf", objects, np.random.default_rng(1))).notes == (
        "subtracted 3 negative volumes",
        "object 'b' changes nothing here; not taken: wall_generator = arachne",
        "support blocker 'no_support' and 2 more are taken as [[no_support]]",
    )


def test_a_file_that_keeps_nothing_but_g_code_says_so(tmp_path: Path) -> None:
    path = bambu(tmp_path / "a.3mf", [], np.random.default_rng(0), {"Metadata/plate_1.gcode": "G1 X1\n"})
    with pytest.raises(
        MeshError, match="its build places no mesh, it keeps nothing but G-code of a sliced plate: save the project"
    ):
        read_model(path)
