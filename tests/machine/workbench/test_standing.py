"""How a model stands: what of it overhangs however it is turned, and on a pedestal."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from machine.workbench.bench.bench import Bench, with_model
from machine.workbench.work import models as work
from machine.workbench.work.models import Standing, stand
from mdp.mesh import Mesh
from mdp.pose import turned_by
from mdp.search.plan_file import PlannedPart
from profiles.errors import MeshError
from profiles.profile import load
from tests.machine.workbench.models import model
from tests.shapes import tee


def standing(mesh: Mesh, turns_deg: tuple[float, float, float] = (0.0, 0.0, 0.0), **settings: Any) -> Standing:
    profile = load(settings=[f"{key.replace('__', '.')}={value}" for key, value in settings.items()])
    bench = replace(with_model(Bench(profile), model(mesh=mesh)), rotation=turned_by(turns_deg).tolist())
    return stand(lambda report: None, bench)


# A tee is 10 mm thick: its bar of 40 mm hangs over its stem by 15 mm at each side, and seen along its thickness it has 700 mm2.
@pytest.mark.parametrize(("turns_deg", "overhang_mm2", "size_mm"), [
    ((0.0, 0.0, 0.0), 300.0, (40.0, 10.0, 40.0)),
    ((180.0, 0.0, 0.0), 0.0, (40.0, 10.0, 40.0)),
    ((90.0, 0.0, 0.0), 0.0, (40.0, 40.0, 10.0)),
    ((0.0, 90.0, 0.0), 300.0, (40.0, 10.0, 40.0)),
    ((0.0, 37.0, 0.0), 300.0 + 100.0, None),
    ((90.0, 37.0, 11.0), 700.0, None),
])  # fmt: skip
def test_what_overhangs_is_what_is_seen_from_below_and_does_not_stand_on_the_platform(
    turns_deg: tuple[float, float, float], overhang_mm2: float, size_mm: tuple[float, float, float] | None
) -> None:
    stood = standing(tee(), turns_deg)
    assert stood.overhang_mm2 == pytest.approx(overhang_mm2)
    assert stood.size_mm == pytest.approx(size_mm or stood.size_mm)
    assert (stood.problem, stood.pedestal, stood.refusal) == ("", b"", "")


def test_what_is_larger_than_the_machine_reaches_is_told_in_the_sentence_of_export() -> None:
    assert standing(tee(height=300.0)).problem.startswith("part 1 reaches Z 300.0 mm at A0.0 C0.0, Z goes from ")


def test_copies_stand_beside_the_model_in_parts_too_and_what_has_no_room_is_told_in_the_sentence_of_export() -> None:
    bench = replace(with_model(Bench(load(settings=["process.place_mm=[10, 5]"])), model(mesh=tee())), copies=3)
    stood = stand(lambda report: None, bench)
    assert (len(stood.copies_mm), stood.copies_mm[0], stood.copies_problem) == (3, (0.0, 0.0), "")
    crowd = stand(lambda report: None, replace(bench, copies=500))
    assert crowd.copies_mm == ((0.0, 0.0),)
    assert crowd.copies_problem.startswith("500 copies: ")
    cut = replace(bench, cuts=(PlannedPart((0.0, 0.0, 1.0), 20.0),))
    apart = stand(lambda report: None, cut)
    assert (len(apart.copies_mm), apart.copies_problem) == (3, "")


def test_on_a_pedestal_the_feet_stand_and_its_triangles_are_those_of_a_body_of_its_height() -> None:
    stood = standing(tee(), search__pedestal_mm=10)
    points, faces = np.frombuffer(stood.pedestal, "<u4", 2)
    places = np.frombuffer(stood.pedestal, "<f8", 3 * points, 8).reshape(-1, 3)
    assert len(stood.pedestal) == 8 + 24 * points + 12 * faces
    assert np.ptp(places, axis=0) == pytest.approx((14.0, 14.0, 10.3), abs=0.01)  # its feet and 2 mm, and what is sunk in
    assert (stood.overhang_mm2, stood.size_mm[2]) == (pytest.approx(300.0), pytest.approx(40.0))


def test_what_cannot_be_put_on_a_pedestal_stands_without_one_and_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(mesh: Mesh, height_mm: float) -> Mesh:
        raise MeshError("no feet")

    monkeypatch.setattr(work, "pedestal_under", refuse)
    stood = standing(tee(), search__pedestal_mm=10)
    assert (stood.pedestal, stood.refusal, stood.overhang_mm2) == (b"", "no feet", pytest.approx(300.0))
