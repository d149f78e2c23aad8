"""A raft under a whole print: all parts are lifted equally, and the dry run accepts it but still finds its faults."""

import re
from collections.abc import Callable
from functools import cache

import manifold3d as m3
import numpy as np
import pytest

from machine.dryrun.agreement import agreement
from machine.dryrun.dryrun import dry_run
from machine.pipeline.comparison import compare_with_one_part
from machine.pipeline.pipeline import build
from machine.pipeline.plate import on_one_plate
from machine.planning.fit import check_parts, standing_at
from machine.program import Program
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.search.parts import one_piece
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, cut_by_plan
from profiles.errors import MoveError, ProfileError
from profiles.profile import Profile, load
from slicer.estimate.estimate import estimate
from slicer.raft import lift_mm
from tests.machine.dryrun.planted import layers, on, word
from tests.machine.hand import segment_types
from tests.shapes import box, standing, tee

RAFT = "process.raft_layers=3"
ARM = PlanFile("arm", parts=(PlannedPart((1.0, 0.0, 0.0), 8.0),))  # the arm of a T, printed sideways
COARSE = ("process.layer_height_mm=0.3", "process.first_layer_height_mm=0.3", "search.nozzle_load_n=0")
LIFT_MM = 0.3 + 2 * 0.3 + 0.1


def coarse(*settings: str) -> Profile:
    return load(settings=[*COARSE, *settings])


@cache
def printed(*settings: str) -> Program:
    """A T in two parts, the second printed sideways."""
    profile = coarse(*settings)
    return build(cut_by_plan(tee(), "T", profile, SearchRequest(plan=ARM)), profile)


def alone(mesh: Mesh, profile: Profile) -> Decomposition:
    return Decomposition("box", mesh, (one_piece(mesh, profile.machine),), 1, "classic", 0.0, 0.0, 0, 0, 0.0)


def placed(program: Program, part: int) -> np.ndarray:
    """(n, 2, 3) beads of the model in a part, in the workpiece frame."""
    own = [
        name not in ("Custom", "Skirt/Brim", "Support material", "Support material interface")
        for name in segment_types(program.run)
    ]
    rows = np.flatnonzero(np.array(own) & (program.run.program.part[program.run.segment_row] == part))
    beads: np.ndarray = program.run.deposited.segments(rows)
    return beads


@pytest.mark.parametrize("part", [1, 2])
def test_every_part_is_printed_where_it_is_without_a_raft_only_higher(part: int) -> None:
    raised, flat = (placed(printed(*more), part).reshape(-1, 3) for more in ((RAFT,), ()))
    apart = np.array([raised.min(axis=0) - flat.min(axis=0), raised.max(axis=0) - flat.max(axis=0)])
    assert apart == pytest.approx(np.tile([0.0, 0.0, LIFT_MM], (2, 1)), abs=0.002)


def test_the_dry_run_finds_nothing_and_the_plastic_is_the_lifted_model_s() -> None:
    program, profile = printed(RAFT), coarse(RAFT)
    assert program.decomposition is not None
    assert program.decomposition.mesh.bounds_mm[0, 2] == pytest.approx(LIFT_MM)
    assert [part.on_plate for part in program.decomposition.parts] == [True, False]
    agreed, run = agreement(program.run, program.decomposition.mesh, profile)
    assert agreed.outside < 0.01
    assert agreed.shift_mm < 0.05
    assert {finding.code for finding in run.findings} <= {"uncalibrated"}


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_model_alone_on_a_raft_of_any_height_has_no_finding(count: int) -> None:
    profile = load(settings=[f"process.raft_layers={count}", "process.brim_mm=3"])
    run = build(alone(box(15, 15, 4), profile), profile).run
    assert {finding.code for finding in run.findings} <= {"uncalibrated"}


@pytest.mark.parametrize(
    ("code", "edit"),
    [
        ("contents", on(layers(1, 2), lambda _: None)),
        ("gap", on(layers(1, 2, 2), lambda _: None)),
        ("air", on(layers(1, 1, 3), lambda _: None)),
        ("contents", on(layers(1, 4, 200), word("Z", lambda z: z + 0.3))),
        ("filled", on(layers(1, 4, 1), word("Z", lambda z: z - 0.3))),
        ("extrusion", on(layers(1, 3), word("E", lambda e: 0.6 * e, "G1 .*E[0-9]"))),
    ],
    ids=["no second layer", "no upper layers", "no raft", "a model too high", "a model in its raft", "a lean raft"],
)
def test_a_fault_in_or_above_a_raft_is_found(code: str, edit: Callable[[list[str]], list[str]]) -> None:
    profile = load(settings=[RAFT])
    lines = list(build(alone(box(15, 15, 4), profile), profile).lines)
    assert code in {finding.code for finding in dry_run(edit(lines), profile).errors}


def test_reported_layer_heights_are_measured_from_the_plate() -> None:
    told = [float(line[3:]) for line in printed(RAFT).lines if re.match(";Z:", line)]
    assert told[:4] == pytest.approx([0.3, 0.6, 0.9, LIFT_MM + 0.3])


def test_copies_leave_room_for_their_rafts_and_each_has_its_own() -> None:
    profile = load(settings=[RAFT, "process.complete_objects=true", "process.skirt_loops=0"])
    model = alone(box(15, 15, 4), profile)
    decomposition, settings = on_one_plate([model, model], profile)
    program = build(decomposition, settings)
    assert {finding.code for finding in program.run.findings} <= {"uncalibrated"}
    props = [name.startswith("Support") for name in segment_types(program.run)]
    rows = np.flatnonzero(np.array(props))
    part = program.run.program.part[program.run.segment_row[rows]]
    first, second = (program.run.deposited.segments(rows[part == k]).reshape(-1, 3) for k in (1, 2))
    assert [first[:, 2].min(), second[:, 2].min()] == pytest.approx([0.2, 0.2])
    axis = int(np.argmax(np.abs(first.mean(axis=0) - second.mean(axis=0))))
    between = max(first[:, axis].min() - second[:, axis].max(), second[:, axis].min() - first[:, axis].max())
    assert between > 5.0


def test_a_model_that_only_its_raft_lifts_out_of_reach_is_refused() -> None:
    tall = standing(m3.Manifold.cube((20, 20, 270)))
    low = ("machine.z.limits_mm=[-80, 260.5]",)
    fits, raised = load(settings=low), load(settings=[*low, "process.raft_layers=20"])
    height_mm = 260.5 - _reach_mm(box(20, 20, 1), fits)
    mesh = Mesh(tall.vertices * [1.0, 1.0, height_mm / 270.0], tall.faces)
    check_parts([one_piece(mesh, fits.machine)], fits)
    with pytest.raises(MoveError, match="part 1 reaches Z"):
        check_parts([one_piece(mesh, raised.machine)], raised)


def _reach_mm(mesh: Mesh, profile: Profile) -> float:
    """Height of the tip above a part of zero height, in the machine's Z."""
    with pytest.raises(MoveError) as error:
        check_parts([one_piece(Mesh(mesh.vertices * [1.0, 1.0, 1000.0], mesh.faces), profile.machine)], profile)
    reached = re.search(r"reaches Z (-?[0-9.]+) mm", str(error.value))
    assert reached is not None
    return float(reached[1]) - 1000.0 + 0.05


def test_a_raft_and_a_pedestal_are_refused_together() -> None:
    with pytest.raises(ProfileError, match=r"process.raft_layers is 3: 0 is allowed with a pedestal \(search.pedestal_mm is 5\)"):
        load(settings=[RAFT, "search.pedestal_mm=5"])


def test_lifting_and_lowering_a_model_leaves_it_unchanged() -> None:
    profile = coarse()
    model = cut_by_plan(tee(), "T", profile, SearchRequest(plan=ARM))
    back = standing_at(standing_at(model, (0.0, 0.0), 0.75), (0.0, 0.0), -0.75)
    assert [part.on_plate for part in back.parts] == [True, False]
    assert back.mesh.vertices == pytest.approx(model.mesh.vertices)
    assert back.parts[1].base.offset_mm == pytest.approx(model.parts[1].base.offset_mm)


def test_one_part_alternatives_are_printed_on_a_raft_too() -> None:
    _, up, _ = compare_with_one_part(printed(RAFT), coarse(RAFT))
    assert up.message == ""
    _, plain, _ = compare_with_one_part(printed(), coarse())
    assert up.filament_mm is not None
    assert plain.filament_mm is not None
    assert up.filament_mm > plain.filament_mm


def test_the_estimate_knows_of_the_raft() -> None:
    profile, raised = load(), load(settings=[RAFT])
    part = one_piece(box(40, 40, 10), profile.machine)
    more_mm = estimate(part, raised).filament_mm - estimate(part, profile).filament_mm
    real = [float(np.max(build(alone(part.mesh, own), own).run.program.filament_mm)) for own in (raised, profile)]
    assert more_mm == pytest.approx(real[0] - real[1], rel=0.1)


def test_the_lift_is_that_of_the_layers_and_the_gap() -> None:
    assert lift_mm(coarse(RAFT)) == pytest.approx(LIFT_MM)
