"""Marks: volumes that are not printed, their settings and the paint of a slicer file, and their positions."""

import zipfile
from itertools import product
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Floats, Mesh
from mdp.read import read_model
from mdp.zone import MeshVolume, Zone
from tests.mdp.slicer_files import (
    AT_ORIGIN,
    BLOCK,
    BOX,
    CONFIG,
    CYLINDER,
    DIALECTS,
    Made,
    Object,
    Placed,
    bambu,
    change,
    check,
    paint,
    prusaslicer,
    written,
)
from tests.shapes import from_manifold


def moved(solid: m3.Manifold, linear: Floats) -> Mesh:
    """A solid of the file at its position after reading, moved as the block of that file."""
    block = from_manifold(BLOCK)
    places = block.vertices @ linear.T
    low, high = places.min(axis=0), places.max(axis=0)
    return from_manifold(solid).transform(linear, -np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]))


@pytest.mark.parametrize("dialect", DIALECTS)
def test_volumes_that_are_not_printed_become_marks_at_their_place(tmp_path: Path, dialect: str) -> None:
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


@pytest.mark.parametrize("turn_deg", [(0.0, 0.0, 0.0), (20.0, 30.0, 40.0)])
@pytest.mark.parametrize("corner_mm", [(4.9, 3.9, 4.9), (5.0, 4.0, 0.0), (2.0, 4.0, 5.0)])
def test_a_modifier_of_eight_corners_that_is_not_a_box_keeps_its_shape(
    tmp_path: Path, corner_mm: tuple[float, float, float], turn_deg: tuple[float, float, float]
) -> None:
    corners = [*product((-5.0, 5.0), (-4.0, 4.0), (-5.0, 5.0))]
    solid = m3.Manifold.hull_points([*corners[:-1], corner_mm]).rotate(turn_deg)  # three edges of the first corner stay square
    model = read_model(
        prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(solid, "modifier", {"perimeters": "4"})], [AT_ORIGIN])])
    )
    (modifier,) = model.zones.modifiers
    assert solid.num_vert() == 8
    assert isinstance(modifier.volume, MeshVolume)
    assert modifier.volume.mesh.volume_mm3 == pytest.approx(solid.volume())
    assert modifier.volume.mesh.volume_mm3 < 799.0  # less than the volume of 10 x 8 x 10 mm


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


def test_a_modifier_applies_only_to_its_own_object(tmp_path: Path) -> None:
    beside = Placed(np.vstack([np.eye(3), [40.0, 0.0, 10.0]]))
    wide = m3.Manifold.cube((100.0, 5.0, 5.0), True)
    objects = [Object([Made(BLOCK), Made(wide, "modifier", {"perimeters": "4"})], [AT_ORIGIN]), Object([Made(BLOCK)], [beside])]
    (modifier,) = read_model(prusaslicer(tmp_path / "a.3mf", objects)).zones.modifiers
    assert (modifier.volume.min_mm[0], modifier.volume.max_mm[0]) == (-35.0, -5.0)  # no farther than its own object


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
def test_triangles_painted_on_more_than_half_are_marked_in_any_placement(
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


def test_a_note_about_many_volumes_is_given_once(tmp_path: Path) -> None:
    volumes = [Made(BLOCK), *(Made(BOX.translate((0.0, 0.0, 4.0 * k)), "negative") for k in range(3))]
    blockers = [Made(BOX, "no_support")] * 3
    objects = [Object([*volumes, *blockers], [AT_ORIGIN], {"wall_generator": "arachne"})]
    assert read_model(bambu(tmp_path / "a.3mf", objects, np.random.default_rng(1))).notes == (
        "subtracted 3 negative volumes",
        "object 'b' changes nothing here; not taken: wall_generator = arachne",
        "support blocker 'no_support' and 2 more are taken as [[no_support]]",
    )
