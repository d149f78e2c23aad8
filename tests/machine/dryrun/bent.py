"""A small print of three parts, sliced as for a user: a foot, a neck that leans from it, a head that leans from the neck."""

from functools import cache

import manifold3d as m3
import numpy as np

from machine.gcode.writer import write_gcode
from machine.planning.plan import plan
from mdp.clearance import allowed_poses
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.plane import PLATFORM, Plane
from mdp.pose import level
from profiles.profile import Profile, load
from slicer.slice import slice_parts
from tests.machine.hand import part
from tests.shapes import from_manifold

FOOT = m3.Manifold.cube((11.0, 9.0, 14.0)).translate((-5.5, -4.5, 0.0))
NECK = m3.Manifold.cube((7.0, 5.0, 9.0)).translate((-3.0, -2.5, 0.0)).rotate((0.0, 15.0, 0.0)).translate((0.0, 0.0, 8.0))
HEAD = m3.Manifold.cube((5.0, 4.0, 5.0)).translate((-2.5, -2.0, 0.0)).rotate((-10.0, 8.0, 0.0)).translate((2.0, 0.0, 13.5))


def leaning(tilt_x_deg: float, tilt_y_deg: float, through: tuple[float, float, float]) -> Plane:
    """The plane through a point whose normal is z turned about x, then about y."""
    a, b = np.radians([tilt_x_deg, tilt_y_deg])
    normal = np.array([np.sin(b) * np.cos(a), -np.sin(a), np.cos(b) * np.cos(a)])
    return Plane(normal, float(normal @ through))


NECK_BASE, HEAD_BASE = leaning(0.0, 15.0, (0.0, 0.0, 8.0)), leaning(-10.0, 8.0, (2.0, 0.0, 13.5))


@cache
def bent(machine: str) -> tuple[Profile, Mesh, tuple[str, ...]]:
    """Profile, model and G-code of the three parts for a machine."""
    profile = load(machine=machine)
    foot = FOOT.trim_by_plane(-NECK_BASE.normal, -NECK_BASE.offset_mm)
    neck = NECK.trim_by_plane(-HEAD_BASE.normal, -HEAD_BASE.offset_mm)
    meshes = [from_manifold(solid) for solid in (foot, neck, HEAD)]
    bases = (PLATFORM, NECK_BASE, HEAD_BASE)
    poses = [level(profile.machine)]
    poses += [allowed_poses(profile.machine, b.normal, m.vertices)[0] for b, m in zip(bases[1:], meshes[1:], strict=True)]
    parts = tuple(part(k + 1, mesh, bases[k], poses[k], profile.machine) for k, mesh in enumerate(meshes))
    whole = from_manifold(foot + neck + HEAD)
    decomposition = Decomposition("bent", whole, parts, 2, "classic", 100.0, 0.0, 0, 1, 0.0)
    sliced = slice_parts(parts, profile)
    return profile, whole, tuple(write_gcode(plan(decomposition, sliced, profile), profile))
