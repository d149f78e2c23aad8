"""The picture of a layer, read back as regions."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
import shapely

from mdp.mesh import Floats
from profiles.errors import SliceError
from slicer.drawing import COLOURS, layer_svg
from slicer.paths import Kind
from slicer.slice import slice_part
from tests.shapes import bowl, branch, tee
from tests.slicer.hand import BARE, SOLID, as_shapely, profile, section_at, whole

SVG = "{http://www.w3.org/2000/svg}"


def lines(group: ET.Element) -> list[tuple[Floats, ET.Element]]:
    return [(np.array([p.split(",") for p in e.attrib["points"].split()], np.float64), e) for e in group.iter(f"{SVG}polyline")]


def groups(picture: str) -> dict[str, ET.Element]:
    """The groups of a picture by their names."""
    return {g.attrib["id"]: g for g in ET.fromstring(picture).iter(f"{SVG}g") if g.get("id")}


def region(group: ET.Element) -> shapely.Geometry:
    """The area that the beads of a group cover."""
    return shapely.union_all([shapely.LineString(p).buffer(float(e.attrib["stroke-width"]) / 2) for p, e in lines(group)])


def test_the_beads_of_a_solid_layer_cover_the_section_and_nothing_else() -> None:
    sliced = slice_part(whole(bowl()), profile(*SOLID))
    drawn = groups(layer_svg(sliced, 41))
    covered = shapely.union_all([region(drawn[kind.value]) for kind in Kind if kind.value in drawn])
    section = as_shapely(section_at(bowl(), 8.1))
    assert covered.difference(section.buffer(0.03)).area < 0.01
    assert section.difference(covered).area < 0.01 * section.area


def test_every_path_is_drawn_in_the_group_of_its_kind_at_its_width() -> None:
    sliced = slice_part(whole(tee()), profile())
    drawn = groups(layer_svg(sliced, 152))
    for kind in Kind:
        paths = [p for p in sliced.layers[151].paths if p.kind is kind]
        elements = lines(drawn[kind.value]) if paths else []
        assert len(elements) == len(paths)
        for path, (points, element) in zip(paths, elements, strict=True):
            assert points == pytest.approx(path.points, abs=6e-4)
            assert float(element.attrib["stroke-width"]) == pytest.approx(path.width_mm, abs=6e-5)


def test_travels_and_seams_are_where_paths_end_and_walls_begin() -> None:
    layer = (sliced := slice_part(whole(branch()), profile(*BARE))).layers[99]
    drawn = groups(layer_svg(sliced, 100))
    ways = [p for p, _ in lines(drawn["travels"])]
    ends = np.array([p.points[-1] for p in layer.paths])
    assert max(np.hypot(*(ends - way[0]).T).min() for way in ways) < 1e-3
    dots = [(float(c.attrib["cx"]), float(c.attrib["cy"])) for c in drawn["seams"].iter(f"{SVG}circle")]
    starts = np.array([p.points[0] for p in layer.paths if p.kind is Kind.OUTER_WALL])
    assert len(dots) >= 1
    assert max(np.hypot(*(starts - dot).T).min() for dot in dots) < 1e-3


def test_the_picture_holds_the_whole_layer() -> None:
    sliced = slice_part(whole(branch()), profile())
    x, y, width, height = (float(v) for v in ET.fromstring(layer_svg(sliced, 1)).attrib["viewBox"].split())
    points = np.concatenate([p.points for p in sliced.layers[0].paths]) * (1, -1)
    assert (points > (x, y)).all()
    assert (points < (x + width, y + height)).all()


def test_every_kind_has_a_different_colour() -> None:
    assert set(COLOURS) == set(Kind)
    assert len(set(COLOURS.values())) == len(Kind)


@pytest.mark.parametrize("number", [0, 101])
def test_a_layer_that_is_not_there_is_named(number: int) -> None:
    sliced = slice_part(whole(bowl()), profile(*BARE))
    with pytest.raises(SliceError, match=rf"part 1 has no layer {number}: its layers are 1 to 100"):
        layer_svg(sliced, number)
