"""Slicer files: their volumes, the plates of their objects, omissions and refusals."""

from pathlib import Path

import numpy as np
import pytest

from mdp.formats.readers import READERS
from mdp.formats.slicer_file import painted_shares
from mdp.mesh import Floats
from mdp.read import read_model
from mdp.zone import Zone
from profiles.errors import MeshError
from profiles.messages import phrase
from tests.mdp import files
from tests.mdp.slicer_files import (
    AT_ORIGIN,
    BLOCK,
    BOX,
    CONFIG,
    CYLINDER,
    Made,
    Object,
    Placed,
    bambu,
    change,
    check,
    prusaslicer,
)
from tests.shapes import from_manifold


def test_a_height_range_of_an_object_that_does_not_exist_is_left_out_with_a_note(tmp_path: Path) -> None:
    option = '<option opt_key="perimeters">6</option>'
    ranges = f'<objects><object id="77"><range min_z="1" max_z="2">{option}</range></object></objects>'
    further = {"Metadata/Prusa_Slicer_layer_config_ranges.xml": ranges}
    model = read_model(prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK)], [AT_ORIGIN])], further))
    assert model.notes == ("the height ranges of object 77 are left out: there is no such object",)


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


def test_parts_of_a_slicer_file_are_distinguished_from_negative_volumes(tmp_path: Path) -> None:
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK), Made(BOX, "negative")], [AT_ORIGIN])])
    (built,) = READERS[".3mf"](path, None).objects
    assert [role.kind for _, role in built.volumes] == ["part", "negative volume"]


def test_a_slicer_file_says_which_plate_is_taken_and_refuses_one_that_is_not_there(tmp_path: Path) -> None:
    at = [Placed(np.vstack([np.eye(3), [100.0 * plate, 0.0, 20.0]]), plate, plate != 1) for plate in (1, 2, 3)]
    objects = [Object([Made(BLOCK)], at[:2]), Object([Made(BOX)], at[2:])]
    path = bambu(tmp_path / "a.3mf", objects, np.random.default_rng(0))
    assert read_model(path).notes == (
        f"prints plate 2; {phrase('another plate', '--plate prints another')}: 3",
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


@pytest.mark.parametrize("kind", ["support", "solidsupport", "other"])
def test_objects_that_are_no_models_are_left_out(tmp_path: Path, kind: str) -> None:
    objects = {1: files.threemf_mesh(from_manifold(BLOCK)), 2: files.threemf_mesh(from_manifold(CYLINDER))}
    path = files.threemf(tmp_path / "a.3mf", objects, '<item objectid="1"/><item objectid="2"/>')
    change(path, "3D/a.model", 'id="2" type="model"', f'id="2" name="pole" type="{kind}"')
    model = read_model(path)
    check(model.mesh, BLOCK)
    assert model.notes == (f"leaves out object pole, an object of type {kind}, which is not printed",)


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


def test_colours_painted_on_triangles_are_reported(tmp_path: Path) -> None:
    path = prusaslicer(tmp_path / "a.3mf", [Object([Made(BLOCK)], [AT_ORIGIN])])
    change(path, "3D/3dmodel.model", "<triangle ", '<triangle slic3rpe:mmu_segmentation="4" paint_seam="8" ')
    model = read_model(path)
    check(model.mesh, BLOCK)
    assert model.notes == (
        "12 triangles painted for filaments are not taken",
        "paint against seams on 12 of its triangles is taken as [[no_seam]]",
    )


def test_a_file_with_only_g_code_is_refused_with_that_reason(tmp_path: Path) -> None:
    path = bambu(tmp_path / "a.3mf", [], np.random.default_rng(0), {"Metadata/plate_1.gcode": "G1 X1\n"})
    with pytest.raises(
        MeshError, match="its build places no mesh, it keeps nothing but G-code of a sliced plate: save the project"
    ):
        read_model(path)


def area(corners: Floats) -> float:
    (a, b), (c, d) = corners[1] - corners[0], corners[2] - corners[0]
    return 0.5 * abs(a * d - b * c)


def drawn(rng: np.random.Generator, corners: Floats, depth: int, areas: dict[int, float]) -> str:
    """The digits of a randomly split triangle, in reading order; areas: the area of each paint, which is added to."""
    sides = int(rng.integers(4)) if depth else 0
    if not sides:
        paint = int(rng.integers(7))
        areas[paint] = areas.get(paint, 0.0) + area(corners)
        return f"{paint * 4:X}" if paint < 3 else f"C{paint - 3:X}"
    side = int(rng.integers(3)) if sides < 3 else 0
    a, b, c = np.roll(corners, -side, axis=0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    children = {
        1: [(a, b, bc), (bc, c, a)],
        2: [(a, ab, ca), (ab, b, ca), (b, c, ca)],
        3: [(a, ab, ca), (ab, b, bc), (bc, c, ca), (ab, bc, ca)],
    }[sides]
    return f"{4 * side + sides:X}" + "".join(drawn(rng, np.array(child), depth - 1, areas) for child in reversed(children))


@pytest.mark.parametrize("seed", range(20))
def test_shares_are_those_of_the_triangles_that_a_brush_has_made(seed: int) -> None:
    rng, areas = np.random.default_rng(seed), dict[int, float]()
    corners = rng.normal(size=(3, 2))
    shares = painted_shares(drawn(rng, corners, 4, areas)[::-1])
    assert shares == pytest.approx({paint: own / area(corners) for paint, own in areas.items()})
    assert sum(shares.values()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("digits", "shares"),
    [
        ("4", {1: 1.0}),
        ("8", {2: 1.0}),
        ("2C", {5: 1.0}),  # 3 more than the previous digit
        ("041", {1: 0.5, 0: 0.5}),  # one side halved: the second half is painted
        ("0842", {1: 0.5, 2: 0.25, 0: 0.25}),  # two sides halved: the last of the three is half of it
        ("44", "1 digit left over"),
        ("41", "digits are missing"),
        ("C", "digits are missing"),
        ("4G", "invalid literal"),
    ],
)
def test_digits_are_read_from_the_last(digits: str, shares: dict[int, float] | str) -> None:
    if isinstance(shares, str):
        with pytest.raises(ValueError, match=shares):
            painted_shares(digits)
    else:
        assert painted_shares(digits) == shares
