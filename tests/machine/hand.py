"""A hand-made print of two parts: a post on the build plate and an arm printed from its side."""

from functools import cache

import manifold3d as m3
import numpy as np

from machine.dryrun.dryrun import DryRun
from machine.gcode.writer import write_gcode
from machine.planning.moves import MachineProgram
from machine.planning.plan import plan
from mdp.clearance import allowed_poses
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Mesh
from mdp.plane import PLATFORM, Plane
from mdp.pose import Pose, level, rotation
from profiles.machine import Machine
from profiles.profile import Profile, load
from slicer.paths import Kind, Layer, Path, SlicedPart
from tests.shapes import from_manifold

SIDE = Plane(np.array([1.0, 0.0, 0.0]), 5.0)
NO_APPROACH = np.zeros((0, 2))


def post_and_arm(machine: Machine, height: float = 60.0, reach: float = 10.0) -> Decomposition:
    """A 10 x 10 post and an arm 10 x 10 that leaves its +x side at the top."""
    post = m3.Manifold.cube((10.0, 10.0, height)).translate((-5.0, -5.0, 0.0))
    arm = m3.Manifold.cube((reach, 10.0, 10.0)).translate((5.0, -5.0, height - 10.0))
    meshes = [from_manifold(solid) for solid in (post, arm)]
    poses = [level(machine), allowed_poses(machine, SIDE.normal, meshes[1].vertices)[0]]
    parts = [
        part(k + 1, mesh, base, poses[k], machine) for k, (mesh, base) in enumerate(zip(meshes, (PLATFORM, SIDE), strict=True))
    ]
    return Decomposition("post and arm", from_manifold(post + arm), tuple(parts), 2, "classic", 100.0, 0.0, 0, 1, 0.0)


def part(index: int, mesh: Mesh, base: Plane, pose: Pose, machine: Machine) -> Part:
    return Part(index, mesh, base, pose, rotation(machine, pose), mesh.volume_mm3, 0.0)


def squares(piece: Part, profile: Profile, layers: int = 3) -> SlicedPart:
    """Two squares in each layer along the part's bounding box: the outer one reached with a retraction, the inner one without."""
    process, material = profile.process, profile.material
    add_c = material.first_layer_nozzle_c - material.nozzle_c if piece.on_plate else 0.0
    lo, hi = piece.in_part_frame().bounds_mm
    layers_made = []
    for k in range(layers):
        paths = []
        for kind, inset in ((Kind.OUTER_WALL, 0.5), (Kind.INNER_WALL, 1.5)):
            x0, y0, x1, y1 = lo[0] + inset * 0.45, lo[1] + inset * 0.45, hi[0] - inset * 0.45, hi[1] - inset * 0.45
            ring = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]])
            paths.append(Path(kind, ring, process.line_width_mm, 40.0, 1.0, NO_APPROACH, kind is Kind.OUTER_WALL))
        layers_made.append(Layer.of((k + 1) * 0.2, 0.2, tuple(paths), 0.0 if k == 0 else 1.0, add_c if k == 0 else 0.0))
    return SlicedPart(piece.index, tuple(layers_made))


@cache
def printed(
    machine: str = "generic_ac", layers: int = 3
) -> tuple[Profile, Decomposition, tuple[SlicedPart, ...], MachineProgram]:
    """Profile, decomposition, sliced parts and program of the post and the arm."""
    profile = load(machine=machine, settings=["machine.purge_mm=0"])  # the purge line has its own tests
    decomposition = post_and_arm(profile.machine)
    sliced = tuple(squares(piece, profile, layers) for piece in decomposition.parts)
    return profile, decomposition, sliced, plan(decomposition, sliced, profile)


@cache
def text(machine: str = "generic_ac", layers: int = 3) -> tuple[str, ...]:
    """The G-code of the post and the arm."""
    profile, _, _, program = printed(machine, layers)
    return tuple(write_gcode(program, profile))


@cache
def whole(machine: str = "generic_ac") -> tuple[Profile, tuple[str, ...]]:
    """Profile and G-code of a post printed to its full height, 60 mm, and the arm on its side."""
    profile = load(machine=machine, settings=["machine.purge_mm=0"])  # the purge line has its own tests
    decomposition = post_and_arm(profile.machine)
    sliced = [squares(piece, profile, layers) for piece, layers in zip(decomposition.parts, (300, 5), strict=True)]
    return profile, tuple(write_gcode(plan(decomposition, sliced, profile), profile))


def segment_types(run: DryRun) -> list[str]:
    """The type of each deposited segment of a dry run."""
    return [run.program.types[k] for k in run.program.type[run.segment_row]]
