"""Warm-up: loads the compiled kernels with a tiny model; the first run ever compiles them, in two processes, and says so."""

import subprocess
import sys
import threading
from pathlib import Path
from time import perf_counter

import manifold3d as m3
import numpy as np

from machine.app.progress import say
from machine.dryrun.dryrun import dry_run
from machine.gcode import write_gcode
from machine.plan import plan
from mdp.cut import cut, mesh_of
from mdp.decomposition import Decomposition, Part
from mdp.overhang import risky_upright, threshold
from mdp.plane import PLATFORM, Plane
from mdp.pose import level, poses, rotation
from mdp.search import decompose
from mdp.sweep import Remainder, gains, sweep, sweep_kernel
from profiles.profile import Profile, load
from slicer.slice import slice_part

LEANING = np.array([0.0, np.sin(0.2), np.cos(0.2)])
COMPILING_AFTER_S = 4.0  # loading kernels that are compiled takes less; the cache may be an older version's


def warm(profile: Profile) -> None:
    """Bring all kernels of a print into memory, compiling them where no earlier run has left them on disk."""
    began = perf_counter()
    other: list[subprocess.Popen[bytes]] = []

    def compiling() -> None:
        say("compiling the kernels (only the first run does)")
        other.append(subprocess.Popen([sys.executable, "-m", "machine.app.warmup"], stderr=subprocess.DEVNULL))

    timer = threading.Timer(COMPILING_AFTER_S if _compiled_before() else 0.0, compiling)
    timer.daemon = True
    timer.start()
    try:
        # The largest kernel first: meanwhile the other process compiles what comes after it.
        sweep(_remainder(), LEANING[None], 1.0)
        few = profile.search.model_copy(update={"directions": 8, "beam_width": 1, "most_parts": 2})
        decompose(mesh_of(_tee()), "warm", profile.model_copy(update={"search": few}))
        for process in other:
            process.wait()
        _print(profile)
    finally:
        timer.cancel()
        timer.join()
        for process in other:
            process.kill()
            process.wait()
    if other:
        say(f"compiled in {perf_counter() - began:.0f} s")


def _compiled_before() -> bool:
    """Whether numba's cache holds the largest kernel, of this or an older version."""
    return any(Path(sweep_kernel.stats.cache_path).glob("sweep.*.nbi"))


def _remainder() -> Remainder:
    mesh = mesh_of(_tee())
    return Remainder(mesh, risky_upright(mesh, 45.0))


def _tee() -> m3.Manifold:
    bar = m3.Manifold.cube((30.0, 4.0, 4.0), True).translate((0.0, 0.0, 28.0))
    return m3.Manifold.cube((4.0, 4.0, 30.0), True).translate((0.0, 0.0, 15.0)) + bar


def _print(profile: Profile) -> None:
    """Slice, plan, write and dry-run a tee in two parts."""
    coarse = {"layer_height_mm": 0.3, "line_width_mm": 0.6, "first_layer_height_mm": 0.3, "support": "auto", "walls": 2}
    profile = profile.model_copy(update={"process": profile.process.model_copy(update=coarse)})
    plane = Plane(LEANING, 20.0)
    above, below = cut(_tee(), plane)
    parts = []
    for index, (base, solid) in enumerate(((PLATFORM, below), (plane, above)), start=1):
        leaning = poses(profile.machine, LEANING)
        pose = leaning[0] if leaning and index > 1 else level(profile.machine)
        mesh = mesh_of(solid)
        parts.append(Part(index, mesh, base, pose, rotation(profile.machine, pose), mesh.volume_mm3, 0.0))
    found = Decomposition("warm", mesh_of(_tee()), tuple(parts), 1, "classic", 0.0, 0.0, 0, 0, 0.0)
    sliced = [slice_part(part, profile, parts[:k], parts[k + 1 :]) for k, part in enumerate(parts)]
    dry_run(list(write_gcode(plan(found, sliced, profile), profile)), profile)


if __name__ == "__main__":
    gains(_remainder(), LEANING[None], 1.0, threshold(45.0))
    _print(load())
