"""Measures one evaluation of all candidates of a solid: `python tools/bench_sweep.py MODEL [--set KEY=VALUE]`.

One evaluation is `gains` and `sweep` of every direction, as the search asks for them. Every figure is the least of several
runs, warm: processor time on one thread, wall time on two. Growth: the model decimated to 2,000 faces by manifold3d, then
subdivided at the edges' midpoints, so that the shape stays and only the faces become more.
"""

import argparse
import resource
import time
from collections.abc import Callable, Sequence

import numba
import numpy as np

from mdp.candidates import bounds
from mdp.cut import mesh_of, solid_of
from mdp.footing import find_footing
from mdp.fragile import SLIVER_COSINE, find_slivers
from mdp.mesh import Floats, Mesh
from mdp.overhang import risky_upright, threshold
from mdp.pieces import count_pieces, find_critical
from mdp.read import locate, read_mesh
from mdp.sums import dot, find_heights, find_lowest, sum_risks, sum_volumes
from mdp.sweep import Remainder, gains, sweep
from profiles.profile import Profile, load

RUNS = 5
LARGEST = 200_000


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="core time of one evaluation of all candidates")
    parser.add_argument("model")
    parser.add_argument("--set", action="append", default=[])
    options = parser.parse_args(arguments)
    profile = load(settings=options.set)
    mesh, _ = read_mesh(locate(options.model))
    kernels(mesh, profile)
    growth(mesh, profile)
    print(f"\nlargest resident memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


def kernels(mesh: Mesh, profile: Profile) -> None:
    """One row a kernel, on one thread."""
    remainder, limits, angle = solid(mesh, profile), bounds(mesh, profile.machine, profile.search), threshold(45.0)
    directions, step = limits.directions, profile.search.offset_step_mm
    count = int(gains(remainder, directions, step, angle).count.sum())
    print(f"{len(mesh.faces)} faces, {len(directions)} directions, {count} candidates\n")
    print("| kernel | us a direction | us a candidate |\n|---|---|---|")
    for name, work in pieces_of_work(remainder, limits.least_height_mm, directions, step, angle).items():
        core_s = least_core_s(work)
        print(f"| {name} | {core_s / len(directions) * 1e6:.1f} | {core_s / count * 1e6:.2f} |")


def pieces_of_work(
    remainder: Remainder, watched: Floats, directions: Floats, step: float, angle: float
) -> dict[str, Callable[[], object]]:
    """Every kernel for all directions, on one thread."""
    laid, columns = remainder.facets, remainder.columns(step)
    x, y, z = laid.points
    heights, counts = _all_heights(x, y, z, directions, step)
    looks = np.ascontiguousarray(directions @ laid.vertex_normal_rows)
    tree = (remainder.tree.low, remainder.tree.high)
    surface = (laid.mesh.vertices, laid.mesh.faces, laid.mesh.normals, laid.vertex_normals)
    sharp = laid.sharp_corners(SLIVER_COSINE)
    solid_rows = (laid.points, laid.corners, laid.flatness, surface, laid.standing, laid.links, tree, remainder.anchors)
    areas = (laid.corners, laid.normals, laid.mesh.areas_mm2, laid.risky)
    slivers = (laid.flatness, sharp, laid.corners, laid.normals)
    return {
        "heights": lambda: _all_heights(x, y, z, directions, step),
        "risky areas (gains)": lambda: _risks(areas, directions, heights, counts, angle, columns),
        "section and volume": lambda: _volumes(laid.corners, laid.vectors_mm2, directions, heights, counts, step, columns),
        "lowest point": lambda: _lowest(z, laid.rising_edges, heights, counts, watched, columns),
        "slivers": lambda: _slivers(slivers, looks, laid.vertex_normal_rows, directions, heights, counts, step, columns),
        "pieces below": lambda: _pieces(solid_rows, looks, directions, heights, counts, columns, False),
        "pieces below and footing above": lambda: _pieces(solid_rows, looks, directions, heights, counts, columns, True),
        "gains, whole": lambda: gains(remainder, directions, step, angle),
        "sweep, whole": lambda: sweep(remainder, directions, step, watched),
    }


def growth(mesh: Mesh, profile: Profile) -> None:
    """One row a number of faces: what a face costs must not grow."""
    heads = ("faces", "candidates", "us a candidate", "ns a face and direction", "1 core s", "2 cores s", "made ready s")
    print(f"\n| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    shape = decimated(mesh, 2000)
    while len(shape.faces) <= LARGEST:
        print(f"| {' | '.join(row(shape, profile))} |")
        shape = subdivided(shape)


def row(shape: Mesh, profile: Profile) -> list[str]:
    """The figures of one mesh."""
    limits, angle, step = bounds(shape, profile.machine, profile.search), threshold(45.0), profile.search.offset_step_mm
    directions, watched, remainder = limits.directions, limits.least_height_mm, solid(shape, profile)
    began = time.process_time()
    gains(remainder, directions[:1], step, angle)
    sweep(remainder, directions[:1], step, watched[:1])
    ready_s = time.process_time() - began
    count = int(gains(remainder, directions, step, angle).count.sum())

    def evaluate() -> None:
        gains(remainder, directions, step, angle)
        sweep(remainder, directions, step, watched)

    core_s, two_s = least_core_s(evaluate), least_wall_s(evaluate, 2)
    each = [core_s / count * 1e6, core_s / len(directions) / len(shape.faces) * 1e9]
    seconds = [f"{value:.3f}" for value in (core_s, two_s, ready_s)]
    return [str(len(shape.faces)), str(count), f"{each[0]:.2f}", f"{each[1]:.1f}", *seconds]


def solid(mesh: Mesh, profile: Profile) -> Remainder:
    """The mesh ready for the sweep."""
    return Remainder(mesh, risky_upright(mesh, profile.process.self_supporting_angle_deg))


def decimated(mesh: Mesh, faces: int) -> Mesh:
    """About so many faces; manifold3d drops edges shorter than a tolerance, which is doubled until few enough are left."""
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


def least_core_s(work: Callable[[], object]) -> float:
    """Processor time on one thread, the least of several runs."""
    numba.set_num_threads(1)
    try:
        return _least(work, time.process_time)
    finally:
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)


def least_wall_s(work: Callable[[], object], threads: int) -> float:
    """Wall time on some threads, the least of several runs."""
    numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
    try:
        return _least(work, time.perf_counter)
    finally:
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)


def _least(work: Callable[[], object], clock: Callable[[], float]) -> float:
    work()
    seconds = []
    for _ in range(RUNS):
        began = clock()
        work()
        seconds.append(clock() - began)
    return min(seconds)


@numba.njit
def _all_heights(x, y, z, directions, step):  # type: ignore[no-untyped-def]
    heights, counts = np.empty((len(directions), len(x))), np.empty(len(directions), np.int64)
    for k in range(len(directions)):
        counts[k] = find_heights(x, y, z, directions[k], step, heights[k])[1]
    return heights, counts


@numba.njit
def _risks(areas, directions, heights, counts, angle, columns):  # type: ignore[no-untyped-def]
    corners, normals, sizes, risky = areas
    up, residual = np.zeros(columns), np.zeros(columns)
    for k in range(len(directions)):
        sum_risks(corners, normals, sizes, risky, directions[k], heights[k], counts[k], angle, up, residual)


@numba.njit
def _volumes(corners, vectors, directions, heights, counts, step, columns):  # type: ignore[no-untyped-def]
    section, volume = np.zeros(columns), np.zeros(columns)
    for k in range(len(directions)):
        sum_volumes(corners, vectors, directions[k], heights[k], counts[k], step, section, volume)


@numba.njit
def _lowest(z, edges, heights, counts, watched, columns):  # type: ignore[no-untyped-def]
    lowest = np.empty(columns)
    for k in range(len(heights)):
        lowest[:] = np.inf
        find_lowest(z, edges, heights[k], counts[k], watched[k], lowest)


@numba.njit
def _slivers(faces, looks, vertex_normals, directions, heights, counts, step, columns):  # type: ignore[no-untyped-def]
    flatness, sharp, corners, normals = faces
    fragile = np.zeros(columns)
    for k in range(len(heights)):
        d = directions[k]
        dot(vertex_normals[0], vertex_normals[1], vertex_normals[2], d[0], d[1], d[2], looks[k])
        find_slivers(looks[k], flatness, sharp, corners, normals, d, heights[k], counts[k], step, fragile)


@numba.njit
def _pieces(solid_rows, looks, directions, heights, counts, columns, above):  # type: ignore[no-untyped-def]
    points, corners, flatness, surface, standing, links, tree, anchor = solid_rows
    pieces, footing, room = np.zeros(columns, np.int32), np.zeros(columns), np.empty(points.shape[1], np.int32)
    for k in range(len(heights)):
        found = room[: find_critical(looks[k], flatness, heights[k], links, room)]
        count_pieces(surface, standing, links, found, tree, anchor, looks[k], heights[k], counts[k], pieces)
        if above:
            rows = (points, corners, surface, links, found, tree, anchor, looks[k])
            find_footing(rows, directions[k], heights[k], 2.0, pieces[: counts[k]] == 0, footing)


if __name__ == "__main__":
    main()
