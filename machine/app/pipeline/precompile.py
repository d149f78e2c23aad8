"""Precompile: the first run ever compiles the kernels with a tiny model, in two processes; later runs find them cached.

The search's kernels and those that make and try a program take about the same time. Where both are needed another process
compiles the latter, while this one compiles the former and searches. Where only the search is, they share its kernels.
"""

import atexit
import os
import subprocess
import sys
from threading import Thread
from time import perf_counter

import manifold3d as m3
import numpy as np

from machine.app.pictures.raster import draw
from machine.app.terminal.progress import say
from machine.dryrun.conformity.agreement import agreement
from machine.dryrun.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.planning.plan import plan
from mdp.cost.cost import CostTerms, measure_seam
from mdp.cost.forecast import Surface
from mdp.cost.hidden import hidden_shares
from mdp.cut import cut, mesh_of
from mdp.decomposition import Decomposition, Part
from mdp.kernels.cache import mark, note_unwritten, trouble
from mdp.overhang import risky_upright, threshold
from mdp.plane import PLATFORM, Plane
from mdp.pose import level, poses, rotation
from mdp.search.parts import one_piece
from mdp.support_need.need import SupportNeed
from mdp.sweep.hopeless import Savers, hopeless_faces
from mdp.sweep.sweep import Remainder, gains, sweep
from profiles.profile import Profile, load
from slicer.estimate.estimate import estimate
from slicer.slice import slice_part

SEARCH, PROGRAM, DRY_RUN, PICTURE = "search", "program", "dry-run", "picture"
LEANING = np.array([0.0, np.sin(0.2), np.cos(0.2)])
PLANE = Plane(LEANING, 20.0)

_others: list["subprocess.Popen[bytes]"] = []


def compile_search(program_too: bool) -> None:
    """Return when the kernels of the search are compiled; those for a program may be under way then: see compile_program."""
    needed = [what for what in ((SEARCH, PROGRAM) if program_too else (SEARCH,)) if not mark(what).exists()]
    if not needed:
        return
    began = _tell()
    _start(needed[-1])
    if SEARCH in needed:
        _sweep()
        if len(needed) > 1:
            _beside_sweep()
        else:
            _finish(SEARCH)
        _keep(SEARCH)
        say(f"compiled what the search needs in {perf_counter() - began:.0f} s")


def compile_program(profile: Profile) -> None:
    """Return when the kernels that make and try a program are compiled."""
    if mark(PROGRAM).exists():
        return
    if not _others:
        began = _tell()
        _program(profile)
        _keep(PROGRAM)
        say(f"compiled in {perf_counter() - began:.0f} s")
    elif _finish(PROGRAM):
        _keep(PROGRAM)


def announce_dry_run_compilation() -> None:
    """Say that a dry run compiles its kernels, where it does, once."""
    if not (mark(PROGRAM).exists() or mark(DRY_RUN).exists()):
        _tell()
        _keep(DRY_RUN)


def compile_pictures() -> None:
    """Return when the kernels that draw are compiled."""
    if not mark(PICTURE).exists():
        began = _tell()
        draw([mesh_of(_tee())], [(128.0, 128.0, 128.0)], size=(32, 32))
        _keep(PICTURE)
        say(f"compiled what pictures need in {perf_counter() - began:.0f} s")


def _tell() -> float:
    say("compiling the kernels (only the first run does)")
    return perf_counter()


def _keep(what: str) -> None:
    cached = mark(what)
    if trouble():
        return
    try:
        cached.parent.mkdir(parents=True, exist_ok=True)
        cached.touch()
    except OSError as error:
        note_unwritten(cached.parent, error)


def _start(what: str) -> None:
    """Compile in another process, which ends with this one: whatever ends it, the pipe between them is closed then."""
    command = [sys.executable, "-m", "machine.app.pipeline.precompile", what]
    _others.append(subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL))
    atexit.register(_others[-1].kill)


def _finish(what: str) -> bool:
    """Wait for the other process; False where it failed: then the work itself compiles what is missing."""
    other = _others.pop()
    done = other.wait() == 0
    if not done:
        say(f"compiling the kernels for the {what} beside the work failed; the work compiles them itself")
    return done


def _remainder() -> Remainder:
    mesh = mesh_of(_tee())
    return Remainder(mesh, risky_upright(mesh, 45.0))


def _tee() -> m3.Manifold:
    bar = m3.Manifold.cube((30.0, 4.0, 4.0), True).translate((0.0, 0.0, 28.0))
    return m3.Manifold.cube((4.0, 4.0, 30.0), True).translate((0.0, 0.0, 15.0)) + bar


def _fin() -> m3.Manifold:
    """A fin of the tee, thinner and thinner, for walls of varying width."""
    outline = np.array([[0.0, -0.8], [9.0, -0.2], [9.0, 0.2], [0.0, 0.8]])
    return m3.Manifold.extrude(m3.CrossSection([outline]), 12.0)


def _sweep() -> None:
    """The largest kernel, and those that lay out a surface for it."""
    sweep(_remainder(), LEANING[None], 1.0)


def _beside_sweep() -> None:
    """The other kernels of the search, and those of the estimate that it chooses by."""
    profile = load()
    estimate(one_piece(mesh_of(_tee()), profile.machine), profile)
    remainder = _remainder()
    gains(remainder, LEANING[None], 1.0, threshold(45.0))
    hopeless_faces(remainder.facets, Savers(LEANING[None], np.zeros(1), threshold(45.0)))
    remainder.thin_mm(PLANE)
    hidden_shares(remainder.mesh)
    SupportNeed.of(remainder.mesh, load().process, 1.0).along(LEANING[None])
    measure_seam(remainder.mesh, remainder.mesh.areas_mm2, PLANE, 0.0)
    Surface.of(remainder, CostTerms(45.0, False)).left_mm2([PLANE])


def _program(profile: Profile) -> None:
    """Slice, plan, write and dry-run a tee in two parts."""
    coarse = {"layer_height_mm": 0.3, "line_width_mm": 0.6, "first_layer_height_mm": 0.3, "support": "auto", "walls": 2}
    profile = profile.model_copy(update={"process": profile.process.model_copy(update=coarse)})
    solid = _tee() + _fin()
    above, below = cut(solid, PLANE)
    parts = []
    for index, (base, piece) in enumerate(((PLATFORM, below), (PLANE, above)), start=1):
        leaning = poses(profile.machine, LEANING)
        pose = leaning[0] if leaning and index > 1 else level(profile.machine)
        mesh = mesh_of(piece)
        parts.append(Part(index, mesh, base, pose, rotation(profile.machine, pose), mesh.volume_mm3, 0.0))
    decomposition = Decomposition("warm", mesh_of(solid), tuple(parts), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    sliced = [slice_part(part, profile, parts[:k], parts[k + 1 :]) for k, part in enumerate(parts)]
    run = dry_run(list(write_gcode(plan(decomposition, sliced, profile), profile)), profile)
    agreement(run, decomposition.mesh, profile)


def _end_with_parent() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


if __name__ == "__main__":
    Thread(target=_end_with_parent, daemon=True).start()
    if sys.argv[1] == SEARCH:
        _beside_sweep()
    else:
        _program(load())
