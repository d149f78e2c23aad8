"""User-defined planes: cut as given, completed, or refused with the reason; plans cut again without a search."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from machine.workbench.bench.page_words import page_words
from mdp.cut import below, mesh_of, solid_of
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.plane import Plane
from mdp.save import stl
from mdp.search.plan_file import PlanFile, PlannedPart, plan_of
from mdp.search.plan_reading import read_plan
from mdp.search.plan_writing import plan_text
from mdp.search.search import SearchRequest, cut_by_plan, decompose
from mdp.zone import Painted, Zone, Zones
from profiles.errors import PlanError
from profiles.frozen import Vector
from profiles.messages import option, terminal_words
from profiles.profile import Profile, load
from tests import shapes

UP, TO_X, FROM_X = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)
LEANING = (0.6, 0.0, 0.8)
RED, GREEN, BLUE = 0xFF0000, 0x00FF00, 0x0000FF
FREE = "search.clearance=false"


def _profile(*settings: str, machine: str = "generic_ac") -> Profile:
    return load(machine=machine, settings=("search.directions=100", "search.seam_mm=0.8", *settings))


def _by_hand(*parts: tuple[Vector | None, float | None], zones: Zones | None = None) -> PlanFile:
    return PlanFile("mine.toml", parts=tuple(PlannedPart(*part) for part in parts), zones=zones or Zones())


def _cut(mesh: Mesh, *parts: tuple[Vector | None, float | None], profile: Profile | None = None) -> Decomposition:
    return cut_by_plan(mesh, "shape", profile or _profile(), SearchRequest(plan=_by_hand(*parts)))


def _refusal(mesh: Mesh, *parts: tuple[Vector | None, float | None], profile: Profile | None = None) -> str:
    with pytest.raises(PlanError) as refused:
        _cut(mesh, *parts, profile=profile)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def _planes(decomposition: Decomposition) -> list[tuple[list[float], float]]:
    return [(part.base.normal.tolist(), part.base.offset_mm) for part in decomposition.parts[1:]]


@pytest.mark.parametrize("name", ["tee", "branch", "bowl", "box"])
def test_the_plan_of_a_search_gives_its_parts_again_bit_by_bit(tmp_path: Path, name: str) -> None:
    mesh = getattr(shapes, name)()
    searched = decompose(mesh, "shape", _profile("search.pedestal_mm=5"))
    (tmp_path / "plan.toml").write_text(plan_text(plan_of(searched)))
    again = cut_by_plan(mesh, "shape", _profile("search.pedestal_mm=5"), SearchRequest(plan=read_plan(tmp_path / "plan.toml")))
    assert [stl(part.mesh) for part in again.parts] == [stl(part.mesh) for part in searched.parts]
    assert [part.pose for part in again.parts] == [part.pose for part in searched.parts]
    assert again.candidates_evaluated == again.rounds == 0
    assert [(row.parts, row.chosen) for row in again.front] == [(row.parts, row.chosen) for row in searched.front]
    assert [str(row.seam_mm) for row in again.front] == [
        str(row.seam_mm) for row in searched.front
    ]  # the text in a page is identical
    assert again.cost_mm2 == pytest.approx(searched.cost_mm2)


def _two_arms() -> Mesh:
    """A post with an arm on either side."""
    arms = [m3.Manifold.cylinder(35, 5, 5, 48).rotate((0, tilt, 0)).translate((0, 0, 30)) for tilt in (60, -60)]
    return shapes.standing(m3.Manifold.cylinder(45, 8, 8, 48) + arms[0] + arms[1])


@cache
def _searched_arms() -> Decomposition:
    """The search's decomposition of a post with two arms, computed once for all tests."""
    return decompose(_two_arms(), "shape", _profile())


def test_a_plan_takes_another_row_of_its_front_without_a_search() -> None:
    searched = _searched_arms()
    plan = plan_of(searched)
    assert len(searched.parts) > 2
    for count in range(1, len(searched.front) + 1):
        assert len(cut_by_plan(_two_arms(), "shape", _profile(), SearchRequest(plan=plan, parts=count)).parts) == count
    many = cut_by_plan(_two_arms(), "shape", _profile(), SearchRequest(plan=plan, parts=50))
    assert len(many.parts) == len(searched.front)
    assert many.notes == (f"{option('parts', 50)}: the plan plan.toml holds no more than {len(searched.front)}",)


def test_planes_changed_by_hand_stay_a_row_of_the_plan_when_another_row_is_cut() -> None:
    searched = plan_of(_searched_arms())
    mine = replace(searched, parts=_by_hand((UP, 35.0), (UP, 40.0)).parts)
    for front in (searched.front, tuple(row for row in searched.front if row.parts < 3)):
        saved = plan_of(cut_by_plan(_two_arms(), "shape", _profile(), SearchRequest(plan=replace(mine, front=front), parts=2)))
        assert saved.row(3) == mine.parts
        assert saved.front[2].cost_mm2 == pytest.approx(
            cut_by_plan(_two_arms(), "shape", _profile(), SearchRequest(plan=mine)).cost_mm2
        )


def test_a_search_for_a_number_of_parts_chooses_that_row_of_the_front() -> None:
    free, (two, many) = (
        _searched_arms(),
        (decompose(_two_arms(), "shape", _profile(), SearchRequest(parts=parts)) for parts in (2, 50)),
    )
    assert len(free.parts) > len(two.parts) == 2
    assert len(many.parts) == len(many.front)
    assert many.notes == (f"{option('parts', 50)}: the search found no more than {len(many.front)}",)
    assert [row.cost_mm2 for row in two.front] == [row.cost_mm2 for row in free.front]
    assert len(decompose(_two_arms(), "shape", _profile(), SearchRequest(parts=1)).parts) == 1


@pytest.mark.parametrize("parts", [0, -1, 1001])
def test_no_parts_at_all_or_too_many_are_refused(parts: int) -> None:
    with pytest.raises(PlanError, match=f"--parts is {parts}: 1 to 1000 is allowed"):
        decompose(shapes.box(), "shape", _profile(), SearchRequest(parts=parts))
    with pytest.raises(PlanError, match=f"--parts is {parts}: 1 to 1000 is allowed"):
        cut_by_plan(shapes.box(), "shape", _profile(), SearchRequest(plan=_by_hand(), parts=parts))


def test_a_plane_by_hand_may_gain_nothing_and_make_a_small_part() -> None:
    parts = _cut(shapes.box(), (UP, 19.5)).parts
    assert [part.volume_mm3 for part in parts] == pytest.approx([400 * 19.5, 200.0])


def test_a_plan_of_another_model_is_refused() -> None:
    plan = plan_of(decompose(shapes.tee(), "tee.stl", _profile()))
    with pytest.raises(PlanError, match=r"was made for another model: tee.stl is not new.stl as it is read now"):
        cut_by_plan(shapes.tee(arm=41.0), "new.stl", _profile(), SearchRequest(plan=plan))
    with pytest.raises(PlanError, match="was made for another model"):
        decompose(shapes.tee(arm=41.0), "new.stl", _profile(), SearchRequest(plan=plan))
    assert (
        len(cut_by_plan(shapes.tee(arm=40.5), "new.stl", _profile(), SearchRequest(plan=replace(plan, sha256=""))).parts)
        == len(plan.parts) + 1
    )


def test_a_plane_beside_the_model_is_refused_with_the_possible_range() -> None:
    sentence = _refusal(shapes.box(), (UP, 35.0))
    assert sentence.startswith("plan mine.toml: part 2 cannot be cut off: its plane misses the model")
    assert "between 0.0 and 20.0 mm, offset_mm is 35" in sentence


def test_a_page_shows_the_offset_of_a_refused_plane_with_one_decimal() -> None:
    with pytest.raises(PlanError) as refused:
        _cut(shapes.box(), (UP, 34.56789))
    assert page_words(f"{refused.value}").endswith("between 0.0 and 20.0 mm, the offset is 34.6 mm")


def test_planes_in_an_impossible_order_are_refused() -> None:
    assert "part 2 cannot be cut off: nothing is left above its plane, later parts have taken it: change the order" in _refusal(
        shapes.box(z=40.0), (UP, 30.0), (UP, 20.0)
    )
    assert len(_cut(shapes.box(z=40.0), (UP, 20.0), (UP, 30.0)).parts) == 3


def test_a_plane_that_cuts_the_build_plate_is_refused() -> None:
    sentence = _refusal(shapes.box(), (LEANING, 2.0))
    assert "part 2 cannot be cut off: it would cut into the build plate; offset_mm must be at least " in sentence
    assert "offset_mm must be at least 8.5" in sentence  # 0.6 times 10 sqrt 2


def test_a_plane_that_lets_something_float_is_refused() -> None:
    post, beam = m3.Manifold.cube((8, 8, 40)), m3.Manifold.cube((60, 8, 8)).translate((-52, 0, 32))
    gallows = shapes.standing(post + beam + m3.Manifold.cube((8, 8, 32)).translate((-52, 0, 4)))
    sentence = _refusal(gallows, (LEANING, 22.0), profile=_profile(FREE))
    assert "part 2 cannot be cut off: the remainder would not stand on the build plate" in sentence


def test_a_direction_out_of_reach_is_refused() -> None:
    machine = load().machine
    tilt = machine.tilt.model_copy(update={"limits_deg": (-20.0, 20.0)})
    stiff = _profile().model_copy(update={"machine": machine.model_copy(update={"tilt": tilt})})
    sentence = _refusal(shapes.branch(), (LEANING, 20.0), profile=stiff)
    assert "part 2 cannot be cut off: the axes do not reach the direction of its normal on generic A/C table" in sentence


def test_the_body_of_the_head_that_would_meet_the_table_is_named() -> None:
    low = shapes.tee(height=14.0)
    sentence = _refusal(low, (LEANING, 8.0))
    assert re.search(
        r"the head's [a-z ]+ would meet the table: what is cut off must begin at least \d+\.\d mm above it", sentence
    )
    assert len(_cut(low, (LEANING, 8.0), profile=_profile(FREE)).parts) == 2


def test_a_model_lower_than_the_head_needs_is_said_to_be_one_that_the_machine_cannot_cut_at_this_tilt() -> None:
    sentence = _refusal(shapes.tee(height=14.0), (LEANING, 8.0), profile=_profile("machine.clearance_mm=20"))
    assert sentence.endswith("mm above it, and the model is 14.0 mm high: generic A/C table cannot cut this model at this tilt")


def test_the_axis_that_would_leave_its_limits_is_named() -> None:
    machine = load().machine
    narrow = machine.model_copy(update={"x": machine.x.model_copy(update={"limits_mm": (-5.0, 5.0)})})
    sentence = _refusal(shapes.branch(), (UP, 30.0), profile=_profile().model_copy(update={"machine": narrow}))
    assert re.search(r"part 2 cannot be cut off: X would go from -?\d+\.\d to \d+\.\d mm, -5 to 5 is allowed", sentence)


def test_a_sliver_is_refused_with_its_thickness() -> None:
    assert "its plane would leave a sliver 0.1 mm thin: 0.3 is the least (search.fragile_mm)" in _refusal(
        shapes.box(), (UP, 19.9)
    )


def test_an_offset_next_to_nothing_is_refused() -> None:
    assert "offset_mm is 0.001: 0 or at least 0.03125 is allowed" in _refusal(shapes.box(), (TO_X, 0.001), profile=_profile(FREE))


def test_a_plan_with_a_plane_left_open_is_sent_to_the_search() -> None:
    assert "part 2 has no offset_mm: decompose --planes mine.toml finds it" in _refusal(shapes.tee(), (LEANING, None))
    assert "part 2 has no normal" in _refusal(shapes.tee(), (None, 20.0))
    with pytest.raises(PlanError, match=r"^part 2 has no offset_mm: "):  # a plan that is in no file
        cut_by_plan(shapes.tee(), "shape", _profile(), SearchRequest(plan=replace(_by_hand((LEANING, None)), name="")))


def test_an_open_offset_is_chosen_to_save_the_most_support() -> None:
    by_hand = _by_hand((LEANING, None))
    profile = _profile("search.most_parts=2")
    completed = decompose(shapes.branch(), "shape", profile, SearchRequest(plan=by_hand))
    ((normal, offset_mm),) = _planes(completed)
    assert normal == list(LEANING)
    assert offset_mm == round(offset_mm)
    assert completed.reduction > 0.8


def test_an_open_direction_is_chosen_for_its_offset() -> None:
    found = decompose(shapes.branch(), "shape", _profile("search.most_parts=2"), SearchRequest(plan=_by_hand((None, 20.25))))
    assert [plane[1] for plane in _planes(found)] == [20.25]
    assert found.reduction > 0.5


def test_a_plane_that_nothing_can_complete_says_why() -> None:
    with pytest.raises(PlanError, match=r"part 2: no offset_mm can be found for it among \d+: .*\d+ because "):
        decompose(shapes.box(z=8.0), "shape", _profile(), SearchRequest(plan=_by_hand(((0.98, 0.0, 0.2), None))))
    with pytest.raises(PlanError, match="no normal can be found for it, no such plane cuts what is left of the model"):
        decompose(shapes.box(), "shape", _profile(), SearchRequest(plan=_by_hand((None, 99999.0))))
    with pytest.raises(PlanError, match=r"part 2: offset_mm is 1e-05: 0 or at least 0.03125 is allowed"):
        decompose(shapes.box(), "shape", _profile(), SearchRequest(plan=_by_hand((None, 1e-5))))
    with pytest.raises(PlanError, match="part 2 has neither normal nor offset_mm: leave it out"):
        decompose(shapes.box(), "shape", _profile(), SearchRequest(plan=_by_hand((None, None))))


def test_planes_by_hand_are_kept_and_the_others_are_found() -> None:
    arms, profile = _two_arms(), _profile()
    by_hand = _by_hand((LEANING, 28.25))
    both = decompose(arms, "shape", profile, SearchRequest(plan=by_hand))
    assert _planes(both)[-1] == (list(LEANING), 28.25)
    assert len(both.parts) == 3
    assert both.reduction > 0.9
    assert [row.parts for row in both.front] == list(range(2, len(both.front) + 2))
    again = decompose(arms, "shape", profile, SearchRequest(plan=replace(by_hand, front=plan_of(both).front)))
    sentence = "with planes by hand, the search finds the other planes again for every number of parts"
    kept = f"the [[front]] of mine.toml is not kept: {sentence}"
    assert again.notes == (*both.notes, kept)
    with pytest.raises(PlanError, match=r"--parts 1: the planes by hand of mine.toml alone make 2 parts"):
        decompose(arms, "shape", profile, SearchRequest(plan=by_hand, parts=1))


def test_planes_by_hand_cut_a_model_that_needs_no_support() -> None:
    assert _planes(decompose(shapes.box(), "shape", _profile(), SearchRequest(plan=_by_hand((UP, 10.0))))) == [(list(UP), 10.0)]


def test_no_plane_passes_through_a_zone_that_stays_whole() -> None:
    tee = shapes.tee()
    zone = Zone((-20.0, -5.0, 30.0), (-6.0, 5.0, 40.0))
    kept = decompose(tee, "shape", _profile(), SearchRequest(plan=_by_hand(zones=Zones(keep=(zone,)))))
    free = decompose(tee, "shape", _profile())
    for part in kept.parts[1:]:
        low, high = zone.spans_mm(part.base.normal[None])[0, 0]
        assert not low < part.base.offset_mm < high
    assert len(free.parts) > len(kept.parts) or kept.cost_mm2 >= free.cost_mm2
    with pytest.raises(PlanError, match=r"its plane would pass through zone 1 of \[\[keep\]\], which stays whole"):
        cut_by_plan(tee, "shape", _profile(), SearchRequest(plan=_by_hand((UP, 35.0), zones=Zones(keep=(zone,)))))


def test_seams_keep_out_of_a_zone_where_they_weigh_a_hundred_times() -> None:
    tee = shapes.tee()
    everywhere = Zone((-50.0, -50.0, 0.0), (50.0, 50.0, 50.0))
    assert len(decompose(tee, "shape", _profile()).parts) > 1
    assert len(decompose(tee, "shape", _profile(), SearchRequest(plan=_by_hand(zones=Zones(no_seam=(everywhere,))))).parts) == 1
    by_hand = cut_by_plan(tee, "shape", _profile(), SearchRequest(plan=_by_hand((UP, 35.0), zones=Zones(no_seam=(everywhere,)))))
    free = cut_by_plan(tee, "shape", _profile(), SearchRequest(plan=_by_hand((UP, 35.0))))
    assert by_hand.seam_mm == free.seam_mm == pytest.approx(100.0)
    assert by_hand.cost_mm2 - free.cost_mm2 == pytest.approx(99 * 0.8 * np.linalg.norm([25.0, 10.0, 40.0]) / 100.0 * 100.0)


def _painted_tee() -> Mesh:
    """A tee of triangles of about 5 mm: the underside of one arm is red, the head green, the rest blue."""
    tee = shapes.from_manifold(solid_of(shapes.tee()).refine_to_length(5.0))
    middles = tee.vertices[tee.faces].mean(axis=1)
    under = (tee.normals[:, 2] < -0.9) & (middles[:, 0] < -6.0)
    return Mesh(tee.vertices, tee.faces, np.select([under, middles[:, 2] > 30.1], [RED, GREEN], BLUE).astype(np.int32))


def test_no_plane_passes_through_faces_of_a_colour_that_stay_whole() -> None:
    tee = _painted_tee()
    zones = Zones(keep=(Painted(RED),))
    kept = decompose(tee, "shape", _profile(), SearchRequest(plan=_by_hand(zones=zones)))
    red = tee.vertices[tee.faces[tee.colours == RED]]
    assert len(kept.parts) > 1
    for part in kept.parts[1:]:
        heights = red @ part.base.normal - part.base.offset_mm
        assert not ((heights.min(axis=1) < -1e-5) & (heights.max(axis=1) > 1e-5)).any()
    with pytest.raises(PlanError, match=r"its plane would pass through zone 1 of \[\[keep\]\], which stays whole"):
        cut_by_plan(tee, "shape", _profile(), SearchRequest(plan=_by_hand(((-0.6, 0.0, 0.8), 31.2), zones=zones)))


def test_seams_weigh_a_hundredfold_on_faces_of_a_colour_after_any_cuts() -> None:
    around = np.array([(-10, -10), (0, -10), (10, -10), (10, 10), (0, 10), (-10, 10)], dtype=np.float64)
    corners = np.concatenate([np.column_stack([around, np.full(6, z)]) for z in (0.0, 20.0)])
    cap, following = np.array([(0, 1, 5), (1, 4, 5), (1, 2, 4), (2, 3, 4)]), np.roll(np.arange(6), -1)
    sides = [(k, n, n + 6) for k, n in enumerate(following)] + [(k, n + 6, k + 6) for k, n in enumerate(following)]
    faces = np.concatenate([cap[:, ::-1], cap + 6, sides])
    green_half = (corners[faces].mean(axis=1)[:, 0] < 0.0) & (np.arange(20) >= 8)
    painted = Mesh(corners, faces, np.where(green_half, GREEN, BLUE).astype(np.int32))
    profile, planes = _profile("search.hidden_seam_share=1", "search.seam_mm=0.6"), ((UP, 7.0), (UP, 13.0))
    green = cut_by_plan(painted, "shape", profile, SearchRequest(plan=_by_hand(*planes, zones=Zones(no_seam=(Painted(GREEN),)))))
    free = cut_by_plan(painted, "shape", profile, SearchRequest(plan=_by_hand(*planes)))
    assert green.seam_mm == free.seam_mm == pytest.approx(160.0)
    assert green.cost_mm2 - free.cost_mm2 == pytest.approx(99 * 0.6 * 80.0 * np.linalg.norm([20.0, 20.0, 20.0]) / 100.0)


def test_a_colour_that_nothing_is_painted_with_is_refused_by_its_name() -> None:
    zones = Zones(no_seam=(Painted(GREEN), Painted(0xABCDEF)))
    with pytest.raises(
        PlanError, match=r"^plan mine.toml: no_seam 1: colour is #00ff00, but shape paints no face: a 3MF, PLY, GLB or STEP"
    ):
        decompose(shapes.tee(), "shape", _profile(), SearchRequest(plan=_by_hand(zones=zones)))
    unknown = "no_seam 2: colour is #abcdef, but no face of shape is painted so; its colours are #0000ff, #00ff00, #ff0000$"
    with pytest.raises(PlanError, match=unknown):
        cut_by_plan(_painted_tee(), "shape", _profile(), SearchRequest(plan=_by_hand((UP, 35.0), zones=zones)))


def test_a_zone_without_seams_gives_a_note_if_seams_cost_nothing() -> None:
    zones = Zones(no_seam=(Zone((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),))
    found = decompose(shapes.tee(), "shape", _profile("search.seam_mm=0"), SearchRequest(plan=_by_hand(zones=zones)))
    sentence = "[[no_seam]] has no effect on cuts, since seams cost nothing (search.objective, search.seam_mm)"
    assert sentence in map(terminal_words, found.notes)


def test_the_published_search_starts_from_planes_by_hand_too() -> None:
    profile = _profile("search.method=published", FREE)
    found = decompose(shapes.tee(), "shape", profile, SearchRequest(plan=_by_hand((LEANING, 30.0))))
    assert np.allclose(found.parts[-1].base.normal, LEANING)


POST_MM = (4.0, 6.0)
# The post's corner bears the stresses of both axes, M / (b h^2 / 6) and M / (h b^2 / 6); their root sum of squares counts.
STRESS_PER_NMM = float(np.hypot(6.0 / (4.0 * 6.0**2), 6.0 / (6.0 * 4.0**2)))


def _post(length_mm: float) -> Mesh:
    """A post on a plate 5 mm thick, length_mm long above z = 6."""
    plate = m3.Manifold.cube((40, 40, 5), True).translate((0, 0, 2.5))
    return shapes.standing(plate + m3.Manifold.cube((*POST_MM, 6.0 + length_mm), True).translate((0, 0, 3.0 + length_mm / 2)))


def test_a_post_is_cut_off_as_long_as_its_base_bears_the_push_of_the_nozzle() -> None:
    most_mm = 20.0 * 0.6 / (5.0 * STRESS_PER_NMM)  # MPa over N, a weld to cold plastic
    assert len(_cut(_post(0.98 * most_mm), (UP, 6.0)).parts) == 2
    refusal = _refusal(_post(1.02 * most_mm), (UP, 6.0))
    assert "the nozzle could break the part or a piece of it off its base" in refusal
    assert "5 N at its top are 12.2 MPa at its base, 12 are allowed" in refusal


@pytest.mark.parametrize(
    ("load_n", "objective", "parts"), [(5, "scar", 2), (1000, "scar", 1), (1000, "risky", 2), (0, "scar", 2)]
)
def test_a_search_leaves_no_base_that_the_nozzle_could_break(load_n: int, objective: str, parts: int) -> None:
    settings = (f"search.nozzle_load_n={load_n}", f"search.objective={objective}")
    found = decompose(shapes.branch(), "shape", _profile(*settings))
    assert len(found.parts) == parts
    assert any("the nozzle could break the part" in reason for reason in found.rejected) == (parts == 1)
    notes = [note for note in found.notes if "a seam that costs more than the support it saves" in note]
    assert len(notes) == (parts == 1)
    assert all("decompose --planes FILE" in terminal_words(note) for note in notes)


def test_every_part_knows_how_long_its_seam_is_seen() -> None:
    wide, narrow = m3.Manifold.cube((20.0, 20.0, 20.0)), m3.Manifold.cube((10.0, 12.0, 10.0)).translate((5.0, 4.0, 20.0))
    cut = _cut(mesh_of(wide + narrow), (UP, 10.0), (UP, 24.0), profile=_profile("search.nozzle_load_n=0"))
    assert [part.seam_mm for part in cut.parts] == pytest.approx([0.0, 80.0, 44.0])
    assert cut.seam_mm == pytest.approx(124.0)


def test_a_part_with_a_feather_edge_is_reported() -> None:
    wedge = mesh_of(
        below(solid_of(shapes.box(20.0, 20.0, 40.0)), Plane(np.array([0.0, np.sin(0.2), np.cos(0.2)]), 30.0 * np.cos(0.2)))
    )
    cut = _cut(wedge, (UP, 30.0), profile=_profile("search.nozzle_load_n=0"))
    assert cut.parts[1].feather_share == pytest.approx(20.0 / 60.0)
    assert any(note.startswith("part 2: 33% of its seam") and "feather edge" in note for note in cut.notes)
