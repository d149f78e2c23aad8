"""At the end of a print the tip is retracted, above and beside the print, on every machine."""

import manifold3d as m3
import numpy as np
import pytest

from machine.dryrun import dry_run
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind
from machine.gcode.writer import write_gcode
from machine.kinematics.collision import hull, solids
from machine.kinematics.table import machine_points, workpiece_points
from machine.planning.moves import MachineProgram
from machine.planning.plan import plan
from machine.planning.stand import BESIDE_MM
from mdp.clearance import allowed_poses
from mdp.decomposition import Decomposition
from mdp.plane import PLATFORM, Plane
from mdp.pose import UP, Pose, level
from profiles.places import shipped
from profiles.profile import Profile, load
from tests.machine.hand import part, squares
from tests.shapes import from_manifold

MACHINES = sorted(shipped("machine"))
OUTLINE_MM = BESIDE_MM - 2.0  # of the centrelines of the beads


def program_of(machine: str, upright: bool) -> tuple[Profile, MachineProgram]:
    """A post 30 mm high; unless it is upright, its top is cut off at a slant and printed with the table tilted."""
    profile = load(machine=machine, settings=["machine.purge_mm=0"])
    post, slant = m3.Manifold.cube((10.0, 10.0, 30.0)).translate((-5.0, -5.0, 0.0)), np.radians(20.0)
    plane = Plane(np.array([np.sin(slant), 0.0, np.cos(slant)]), 22.0)
    top, rest = post.split_by_plane(tuple(plane.normal), plane.offset_mm)
    parts = [part(1, from_manifold(post if upright else rest), PLATFORM, level(profile.machine), profile.machine)]
    if not upright:
        mesh = from_manifold(top)
        parts.append(part(2, mesh, plane, allowed_poses(profile.machine, plane.normal, mesh.vertices)[0], profile.machine))
    whole = Decomposition("post", from_manifold(post), tuple(parts), len(parts), "classic", 100.0, 0.0, 0, 1, 0.0)
    layers = {1: 150 if upright else 105, 2: 5}
    return profile, plan(whole, [squares(piece, profile, layers[piece.index]) for piece in parts], profile)


ENDS = [(machine, upright) for machine in MACHINES for upright in (True, False) if upright or load(machine=machine).machine.tilts]


@pytest.mark.parametrize(("machine", "upright"), ENDS)
def test_the_end_block_runs_with_the_tip_next_to_the_print_and_above_everything(machine: str, upright: bool) -> None:
    profile, program = program_of(machine, upright)
    lines = list(write_gcode(program, profile))
    parsed = parse_gcode(lines, profile.machine)
    end, strokes = parsed.end[-1], parsed.kind == MoveKind.EXTRUDE
    pose = Pose(end[3], end[4])
    assert pose == level(profile.machine)
    pulled_mm = float(parsed.filament_mm[strokes][-1] - parsed.filament_mm[-1])
    assert pulled_mm == pytest.approx(profile.material.retract_mm, abs=1e-3)
    laid = np.vstack([workpiece_points(profile.machine, Pose(*row[3:5]), row[None, :3]) for row in parsed.end[strokes]])
    standing = machine_points(profile.machine, pose, laid)[:, :2]
    assert np.maximum(standing.min(axis=0) - end[:2], end[:2] - standing.max(axis=0)).max() > OUTLINE_MM
    highest = max(float(reach_of(UP[None])[0]) for _, reach_of in solids(profile.machine, pose, hull(laid, 0.3)))
    assert end[2] >= min(highest + profile.machine.lift_mm, profile.machine.z.limits_mm[1]) - 0.5
    assert not [finding for finding in dry_run(lines, profile).findings if finding.code in ("collision", "limits")]


def test_the_distance_to_a_finished_print_is_measured_from_the_beads_not_their_centre_lines() -> None:
    profile, program = program_of("generic_ac", True)
    middles = program.points_mm[np.repeat(program.is_stroke, np.diff(program.starts)), :2]
    end = program.points_mm[-1, :2]
    away_mm = np.maximum(middles.min(axis=0) - end, end - middles.max(axis=0)).max()
    assert away_mm == pytest.approx(BESIDE_MM + 0.5 * profile.process.line_width_mm)
