"""Plate: models keep their distance, are printed together or one after the other, and are refused if they do not fit."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import manifold3d as m3
import numpy as np
import pytest
import shapely

from machine.dryrun.agreement import agreement
from machine.dryrun.dryrun import summary
from machine.pipeline.given_plan import request_of_each
from machine.pipeline.pipeline import build
from machine.pipeline.plate import naming_parts, on_one_plate
from machine.pipeline.requests import ModelRequest
from machine.planning.fit import places_on_plate
from machine.program import Program
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Mesh, together
from mdp.topology.components import vertex_components
from mdp.topology.cross_section import cross_sections
from mdp.zone import Grown, Marked, MeshVolume, Modifier, Zone
from profiles.errors import MoveError, PlanError
from profiles.machine import TableBox
from profiles.part_settings import PartSettings
from profiles.profile import Profile, load, with_part_settings
from slicer.geometry.polygons import of_contours
from slicer.modifiers import modified_places
from slicer.sectioning import marked_areas
from tests.machine.hand import segment_types
from tests.shapes import box, standing, tee
from tests.slicer.hand import cut, whole

COARSE = ["process.layer_height_mm=0.3", "process.first_layer_height_mm=0.3"]


def decomposed(*parts: Part, name: str = "box") -> Decomposition:
    mesh = parts[0].mesh if len(parts) == 1 else together([part.mesh for part in parts])
    return Decomposition(name, mesh, parts, 1, "classic", 0.0, 0.0, 0, 0, 0.0, folded_mm3=1e9)


def in_copies(model: Decomposition, count: int, profile: Profile) -> tuple[Decomposition, Profile]:
    return on_one_plate([model] * count, profile)


def plate(*settings: str) -> Profile:
    return load(settings=[*COARSE, *settings])


@pytest.mark.parametrize(("count", "reach_mm"), [(1, 0.0), (2, 12.5), (4, 17.7), (5, 25.0), (9, 35.4)])
def test_copies_are_placed_in_rows_near_the_middle(count: int, reach_mm: float) -> None:
    places = np.array(places_on_plate((20.0, 20.0), 5.0, count, plate().machine))
    assert np.hypot(*places.T).max() == pytest.approx(reach_mm, abs=0.1)
    apart = np.abs(places[:, None] - places[None]).max(axis=2) + 99.0 * np.eye(count)
    assert apart.min() >= 25.0 - 1e-9


def test_an_oblong_plate_takes_as_many_copies_as_fit_in_rows() -> None:
    machine = load(settings=["machine.table.size_mm=[196, 99]"]).machine
    places = places_on_plate((20.0, 20.0), 5.0, 1000, machine)
    assert len(places) == int((196 - 4 + 5) / 25) * int((99 - 4 + 5) / 25)  # 2 mm stay free at every edge


def test_copies_on_a_round_plate_keep_to_its_edge_and_apart() -> None:
    machine = plate().machine
    disc = shapely.Point(0.0, 0.0).buffer(machine.table.radius_mm, quad_segs=1000)
    boxes = [shapely.box(x - 15, y - 6, x + 15, y + 6) for x, y in places_on_plate((30.0, 12.0), 5.0, 1000, machine)]
    assert len(boxes) > 20
    assert all(disc.covers(box.buffer(2.0, join_style="mitre")) for box in boxes)
    assert min(a.distance(b) for a, b in combinations(boxes, 2)) == pytest.approx(5.0)


def test_copies_are_placed_so_that_the_head_stays_clear_of_a_clip() -> None:
    machine = load(settings=["machine.head.silhouette_mm=[[0.6, 0], [8, 5], [20, 30]]", "machine.head.boxes=[]"]).machine
    clip = TableBox(name="clip", min_mm=(-20.0, -90.0, 0.0), max_mm=(20.0, -30.0, 12.0))
    clipped = machine.model_copy(update={"table": machine.table.model_copy(update={"clips": [clip]})})
    free, kept = (places_on_plate((20.0, 20.0), 5.0, 1000, of) for of in (machine, clipped))
    # the head is 8 mm wide at 5 mm and 20 mm at 30 mm: 11.84 mm at 1 mm above the clip
    near = shapely.box(-20.0, -90.0, 20.0, -30.0).buffer(11.84 + machine.clearance_mm, join_style="mitre")
    assert any(near.intersects(shapely.box(x - 10, y - 10, x + 10, y + 10)) for x, y in free)
    assert not any(near.buffer(-1e-6).intersects(shapely.box(x - 10, y - 10, x + 10, y + 10)) for x, y in kept)
    assert len(kept) > 0.6 * len(free)


def clipped(*corners_mm: tuple[float, float, float]) -> Profile:
    """A profile whose plate has a clip between two corners."""
    profile, clip = plate("process.support=none"), TableBox(name="clip", min_mm=corners_mm[0], max_mm=corners_mm[1])
    table = profile.machine.table.model_copy(update={"clips": [clip]})
    return profile.model_copy(update={"machine": profile.machine.model_copy(update={"table": table})})


def test_copies_around_a_clip_are_printed_without_a_collision_on_the_ways_between_them() -> None:
    profile = clipped((-3.0, -3.0, 0.0), (3.0, 3.0, 10.0))
    model = decomposed(whole(box(16, 16, 1.8)))
    decomposition, profile = in_copies(model, 6, profile)
    program = build(decomposition, profile)
    assert [finding.message for finding in program.run.errors] == []
    travels = program.run.program.end[:, 2][program.run.program.end[:, 2] > 11.0]
    assert len(travels) > 0  # the tip rises to cross the clip


def test_models_of_several_sizes_are_placed_clear_of_a_clip() -> None:
    profile = clipped((-20.0, -20.0, 0.0), (20.0, 20.0, 10.0))
    models = [decomposed(whole(box(side, side, 4)), name=f"{side:g}") for side in (30.0, 16.0, 12.0)]
    decomposition, profile = on_one_plate(models, profile)
    clip = shapely.box(-20.0, -20.0, 20.0, 20.0)
    (mesh,) = {part.mesh for part in decomposition.parts}
    of_vertex = vertex_components(len(mesh.vertices), mesh.faces)
    footprints = [shapely.MultiPoint(mesh.vertices[of_vertex == k, :2]).envelope for k in np.unique(of_vertex)]
    assert sorted(round(footprint.area) for footprint in footprints) == [144, 256, 900]
    assert min(clip.distance(footprint) for footprint in footprints) > 5.0


def test_every_copy_has_the_settings_of_its_modifiers() -> None:
    half = Modifier(Zone((-99.0, 0.0, -1.0), (99.0, 5.0, 99.0)), {"infill_density": 1.0})
    insert = Modifier(MeshVolume(Path("insert.stl"), box(4.0, 4.0, 4.0)), {"walls": 5})
    (many,) = in_copies(decomposed(replace(whole(box(10, 10, 9)), modifiers=(half, insert))), 2, plate())[0].parts
    volumes = [(modifier.volume, modifier.process) for modifier in many.modifiers]
    assert [own for _, own in volumes] == [half.process, insert.process] * 2
    boxes = [volume.min_mm[1] for volume, _ in volumes if isinstance(volume, Zone)]
    meshes = [float(volume.mesh.bounds_mm[0, 1]) for volume, _ in volumes if isinstance(volume, MeshVolume)]
    assert sorted(boxes) == [-7.5, 7.5]  # 10 mm deep, 5 mm apart
    assert sorted(meshes) == [-9.5, 5.5]


def test_a_modifier_that_extends_beyond_its_model_does_not_change_adjacent_copies() -> None:
    half = Modifier(Zone((-99.0, 0.0, -1.0), (99.0, 99.0, 99.0)), {"infill_density": 1.0})
    (many,) = in_copies(decomposed(replace(whole(box(10, 10, 9)), modifiers=(half,))), 2, plate())[0].parts
    (place,) = modified_places(many, many.in_part_frame(), plate().process, np.array([4.5]))
    section = of_contours(cross_sections(many.mesh, np.array([4.5]))[0])
    assert (section ^ place.areas[0]).area() == pytest.approx(0.5 * section.area())


def test_every_copy_is_printed_and_a_layer_of_all_comes_before_the_next() -> None:
    many, profile = in_copies(decomposed(whole(box(10, 10, 0.9))), 3, plate())
    program = build(many, profile)
    assert [finding.code for finding in program.run.findings if finding.code != "uncalibrated"] == []
    single = build(decomposed(whole(box(10, 10, 0.9))), profile)
    own = [float(printed.run.segment_mm3[_own(printed.run)].sum()) for printed in (single, program)]
    assert own[1] == pytest.approx(3.0 * own[0], rel=1e-3)
    assert program.run.program.layers == single.run.program.layers == 3


def _own(run) -> np.ndarray:  # type: ignore[no-untyped-def]
    return np.array([name not in ("Custom", "Skirt/Brim") for name in segment_types(run)])


def test_marks_go_along_with_every_copy() -> None:
    part = whole(tee().transform(np.eye(3), (3.0, 1.0, 0.0)))
    for zone in (Zone((4.0, -9.0, 29.0), (9.0, 9.0, 31.0)), Grown((12.0, 0.0, 30.0), 1.0)):
        marked = Marked.of(part.mesh, (zone,))
        (many,) = in_copies(decomposed(replace(part, no_support=marked, no_seam=marked)), 3, plate())[0].parts
        alone = marked.touched(part.mesh)
        assert 0 < alone.sum() < len(alone)
        for copies in (many.no_support, many.no_seam):
            assert copies.touched(many.mesh).tolist() == 3 * alone.tolist()


@pytest.mark.parametrize("axes", [None, ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))])
def test_a_box_that_extends_beyond_its_model_does_not_mark_adjacent_copies(axes: Any) -> None:
    ring = together([box(4, 10, 9).transform(np.eye(3), (x, 0.0, 0.0)) for x in (-8.0, 8.0)])
    right = Zone((2.0, -99.0, -1.0), (99.0, 99.0, 99.0))
    if axes is not None:
        right = Zone((-99.0, -99.0, -1.0), (99.0, -2.0, 99.0), axes)
    marks = Marked((right,))
    part = replace(whole(ring), no_seam=marks, no_support=marks, support=marks)
    (many,) = in_copies(decomposed(part), 2, plate())[0].parts
    alone, half = marks.touched(ring), 0.5 * len(ring.faces)
    assert alone.sum() == half
    cuts_mm, section = np.array([4.5]), of_contours(cross_sections(many.mesh, np.array([4.5]))[0])
    for mark in (many.no_seam, many.no_support, many.support):
        assert mark.touched(many.mesh).tolist() == 2 * alone.tolist()
        (area,) = marked_areas(mark, many, many.in_part_frame(), cuts_mm)
        assert (section ^ area).area() == pytest.approx(0.5 * section.area())


def test_a_box_of_a_sequentially_printed_model_does_not_reach_into_adjacent_models() -> None:
    everywhere = Marked((Zone((-99.0, -99.0, -1.0), (99.0, 99.0, 99.0)),))
    part = replace(whole(box(10, 10, 9)), no_seam=everywhere, no_support=everywhere, support=everywhere)
    one, other = in_copies(decomposed(part), 2, plate("process.complete_objects=true"))[0].parts
    cuts_mm = np.array([4.5])
    sections = [of_contours(cross_sections(copy.mesh, cuts_mm)[0]) for copy in (one, other)]
    for mark in (other.no_seam, other.no_support, other.support):
        level = replace(other, rotation=np.eye(3))
        (area,) = marked_areas(mark, level, other.mesh, cuts_mm)
        assert [(section ^ area).area() for section in sections] == pytest.approx([0.0, 100.0])


def test_settings_of_a_part_of_one_model_hold_for_no_other_model() -> None:
    post = decomposed(whole(box(10, 10, 9)), name="post")
    tilted = decomposed(*cut(box(20, 20, 14), ((0.5, 0.0, 1.0), 9.0)), name="tilted")
    settings = {post: [own(1, walls=5)], tilted: [own(2, layer_height_mm=0.25)]}
    print_, profile = on_one_plate([post, tilted], plate("process.skirt_loops=0"), settings)
    (modifier,) = print_.parts[0].modifiers
    inside = [face.all() for face in _inside(modifier.volume, print_.parts[0].mesh)]
    assert (modifier.process, sum(inside)) == ({"walls": 5}, len(post.mesh.faces))
    named = {part.index: part.of for part in print_.parts[1:]}
    assert [(settings.part, named[settings.part]) for settings in profile.parts] == [(2, "part 2 of tilted")]
    with pytest.raises(PlanError, match=r"part 1 of post: process.layer_height_mm holds for a whole part, .*complete_objects"):
        on_one_plate([post, tilted], plate(), {post: [own(1, layer_height_mm=0.2)], tilted: []})


def own(part: int, **process: Any) -> PartSettings:
    return PartSettings(part=part, process=process)


def _inside(volume: Any, mesh: Mesh) -> np.ndarray:
    points = mesh.vertices[mesh.faces]
    return np.all((points >= volume.min_mm) & (points <= volume.max_mm), axis=2)


def test_a_refused_part_is_named_by_its_model_too() -> None:
    parts = [whole(box(10, 10, 9)), replace(whole(box(10, 10, 9)), index=2, of="part 3 of hook.stl")]
    with pytest.raises(MoveError, match=r"^part 2 \(part 3 of hook.stl\) reaches X 99 mm$"), naming_parts(parts):
        raise MoveError("part 2 reaches X 99 mm")
    with pytest.raises(MoveError, match=r"^part 1 reaches X 99 mm$"), naming_parts(parts):
        raise MoveError("part 1 reaches X 99 mm")


def test_each_plan_applies_to_the_model_it_names(tmp_path: Path) -> None:
    for name in ("tee", "hook"):
        (tmp_path / f"{name}.toml").write_text(f'version = 1\nmodel = "{name}.stl"\n')
    tee_plan, hook_plan = tmp_path / "tee.toml", tmp_path / "hook.toml"

    def of_each(*plans: Path) -> dict[str, ModelRequest]:
        return request_of_each(ModelRequest("a/hook.stl", plate(), plans=plans, beside=("b/tee.stl", "post.stl")))

    found = {name: request.plan for name, request in of_each(tee_plan, hook_plan).items()}
    assert found == {"a/hook.stl": hook_plan, "b/tee.stl": tee_plan, "post.stl": None}
    with pytest.raises(PlanError, match=r"tee.toml cuts tee.stl already"):
        of_each(tee_plan, tee_plan)
    hook_plan.write_text("version = 1\n")
    with pytest.raises(PlanError, match=r'model is "": .* the name of one of these: hook.stl, tee.stl, post.stl'):
        of_each(hook_plan)


def test_slender_copies_have_the_brim_that_one_alone_would_have() -> None:
    tower = standing(m3.Manifold.cube((3, 3, 60)))
    assert in_copies(decomposed(whole(tower)), 4, plate())[1].process.brim_mm == 5.0
    assert in_copies(decomposed(whole(box())), 4, plate())[1].process.brim_mm == 0.0


def test_copies_that_have_no_room_are_refused() -> None:
    with pytest.raises(PlanError) as refused:
        in_copies(decomposed(whole(box())), 100, plate())
    room = "100 copies: box measures 20.0 x 20.0 mm, the plate of generic A/C table has room for 37 with 5 mm between them"
    assert str(refused.value) == room


def test_a_repeated_mesh_is_closed_and_as_large_as_all_copies() -> None:
    mesh: Mesh = in_copies(decomposed(whole(box())), 4, plate())[0].mesh
    assert mesh.volume_mm3 == pytest.approx(4 * 8000.0)
    assert len(mesh.faces) == 48


def large_and_small(*settings: str) -> tuple[Decomposition, Profile]:
    models = [decomposed(whole(box(30, 20, 2.1)), name="large"), decomposed(whole(box(10, 10, 1.2)), name="small")]
    return on_one_plate(models, plate("process.skirt_loops=0", *settings))


def boxes_of(print_: Decomposition) -> list[shapely.Geometry]:
    """The bounding rectangle of each model on a plate, by its connected vertices."""
    label = vertex_components(len(print_.mesh.vertices), print_.mesh.faces)
    return [shapely.MultiPoint(print_.mesh.vertices[label == k, :2]).envelope for k in np.unique(label)]


def beads_of(program: Program) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Part and layer of every bead except the purge line's, and whether it belongs to the small box in front."""
    run = program.run
    which = np.flatnonzero(run.program.part[run.segment_row] > 0)
    rows, y = run.segment_row[which], run.deposited.segments(which)[:, :, 1].mean(axis=1)
    return run.program.part[rows], run.program.layer[rows], y < -5.0


def test_models_of_two_sizes_are_placed_five_millimetres_apart_around_the_middle() -> None:
    print_, _ = large_and_small()
    large, small = boxes_of(print_)
    assert large.distance(small) == pytest.approx(5.0)
    assert print_.mesh.bounds_mm.tolist() == [[-15.0, -17.5, 0.0], [15.0, 17.5, 2.1]]  # 10 + 5 + 20 deep
    assert (print_.name, len(print_.parts)) == ("large, small", 1)


def test_layer_by_layer_printing_puts_both_models_in_every_layer_they_reach() -> None:
    program = build(*large_and_small())
    part, layer, is_small = beads_of(program)
    assert set(part.tolist()) == {1}
    assert (np.diff(layer) >= 0).all()
    assert sorted(set(layer[is_small].tolist())) == [1, 2, 3, 4]  # 1.2 mm in layers of 0.3
    assert sorted(set(layer[~is_small].tolist())) == [1, 2, 3, 4, 5, 6, 7]
    box_mm = np.array(summary(program.run)["bounds_mm"])
    assert box_mm[:, 1] == pytest.approx([-17.5, 17.5], abs=0.25)  # the bead's centreline is half a line width inside
    assert [finding.code for finding in program.run.findings] == ["uncalibrated"]


def test_one_after_the_other_the_lower_model_is_done_before_the_higher_one_begins() -> None:
    program = build(*large_and_small("process.complete_objects=true"))
    part, layer, is_small = beads_of(program)
    assert (part == np.where(is_small, 1, 2)).all()
    assert (np.diff(part) >= 0).all()
    assert [int(layer[part == k].max()) for k in (1, 2)] == [4, 7]
    assert program.run.program.layers == 11
    assert [finding.code for finding in program.run.findings] == ["uncalibrated"]


def test_a_model_printed_after_another_gets_the_first_layer_that_it_would_have_alone() -> None:
    settings = ("process.skirt_loops=0", "process.first_layer_flow=1.1", "process.interface_flow=0.9", "material.bed_c=60")
    alone = build(decomposed(whole(box(30, 20, 2.1))), plate(*settings))
    second = build(*large_and_small("process.complete_objects=true", *settings))
    laid = [run.segment_mm3[run.program.part[run.segment_row] == part].sum() for run, part in ((alone.run, 1), (second.run, 2))]
    assert laid[1] == pytest.approx(laid[0], rel=1e-3)
    assert second.run.errors == ()


def test_a_model_next_to_a_tall_one_is_placed_far_enough_away_for_the_head() -> None:
    models = [decomposed(whole(box(20, 20, height)), name=str(height)) for height in (12, 12.5)]
    gaps = []
    for settings in ((), ("process.complete_objects=true",)):
        print_, _ = on_one_plate(models, plate("process.skirt_loops=0", *settings))
        gaps.append(boxes_of(print_)[0].distance(boxes_of(print_)[1]))
    assert plate().machine.head.silhouette_mm[-2:] == [(11.5, 4.5), (15.0, 16.0)]  # 13.8 mm wide at a height of 12 mm
    assert gaps == pytest.approx([5.0, 17.5])  # a multiple of 2.5 mm


def test_models_the_head_cannot_pass_are_refused_with_alternatives() -> None:
    models = [decomposed(whole(box(60, 60, height)), name=f"{height} high") for height in (70, 75, 80)]
    with pytest.raises(PlanError) as refused:
        on_one_plate(models, plate("process.complete_objects=true"))
    assert "that the head reaches without hitting them" in str(refused.value)
    wanted = "process.complete_objects = false prints them layer by layer; or print fewer copies, or set a smaller process.scale"
    assert str(refused.value).endswith(wanted)


def test_models_that_would_fit_but_for_the_head_are_refused_with_that_cause_even_where_no_free_place_is_left() -> None:
    models = [decomposed(whole(box(60 + k, 60, 70 + k)), name=f"box {k}") for k in range(3)]
    on_one_plate(models, plate())  # printed layer by layer, all models fit
    with pytest.raises(PlanError) as refused:
        on_one_plate(models, plate("process.complete_objects=true"))
    place, _, cause = str(refused.value).partition(" that the head reaches without hitting them: ")
    assert place.endswith("has no place for it beside another one")
    assert cause.startswith("models are printed one after another")


def test_a_model_without_room_is_named_with_the_room_that_it_needs() -> None:
    models = [decomposed(whole(box(90, 90, 3)), name=name) for name in ("first", "second")]
    models.append(decomposed(whole(box(40, 160, 3)), name="long"))
    with pytest.raises(PlanError) as refused:
        on_one_plate(models, plate())
    sentence = "second measures 90.0 x 90.0 mm, the plate of generic A/C table has no room for it 5 mm from another model"
    assert str(refused.value).startswith(sentence)


def test_a_model_that_is_too_high_among_others_is_named() -> None:
    models = [decomposed(whole(box(20, 20, height)), name=f"{height} high") for height in (10, 300)]
    with pytest.raises(MoveError, match=r"^300 high: part 1 reaches Z 300\.0 mm"):
        on_one_plate(models, plate())


def test_tilted_parts_are_printed_next_to_another_model_without_a_finding() -> None:
    tilted = decomposed(*cut(box(20, 20, 14), ((0.5, 0.0, 1.0), 9.0)), name="tilted")
    print_, profile = on_one_plate([tilted, decomposed(whole(box(10, 10, 9)), name="post")], plate())
    assert [part.index for part in print_.parts] == [1, 2]
    assert print_.parts[1].base.limbs_mm is not None
    assert [finding.code for finding in build(print_, profile).run.findings] == ["uncalibrated"]


def test_settings_of_a_part_hold_for_that_part_of_every_copy() -> None:
    model = decomposed(*cut(box(20, 20, 14), ((0.5, 0.0, 1.0), 9.0)))
    profile = with_part_settings(plate(), [PartSettings(part=2, process={"walls": 4})])
    print_, printed = on_one_plate([model, model], profile)
    assert [part.index for part in print_.parts] == [1, 2, 3]
    assert [(own.part, own.process) for own in printed.parts] == [(2, {"walls": 4}), (3, {"walls": 4})]


def test_the_same_models_give_the_same_plate() -> None:
    plates = [large_and_small("process.complete_objects=true")[0] for _ in range(2)]
    assert plates[0].mesh.vertices.tobytes() == plates[1].mesh.vertices.tobytes()
    assert [part.pose for part in plates[0].parts] == [part.pose for part in plates[1].parts]


def test_the_agreement_with_the_model_covers_all_models() -> None:
    print_, profile = large_and_small("process.infill_density=1")
    agreed, run = agreement(build(print_, profile).run, print_.mesh, profile)
    assert (agreed.filled > 0.98, agreed.outside < 0.01, run.errors) == (True, True, ())
    half, _ = agreement(run, boxes_alone(), profile)
    assert half.outside > 0.05


def boxes_alone() -> Mesh:
    """The large box where it stands on the plate, without the small one."""
    return box(30, 20, 2.1).transform(np.eye(3), (0.0, 7.5, 0.0))
