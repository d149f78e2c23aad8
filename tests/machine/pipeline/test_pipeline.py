"""The whole pipeline, from a model file to the plastic of a simulated printer."""

from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from machine.dryrun.agreement import agreement
from machine.link.stream import print_lines
from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.requests import ModelRequest
from machine.program import Program
from machine.simulator.simulator import SimulatedPrinter
from mdp.decomposition import Decomposition
from profiles.profile import load
from slicer.slice import slice_parts
from tests.shapes import from_manifold
from tests.slicer.hand import cut

SHARED = Path(__file__).parents[3].parent / "shared" / "models"
RUNS = [("generic_ac", "demo:figure"), ("generic_ac", "demo:lattice"), ("fractal5pro", "demo:tree")]
if SHARED.exists():
    RUNS += [("generic_ac", str(SHARED / "bracket.3mf")), ("fractal5pro", str(SHARED / "kitten.off"))]
WHOLE = "bracket.3mf"  # no cut reduces its risky area
QUICK = ["search.directions=40", "search.beam_width=1", "process.layer_height_mm=0.3", "process.first_layer_height_mm=0.3"]
QUICK += ["process.scale=0.25", "process.walls=1", "process.infill_density=0.05"]  # a fortieth of the lines in the same shapes
QUICK += ["search.seam_mm=0", "search.cut_mm2=0"]  # otherwise a model this small would not be cut


def _built(model: str, machine: str) -> Program:
    profile = load(machine=machine, settings=QUICK)
    return build(decompose_model(ModelRequest(model, profile, orient=False)).decomposition, profile)


@pytest.mark.slow
@pytest.mark.parametrize(("machine", "model"), RUNS, ids=lambda name: Path(name).name)
def test_the_simulated_printer_lays_the_plastic_where_the_model_is(machine: str, model: str) -> None:
    profile = load(machine=machine)
    program = _built(model, machine)
    assert not [finding for finding in program.run.findings if finding.severity == "error"]
    with SimulatedPrinter(profile.machine) as printer:
        assert not print_lines(program.lines, printer.path).cancelled
        record = printer.record
    segments, volumes = record.deposited(profile.material.diameter_mm)
    assert volumes.sum() == pytest.approx(program.run.segment_mm3.sum(), rel=1e-3)
    assert np.abs(segments - program.run.deposited.segments()).max() < 2e-3
    assert program.decomposition is not None
    assert (len(program.decomposition.parts) == 1) == (Path(model).name == WHOLE)
    assert agreement(program.run, program.decomposition.mesh, profile)[0].outside <= 0.01
    assert (record.clamped, record.unknown, record.nozzle_target_c, record.bed_target_c) == (0, 0, 0.0, 0.0)


@pytest.mark.slow
def test_the_plastic_is_what_the_sliced_paths_say() -> None:
    profile = load(settings=[*QUICK, "material.prime_extra_mm=0"])  # filament pushed after a turn belongs to no path
    decomposition = decompose_model(ModelRequest("demo:tree", profile, orient=False), to_build=True).decomposition
    assert all(row.time_s is None for row in decomposition.front)  # without seams only support counts: no part is estimated
    planned = sum(part.volume_mm3 for part in slice_parts(decomposition.parts, profile))
    built = build(decomposition, profile)
    run = built.run
    assert built.decomposition is not None
    assert [row.time_s for row in built.decomposition.front if row.chosen] == [run.time_s]
    of_parts = run.program.part[run.segment_row] > 0  # without the purge line
    assert run.segment_mm3[of_parts].sum() == pytest.approx(planned, rel=1e-3)


def _arms(*settings: str) -> Program:
    """An arm 12 mm wide leans out of a block to the right, one 4 mm wide to the left."""
    block = m3.Manifold.cube((30.0, 16.0, 12.0), True).translate((0.0, 0.0, 6.0))
    arms = [m3.Manifold.cube((wide, wide, 26.0), True).translate((0.0, 0.0, 13.0)) for wide in (12.0, 4.0)]
    right, left = (arm.rotate((0.0, lean, 0.0)).translate((0.0, 0.0, 9.0)) for arm, lean in zip(arms, (40.0, -40.0), strict=True))
    x, z = np.sin(np.radians(40.0)), np.cos(np.radians(40.0))
    parts = cut(from_manifold(block + right + left), ((x, 0.0, z), 19.5), ((-x, 0.0, z), 19.5))
    profile = load(settings=[*settings, "process.skirt_loops=0"])
    whole = from_manifold(block + right + left)
    return build(Decomposition("arms", whole, tuple(parts), 1, "classic", 0.0, 0.0, 0, 1, 0.0), profile)


def test_pins_are_filled_without_a_finding_and_the_part_too_slender_for_one_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    program = _arms("process.interlock=pins")
    assert {finding.code for finding in program.run.findings} <= {"uncalibrated"}
    assert [part.pins > 0 for part in program.sliced] == [False, False, True]
    assert "no pins under part 2: a pin needs an area 4.6 mm wide" in capsys.readouterr().err


def test_a_vase_that_stops_below_a_tip_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    cone = cut(from_manifold(m3.Manifold.cylinder(6, 6, 0, 48)))
    profile = load(settings=["process.spiral_vase=true", "process.support=none"])
    program = build(Decomposition("cone", cone[0].mesh, tuple(cone), 1, "classic", 0.0, 0.0, 0, 1, 0.0), profile)
    assert "the vase stops at 5.80 mm: above that the model is too narrow for a spiral wall" in capsys.readouterr().err
    assert program.sliced[0].layers[-1].z_mm == pytest.approx(5.8)


def test_grooves_are_filled_without_a_finding() -> None:
    program = _arms("process.interlock=grooves", "process.interlock_mm=0.2")
    assert {finding.code for finding in program.run.findings} <= {"uncalibrated"}
