import io
from collections.abc import Callable, Sequence
from concurrent.futures import Future, wait
from dataclasses import replace
from functools import cache
from itertools import pairwise, product
from typing import Any

import manifold3d as m3
import numpy as np
import pytest

from mdp.clearance import least_tip_height_mm
from mdp.decomposition import Decomposition, FrontRow, Part
from mdp.kernels.threads import ahead
from mdp.mesh import Mesh
from mdp.overhang import facing_down
from mdp.plane import Plane
from mdp.pose import Pose, rotation
from mdp.ranking.candidates import directions
from mdp.ranking.features import COLUMNS
from mdp.search.front import ParetoFront, Price
from mdp.search.parts import folded_mm3
from mdp.search.search import SearchRequest, decompose
from profiles.errors import UserError
from profiles.messages import key_name
from profiles.profile import load
from tests import shapes
from tests.checks import assert_closed
from tests.mdp.solids import random_solid


def _decompose(mesh: Mesh, *settings_: str, machine: str = "generic_ac") -> Decomposition:
    return decompose(mesh, "shape", load(machine=machine, settings=("search.directions=100", "search.seam_mm=0.8", *settings_)))


@cache
def _found(name: str, *settings_: str, machine: str = "generic_ac") -> Decomposition:
    """The search's decomposition of a named shape, computed once for all tests."""
    return _decompose(getattr(shapes, name)(), *settings_, machine=machine)


def test_a_leaning_arm_becomes_a_separate_part_without_overhangs() -> None:
    decomposition = _found("branch")
    assert len(decomposition.parts) == 2
    assert decomposition.parts[1].direction[0] > 0.2
    assert decomposition.reduction > 0.85


def test_voids_forbid_no_cut() -> None:
    """Arms with a void in each are cut like solid ones, except for the stair-stepping inside; the ceilings of 4 mm are
    bridged."""
    solid, hollow = (_found(name, "search.stair_weight=0") for name in ("tee", "hollow_tee"))
    assert [tuple(part.direction) for part in hollow.parts] == [tuple(part.direction) for part in solid.parts]
    assert len(hollow.parts) == 2
    assert hollow.risky_area_mm2 == pytest.approx(solid.risky_area_mm2) == pytest.approx(2 * 15 * 10)
    assert sum(part.volume_mm3 for part in hollow.parts) == pytest.approx(40 * 100 + 30 * 100 - 2 * 4**3)


@pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])
@pytest.mark.parametrize("name", ["tee", "branch", "bowl", "hollow_tee"])
def test_parts_are_closed_add_up_and_come_in_a_printable_order(name: str, machine: str) -> None:
    decomposition = _found(name, machine=machine)
    mesh, parts = getattr(shapes, name)(), decomposition.parts
    assert sum(part.volume_mm3 for part in parts) == pytest.approx(mesh.volume_mm3, rel=1e-9)
    assert parts[0].base.heights_mm(parts[0].mesh.vertices).min() == pytest.approx(parts[0].mesh.bounds_mm[0, 2]) == 0.0
    for position, part in enumerate(parts):
        assert all(part.base.heights_mm(earlier.mesh.vertices).max() < 1e-6 for earlier in parts[:position])
        assert_closed(part.mesh)
        assert rotation(load(machine=machine).machine, part.pose) @ part.direction == pytest.approx([0, 0, 1], abs=1e-7)
        assert part.in_part_frame().bounds_mm[0, 2] == pytest.approx(0.0, abs=1e-6)


def test_the_residual_is_the_area_of_the_parts_faces_that_look_down_over_air() -> None:
    decomposition = _decompose(shapes.tee(), "process.self_supporting_angle_deg=20", "search.most_parts=2")
    left_mm2 = sum(_over_air_mm2(part.in_part_frame(), 20.0) for part in decomposition.parts)
    assert decomposition.residual_area_mm2 == pytest.approx(left_mm2)
    assert 0.0 < left_mm2 < decomposition.risky_area_mm2


def _over_air_mm2(mesh: Mesh, angle_deg: float) -> float:
    """Area of the faces of a mesh in its part frame that lean further than the angle and lie above z = 0.3."""
    leaning = mesh.normals[:, 2] < -np.sin(np.radians(angle_deg)) - 1e-4
    above = mesh.vertices[mesh.faces, 2].max(axis=1) > 0.3
    return float(mesh.areas_mm2[leaning & above].sum())


@pytest.mark.parametrize("seed", [3, 5, 11])
def test_no_face_of_a_part_rests_on_air(seed: int) -> None:
    everything = ("search.objective=risky", "search.fragile_mm=0", "search.least_gain=0", "search.clearance=false")
    decomposition = _decompose(random_solid(seed), *everything)
    assert len(decomposition.parts) > 1
    for position, part in enumerate(decomposition.parts[1:], start=1):
        beneath = sum(_area_in_plane(earlier.mesh, part.base, 1.0) for earlier in decomposition.parts[:position])
        down = part.mesh.areas_mm2[facing_down(part.mesh, part.direction, 45.0)].sum()
        assert _area_in_plane(part.mesh, part.base, -1.0) == pytest.approx(beneath, abs=1e-5)
        assert part.risky_area_mm2 == pytest.approx(down - beneath, abs=1e-5)


def _area_in_plane(mesh: Mesh, plane: Plane, looking: float) -> float:
    """Area of the faces in a plane whose normals agree with it (1) or oppose it (-1)."""
    inside = np.abs(plane.heights_mm(mesh.vertices)[mesh.faces]).max(axis=1) < 1e-6
    return float(mesh.areas_mm2[inside & (mesh.normals @ plane.normal * looking > 0.5)].sum())


def test_a_cut_that_saves_less_than_its_price_and_seam_is_not_made() -> None:
    free, priced, dear = (_found("branch", f"search.cut_mm2={price}") for price in (0, 7, 1000))
    assert [len(found.parts) for found in (free, priced, dear)] == [2, 2, 1]
    assert priced.front[1].cost_mm2 == pytest.approx(free.front[1].cost_mm2 + 7.0, abs=1e-6)
    assert priced.front[1].support_area_mm2 == pytest.approx(free.front[1].support_area_mm2, abs=1e-6)


def test_a_box_is_one_part_and_says_why() -> None:
    decomposition = _decompose(shapes.box())
    assert len(decomposition.parts) == 1
    assert decomposition.notes == ("no face needs support: the model is printed as one part",)


def test_a_request_for_one_part_needs_no_search() -> None:
    whole = decompose(shapes.branch(), "shape", load(), SearchRequest(parts=1))
    assert (len(whole.parts), whole.rounds, whole.candidates_evaluated) == (1, 0, 0)
    assert whole.chosen is not None
    assert whole.residual_area_mm2 == whole.risky_area_mm2 > 0


def test_a_request_for_one_part_costs_the_same_as_the_uncut_model() -> None:
    whole, searched = decompose(shapes.branch(), "shape", load(), SearchRequest(parts=1)).front[0], _found("branch").front[0]
    assert (whole.support_area_mm2, whole.cost_mm2) == (searched.support_area_mm2, searched.cost_mm2)
    assert whole.support_area_mm2 > 0.0


def test_no_feasible_cut_names_the_constraints_with_their_counts() -> None:
    decomposition = _decompose(shapes.tee(), "search.least_volume_share=0.9")
    assert len(decomposition.parts) == 1
    assert any("search.least_volume_share" in why for why in decomposition.rejected)


def test_every_part_clears_the_table_by_the_dimensions_of_the_head() -> None:
    machine = load().machine
    for part in _decompose(shapes.tee(height=60.0)).parts[1:]:
        assert part.mesh.bounds_mm[0, 2] >= least_tip_height_mm(machine, part.pose)


def test_without_clearance_more_candidates_survive() -> None:
    low = shapes.tee(height=14.0)
    assert len(_decompose(low).parts) == 1
    assert len(_decompose(low, "search.clearance=false").parts) > 1


def test_a_pedestal_makes_low_cuts_printable() -> None:
    low = shapes.tee(height=14.0)
    lifted = _decompose(low, "search.pedestal_mm=20")
    assert len(_decompose(low).parts) == 1
    assert len(lifted.parts) > 1
    assert lifted.mesh.bounds_mm[1, 2] == pytest.approx(low.bounds_mm[1, 2] + 20.0, abs=0.31)


def test_a_record_holds_the_search_and_changes_nothing() -> None:
    profile = load(settings=["search.directions=100", "search.beam_width=2", "search.polish=false"])
    records: list[bytes] = []
    decomposition = decompose(shapes.tee(), "tee", profile, SearchRequest(on_record=records.append))
    record = np.load(io.BytesIO(records[0]))
    assert decomposition.residual_area_mm2 == decompose(shapes.tee(), "tee", profile).residual_area_mm2
    assert record["node_outcome"][0] * decomposition.risky_area_mm2 == pytest.approx(decomposition.cost_mm2, abs=1e-6)
    assert record["features"].shape[1] == len(COLUMNS)
    assert record["chosen"].sum() == len(record["node_cost"]) - 1
    assert (record["features"][:, 1] + record["features"][:, 5] <= 1 + 1e-9).all()


def test_the_same_search_twice_gives_the_same_parts() -> None:
    first, second = _found("branch"), _decompose(shapes.branch())
    for a, b in zip(first.parts, second.parts, strict=True):
        assert np.array_equal(a.mesh.vertices, b.mesh.vertices)
        assert a.pose == b.pose


def test_a_wider_beam_is_never_worse_on_a_tee() -> None:
    narrow, wide = (_found("tee", f"search.beam_width={width}").residual_area_mm2 for width in (1, 5))
    assert wide <= narrow + 1e-9


@pytest.mark.parametrize("name", ["tee", "branch"])
def test_each_width_of_the_ladder_is_as_good_as_the_one_before_within_what_laying_planes_symmetric_may_cost(name: str) -> None:
    found = [_found(name, f"search.beam_width={width}") for width in (1, 2, 5)]
    costs = [min(row.cost_mm2 for row in decomposition.front) for decomposition in found]
    assert all(wider <= 1.01 * narrower for narrower, wider in pairwise(costs))


def test_the_published_search_keeps_to_its_volume_floor() -> None:
    mesh = shapes.branch()
    decomposition = _decompose(mesh, "search.method=published", "search.clearance=false")
    assert len(decomposition.parts) > 1
    assert all(part.volume_mm3 >= 0.1 * mesh.volume_mm3 for part in decomposition.parts[1:])


def test_a_time_limit_of_zero_leaves_one_part_and_says_so() -> None:
    decomposition = _decompose(shapes.tee(), "search.time_limit_s=0")
    assert len(decomposition.parts) == 1
    assert decomposition.notes == (f"{key_name('search.time_limit_s')} = 0 ended the search; the best so far is used",)


def test_ctrl_c_ends_the_search_and_its_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[Future[object]] = []

    def note(*work: Any) -> Future[object]:
        begun.append(ahead(*work))
        return begun[-1]

    def interrupt(stage: int, beam: int, best_share: float, measure: Callable[[], FrontRow]) -> None:
        if stage > 0:
            raise KeyboardInterrupt

    monkeypatch.setattr("mdp.search.beam.ahead", note)
    with pytest.raises(KeyboardInterrupt):
        decompose(
            shapes.branch(),
            "branch",
            load(settings=["search.beam_width=8", "search.directions=200"]),
            SearchRequest(on_stage=interrupt),
        )
    assert len(begun) > 2
    assert wait(begun, timeout=60).not_done == set()


def test_space_that_a_fold_winds_around_twice_is_reported_and_no_other_difference_is_allowed() -> None:
    decomposition = _found("tee")
    folded = shapes.tee(arm=40.004)  # its volume seems to be 0.4 mm3 larger
    assert folded_mm3(decomposition.mesh, decomposition.parts) == 0.0
    assert folded_mm3(folded, decomposition.parts) == pytest.approx(0.4)
    allowed = Decomposition(**vars(decomposition) | {"mesh": folded, "folded_mm3": 0.4001})
    assert allowed.volume_mm3 == pytest.approx(decomposition.volume_mm3)
    with pytest.raises(UserError, match="add up to"):
        Decomposition(**vars(decomposition) | {"mesh": folded})


def test_swapped_parts_are_refused() -> None:
    decomposition = _found("branch")
    swapped = [decomposition.parts[1], decomposition.parts[0]]
    fields = vars(decomposition) | {"parts": tuple(swapped)}
    with pytest.raises(UserError, match="stands at place 1"):
        Decomposition(**fields)


def test_the_clearance_of_one_box_is_the_closed_formula() -> None:
    machine = load().machine
    head = machine.head.model_copy(update={"silhouette_mm": [(0.0, 0.0)]})
    boxed = machine.model_copy(update={"head": head, "clearance_mm": 0.0})
    for tilt in (20.0, 55.0, 80.0):
        t = np.radians(tilt)
        corners = [y * s * np.sin(t) - 40 * np.cos(t) for y, s in product((30.0, -25.0), (1, -1)) if y * s > 0]
        beam = [y * np.sin(t) - 60 * np.cos(t) for y in (45.0,)]
        both = {least_tip_height_mm(boxed, Pose(tilt, 0.0)), least_tip_height_mm(boxed, Pose(-tilt, 180.0))}
        assert max(both) == pytest.approx(max(0.0, *corners, *beam))


def test_directions_are_spread_over_the_cap() -> None:
    spread = directions(load().search)
    nearest = np.sort(np.arccos(np.clip(spread @ spread.T, -1, 1)), axis=1)[:, 1]
    assert len(spread) == 600
    assert spread[:, 2].min() >= np.sin(np.radians(10.0))
    assert np.degrees(nearest).min() > 3.5


@pytest.mark.parametrize("method", ["published", "best"])
def test_the_least_outcome_on_record_is_the_result(method: str) -> None:
    words = (f"search.method={method}", "search.objective=risky", "search.polish=false", "search.directions=100")
    records: list[bytes] = []
    decomposition = decompose(shapes.ball(), "ball", load(settings=words), SearchRequest(on_record=records.append))
    with np.load(io.BytesIO(records[0])) as record:
        outcomes = record["node_outcome"]
    assert outcomes.min() == outcomes[0] == pytest.approx(decomposition.residual_area_mm2 / decomposition.risky_area_mm2)
    assert 0.5 < outcomes[0] < 0.9


def test_a_list_of_the_published_search_is_what_filled_its_beam() -> None:
    words = ("search.method=published", "search.objective=risky", "search.directions=100", "search.beam_width=3")
    records: list[bytes] = []
    decompose(shapes.tee(), "tee", load(settings=words), SearchRequest(on_record=records.append))
    with np.load(io.BytesIO(records[0])) as record:
        assert record["stage"].tolist() == [1, 1, 1]
        assert record["child"].tolist() == [1, 2, 3]
        assert record["node_expanded"].tolist() == [True, True, True, True]


@pytest.mark.parametrize("method", ["published", "best"])
def test_either_of_two_equally_expensive_decompositions_may_be_the_best(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    words = (f"search.method={method}", "search.objective=risky", "search.directions=100", "search.polish=false")
    usual, offer = decompose(shapes.tee(), "tee", load(settings=words)), ParetoFront.offer
    monkeypatch.setattr(ParetoFront, "offer", lambda front, node: offer(front, replace(node)))
    twin = decompose(shapes.tee(), "tee", load(settings=words))
    assert [row.chosen for row in twin.front] == [row.chosen for row in usual.front]
    assert len(twin.parts) == len(usual.parts) > 1


def test_a_search_reports_its_beginning_unless_nothing_needs_support() -> None:
    told: list[int] = []
    decompose(
        shapes.tee(),
        "tee",
        load(settings=["search.directions=60"]),
        SearchRequest(on_stage=lambda stage, *others: told.append(stage)),
    )
    assert told[:2] == [0, 1]
    told.clear()
    decompose(shapes.box(10.0, 10.0, 10.0), "box", load(), SearchRequest(on_stage=lambda stage, *others: told.append(stage)))
    assert told == []


def test_a_cut_through_the_bulk_of_a_model_is_made_only_on_demand() -> None:
    """A thick flat slab with an overhanging rim all round is cut at its waist, which is as wide as the slab."""
    slab = m3.Manifold.cube((40.0, 40.0, 30.0), True).translate((0.0, 0.0, 15.0))
    rimmed = slab + m3.Manifold.cube((60.0, 60.0, 30.0), True).translate((0.0, 0.0, 45.0))
    profile = load(settings=["search.directions=60", "search.clearance=false", "search.seam_mm=0.8"])

    def price(parts: Sequence[Part]) -> Price:
        return 10.0 * len(parts), 100.0

    chosen = decompose(shapes.from_manifold(rimmed), "rimmed", profile, SearchRequest(price=price))
    assert len(chosen.parts) == 1
    asked = decompose(shapes.from_manifold(rimmed), "rimmed", profile, SearchRequest(price=price, parts=2))
    assert len(asked.parts) == 2


def test_no_candidate_is_evaluated_if_nothing_needs_support() -> None:
    assert decompose(shapes.box(10.0, 10.0, 10.0), "box", load()).candidates_evaluated == 0
