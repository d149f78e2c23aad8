"""Precompile: exercises on tiny models, in bundles, that compile the kernels of a first run.

A bundle does what the command does later, and so compiles exactly the kernels that will be called; later runs find them cached.
The processes are those of `machine.pipeline.compilers`.
"""

import gc
import os
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import manifold3d as m3
import numpy as np

from machine.dryrun.agreement import agreement
from machine.dryrun.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.pipeline.choice import pricing
from machine.pipeline.raster import draw
from machine.planning.plan import plan
from mdp.clearance import passes_clear
from mdp.cost.cost import CostTerms
from mdp.cost.forecast import Forecast
from mdp.cost.hidden import hidden_shares
from mdp.cut import cut, mesh_of
from mdp.decomposition import Decomposition, Part
from mdp.kernels.cache import trouble
from mdp.kernels.kernel import on_compiled
from mdp.kernels.workers import tell
from mdp.overhang import risky_upright, threshold
from mdp.plane import PLATFORM, Plane
from mdp.pose import level, poses, rotation
from mdp.search.search import SearchRequest, decompose
from mdp.support_need.need import SupportNeed
from mdp.sweep.crossing import measure_rim
from mdp.sweep.limbs import LimbGrid, find_limbs, limb_reach, sum_limbs
from mdp.sweep.sweep import Remainder, gains, sweep, unavoidable_faces
from profiles.profile import Profile, load
from slicer.slice import slice_part

LEANING = np.array([0.0, np.sin(0.2), np.cos(0.2)])
PLANE = Plane(LEANING, 20.0)
COARSE = {"layer_height_mm": 0.3, "line_width_mm": 0.6, "first_layer_height_mm": 0.3, "support": "auto", "walls": 2}
NO_COLLECTION = 100_000  # numba leaves little garbage, and collecting it takes a tenth of the time

PROGRAM = """;LAYER_CHANGE
;TYPE:Outer wall
;WIDTH:0.4
;HEIGHT:0.2
G21
G90
M83
G92 E0
G1 X-2 Y-2 Z0.2 F3000
G1 X2 Y-2 E0.2 F1200
G1 X2 Y2 E0.2
G3 X-2 Y2 I-2 J0 E0.2
G1 X-2 Y-2 E0.2
G1 E-1 F1800
G1 Z1 F3000
"""


def _judge() -> None:
    """Steps for every model: support need, print time, and places that hide seams."""
    profile = load()
    decompose(
        mesh_of(m3.Manifold.cube((8.0, 8.0, 3.0), True).translate((0.0, 0.0, 1.5))),
        "warm",
        profile,
        SearchRequest(price=pricing(profile)),
    )
    mesh = mesh_of(_tee())
    SupportNeed.of(mesh, profile.process, 1.0).along(LEANING[None])
    hidden_shares(mesh)


def _sweep() -> None:
    """The largest kernel of the search, and those that prepare a surface for it."""
    sweep(_remainder(), LEANING[None], 1.0)


def _search() -> None:
    """The other kernels of the search."""
    remainder = _remainder()
    gains(remainder, LEANING[None], 1.0, threshold(45.0))
    unavoidable_faces(remainder, LEANING[None], np.zeros(1), threshold(45.0))
    remainder.thin_mm(PLANE)
    measure_rim(remainder.mesh, remainder.mesh.areas_mm2, PLANE, 0.0)
    terms = CostTerms(45.0, False)
    Forecast.of(remainder, terms).left_mm2([PLANE])
    Forecast.of(remainder, terms, remainder.mesh.areas_mm2).parts([PLANE])
    _limbs(remainder)


def _limbs(remainder: Remainder) -> None:
    """Kernels of cuts that remove single limbs."""
    row = np.zeros(1)
    find_limbs(remainder, LimbGrid(LEANING[None], 1.0, row, np.zeros((1, 0, 2)), 0.8, 20.0, 5.0, 100.0, 4.0, 2.0), -0.7)
    limb = replace(PLANE, limbs_mm=remainder.mesh.vertices[:1])
    sum_limbs(remainder, [limb], -0.7, 2.0)
    limb_reach(remainder, limb)
    profile, corners = load(), remainder.mesh.vertices[remainder.mesh.faces]
    passes_clear(profile.machine, level(profile.machine), (corners, corners + np.array([60.0, 0.0, 0.0])), 0.0)


def _slice() -> None:
    """Slice a tee in two parts, plan its moves and write them."""
    profile = _coarse()
    decomposition = _two_parts(profile)
    parts = decomposition.parts
    sliced = [slice_part(part, profile, parts[:k], parts[k + 1 :]) for k, part in enumerate(parts)]
    write_gcode(plan(decomposition, sliced, profile), profile)


def _dry_run() -> None:
    """Read a short program, dry-run it and compare it with a model."""
    profile = _coarse()
    run = dry_run(PROGRAM.splitlines(), profile)
    agreement(run, mesh_of(m3.Manifold.cube((4.0, 4.0, 1.0), True)), profile)


def _draw() -> None:
    draw([mesh_of(_tee())], [(128.0, 128.0, 128.0)], size=(32, 32))


BUNDLES: dict[str, Callable[[], None]] = {
    "judge": _judge,
    "sweep": _sweep,
    "search": _search,
    "slice": _slice,
    "dry-run": _dry_run,
    "draw": _draw,
}


def _coarse() -> Profile:
    profile = load()
    return profile.model_copy(update={"process": profile.process.model_copy(update=COARSE)})


def _remainder() -> Remainder:
    mesh = mesh_of(_tee())
    return Remainder(mesh, risky_upright(mesh, 45.0))


def _tee() -> m3.Manifold:
    bar = m3.Manifold.cube((30.0, 4.0, 4.0), True).translate((0.0, 0.0, 28.0))
    return m3.Manifold.cube((4.0, 4.0, 30.0), True).translate((0.0, 0.0, 15.0)) + bar


def _fin() -> m3.Manifold:
    """A tapering fin of the tee, for walls of variable width."""
    outline = np.array([[0.0, -0.8], [9.0, -0.2], [9.0, 0.2], [0.0, 0.8]])
    return m3.Manifold.extrude(m3.CrossSection([outline]), 12.0)


def _two_parts(profile: Profile) -> Decomposition:
    solid = _tee() + _fin()
    above, below = cut(solid, PLANE)
    parts = []
    for index, (base, piece) in enumerate(((PLATFORM, below), (PLANE, above)), start=1):
        leaning = poses(profile.machine, LEANING)
        pose = leaning[0] if leaning and index > 1 else level(profile.machine)
        mesh = mesh_of(piece)
        parts.append(Part(index, mesh, base, pose, rotation(profile.machine, pose), mesh.volume_mm3, 0.0))
    return Decomposition("warm", mesh_of(solid), tuple(parts), 1, "classic", 0.0, 0.0, 0, 0, 0.0)


@cache
def _prepare() -> None:
    """Prepare a process for its first bundle."""
    gc.freeze()
    gc.set_threshold(NO_COLLECTION)
    on_compiled(_tell_kernel)


def _tell_kernel() -> None:
    """Report a compiled kernel, or exit when it cannot be cached and so cannot help the caller."""
    if trouble():
        os._exit(1)
    tell("a kernel")


def compile_bundle(name: str) -> None:
    """In a worker: compile a bundle and report each kernel. Raises OSError when compiled kernels cannot be cached."""
    _prepare()
    BUNDLES[name]()
    if trouble():
        raise OSError(trouble())
