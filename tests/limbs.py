"""Test models with limbs that are printed beside other standing limbs."""

from collections.abc import Sequence
from functools import cache

import manifold3d as m3
import numpy as np

from machine.dryrun import dry_run
from machine.dryrun.dryrun import DryRun
from machine.gcode.writer import write_gcode
from machine.planning.moves import BeginLayer, MachineProgram, Reorient
from machine.planning.plan import plan
from machine.planning.stops import Stop
from mdp.decomposition import Decomposition
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane
from mdp.search.parts import decomposition_of, make_parts
from mdp.search.problem import Problem
from profiles.profile import Profile, load
from slicer.paths import SlicedPart
from slicer.slice import slice_parts
from tests.machine.moves import Stroke, Travel, Wipe, moves_of
from tests.shapes import from_manifold

UP = (0.0, 0.0, 1.0)
LEANING = (np.sin(np.radians(45.0)), 0.0, np.cos(np.radians(45.0)))


def limb(mesh: Mesh, near_mm: Sequence[Sequence[float]], through_mm: Sequence[float], normal: Sequence[float] = UP) -> Plane:
    """A plane through a point that cuts off the limbs containing the vertices nearest to some points."""
    nearest = [mesh.vertices[np.argmin(np.linalg.norm(mesh.vertices - point, axis=1))] for point in np.array(near_mm)]
    return Plane(np.array(normal), float(np.dot(normal, through_mm)), np.array(nearest))


def decomposed(mesh: Mesh, profile: Profile, *planes: Plane) -> Decomposition:
    """A mesh cut by planes; the part of the first plane is printed last."""
    problem = Problem(mesh, profile)
    node = problem.root
    for plane in planes:
        cut = problem.cut(node, plane)
        assert cut is not None
        node = cut
    return decomposition_of(problem, "limbs", make_parts(problem, node), ())


def posts(*at_mm: float, height_mm: float = 20.0, bar_mm: float = 0.0) -> Mesh:
    """Square posts, 8 mm wide, in a row on a plate 4 mm thick; with bar_mm, each carries a bar of that length."""
    solid = m3.Manifold.cube((110.0, 30.0, 4.0), True).translate((0.0, 0.0, 2.0))
    for x in at_mm:
        solid += m3.Manifold.cube((8.0, 8.0, height_mm + 2.0), True).translate((x, 0.0, 3.0 + 0.5 * height_mm))
        if bar_mm:
            solid += m3.Manifold.cube((bar_mm, 8.0, 4.0), True).translate((x, 0.0, 2.0 + height_mm))
    return from_manifold(solid)


def outer_posts(profile: Profile, base_mm: float = 6.0) -> Decomposition:
    """Three posts up to 24 mm; above base_mm the outer two are printed together beside the middle one."""
    mesh = posts(-35.0, 0.0, 35.0)
    return decomposed(mesh, profile, limb(mesh, [(-35.0, 0.0, 24.0), (35.0, 0.0, 24.0)], (0.0, 0.0, base_mm)))


def between_layers(profile: Profile) -> Decomposition:
    """The three posts of `outer_posts`, cut in the middle of a 0.2 mm layer."""
    return outer_posts(profile, 6.1)


def leaning_arm(profile: Profile) -> Decomposition:
    """An arm leaning by 45 degrees, printed along its axis beside a tower of 50 mm that reaches 31 mm above the arm's base
    plane."""
    solid = m3.Manifold.cube((80.0, 90.0, 4.0), True).translate((0.0, 0.0, 2.0))
    solid += m3.Manifold.cube((14.0, 14.0, 16.0), True).translate((0.0, -25.0, 8.0))
    solid += m3.Manifold.cylinder(40.0, 4.0, 4.0, 32).rotate((0.0, 45.0, 0.0)).translate((0.0, -25.0, 10.0))
    solid += m3.Manifold.cube((8.0, 8.0, 50.0), True).translate((20.0, 20.0, 25.0))
    mesh, base = from_manifold(solid), np.array([0.0, -25.0, 10.0]) + 14.0 * np.array(LEANING)
    return decomposed(mesh, profile, limb(mesh, [(28.0, -25.0, 38.0)], base.tolist(), LEANING))


MODELS = {"outer posts": outer_posts, "outer posts, cut between layers": between_layers, "leaning arm": leaning_arm}


@cache
def sliced(model: str) -> tuple[Profile, Decomposition, tuple[SlicedPart, ...]]:
    """A model's parts sliced with sparse infill, without the purge line."""
    profile = load(settings=["process.infill_density=0.1", "machine.purge_mm=0"])
    decomposition = MODELS[model](profile)
    return profile, decomposition, slice_parts(decomposition.parts, profile)


def printed(model: str, stops: Sequence[Stop] = ()) -> tuple[MachineProgram, DryRun]:
    """A model's program and its dry run."""
    profile, decomposition, pieces = sliced(model)
    program = plan(decomposition, pieces, profile, stops)
    return program, dry_run(list(write_gcode(program, profile)), profile)


def moved_part(program: MachineProgram, index: int) -> tuple[Floats, Floats]:
    """(n, 3) starts and ends of a part's straight moves, from its first layer to the next part or table turn."""
    begun = False
    starts, ends = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for move in moves_of(program):
        if isinstance(move, BeginLayer):
            begun = move.part == index
        elif isinstance(move, Reorient):
            begun = False
        elif begun and isinstance(move, Stroke | Travel | Wipe):
            starts.append(move.points_mm[:-1])
            ends.append(move.points_mm[1:])
    return np.concatenate(starts), np.concatenate(ends)
