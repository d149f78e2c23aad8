"""Measures the search: `python tools/bench_search.py MODEL [--set KEY=VALUE] [--widths 1,2,5,10,20,50] [--largest FACES]`.

Three tables in Markdown: one evaluation of all candidates (`gains` and `sweep` of every direction, as the search asks for them)
on one core and two; whole searches by beam width, on the 2020 paper's terms and on ours; growth of both with the faces of one
shape. Figures of evaluations are the least of several warm runs, searches run once. Core time is that of the whole process.
tools/bench_sweep.py tells what each kernel takes.
"""

import argparse
import resource
import time
from collections.abc import Callable, Sequence

import numpy as np

import mdp.kernels.threads
from mdp.cut import mesh_of, solid_of
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.overhang import risky_upright, threshold
from mdp.ranking.candidates import Bounds, bounds_of, directions, plate_disc
from mdp.read import read_mesh
from mdp.search.search import decompose
from mdp.sweep.sweep import Remainder, gains, sweep
from profiles.profile import Profile, load

RUNS = 5
SMALLEST = 2000
TERMS = {
    "the paper's terms": ("search.objective=risky", "search.count_platform_faces=true", "search.clearance=false"),
    "our terms": (),
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="core and wall time of evaluations and searches")
    parser.add_argument("model")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--widths", default="1,2,5,10,20,50")
    parser.add_argument("--largest", type=int, default=250_000, help="faces at which the growth ends")
    options = parser.parse_args(arguments)
    mesh, _ = read_mesh(locate(options.model))
    profile = load(settings=options.set)
    evaluation(mesh, profile)
    for name, terms in TERMS.items():
        searches(mesh, name, [load(settings=(*terms, *options.set, f"search.beam_width={b}")) for b in options.widths.split(",")])
    growth(mesh, profile, options.largest)


def evaluation(mesh: Mesh, profile: Profile) -> None:
    """One row a number of cores."""
    work, count = all_candidates(mesh, profile)
    print(f"{len(mesh.faces)} faces, {profile.search.directions} directions, {count} candidates")
    heading("cores", "core s", "wall s", "core us a candidate")
    for cores in (1, 2):
        core_s, wall_s = on_cores(cores, work)
        row(cores, f"{core_s:.3f}", f"{wall_s:.3f}", f"{core_s / count * 1e6:.2f}")


def searches(mesh: Mesh, name: str, profiles: Sequence[Profile]) -> None:
    """One row a beam width."""
    print(f"\nSearch on {name}")
    heading("B", "M2", "parts", "candidates", "core s", "wall s", "largest memory so far, MB")
    for profile in profiles:
        core, wall = time.process_time(), time.perf_counter()
        result = decompose(mesh, name, profile)
        spent = (f"{time.process_time() - core:.2f}", f"{time.perf_counter() - wall:.2f}")
        figures = (
            profile.search.beam_width,
            f"{result.reduction:.4f}",
            len(result.parts),
            result.candidates_evaluated,
        )
        row(*figures, *spent, memory_mb())


def growth(mesh: Mesh, profile: Profile, largest: int) -> None:
    """One row a number of faces: what a face costs must not grow. The shape is decimated, then subdivided."""
    print("\nGrowth")
    heads = (
        "faces",
        "us a candidate",
        "ns a face and direction",
        "1 core s",
        "2 cores s",
        "search core s",
        "wall s",
        "MB so far",
    )
    heading(*heads)
    shape = decimated(mesh, SMALLEST)
    while len(shape.faces) <= largest:
        work, count = all_candidates(shape, profile)
        core_s, _ = on_cores(1, work)
        _, two_s = on_cores(2, work)
        core, wall = time.process_time(), time.perf_counter()
        decompose(shape, "grown", profile)
        shares = (f"{core_s / count * 1e6:.2f}", f"{core_s / profile.search.directions / len(shape.faces) * 1e9:.1f}")
        spent = (time.process_time() - core, time.perf_counter() - wall)
        row(len(shape.faces), *shares, *(f"{value:.3f}" for value in (core_s, two_s, *spent)), memory_mb())
        shape = subdivided(shape)


def sampled_bounds(mesh: Mesh, profile: Profile) -> Bounds:
    """The bounds of the sampled directions, as a search has them."""
    return bounds_of(directions(profile.search), mesh, profile, plate_disc(mesh, profile.search))


def all_candidates(mesh: Mesh, profile: Profile) -> tuple[Callable[[], object], int]:
    """One evaluation of a solid's candidates, and how many they are."""
    limits = sampled_bounds(mesh, profile)
    angle_deg, step_mm = profile.process.self_supporting_angle_deg, profile.search.offset_step_mm
    remainder = Remainder(mesh, risky_upright(mesh, angle_deg, profile.search.count_platform_faces))

    def evaluate() -> int:
        evaluated = gains(remainder, limits.directions, step_mm, threshold(angle_deg))
        sweep(remainder, limits.directions, step_mm, limits.least_height_mm)
        return int(evaluated.count.sum())

    return evaluate, evaluate()


def on_cores(cores: int, work: Callable[[], object]) -> tuple[float, float]:
    """Processor time and wall time on a number of threads, each the least of several runs."""
    usual, mdp.kernels.threads.THREADS = mdp.kernels.threads.THREADS, cores
    try:
        return _least(work, time.process_time), _least(work, time.perf_counter)
    finally:
        mdp.kernels.threads.THREADS = usual


def _least(work: Callable[[], object], clock: Callable[[], float]) -> float:
    seconds = []
    for _ in range(RUNS):
        began = clock()
        work()
        seconds.append(clock() - began)
    return min(seconds)


def decimated(mesh: Mesh, faces: int) -> Mesh:
    """A mesh of about `faces` faces; manifold3d drops edges shorter than a tolerance, which grows until few enough are left."""
    shape, tolerance = mesh, 0.05
    while len(shape.faces) > faces:
        shape = mesh_of(solid_of(mesh).simplify(tolerance))
        tolerance *= 1.2
    return Mesh(shape.vertices - np.array([0.0, 0.0, shape.bounds_mm[0, 2]]), shape.faces)


def subdivided(mesh: Mesh) -> Mesh:
    """Every face split into four at the midpoints of its edges."""
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    once, which = np.unique(edges, axis=0, return_inverse=True)
    middles = mesh.vertices[once].mean(axis=1)
    ab, bc, ca = (len(mesh.vertices) + which.reshape(-1, 3)).T
    a, b, c = mesh.faces.T
    faces = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return Mesh(np.concatenate([mesh.vertices, middles]), np.concatenate([np.stack(face, axis=1) for face in faces]))


def memory_mb() -> int:
    """Largest resident memory of the process so far."""
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def heading(*cells: str) -> None:
    """Head of a table in Markdown."""
    print(f"\n| {' | '.join(cells)} |\n|{'---|' * len(cells)}")


def row(*cells: object) -> None:
    """Row of a table in Markdown."""
    print(f"| {' | '.join(str(cell) for cell in cells)} |", flush=True)


if __name__ == "__main__":
    main()
