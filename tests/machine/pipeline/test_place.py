"""Place: a model moved on the plate keeps its parts, and everything computed after the search moves with it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from machine.dryrun.agreement import agreement
from machine.pipeline.comparison import compare_with_one_part
from machine.pipeline.pipeline import build
from machine.pipeline.plate import on_one_plate
from machine.planning.fit import places_on_plate, standing_at
from machine.program import Program
from mdp.decomposition import Decomposition
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, cut_by_plan
from mdp.zone import Marked, Zone
from profiles.errors import MoveError, PlanError
from profiles.profile import Profile, load
from tests.machine.hand import segment_types
from tests.shapes import box, tee
from tests.slicer.hand import whole

COARSE = (
    *(f"process.{key}" for key in ("layer_height_mm=0.4", "first_layer_height_mm=0.4", "line_width_mm=0.8")),
    *("search.nozzle_load_n=0", "search.directions=20", "process.walls=1", "process.infill_density=0.05"),
)
ARM = PlanFile("arm", parts=(PlannedPart((1.0, 0.0, 0.0), 8.0),))  # the arm of a T, printed sideways


def at(x: float, y: float, *settings: str) -> Profile:
    return load(settings=[*COARSE, f"process.place_mm=[{x}, {y}]", *settings])


def in_arms(profile: Profile) -> Decomposition:
    return cut_by_plan(tee(), "T", profile, SearchRequest(plan=ARM))


@cache
def printed(x: float, y: float) -> Program:
    return build(in_arms(at(x, y)), at(x, y))


def printed_middle(x: float, y: float) -> np.ndarray:
    run = printed(x, y).run
    own = [name not in ("Custom", "Skirt/Brim") for name in segment_types(run)]
    ends = run.deposited.segments(own).reshape(-1, 3)
    middle: np.ndarray = 0.5 * (ends.min(axis=0) + ends.max(axis=0))[:2]
    return middle


def test_a_plan_gives_the_same_parts_at_any_model_place_and_prints_them_there() -> None:
    here, there = in_arms(at(0, 0)), in_arms(at(20, -10))
    assert [part.mesh.vertices.tolist() for part in here.parts] == [part.mesh.vertices.tolist() for part in there.parts]
    assert printed_middle(20, -10) - printed_middle(0, 0) == pytest.approx([20.0, -10.0], abs=0.1)


def test_the_plastic_at_a_place_is_that_of_the_model_there() -> None:
    program = printed(20, -10)
    assert program.decomposition is not None
    assert program.decomposition.mesh.bounds_mm[:, 0] == pytest.approx([0.0, 40.0])
    agreed, _ = agreement(program.run, program.decomposition.mesh, at(20, -10))
    assert agreed.outside < 0.01
    assert [finding.severity for finding in program.run.findings if finding.severity == "error"] == []


def test_planes_and_marks_are_moved_with_their_parts() -> None:
    decomposition = in_arms(at(20, -10))
    zone = Zone((4.0, -9.0, 29.0), (9.0, 9.0, 31.0))
    marked = tuple(replace(part, no_seam=Marked.of(part.mesh, (zone,))) for part in decomposition.parts)
    arm = standing_at(replace(decomposition, parts=marked), (20.0, -10.0)).parts[1]
    assert arm.base.offset_mm == 28.0
    assert arm.no_seam.volumes[0].min_mm == (24.0, -19.0, 29.0)


def test_a_plane_that_the_machine_does_not_reach_at_a_place_is_refused() -> None:
    with pytest.raises(PlanError, match="part 2 cannot be cut off: Z would go from"):
        in_arms(at(20, -10, "machine.z.limits_mm=[-80, 20]"))
    in_arms(at(0, 0, "machine.z.limits_mm=[-80, 20]"))


def test_a_place_over_the_edge_is_refused_in_the_sentence_of_export() -> None:
    profile = at(95, 0)
    with pytest.raises(MoveError, match=r"mm over the edge .* process.place_mm moves it from 95, 0 mm back towards the middle"):
        build(Decomposition("box", box(), (whole(box()),), 1, "classic", 0.0, 0.0, 0, 0, 0.0), profile)


def test_the_one_piece_comparison_is_at_the_same_place() -> None:
    profile = at(60, 0)  # at twice the offset it would extend over the edge
    ways = compare_with_one_part(build(in_arms(profile), profile), profile)
    assert [way.message for way in ways if "edge" in way.message] == []
    assert all(way.time_s is not None for way in ways)


def test_copies_are_placed_around_the_place_or_anywhere_if_they_do_not_fit_there() -> None:
    machine = at(0, 0).machine
    assert places_on_plate((20.0, 20.0), 5.0, 1, machine, (30.0, 10.0)) == [(30.0, 10.0)]
    near = np.array(places_on_plate((20.0, 20.0), 5.0, 4, machine, (30.0, 10.0)))
    assert near.mean(axis=0) == pytest.approx([30.0, 10.0])
    assert len(places_on_plate((20.0, 20.0), 5.0, 37, machine, (60.0, 0.0))) == 37
    model = Decomposition("box", box(), (whole(box()),), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    many, _ = on_one_plate([model] * 4, at(30, 10))
    assert standing_at(many, (30.0, 10.0)).mesh.bounds_mm[:, :2].mean(axis=0) == pytest.approx([30.0, 10.0])
