"""Purge: the line that fills the nozzle lies at the plate's edge, clear of the print, on every machine."""

import numpy as np
import pytest

from machine.dryrun.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.planning.moves import BeginPart, MachineProgram
from machine.planning.plan import has_purge, plan, purge_lanes
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Floats, Mesh
from mdp.plane import PLATFORM
from mdp.pose import level, rotation
from profiles.profile import Profile, load, load_one, shipped
from slicer.paths import Kind, Layer, Path, SlicedPart
from slicer.slice import slice_part
from tests.machine.moves import Stroke, moves_of
from tests.shapes import box


def loaded(machine: str, *settings: str) -> Profile:
    nozzle_mm = load_one(machine)["machine"].head.nozzle_mm  # type: ignore[attr-defined]
    return load(machine, settings=[f"process.line_width_mm={1.1 * nozzle_mm}", *settings])


def printed(mesh: Mesh, profile: Profile) -> tuple[MachineProgram, Floats | None]:
    pose = level(profile.machine)
    part = Part(1, mesh, PLATFORM, pose, rotation(profile.machine, pose), mesh.volume_mm3, 0.0)
    whole = Decomposition("box", mesh, (part,), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    sliced = (slice_part(part, profile),)
    return plan(whole, sliced, profile), purge_lanes((part,), sliced, profile)


@pytest.mark.parametrize("machine", shipped("machine"))
def test_every_shipped_machine_primes_its_nozzle_next_to_the_print(machine: str) -> None:
    profile = loaded(machine)
    program, lanes = printed(box(20, 20, 0.4), profile)
    assert lanes is not None
    moves = moves_of(program)
    ((at, line),) = [(k, move) for k, move in enumerate(moves) if isinstance(move, Stroke) and move.kind is Kind.PURGE]
    assert line.filament_mm.sum() == pytest.approx(3.9 * (profile.machine.head.nozzle_mm / 0.4) ** 1.05, rel=0.15)
    assert at < next(k for k, move in enumerate(moves) if isinstance(move, BeginPart))
    findings = dry_run(tuple(write_gcode(program, profile)), profile).findings
    assert [finding.code for finding in findings if finding.code != "uncalibrated"] == []


def test_the_line_keeps_clear_of_the_print_and_is_folded_or_left_out_where_there_is_little_room() -> None:
    for side_mm, radius_mm, lanes_there in ((10.0, 35.0, 1), (44.0, 35.0, 2), (20.0, 15.0, 0)):
        profile = loaded("open5x_prusa_i3", "process.skirt_loops=0", f"machine.table.radius_mm={radius_mm}")
        program, lanes = printed(box(side_mm, side_mm, 0.4), profile)
        assert (0 if lanes is None else len(lanes) // 2, has_purge(program)) == (lanes_there, lanes_there > 0)
        if lanes is not None:
            assert np.hypot(*lanes[:, :2].T).max() < radius_mm - 1.0
            assert (np.abs(lanes[:, :2]).max(axis=1) > 0.5 * side_mm + 3.0).all()


def test_no_purge_line_is_printed_unless_requested() -> None:
    assert not has_purge(printed(box(20, 20, 0.4), loaded("generic_ac", "machine.purge_mm=0"))[0])


@pytest.mark.parametrize(
    ("machine", "lines"),
    [
        ("generic_ac", ["G0 X-30.000 Y-93.817 F9000", "G0 Z0.200 F600", "G1 X30.000 E3.77709 F1200"]),
        ("open5x_voron0", ["G0 X-30.000 Y-35.445 F9000", "G0 Z0.200 F600", "G1 X30.000 E3.77709 F1200"]),
        ("linuxcnc_xyzac", ["G1 X-30.000 Y-50.165 F1200", "G1 Z0.200 F600", "G1 X30.000 U3.77709 F1200"]),
    ],
)
def test_the_line_is_written_in_the_words_of_the_firmware_once_the_nozzle_is_hot(machine: str, lines: list[str]) -> None:
    profile = loaded(machine)
    text = list(write_gcode(printed(box(20, 20, 0.4), profile)[0], profile))
    hot = next(k for k, line in enumerate(text) if line.startswith("M109") and line.endswith("215"))
    part = text.index(";PART:1 of 1")
    assert [line for line in text[hot:part] if line in lines] == lines
    assert not any(line.startswith(("M104", "M568")) and line.endswith("215") for line in text[:hot])


def test_the_purge_line_may_run_between_two_strokes_but_no_travel_crosses_it() -> None:
    profile = loaded("generic_ac")
    mesh, pose = box(20, 20, 0.4), level(profile.machine)
    part = Part(1, mesh, PLATFORM, pose, rotation(profile.machine, pose), mesh.volume_mm3, 0.0)
    ends = [np.array([[x, -95.0], [x, -90.0]]) for x in (-60.0, 60.0)]
    paths = [Path(Kind.OUTER_WALL, line, 0.45, 20.0, 1.0, np.zeros((0, 2)), True) for line in ends]
    lanes = purge_lanes([part], [SlicedPart(1, (Layer.of(0.2, 0.2, paths, 0.0),))], profile)
    assert lanes is not None
    assert lanes[:, :2].tolist() == [[-30.0, pytest.approx(-93.817, abs=1e-3)], [30.0, pytest.approx(-93.817, abs=1e-3)]]
