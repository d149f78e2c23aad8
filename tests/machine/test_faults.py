"""Planted faults: each is found by its own code on every shipped machine that tilts."""

import re
from functools import cache

import manifold3d as m3
import numpy as np
import pytest

from machine.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.planning.moves import BeginPart, MachineProgram
from machine.planning.plan import plan
from mdp.clearance import allowed_poses
from mdp.cut import cut, mesh_of
from mdp.decomposition import Decomposition, Part
from mdp.plane import PLATFORM, Plane
from mdp.pose import level, poses, rotation
from profiles.errors import ProfileError
from profiles.machine import Machine
from profiles.profile import Profile, load, shipped
from slicer.paths import SlicedPart
from slicer.slice import slice_part
from tests.machine.moves import moves_of, program_of

LEANING = np.array([0.0, np.sin(np.radians(25.0)), np.cos(np.radians(25.0))])
LIGHT = ["process.walls=1", "process.infill_density=0.05", "process.layer_height_mm=0.4"]  # a sixth of the lines


def _tilting(name: str) -> bool:
    try:
        return load(machine=name).machine.tilts
    except ProfileError:
        return False


EVERY = pytest.mark.parametrize("machine", [name for name in shipped("machine") if _tilting(name)])


def _post(profile: Profile, low_mm: float = 26.0) -> Decomposition:
    """A post of 9 x 9 mm in two parts, the upper one printed leaning by 25 degrees from low_mm."""
    solid, plane = m3.Manifold.cube((9.0, 9.0, low_mm + 8.0)).translate((-4.5, -4.5, 0.0)), Plane(LEANING, low_mm * LEANING[2])
    above, below = cut(solid, plane)
    leaning = [pose for pose in poses(profile.machine, LEANING) if profile.machine.tilts]
    best = allowed_poses(profile.machine, LEANING, mesh_of(above).vertices) or leaning
    parts = []
    for index, (base, piece, pose) in enumerate(((PLATFORM, below, level(profile.machine)), (plane, above, best[0])), start=1):
        mesh = mesh_of(piece)
        parts.append(Part(index, mesh, base, pose, rotation(profile.machine, pose), mesh.volume_mm3, 0.0))
    return Decomposition("post", mesh_of(solid), tuple(parts), 1, "classic", 0.0, 0.0, 0, 0, 0.0)


@cache
def _planned(name: str) -> tuple[Profile, Decomposition, tuple[SlicedPart, ...], MachineProgram]:
    profile = load(machine=name, settings=LIGHT)
    decomposition = _post(profile)
    sliced = _sliced(decomposition, profile)
    return profile, decomposition, sliced, plan(decomposition, sliced, profile)


def _sliced(decomposition: Decomposition, profile: Profile) -> tuple[SlicedPart, ...]:
    parts = decomposition.parts
    return tuple(slice_part(part, profile, parts[:k], parts[k + 1 :]) for k, part in enumerate(parts))


@cache
def _text(name: str) -> tuple[str, ...]:
    profile, _, _, program = _planned(name)
    return tuple(write_gcode(program, profile))


def _errors(lines: list[str], name: str) -> list[str]:
    return [f.code for f in dry_run(lines, _planned(name)[0]).findings if f.severity == "error"]


@EVERY
def test_without_a_fault_there_is_no_error(machine: str) -> None:
    assert _errors(list(_text(machine)), machine) == []


@EVERY
def test_an_axis_over_its_limit_is_found(machine: str) -> None:
    lines, most = list(_text(machine)), _planned(machine)[0].machine.x.limits_mm[1]
    k = next(k for k, line in enumerate(lines) if re.match(r"G[01] X", line))
    lines[k] = re.sub(r"X-?[0-9.]+", f"X{most + 5:.3f}", lines[k])
    assert "axis-limit" in _errors(lines, machine)


@EVERY
def test_a_plane_cut_too_low_for_the_head_is_found(machine: str) -> None:
    profile = _planned(machine)[0]
    bare = profile.model_copy(update={"machine": _bare(profile.machine)})
    low = _post(bare, 3.0)
    program = plan(low, _sliced(low, bare), bare)
    assert "collision" in _errors(list(write_gcode(program, profile)), machine)


def _bare(machine: Machine) -> Machine:
    """The machine as seen by a planner that knows no part of the head except its tip."""
    head = machine.head.model_copy(update={"silhouette_mm": [(0.1, 0.0)], "boxes": []})
    return machine.model_copy(update={"head": head})


@EVERY
def test_swapped_parts_are_found(machine: str) -> None:
    profile, decomposition, sliced, _ = _planned(machine)
    codes = _errors(list(write_gcode(plan(decomposition, sliced[::-1], profile), profile)), machine)
    assert {"order", "air"} <= set(codes)


@EVERY
def test_a_missing_retraction_is_found(machine: str) -> None:
    lines = list(_text(machine))
    turn = [k for k, line in enumerate(lines) if line.startswith(";PART:")][1]
    ends = max(k for k in range(turn) if lines[k] == ";WIPE_END")
    begins = max(k for k in range(ends) if lines[k] == ";WIPE_START")
    still = [re.sub(r" [EU]-?[0-9.]+", "", line) for line in lines[begins:ends]]
    assert still != lines[begins:ends]
    assert set(_errors(lines[:begins] + still + lines[ends:], machine)) == {"retraction"}


@EVERY
def test_a_shifted_centre_is_found(machine: str) -> None:
    profile, decomposition, sliced, _ = _planned(machine)
    x, y, z = profile.machine.tilt.point_mm
    tilt = profile.machine.tilt.model_copy(update={"point_mm": (x + 2.0, y + 2.0, z + 2.0)})
    changed = profile.model_copy(update={"machine": profile.machine.model_copy(update={"tilt": tilt})})
    assert "centre" in _errors(list(write_gcode(plan(decomposition, sliced, changed), changed)), machine)


@EVERY
def test_a_missing_heater_off_command_is_found(machine: str) -> None:
    lines = list(_text(machine))
    off = [k for k, line in enumerate(lines) if re.match(r"(M104 S0|M568 .*S0|M104 P0|M68 E0 Q0|G10 .*S0)\b", line)]
    assert off
    assert "heater-on" in _errors([line for k, line in enumerate(lines) if k not in off], machine)


@EVERY
def test_a_flipped_sign_of_the_tilt_is_found(machine: str) -> None:
    profile, decomposition, sliced, _ = _planned(machine)
    tilt = profile.machine.tilt.model_copy(update={"sign": -profile.machine.tilt.sign, "limits_deg": (-360.0, 360.0)})
    changed = profile.model_copy(update={"machine": profile.machine.model_copy(update={"tilt": tilt})})
    program = program_of("flipped", moves_of(plan(decomposition, sliced, profile)))
    codes = _errors(list(write_gcode(program, changed)), machine)
    assert "sign" in codes


@EVERY
def test_a_tilt_word_with_the_wrong_sign_is_found(machine: str) -> None:
    lines, letter = list(_text(machine)), _planned(machine)[0].machine.tilt.letter
    pose = [m for m in moves_of(_planned(machine)[3]) if isinstance(m, BeginPart)][1].pose
    assert pose != level(_planned(machine)[0].machine)
    word = f"{pose.tilt_deg:.4f}"
    flipped = [
        line if line.startswith(";") else line.replace(f"{letter}{word}", f"{letter}{-pose.tilt_deg:.4f}") for line in lines
    ]
    flipped = [line.replace(f"MOVE={word}", f"MOVE={-pose.tilt_deg:.4f}") if "MOVE=" in line else line for line in flipped]
    assert flipped != lines
    assert set(_errors(flipped, machine)) & {"pose"}
