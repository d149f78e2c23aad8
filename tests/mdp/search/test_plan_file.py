"""Plan files: a written plan reads back equal, and an invalid one is refused in one sentence."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.decomposition import FrontRow
from mdp.plane import Plane
from mdp.save import stl
from mdp.search.plan_file import PlanFile, PlannedPart, mesh_sha256
from mdp.search.plan_reading import read_plan
from mdp.search.plan_writing import plan_text
from mdp.search.search import SearchRequest, cut_by_plan
from mdp.zone import Grown, MeshVolume, Modifier, Painted, Zone, Zones
from profiles.errors import PlanError
from profiles.frozen import Vector
from profiles.part_settings import PartSettings
from profiles.profile import load
from tests import shapes

FIRST = "version = 1\n[[part]]\n"
NUMBERS = st.floats(-1e5, 1e5)


def unit(vector: Vector) -> Vector:
    x, y, z = (float(value) for value in np.array(vector) / np.linalg.norm(vector))
    return x, y, z


NORMALS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda vector: np.linalg.norm(vector) > 1e-3).map(unit)
WHOLE = st.builds(PlannedPart, NORMALS, NUMBERS)
OPEN = st.builds(
    PlannedPart, st.none() | NORMALS, st.none() | NUMBERS, st.text(st.characters(categories=["L", "N"]), max_size=20)
)
PLANES = st.lists(st.builds(lambda normal, offset_mm: Plane(np.array(normal), offset_mm), NORMALS, NUMBERS), max_size=3).map(
    tuple
)
ROWS = st.builds(FrontRow, PLANES, st.floats(0, 1e9), st.floats(0, 1e9), st.floats(0, 1e9))
CORNERS = st.tuples(*[st.floats(-9e4, 9e4)] * 3)
TURNED = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
AXES = st.none() | st.just(TURNED)
BOXES = st.builds(lambda low, axes: Zone(low, (low[0] + 1.0, low[1] + 20.0, low[2] + 300.0), axes), CORNERS, AXES)
ZONES = st.builds(lambda box, room: replace(box, room=room), BOXES, st.none() | BOXES)
GROWN = st.builds(Grown, CORNERS, st.floats(0.0, 180.0))
MODIFIERS = st.builds(
    Modifier,
    ZONES | st.builds(lambda z: Zone((-1e5, -1e5, z), (1e5, 1e5, z + 2.0)), st.floats(-9e4, 9e4)),
    st.sampled_from([{"infill_density": 0.6, "walls": 4}, {"infill_pattern": "gyroid"}]),
)
COLOURS = st.builds(Painted, st.integers(0, 0xFFFFFF))
PLANS = st.builds(
    PlanFile,
    name=st.just("plan.toml"),
    model=st.text(max_size=20),
    sha256=st.text("0123456789abcdef", max_size=64),
    orientation=st.sampled_from([None, TURNED]),
    parts=st.lists(OPEN, max_size=5).map(tuple),
    zones=st.builds(
        Zones,
        *[st.lists(ZONES | COLOURS | GROWN, max_size=2).map(tuple)] * 4,
        modifiers=st.lists(MODIFIERS, max_size=2).map(tuple),
    ),
    settings=st.sampled_from([(), (PartSettings(part=1, process={"infill_pattern": "gyroid", "infill_density": 0.4}),)]),
    front=st.lists(ROWS, max_size=3, unique_by=lambda row: row.parts).map(tuple),
)


@settings(max_examples=60)
@given(PLANS)
def test_a_plan_that_is_written_is_read_again_to_the_last_bit(tmp_path_factory: pytest.TempPathFactory, plan: PlanFile) -> None:
    path = tmp_path_factory.mktemp("plan") / "plan.toml"
    path.write_text(plan_text(plan), encoding="utf-8", newline="")
    again = read_plan(path)
    assert replace(again, front=()) == replace(plan, front=())
    assert plan_text(again) == plan_text(replace(plan, parts=again.parts))


REFUSED = [
    ("", "version is missing: this program reads version 1"),
    ("version = 2", "version is 2: this program reads version 1"),
    ("version = true", "version is True: this program reads version 1"),
    ("version = 1\ncolour = 'red'", "'colour' is not a key of a plan: version, model, sha256, orientation, part,"),
    ("version = 1\nmodel = 5", "model is 5: a text is expected"),
    ("version = 1\nsha256 = []", "sha256 is []: a text is expected"),
    ("version = 1\npart = 3", "part is 3: [[part]] tables are expected"),
    ("version = 1\norientation = [[1, 0, 0], [0, 1, 0]]", "a rotation is expected, three rows of three numbers"),
    ("version = 1\norientation = [[2, 0, 0], [0, 1, 0], [0, 0, 1]]", "a rotation is expected, three rows of three numbers"),
    ("version = 1\norientation = 7", "orientation is 7: 3 numbers in brackets are expected"),
    (
        "version = 1\n[[keep]]\nmin_mm = [0, 0, 0]\nmax_mm = [1, 1, 1]\nroom = 5",
        "keep 1: room is 5: a box is expected, such as {min_mm =",
    ),
    (
        "version = 1\n[[keep]]\nmin_mm = [0, 0, 0]\nmax_mm = [1, 1, 1]\nroom = {min_mm = [0, 0, 0], max_mm = [0, 1, 1]}",
        "keep 1: room min_mm is [0.0, 0.0, 0.0] and max_mm [0.0, 1.0, 1.0]: each number of min_mm must be less",
    ),
    (f"{FIRST}process = 4", "part 1: process is 4: keys and values are expected, as {walls = 4}"),
    ("version = 1\n[[part]]\nnormal = [0, 0, 1]\noffset_mm = 5", "part 1 stands on the build plate and has no plane"),
    (f"{FIRST}tilt_deg = 4", "part 1: 'tilt_deg' is not a key of a plan: normal, offset_mm, limbs_mm, process are allowed"),
    (f"{FIRST}[[part]]\nnormal = [0, 1]", "part 2: normal is [0, 1]: 3 numbers in brackets are expected"),
    (f"{FIRST}[[part]]\nnormal = 'up'", "part 2: normal is 'up': 3 numbers in brackets are expected"),
    (f"{FIRST}[[part]]\nnormal = [0, 0, nan]", "part 2: normal is [0, 0, nan]: 3 numbers in brackets are expected"),
    (f"{FIRST}[[part]]\nnormal = [0, 0, 0]", "part 2: normal is [0, 0, 0]: a direction of a length of about 1 is expected"),
    (f"{FIRST}[[part]]\nnormal = [0, 0, 1e200]", "a direction of a length of about 1 is expected"),
    (f"{FIRST}[[part]]\noffset_mm = nan", "part 2: offset_mm is nan: a number is expected"),
    (f"{FIRST}[[part]]\noffset_mm = -inf", "part 2: offset_mm is -inf: a number is expected"),
    (f"{FIRST}[[part]]\noffset_mm = true", "part 2: offset_mm is True: a number is expected"),
    (f"{FIRST}[[part]]\noffset_mm = '5'", "part 2: offset_mm is '5': a number is expected"),
    (f"{FIRST}[[part]]\noffset_mm = 200000", "part 2: offset_mm is 200000: -100000 to 100000 is allowed"),
    (f"{FIRST}[[part]]\noffset_mm = 0x{'f' * 5000}", "offset_mm is a number of thousands of digits: a number is expected"),
    (f"{FIRST}[[part]]\noffset_mm = {'9' * 5000}", "is not TOML"),
    (FIRST * 1 + "[[part]]\n" * 1001, "there are 1002 [[part]] tables: up to 1000 are allowed"),
    ("version = 1\n[[keep]]\nmin_mm = [0, 0, 0]", "keep 1: max_mm is missing: 3 numbers in brackets are expected"),
    ("version = 1\n[[keep]]\nmin_mm = [0, 0, 0]\nmax_mm = [1, 0, 1]", "each number of min_mm must be less"),
    (
        "version = 1\n[[keep]]\nmin_mm = [0, 0, 0]\nmax_mm = [1, 1, 1]\naxes = [[1, 0, 0], [0, 1, 0], [0, 0, 2]]",
        "keep 1: axes is [[1, 0, 0], [0, 1, 0], [0, 0, 2]]: a rotation is expected, three rows of three numbers",
    ),
    ("version = 1\n[[no_seam]]\nmin_mm = [0, 0, 0]\nmax_mm = [1, inf, 1]", "no_seam 1: max_mm is [1, inf, 1]"),
    (
        "version = 1\n[[keep]]\ncolour = 'red'",
        "keep 1: colour is 'red': # and six hexadecimal digits are expected, as \"#ff0000\"",
    ),
    ("version = 1\n[[no_seam]]\ncolour = 0xff0000", "no_seam 1: colour is 16711680: # and six hexadecimal digits are expected"),
    ("version = 1\n[[keep]]\ncolour = '#ff0000'\nmin_mm = [0, 0, 0]", "keep 1 has a colour and a box: one of them is allowed"),
    ("version = 1\n[[keep]]\ncolour = '#ff0000'\nangle_deg = 3", "keep 1 has a colour and a point: one of them is allowed"),
    ("version = 1\n[[no_support]]\nangle_deg = 3", "no_support 1: point_mm is missing: 3 numbers in brackets are expected"),
    ("version = 1\n[[keep]]\npoint_mm = [0, 0, 0]", "keep 1: angle_deg is missing: a number is expected"),
    ("version = 1\n[[keep]]\npoint_mm = [0, 0, 0]\nangle_deg = 181", "keep 1: angle_deg is 181: 0 to 180 is allowed"),
    (
        "version = 1\n[[keep]]\npoint_mm = [0, 0, 0]\nmin_mm = [0, 0, 0]",
        "keep 1 has a point and a box: one of them is allowed",
    ),
    ("version = 1\n[keep]\nmin_mm = [0, 0, 0]", "[[keep]] tables are expected"),
    ("version = 1\n[[modifier]]\nz_mm = [1, 2]", "modifier 1: process is missing: keys and values are expected, as {walls = 4}"),
    ("version = 1\n[[modifier]]\nprocess = {walls = 4}", "has no volume: one of a box, a height range z_mm, a mesh is expected"),
    ("version = 1\n[[modifier]]\nz_mm = [1, 2]\nmesh = 'a.stl'", "modifier 1 has a height range z_mm and a mesh: one of a box,"),
    ("version = 1\n[[modifier]]\nz_mm = [2, 2]\nprocess = {walls = 4}", "z_mm is [2.0, 2.0]: the first number must be less"),
    ("version = 1\n[[modifier]]\nz_mm = 2\nprocess = {walls = 4}", "modifier 1: z_mm is 2: 2 numbers in brackets are expected"),
    ("version = 1\n[[modifier]]\nmesh = 'none.stl'\nprocess = {walls = 4}", "none.stl: there is no such file"),
    ("version = 1\n[[modifier]]\nmesh = ''\nprocess = {walls = 4}", "mesh is '': the name of a model's file is expected"),
    (
        "version = 1\n[[modifier]]\ncolour = '#ff0000'",
        "modifier 1: 'colour' is not a key of a plan: min_mm, max_mm, axes, room, z_mm,",
    ),
    ("version = 1\n[[keep]]\nmesh = 'a.stl'", "keep 1: 'mesh' is not a key of a plan: min_mm, max_mm, axes, room, colour,"),
    ("version = 1\n[[support]]\nmesh = 'a.stl'\ncolour = '#ff0000'", "support 1 has a mesh and colour: one of them is allowed"),
    ("version = 1\n[[keep]]\nfaces = 'all'", "keep 1: faces is 'all': numbers and ranges of faces are expected"),
    ("version = 1\n[[keep]]\nfaces = '1'\nangle_deg = 3", "keep 1 has faces and angle_deg: one of them is allowed"),
    ("version = 1\n[[front]]\nplanes = 4", "front 1: planes is 4: a list of [x, y, z, offset_mm] is expected"),
    ("version = 1\n[[front]]\nplanes = [[0, 0, 1]]", "front 1: planes is [0, 0, 1]: 4 numbers in brackets are expected"),
    ("version = 1\n[[front]]\nplanes = []\ncost_mm2 = 'dear'", "front 1: cost_mm2 is 'dear': a number is expected"),
    ("version = 1\n[[front]]\nplanes = []\n[[front]]\nplanes = []", "two rows of [[front]] have the same number of planes"),
    ("version = [", "is not TOML"),
    ("version = 1\n" + "x = " + "[" * 20000, "is not TOML"),
    ("version = 1\nversion = 1", "is not TOML"),
]


@pytest.mark.parametrize(("text", "sentence"), REFUSED, ids=[sentence for _, sentence in REFUSED])
def test_an_invalid_plan_is_refused_in_one_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(PlanError) as refused:
        read_plan(path)
    message = str(refused.value)
    assert sentence in message
    assert "mine.toml" in message
    assert "\n" not in message
    assert len(message) < 400


def test_the_mesh_of_a_modifier_is_beside_the_plan_unchanged(tmp_path: Path) -> None:
    insert = shapes.box(3.0, 4.0, 5.0).transform(np.eye(3), (30.0, 0.0, 7.0))
    (tmp_path / "insert.stl").write_bytes(stl(insert))
    (tmp_path / "mine.toml").write_text("version = 1\n[[modifier]]\nmesh = 'insert.stl'\nprocess = {walls = 4}")
    plan = read_plan(tmp_path / "mine.toml")
    (volume,) = (modifier.volume for modifier in plan.zones.modifiers)
    assert isinstance(volume, MeshVolume)
    assert volume.mesh.bounds_mm.tolist() == [[28.5, -2.0, 7.0], [31.5, 2.0, 12.0]]
    for folder, written in ((tmp_path, "insert.stl"), (tmp_path / "parts", "../insert.stl")):
        folder.mkdir(exist_ok=True)
        (folder / "plan.toml").write_text(plan_text(plan, folder))
        assert f'mesh = "{written}"' in (folder / "plan.toml").read_text()
        assert read_plan(folder / "plan.toml").zones == plan.zones
    assert f'mesh = "{(tmp_path / "insert.stl").as_posix()}"' in plan_text(plan)


def test_support_is_wanted_or_not_in_a_mesh_too(tmp_path: Path) -> None:
    (tmp_path / "arm.stl").write_bytes(stl(shapes.box(3.0, 4.0, 5.0)))
    (tmp_path / "mine.toml").write_text("version = 1\n[[support]]\nmesh = 'arm.stl'\n[[no_support]]\nmesh = 'arm.stl'\n")
    plan = read_plan(tmp_path / "mine.toml")
    (held,), (bare,) = plan.zones.support, plan.zones.no_support
    assert isinstance(held, MeshVolume)
    assert held == bare
    assert held.mesh.bounds_mm.tolist() == [[-1.5, -2.0, 0.0], [1.5, 2.0, 5.0]]
    (tmp_path / "again.toml").write_text(plan_text(plan, tmp_path))
    assert read_plan(tmp_path / "again.toml").zones == plan.zones


def test_an_open_mesh_of_a_modifier_is_refused_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "flat.stl").write_bytes(b"solid flat\nendsolid flat\n")
    (tmp_path / "mine.toml").write_text("version = 1\n[[modifier]]\nmesh = 'flat.stl'\nprocess = {walls = 4}")
    with pytest.raises(PlanError, match=r"plan mine.toml: modifier 1: mesh .*flat.stl.*"):
        read_plan(tmp_path / "mine.toml")


def test_a_file_that_cannot_be_read_is_refused_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(bytes(range(128, 256)))
    (tmp_path / "large.toml").write_bytes(b"#" * 10_000_001)
    for name, why in (
        ("none", "no such file"),
        (".", "is a directory"),
        ("binary", "is not text"),
        ("large", "it is not a plan"),
    ):
        with pytest.raises(PlanError, match=why):
            read_plan(tmp_path / (f"{name}.toml" if name != "." else name))


def test_a_normal_of_any_length_is_a_direction(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(f"{FIRST}[[part]]\nnormal = [0, 3, 4]\noffset_mm = 10")
    (part,) = read_plan(tmp_path / "mine.toml").parts
    assert part == PlannedPart((0.0, 0.6, 0.8), 10.0)


@pytest.mark.parametrize("z", [1.0000000000001, 1.0000000000000002, 2.0])
def test_a_plan_with_a_normal_that_is_too_long_is_cut(tmp_path: Path, z: float) -> None:
    (tmp_path / "mine.toml").write_text(f"{FIRST}[[part]]\nnormal = [0.0, 0.0, {z!r}]\noffset_mm = 5.0")
    decomposition = cut_by_plan(
        shapes.box(10.0, 10.0, 20.0), "box", load(), SearchRequest(plan=read_plan(tmp_path / "mine.toml"))
    )
    assert [part.volume_mm3 for part in decomposition.parts] == pytest.approx([500.0, 1500.0])


def test_the_hash_of_a_mesh_distinguishes_micrometres_and_not_rounding() -> None:
    box = shapes.box()
    assert mesh_sha256(box.transform(np.eye(3), (1e-9, 0, 0))) == mesh_sha256(box)
    assert mesh_sha256(box.transform(np.eye(3), (1e-3, 0, 0))) != mesh_sha256(box)


def test_the_row_of_at_most_n_parts_has_the_most_parts() -> None:
    parts = tuple(PlannedPart((0.0, 0.0, 1.0), float(k)) for k in range(5))
    planes = [plane for part in reversed(parts) if (plane := part.plane) is not None]
    rows = [FrontRow(tuple(planes[first:last]), 0.0, 0.0, 0.0) for first, last in ((4, 5), (1, 3), (1, 5))]
    plan = PlanFile("mine.toml", parts=parts[:2], front=tuple(rows))
    assert [len(plan.row(most)) for most in (2, 3, 4, 5, 50)] == [1, 2, 2, 4, 4]
    assert plan.row(3) == parts[:2]
    with pytest.raises(PlanError, match=r"holds no decomposition into 1 parts or fewer, only into 2, 3, 5"):
        plan.row(1)
