"""Fit: a model that is too large for the machine is refused before slicing."""

from contextlib import nullcontext
from dataclasses import replace

import pytest

from machine.planning.fit import check_parts
from mdp.search.parts import one_piece
from profiles.errors import MoveError
from profiles.machine import TableBox
from profiles.profile import load
from tests.machine.hand import post_and_arm
from tests.shapes import box


@pytest.mark.parametrize(
    ("scale", "message"),
    [
        ((1.0, 1.0, 5.0), r"part 1 reaches Z 300.0 mm at A0.0 C0.0, Z goes from -80 to 260 mm on generic A/C table"),
        ((40.0, 1.0, 1.0), r"part 1 reaches X -199.8 mm at A0.0 C0.0, X goes from -160 to 160 mm"),
    ],
)
def test_a_part_larger_than_the_axes_is_refused_before_it_is_sliced(scale: tuple[float, float, float], message: str) -> None:
    profile = load()
    part = post_and_arm(profile.machine).parts[0]
    large = replace(part, mesh=type(part.mesh)(part.mesh.vertices * scale, part.mesh.faces))
    with pytest.raises(MoveError, match=message):
        check_parts([large], profile)
    check_parts([part], profile)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            [],
            r"first layer on the plate is 150 x 150 mm, 5.7 mm over the edge of the plate of .*, 100 mm from its middle: ",
        ),
        (["machine.table.size_mm=[150, 149]"], r"0.3 mm over the edge of the plate of .*, it measures 150 x 149 mm"),
    ],
)
def test_a_model_overhanging_the_plate_edge_is_refused_before_slicing(settings: list[str], message: str) -> None:
    profile = load(settings=settings)
    with pytest.raises(MoveError, match=message):
        check_parts([one_piece(box(150, 150, 2), profile.machine)], profile)
    check_parts([one_piece(box(141, 141, 2), profile.machine)], profile)


@pytest.mark.parametrize(("place", "is_refused"), [("[0, 0]", False), ("[0, -40]", True), ("[52, -40]", False)])
def test_a_model_on_a_clip_is_refused_before_slicing(place: str, is_refused: bool) -> None:
    profile = load(settings=[f"process.place_mm={place}"])
    clip = TableBox(name="front clip", min_mm=(-30.0, -95.0, 0.0), max_mm=(30.0, -55.0, 6.0))
    table = profile.machine.table.model_copy(update={"clips": [clip]})
    clipped = profile.model_copy(update={"machine": profile.machine.model_copy(update={"table": table})})
    refused = pytest.raises(MoveError, match=r"the model would stand on the plate's front clip: .*place_mm.* moves it")
    with refused if is_refused else nullcontext():
        check_parts([one_piece(box(40, 40, 10), clipped.machine)], clipped)
