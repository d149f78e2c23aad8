"""3MF packages: units, transforms, components and parts."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from mdp.read import read_mesh
from tests.mdp import files
from tests.mdp.files import refusal
from tests.shapes import tee


@pytest.mark.parametrize(("unit", "factor"), [("inch", 25.4), ("meter", 1000.0), ("centimeter", 10.0), ("foot", 304.8)])
def test_the_unit_of_a_3mf_is_applied(tmp_path: Path, unit: str, factor: float) -> None:
    box = files.threemf_mesh(files.placed(0.5, 1, 2))
    mesh, _ = read_mesh(files.threemf(tmp_path / "a.3mf", {1: box}, '<item objectid="1"/>', unit))
    assert np.ptp(mesh.bounds_mm, axis=0) == pytest.approx(np.array([0.5, 1, 2]) * factor)


def test_3mf_places_objects_and_components_with_their_transforms(tmp_path: Path) -> None:
    box = files.threemf_mesh(files.placed(10, 10, 10))
    pair = '<components><component objectid="1"/><component objectid="1" transform="1 0 0 0 1 0 0 0 2 20 0 0"/></components>'
    items = '<item objectid="2"/><item objectid="1" transform="-1 0 0 0 1 0 0 0 1 60 0 0"/>'
    mesh, notes = read_mesh(files.threemf(tmp_path / "a.3mf", {1: box, 2: pair}, items))
    assert notes == ()
    assert mesh.volume_mm3 == pytest.approx(1000 + 2000 + 1000)
    assert np.ptp(mesh.bounds_mm, axis=0) == pytest.approx([60, 10, 20])


def test_a_3mf_that_contains_itself_is_refused(tmp_path: Path) -> None:
    ring = '<components><component objectid="1"/></components>'
    assert "contain each other" in refusal(files.threemf(tmp_path / "a.3mf", {1: ring}, '<item objectid="1"/>'))


def test_a_3mf_with_an_unknown_unit_or_object_is_refused(tmp_path: Path) -> None:
    box = {1: files.threemf_mesh(tee())}
    assert "unit 'ell' is unknown; allowed are micron" in refusal(
        files.threemf(tmp_path / "a.3mf", box, '<item objectid="1"/>', "ell")
    )
    assert "object '7' cannot be placed" in refusal(files.threemf(tmp_path / "b.3mf", box, '<item objectid="7"/>'))
    assert "places no mesh" in refusal(files.threemf(tmp_path / "c.3mf", box, ""))


def test_components_may_name_objects_of_other_parts_by_the_same_number(tmp_path: Path) -> None:
    inner = {
        f"3D/{name}.model": files.threemf_model({1: files.threemf_mesh(box), 2: files.threemf_mesh(files.placed(5, 5, 5))})
        for name, box in {"c": files.placed(10, 10, 10), "b": files.placed(20, 20, 20)}.items()
    }
    placed = [("c", 1, 0), ("c", 2, 50), ("b", 1, 100)]
    components = "".join(
        f'<component p:path="/3D/{part}.model" objectid="{number}" transform="1 0 0 0 1 0 0 0 1 {x} 0 0"/>'
        for part, number, x in placed
    )
    objects = {7: f"<components>{components}</components>"}
    mesh, notes = read_mesh(files.threemf(tmp_path / "a.3mf", objects, '<item objectid="7"/>', parts=inner))
    assert (mesh.volume_mm3, notes) == (pytest.approx(1000 + 125 + 8000), ())


def test_components_within_components_are_all_placed(tmp_path: Path) -> None:
    doubled = {
        number: f'<components><component objectid="{number - 1}"/>'
        f'<component objectid="{number - 1}" transform="1 0 0 0 1 0 0 0 1 {2 * 2**number} 0 0"/></components>'
        for number in range(2, 6)
    }
    objects = {1: files.threemf_mesh(files.placed(5, 5, 5)), **doubled}
    assert read_mesh(files.threemf(tmp_path / "a.3mf", objects, '<item objectid="5"/>'))[0].volume_mm3 == pytest.approx(16 * 125)


def test_components_that_double_without_end_are_refused_before_they_are_placed(tmp_path: Path) -> None:
    doubled = {k: f'<components>{2 * f"""<component objectid="{k - 1}"/>"""}</components>' for k in range(2, 31)}
    objects = {1: files.threemf_mesh(tee()), **doubled}
    sentence = refusal(files.threemf(tmp_path / "a.3mf", objects, '<item objectid="30"/>'))
    assert sentence == "places more than 2000 meshes or 20000000 faces by reference"


def _painted(path: Path, resources: str, attributes: dict[int, str], of_object: str = "") -> list[int] | None:
    """The colours of a box whose triangles have further attributes, beside other resources and object attributes."""
    text = files.threemf_model({1: files.threemf_mesh(files.placed(9, 9, 9))}, '<item objectid="1"/>')
    pieces = text.split("<triangle ")
    pieces[1:] = [f"{attributes.get(k, '')} {piece}" for k, piece in enumerate(pieces[1:])]
    text = "<triangle ".join(pieces).replace("<resources>", f"<resources>{resources}")
    text = text.replace('<object id="1"', f'<object id="1" {of_object}')
    text = text.replace("<model ", '<model xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02" ')
    mesh, _ = read_mesh(files.threemf(path, {}, "", parts={"3D/a.model": text}))
    return None if mesh.colours is None else mesh.colours.tolist()


GROUP = '<m:colorgroup id="5"><m:color color="#FF0000FF"/><m:color color="#00FF00"/></m:colorgroup>'
MATERIALS = '<basematerials id="6"><base name="a" displaycolor="#0000FFFF"/><base name="b" displaycolor="blue"/></basematerials>'


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_triangles_of_a_3mf_have_the_colours_that_they_name(tmp_path: Path) -> None:
    named = {0: 'pid="5" p1="0"', 1: 'pid="5" p1="1" p2="1" p3="1"', 2: 'pid="6" p1="0"'}
    named |= {3: 'pid="5" p1="0" p2="1"', 4: 'pid="5" p1="2"', 5: 'pid="6" p1="1"', 6: 'pid="7" p1="0"'}
    assert _painted(tmp_path / "a.3mf", GROUP + MATERIALS, named) == [0xFF0000, 0x00FF00, 0x0000FF] + [-1] * 9


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_the_colour_of_a_whole_object_of_a_3mf_marks_none_of_its_triangles(tmp_path: Path) -> None:
    assert _painted(tmp_path / "a.3mf", GROUP, {}, 'pid="5" pindex="0"') is None
    assert _painted(tmp_path / "b.3mf", GROUP, {3: 'p1="1"'}, 'pid="5" pindex="0"') == [-1] * 3 + [0x00FF00] + [-1] * 8


def _rewritten(path: Path, changes: dict[str, str], names: dict[str, str] | None = None) -> Path:
    """A package of a box with replaced texts in its model, and with other names of its parts."""
    files.threemf(path, {1: files.threemf_mesh(files.placed(10, 20, 30))}, '<item objectid="1"/>')
    with zipfile.ZipFile(path) as archive:
        texts = {name: archive.read(name).decode() for name in archive.namelist()}
    for old, new in changes.items():
        assert old in texts["3D/a.model"]
        texts["3D/a.model"] = texts["3D/a.model"].replace(old, new)
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in texts.items():
            archive.writestr((names or {}).get(name, name), text)
    return path


CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
SLICE = 'xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"'


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({}, {"3D/a.model": "3d/A.Model", "_rels/.rels": "_Rels/.rels"}),
        ({CORE: "http://schemas.microsoft.com/3dmanufacturing/2013/01"}, {}),
        ({f' xmlns="{CORE}"': ""}, {}),
        ({"<triangle ": '<triangle slic3rpe:custom_seam="" ', "<model ": '<!-- <a --><model acme:at="1" '}, {}),
        ({"<model ": f'<model {SLICE} recommendedextensions="s" '}, {}),
        ({"<model ": '<model requiredextensions="p" '}, {}),
    ],
)
def test_variants_of_other_programs_are_read_the_same(tmp_path: Path, changes: dict[str, str], names: dict[str, str]) -> None:
    mesh, notes = read_mesh(_rewritten(tmp_path / "a.3mf", changes, names))
    assert (mesh.volume_mm3, notes) == (pytest.approx(6000), ())
    assert np.ptp(mesh.bounds_mm, axis=0).tolist() == [10, 20, 30]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"<model ": f'<model {SLICE} requiredextensions="p s" '}, "needs the 3MF extension slice, which is not read"),
        ({"<model ": '<model requiredextensions="acme" '}, "needs the 3MF extension acme, which is not read"),
        ({"<model ": "<html ", "</model>": "</html>"}, "its part 3D/a.model is not a 3MF model"),
        ({"</model>": ""}, "its part 3D/a.model is missing or malformed"),
    ],
)
def test_unsupported_elements_that_change_the_shape_are_refused_by_name(
    tmp_path: Path, changes: dict[str, str], words: str
) -> None:
    assert words in refusal(_rewritten(tmp_path / "a.3mf", changes))
