"""Measures the kernels of one evaluation of all candidates: `python tools/bench_sweep.py MODEL [--set KEY=VALUE]`.

Processor time on one thread, warm, the least of several runs; tools/bench_search.py measures evaluations and searches as wholes.
"""

import argparse
from collections.abc import Callable, Sequence

import numba
import numpy as np

from mdp.candidates import bounds
from mdp.footing import find_footing
from mdp.fragile import SLIVER_COSINE, find_slivers
from mdp.mesh import Floats, Mesh
from mdp.overhang import risky_upright, threshold
from mdp.pieces import count_pieces, find_critical
from mdp.read import locate, read_mesh
from mdp.sums import dot, find_heights, find_lowest, sum_risks, sum_volumes
from mdp.sweep import Remainder, gains, sweep
from profiles.profile import Profile, load
from tools.bench_search import on_cores


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="core time of one evaluation of all candidates")
    parser.add_argument("model")
    parser.add_argument("--set", action="append", default=[])
    options = parser.parse_args(arguments)
    profile = load(settings=options.set)
    mesh, _ = read_mesh(locate(options.model))
    kernels(mesh, profile)


def kernels(mesh: Mesh, profile: Profile) -> None:
    """One row a kernel, on one thread."""
    angle_deg, limits = profile.process.self_supporting_angle_deg, bounds(mesh, profile.machine, profile.search)
    remainder, angle = Remainder(mesh, risky_upright(mesh, angle_deg)), threshold(angle_deg)
    directions, step = limits.directions, profile.search.offset_step_mm
    count = int(gains(remainder, directions, step, angle).count.sum())
    print(f"{len(mesh.faces)} faces, {len(directions)} directions, {count} candidates\n")
    print("| kernel | us a direction | us a candidate |\n|---|---|---|")
    for name, work in pieces_of_work(remainder, limits.least_height_mm, directions, step, angle).items():
        spent_s = core_s(work)
        print(f"| {name} | {spent_s / len(directions) * 1e6:.1f} | {spent_s / count * 1e6:.2f} |")


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


def core_s(work: Callable[[], object]) -> float:
    """Processor time on one thread, the least of several runs."""
    return on_cores(1, work)[0]


@numba.njit
def _all_heights(x, y, z, directions, step):  # type: ignore[no-untyped-def]
    heights, counts = np.empty((len(directions), len(x))), np.empty(len(directions), np.int64)
    for k in range(len(directions)):
        counts[k] = find_heights(x, y, z, directions[k], step, heights[k])[1]
    return heights, counts


@numba.njit
def _risks(areas, directions, heights, counts, angle, columns):  # type: ignore[no-untyped-def]
    corners, normals, sizes, risky = areas
    up, residual, room = np.zeros(columns), np.zeros(columns), np.zeros((2, len(sizes) + 1), np.int32)
    for k in range(len(directions)):
        sum_risks(corners, normals, sizes, risky, directions[k], heights[k], counts[k], angle, room, up, residual)


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
