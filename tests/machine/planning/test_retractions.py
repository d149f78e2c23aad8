"""Retractions: wipe, lift, prime and coast; filament that is pulled back is pushed forward again."""

from itertools import pairwise

import numpy as np
import pytest

from machine.gcode.reader.parse import parse_gcode
from machine.gcode.writer import write_gcode
from machine.planning.layer import Laid, trail_after
from machine.planning.moves import BeginLayer, MachineProgram
from machine.planning.plan import plan
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from profiles.profile import Profile, load
from slicer.geometry.polyline import length_mm
from slicer.paths import Kind, Layer, Path
from slicer.slice import slice_part
from slicer.strokes.travels import way_of_wipe
from tests.machine.moves import Retract, Stroke, Travel, Wipe, moves_of
from tests.shapes import box
from tests.slicer.hand import whole


def _towers(*settings: str) -> tuple[MachineProgram, Profile]:
    """Two towers side by side: a retraction in every layer."""
    profile = load(settings=["process.skirt_loops=0", *settings])
    mesh = box(6, 6, 3)
    far = mesh.vertices + np.array([12.0, 0.0, 0.0])
    both = Mesh(np.vstack([mesh.vertices, far]), np.vstack([mesh.faces, mesh.faces + len(far)]).astype(mesh.faces.dtype))
    part = whole(both)
    decomposition = Decomposition("towers", both, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    return plan(decomposition, [slice_part(part, profile)], profile), profile


def _filament(program: MachineProgram) -> tuple[float, float]:
    """Filament pulled back and pushed forward outside strokes."""
    pulled = sum(float(np.sum(m.filament_mm)) for m in moves_of(program) if isinstance(m, Wipe))
    amounts = [m.filament_mm for m in moves_of(program) if isinstance(m, Retract)]
    return pulled + sum(a for a in amounts if a > 0), -sum(a for a in amounts if a < 0)


@pytest.mark.parametrize("wipe", [0, 0.5, 2, 50])
def test_retracted_filament_is_pushed_forward_again(wipe: float) -> None:
    pulled, pushed = _filament(_towers(f"material.wipe_mm={wipe}")[0])
    assert pulled > 10
    assert pulled == pytest.approx(pushed + 0.8)  # the print ends retracted


def test_extra_prime_is_pushed_after_every_retraction() -> None:
    pulled, pushed = _filament(_towers("material.retract_prime_extra_mm=0.1")[0])
    count = round(pulled / 0.8) - 1
    assert pushed == pytest.approx(0.9 * count)


def test_a_wipe_follows_the_path_just_printed_at_the_retraction_speed() -> None:
    program, profile = _towers()
    wipes = [(a, b) for a, b in pairwise(moves_of(program)) if isinstance(b, Wipe)]
    assert all(isinstance(before, Stroke) for before, _ in wipes)
    for _, wipe in wipes:
        lengths = np.linalg.norm(np.diff(wipe.points_mm, axis=0), axis=1)
        assert 0 < lengths.sum() <= profile.material.wipe_mm + 1e-9
        assert wipe.filament_mm.sum() == pytest.approx(profile.material.retract_mm)
        seconds = lengths.sum() / wipe.speed_mm_s
        assert wipe.filament_mm.sum() / seconds <= profile.material.retract_speed_mm_s + 1e-9


def test_a_retracted_travel_crosses_lifted_and_comes_down_at_its_end() -> None:
    layer, checked, pulled = BeginLayer(1, 1, 0.0, 0.2, 0.0), 0, False
    moves = moves_of(_towers("process.lift_mm=0.4")[0])
    last = max(index for index, move in enumerate(moves) if isinstance(move, Stroke))  # after it the tip parks
    for before, move in pairwise(moves[:last]):
        layer = move if isinstance(move, BeginLayer) else layer
        pulled = isinstance(move, Wipe) or (pulled and not isinstance(move, Stroke))
        crosses = isinstance(move, Travel) and np.hypot(*(move.points_mm[-1] - move.points_mm[0])[:2]) > 4
        if layer.z_mm and pulled and crosses and isinstance(before, Travel):
            assert move.points_mm[:, 2] == pytest.approx(layer.z_mm + 0.4)
            checked += 1
    assert checked >= 14


def test_ways_across_have_the_travel_speed_and_those_straight_up_and_down_the_lift_speed() -> None:
    words = ("process.lift_mm=0.4", "process.lift_speed_mm_s=5", "process.travel_speed_mm_s=120")
    travels = [move for move in moves_of(_towers(*words)[0]) if isinstance(move, Travel)][2:]  # the first two lead to the start
    upright = {move.speed_mm_s for move in travels if not np.ptp(move.points_mm[:, :2], axis=0).any()}
    level = {move.speed_mm_s for move in travels if not np.ptp(move.points_mm[:, 2])}
    assert (upright, level) == ({5.0}, {120.0})


def test_coasting_pushes_nothing_over_the_last_stretch_before_a_retraction() -> None:
    moves = moves_of(_towers("material.coast_mm=0.5", "process.infill_density=1")[0])
    coasted = [a for a, b in pairwise(moves) if isinstance(a, Stroke) and isinstance(b, Wipe) and a.filament_mm[-1] == 0]
    assert len(coasted) > 5
    for stroke in coasted:
        dry = np.linalg.norm(np.diff(stroke.points_mm, axis=0), axis=1)[stroke.filament_mm == 0]
        assert dry.sum() == pytest.approx(0.5)


def test_accelerations_are_written_where_they_change_and_read_back() -> None:
    program, profile = _towers("process.outer_wall_acceleration_mm_s2=500", "process.travel_acceleration_mm_s2=1200")
    lines = list(write_gcode(program, profile))
    assert {line for line in lines if line.startswith("M204")} == {"M204 P500 T1200", "M204 P1500 T1200"}
    parsed = parse_gcode(lines, profile.machine)
    outer = (parsed.type == parsed.types.index("External perimeter")) & (parsed.e_mm > 0) & (parsed.layer > 1)
    assert set(parsed.remarks.acceleration[parsed.remark[outer]]) == {500.0}


def test_no_acceleration_is_written_unless_one_is_set() -> None:
    program, profile = _towers()
    assert not [line for line in write_gcode(program, profile) if line.startswith("M204")]


def test_wipes_are_written_with_the_marks_that_viewers_know() -> None:
    program, profile = _towers()
    lines = list(write_gcode(program, profile))
    assert lines.count(";WIPE_START") == lines.count(";WIPE_END") > 0
    inside = lines[lines.index(";WIPE_START") + 1 : lines.index(";WIPE_END")]
    assert inside
    assert all(" E-" in line for line in inside)


def test_a_ring_is_wiped_onward_and_a_line_backward() -> None:
    ring = np.array([[0, 0, 1], [9, 0, 1], [9, 9, 1], [0, 9, 1], [0, 0, 1]], dtype=float)
    assert way_of_wipe(ring, 0.4, 2.0)[-1] == pytest.approx([2, 0, 1])
    assert way_of_wipe(ring[:4], 0.4, 2.0)[-1] == pytest.approx([2, 9, 1])


def _short(length: float, approach: tuple[tuple[float, float], ...] = ()) -> Path:
    points = np.array([[10.0, 0.0], [10.0 + length, 0.0]])
    return Path(Kind.GAP, points, 0.4, 20.0, 1.0, np.array(approach).reshape(-1, 2), False)


def _wiped(path: Path, before: np.ndarray) -> np.ndarray:
    layer = Layer.of(0.2, 0.2, [path], 0.0)
    laid = Laid(layer.points_mm, layer.starts, layer.width_mm, layer.wiped, layer.approach, layer.approach_starts)
    return trail_after(laid, 0, 1, before, 2.0)


def test_a_wipe_longer_than_its_stroke_continues_over_the_travel_and_the_strokes_before_it() -> None:
    before = np.array([[9.0, 0.5, 0.2], [0.0, 0.5, 0.2]])
    way = _wiped(_short(0.15, ((10.0, 0.5),)), before)
    assert way == pytest.approx(np.array([[10.15, 0, 0.2], [10, 0, 0.2], [10, 0.5, 0.2], [9, 0.5, 0.2], [8.65, 0.5, 0.2]]))


def test_a_wipe_retraces_every_point_of_the_travel_to_its_stroke() -> None:
    way = _wiped(_short(0.15, ((9.4, 0.5), (10.0, 0.5))), np.array([[9.4, 0.9, 0.2], [0.0, 0.9, 0.2]]))
    places = [[10.15, 0], [10, 0], [10, 0.5], [9.4, 0.5], [9.4, 0.9], [9.05, 0.9]]
    assert way == pytest.approx(np.insert(places, 2, 0.2, axis=1))


def test_a_wipe_never_returns_to_the_layer_below() -> None:
    way = _wiped(_short(0.6), np.array([[9.0, 0.5, 0.0], [0.0, 0.5, 0.0]]))
    assert way[:, 0].min() == 10.0
    assert length_mm(way[:, :2]) == pytest.approx(2.0), "a lone short stroke is wiped to and fro"


def test_a_stroke_as_long_as_the_wipe_is_wiped_over_itself() -> None:
    assert len(_wiped(_short(5.0), np.array([[9.0, 0.5, 0.2], [0.0, 0.5, 0.2]]))) == 2


def test_a_wipe_that_must_avoid_its_ring_follows_the_inner_wall_or_is_left_out() -> None:
    ring = np.array([[5, 0.9], [5, 0.3], [9, 0.3], [9, 9], [1, 9], [1, 0.3], [5, 0.3], [5, 0.6]], dtype=float)
    path = Path(Kind.OUTER_WALL, ring, 0.6, 20.0, 1.0, np.zeros((0, 2)), False, wiped=False)
    inner = np.array([[5, 0.9, 0.2], [8, 0.9, 0.2]])
    assert _wiped(path, inner) == pytest.approx(np.array([[5, 0.6, 0.2], [5, 0.9, 0.2], [6.7, 0.9, 0.2]]))
    assert not len(_wiped(path, inner[:0]))
