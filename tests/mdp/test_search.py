import io
from concurrent.futures import Future, wait
from itertools import product
from typing import Any

import numpy as np
import pytest

from mdp.candidates import directions
from mdp.clearance import least_tip_height_mm
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.overhang import facing_down
from mdp.plane import Plane
from mdp.pose import Pose, rotation
from mdp.search import Progress, decompose, folded_mm3
from mdp.threads import ahead
from profiles.errors import DecompositionError
from profiles.profile import load
from tests import shapes
from tests.checks import assert_closed
from tests.mdp.solids import random_solid


def _decomposed(mesh: Mesh, *settings_: str, machine: str = "generic_ac") -> Decomposition:
    return decompose(mesh, "shape", load(machine=machine, settings=("search.directions=200", *settings_)))


def test_a_leaning_arm_becomes_a_part_of_its_own_without_risk() -> None:
    found = _decomposed(shapes.branch())
    assert len(found.parts) == 2
    assert found.parts[1].direction[0] > 0.2
    assert found.reduction > 0.95


@pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])
@pytest.mark.parametrize("name", ["tee", "branch", "bowl", "hollow"])
def test_parts_are_closed_add_up_and_come_in_a_printable_order(name: str, machine: str) -> None:
    mesh = getattr(shapes, name)()
    found = _decomposed(mesh, machine=machine)
    assert sum(part.volume_mm3 for part in found.parts) == pytest.approx(mesh.volume_mm3, rel=1e-9)
    for part in found.parts:
        assert_closed(part.mesh)
        assert rotation(load(machine=machine).machine, part.pose) @ part.direction == pytest.approx([0, 0, 1], abs=1e-7)
        assert part.in_part_frame().bounds_mm[0, 2] == pytest.approx(0.0, abs=1e-6)


def test_the_residual_that_the_sweep_promised_is_the_area_left_on_the_parts() -> None:
    found = _decomposed(shapes.tee(), "process.self_supporting_angle_deg=20")
    by_parts = sum(part.risky_area_mm2 for part in found.parts)
    assert found.residual_area_mm2 == pytest.approx(by_parts)
    assert found.residual_area_mm2 < found.risky_area_mm2


@pytest.mark.parametrize("seed", [3, 5, 11])
def test_no_face_of_a_part_rests_on_air(seed: int) -> None:
    found = _decomposed(random_solid(seed), "search.fragile_mm=0", "search.least_gain=0", "search.clearance=false")
    assert len(found.parts) > 1
    for position, part in enumerate(found.parts[1:], start=1):
        beneath = sum(_area_in_plane(earlier.mesh, part.base, 1.0) for earlier in found.parts[:position])
        down = part.mesh.areas_mm2[facing_down(part.mesh, part.direction, 45.0)].sum()
        assert _area_in_plane(part.mesh, part.base, -1.0) == pytest.approx(beneath, abs=1e-5)
        assert part.risky_area_mm2 == pytest.approx(down - beneath, abs=1e-5)


def _area_in_plane(mesh: Mesh, plane: Plane, looking: float) -> float:
    """Area of the faces in a plane that look along its normal (1) or against it (-1)."""
    inside = np.abs(plane.heights_mm(mesh.vertices)[mesh.faces]).max(axis=1) < 1e-6
    return float(mesh.areas_mm2[inside & (mesh.normals @ plane.normal * looking > 0.5)].sum())


def test_a_box_is_one_part_and_says_why() -> None:
    found = _decomposed(shapes.box())
    assert len(found.parts) == 1
    assert found.notes == ("no face needs support: the model is printed straight up as one part",)


def test_no_feasible_cut_names_the_constraints_with_their_counts() -> None:
    found = _decomposed(shapes.tee(), "search.least_volume_share=0.9")
    assert len(found.parts) == 1
    assert "search.least_volume_share" in found.notes[0]


def test_every_part_clears_the_table_by_the_heads_own_measure() -> None:
    machine = load().machine
    for part in _decomposed(shapes.tee(height=60.0)).parts[1:]:
        assert part.mesh.bounds_mm[0, 2] >= least_tip_height_mm(machine, part.pose)


def test_without_clearance_more_candidates_survive() -> None:
    low = shapes.tee(height=14.0)
    assert len(_decomposed(low).parts) == 1
    assert len(_decomposed(low, "search.clearance=false").parts) > 1


def test_a_pedestal_makes_low_cuts_printable() -> None:
    low = shapes.tee(height=14.0)
    lifted = _decomposed(low, "search.pedestal_mm=20")
    assert len(_decomposed(low).parts) == 1
    assert len(lifted.parts) > 1
    assert lifted.mesh.bounds_mm[1, 2] == pytest.approx(low.bounds_mm[1, 2] + 20.0, abs=0.31)


def test_a_record_tells_the_search_and_changes_nothing() -> None:
    profile = load(settings=["search.directions=200", "search.beam_width=2"])
    kept: list[bytes] = []
    found = decompose(shapes.tee(), "tee", profile, on_record=kept.append)
    told = np.load(io.BytesIO(kept[0]))
    assert found.residual_area_mm2 == decompose(shapes.tee(), "tee", profile).residual_area_mm2
    assert told["node_outcome"][0] * found.risky_area_mm2 == pytest.approx(found.residual_area_mm2, abs=1e-6)
    assert told["features"].shape[1] == 6
    assert told["chosen"].sum() == len(told["node_cost"]) - 1
    assert (told["features"][:, 1] + told["features"][:, 5] <= 1 + 1e-9).all()


def test_the_same_search_twice_gives_the_same_parts() -> None:
    first, second = _decomposed(shapes.branch()), _decomposed(shapes.branch())
    for a, b in zip(first.parts, second.parts, strict=True):
        assert np.array_equal(a.mesh.vertices, b.mesh.vertices)
        assert a.pose == b.pose


def test_a_wider_beam_is_never_worse_on_a_tee() -> None:
    narrow, wide = (_decomposed(shapes.tee(), f"search.beam_width={width}").residual_area_mm2 for width in (1, 4))
    assert wide <= narrow + 1e-9


@pytest.mark.parametrize("name", ["tee", "branch"])
def test_each_width_of_the_ladder_is_at_least_as_good_as_the_one_before(name: str) -> None:
    mesh = getattr(shapes, name)()
    left = [_decomposed(mesh, f"search.beam_width={width}").residual_area_mm2 for width in (1, 2, 5)]
    assert left == sorted(left, reverse=True)


def test_the_published_search_keeps_to_its_volume_floor() -> None:
    mesh = shapes.branch()
    found = _decomposed(mesh, "search.method=published", "search.clearance=false")
    assert len(found.parts) > 1
    assert all(part.volume_mm3 >= 0.1 * mesh.volume_mm3 for part in found.parts[1:])


def test_a_time_limit_of_nothing_leaves_one_part_and_says_so() -> None:
    found = _decomposed(shapes.tee(), "search.time_limit_s=0")
    assert len(found.parts) == 1
    assert found.notes == ("search.time_limit_s = 0 ended the search; the best so far is used",)


def test_ctrl_c_ends_the_search_and_what_it_had_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[Future[object]] = []

    def noted(*work: Any) -> Future[object]:
        begun.append(ahead(*work))
        return begun[-1]

    def interrupted(progress: Progress) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("mdp.beam.ahead", noted)
    with pytest.raises(KeyboardInterrupt):
        decompose(shapes.branch(), "branch", load(settings=["search.beam_width=8"]), on_stage=interrupted)
    assert len(begun) > 2
    assert wait(begun, timeout=60).not_done == set()


def test_space_that_a_fold_winds_around_twice_is_told_and_no_other_difference_is_allowed() -> None:
    found = _decomposed(shapes.tee())
    folded = shapes.tee(arm=40.004)  # as if its volume counted 0.4 mm3 twice
    assert folded_mm3(found.mesh, found.parts) == 0.0
    assert folded_mm3(folded, found.parts) == pytest.approx(0.4)
    assert Decomposition(**vars(found) | {"mesh": folded, "folded_mm3": 0.4001}).volume_mm3 == pytest.approx(found.volume_mm3)
    with pytest.raises(DecompositionError, match="add up to"):
        Decomposition(**vars(found) | {"mesh": folded})


def test_swapped_parts_are_refused() -> None:
    found = _decomposed(shapes.branch())
    swapped = [found.parts[1], found.parts[0]]
    fields = vars(found) | {"parts": tuple(swapped)}
    with pytest.raises(DecompositionError, match="stands at place 1"):
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
    found = directions(load().search)
    nearest = np.sort(np.arccos(np.clip(found @ found.T, -1, 1)), axis=1)[:, 1]
    assert len(found) == 600
    assert found[:, 2].min() >= np.sin(np.radians(10.0))
    assert np.degrees(nearest).min() > 3.5
