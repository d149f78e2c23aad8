"""Measures slicing in core seconds: `python tools/bench_slice.py [MODEL ...] [--height MM] [--set KEY=VALUE]`.

Every model is scaled to one height (default 60 mm: 300 layers of 0.2 mm), stands as one part on the platform and is
sliced once to warm up and then three times; the least time counts. Without a model the ones that ship are measured.
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Mesh
from mdp.plane import PLATFORM
from mdp.pose import level
from mdp.read import locate, read_mesh
from profiles.profile import Profile, load
from slicer.heights import heights
from slicer.paths import SlicedPart
from slicer.section import sections
from slicer.slice import slice_part

RUNS = 3
SHIPPED = ("demo:figure", "demo:tree", "demo:bracket", "demo:lattice")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print one row per model."""
    parser = argparse.ArgumentParser(description="slicing in core seconds")
    parser.add_argument("models", nargs="*", default=SHIPPED)
    parser.add_argument("--height", type=float, default=60.0)
    parser.add_argument("--set", action="append", default=[])
    options = parser.parse_args(arguments)
    profile = load(settings=options.set)
    print(f"{'model':24} {'faces':>7} {'layers':>6} {'section s':>9} {'slice s':>8} {'paths':>7} {'travel m':>8} retract     cm3")
    for model in options.models:
        print(row(model, standing(model, options.height), profile))


def standing(model: str, height_mm: float) -> Part:
    """The model as the only part, scaled to the height."""
    mesh, _ = read_mesh(locate(model))
    mesh = Mesh(mesh.vertices * (height_mm / mesh.bounds_mm[1, 2]), mesh.faces)
    return Part(1, mesh, PLATFORM, level(load().machine), np.eye(3), mesh.volume_mm3, 0.0)


def row(model: str, part: Part, profile: Profile) -> str:
    """Times and measures of one model."""
    at = heights(float(part.mesh.bounds_mm[1, 2]), profile.process, True)
    sliced = slice_part(part, profile)
    section_s = min(core_seconds(lambda: sections(part.mesh, at.cut_mm)) for _ in range(RUNS))
    slice_s = min(core_seconds(lambda: slice_part(part, profile)) for _ in range(RUNS))
    paths = [path for layer in sliced.layers for path in layer.paths]
    retractions = sum(path.retract for path in paths)
    return (
        f"{model[-24:]:24} {len(part.mesh.faces):7} {len(sliced.layers):6} {section_s:9.3f} {slice_s:8.3f} {len(paths):7} "
        f"{travel_mm(sliced) / 1000:8.2f} {retractions:7} {sliced.volume_mm3 / 1000:7.2f}\n    {metres(sliced)}"
    )


def core_seconds(work: Callable[[], object]) -> float:
    """Processor time of a call, all threads."""
    began = time.process_time()
    work()
    return time.process_time() - began


def travel_mm(sliced: SlicedPart) -> float:
    """Length of all travels."""
    paths = [path for layer in sliced.layers for path in layer.paths]
    hops = np.array([b.points[0] - a.points[-1] for a, b in pairwise(paths)])
    return float(np.hypot(*hops.T).sum())


def metres(sliced: SlicedPart) -> str:
    """Length of every kind of path."""
    lengths: defaultdict[str, float] = defaultdict(float)
    for layer in sliced.layers:
        for path in layer.paths:
            lengths[path.kind.value] += path.length_mm / 1000
    return ", ".join(f"{kind} {length:.2f} m" for kind, length in lengths.items())


if __name__ == "__main__":
    main()
