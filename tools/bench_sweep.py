"""Measures the kernels of one evaluation of all candidates: `python tools/bench_sweep.py MODEL [--set KEY=VALUE]`.

Processor time on one thread, warm, the least of several runs; tools/bench_search.py measures evaluations and searches as wholes.
"""

import argparse
from collections.abc import Callable, Sequence

import numba
import numpy as np

from mdp.kernels.arrays import dot
from mdp.mesh import Floats, Mesh
from mdp.model_file import locate
from mdp.overhang import risky_upright, threshold
from mdp.read import read_mesh
from mdp.search.problem import Problem
from mdp.sweep.components import count_pieces, find_contact_areas, find_critical, plant_tree
from mdp.sweep.crossing import OffsetGrid, find_heights, find_lowest, integrate_blemishes, integrate_volume
from mdp.sweep.slivers import find_slivers
from mdp.sweep.sweep import Remainder, blemishes_of, gains, sweep
from profiles.profile import Profile, load
from tools.bench_search import on_cores, sampled_bounds


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
    angle_deg, limits = profile.process.self_supporting_angle_deg, sampled_bounds(mesh, profile)
    remainder, angle = Remainder(mesh, risky_upright(mesh, angle_deg)), threshold(angle_deg)
    scarred = Problem(mesh, profile).root.remainder
    directions, step = limits.directions, profile.search.offset_step_mm
    count = int(gains(remainder, directions, step, angle).columns.sum())
    print(f"{len(mesh.faces)} faces, {len(directions)} directions, {count} candidates\n")
    print("| kernel | us a direction | us a candidate |\n|---|---|---|")
    work_of = pieces_of_work(remainder, limits.least_height_mm, directions, step, angle)
    work_of["gains, with support's need, seams, stairs and bores"] = lambda: gains(scarred, directions, step, angle)
    for name, work in work_of.items():
        spent_s = core_s(work)
        print(f"| {name} | {spent_s / len(directions) * 1e6:.1f} | {spent_s / count * 1e6:.2f} |")


def pieces_of_work(
    remainder: Remainder, watched: Floats, directions: Floats, step: float, angle: float
) -> dict[str, Callable[[], object]]:
    """Every kernel for all directions, on one thread."""
    layout, columns = remainder.layout, remainder.most_columns(step)
    heights, counts = _all_heights(layout.faces.points, directions, step)
    cosines, blemishes = np.ascontiguousarray(directions @ layout.vertex_normals), blemishes_of(remainder, directions, angle)
    grids = (directions, heights, counts, step, columns)
    return {
        "heights": lambda: _all_heights(layout.faces.points, directions, step),
        "risky areas (gains)": lambda: _risks(blemishes, grids),
        "section and volume": lambda: _volumes(layout, grids),
        "lowest point": lambda: _lowest(layout, grids, watched),
        "slivers": lambda: _slivers(layout, grids, cosines),
        "pieces below": lambda: _pieces(layout, grids, cosines, False),
        "pieces below and contact areas above": lambda: _pieces(layout, grids, cosines, True),
        "gains, whole": lambda: gains(remainder, directions, step, angle),
        "sweep, whole": lambda: sweep(remainder, directions, step, watched),
    }


def core_s(work: Callable[[], object]) -> float:
    """Processor time on one thread, the least of several runs."""
    return on_cores(1, work)[0]


@numba.njit
def _all_heights(points, directions, step):  # type: ignore[no-untyped-def]
    heights, counts = np.empty((len(directions), points.shape[1])), np.empty(len(directions), np.int64)
    for k in range(len(directions)):
        counts[k] = find_heights(points, directions[k], step, heights[k])[1]
    return heights, counts


@numba.njit
def _risks(blemishes, grids):  # type: ignore[no-untyped-def]
    directions, heights, counts, step, _ = grids
    for k in range(len(directions)):
        integrate_blemishes(blemishes, k, OffsetGrid(directions[k], heights[k], counts[k], step))


@numba.njit
def _volumes(layout, grids):  # type: ignore[no-untyped-def]
    directions, heights, counts, step, columns = grids
    section, volume = np.zeros(columns), np.zeros(columns)
    for k in range(len(directions)):
        integrate_volume(layout, OffsetGrid(directions[k], heights[k], counts[k], step), section, volume)


@numba.njit
def _lowest(layout, grids, watched):  # type: ignore[no-untyped-def]
    directions, heights, counts, step, columns = grids
    lowest = np.empty(columns)
    for k in range(len(directions)):
        lowest[:] = np.inf
        grid = OffsetGrid(directions[k], heights[k], counts[k], step)
        find_lowest(layout.faces.points[2], layout.rising_edges, grid, watched[k], lowest)


@numba.njit
def _slivers(layout, grids, cosines):  # type: ignore[no-untyped-def]
    directions, heights, counts, step, columns = grids
    normals, fragile = layout.vertex_normals, np.zeros(columns)
    for k in range(len(directions)):
        dot(normals[0], normals[1], normals[2], directions[k], cosines[k])
        find_slivers(layout, OffsetGrid(directions[k], heights[k], counts[k], step), cosines[k], fragile)


@numba.njit
def _pieces(layout, grids, cosines, above):  # type: ignore[no-untyped-def]
    directions, heights, counts, step, columns = grids
    pieces, contact_area = np.zeros(columns, np.int32), np.zeros(columns)
    scratch, wanted = np.empty(layout.faces.points.shape[1], np.int32), np.zeros(columns, np.int32)
    for k in range(len(directions)):
        critical = scratch[: find_critical(layout, heights[k], cosines[k], scratch)]
        grid = OffsetGrid(directions[k], heights[k], counts[k], step)
        count_pieces(plant_tree(layout, grid, cosines[k], critical, counts[k] < 0), pieces)
        if above:
            for column in range(counts[k]):
                wanted[column] = pieces[column] == 0
            tree = plant_tree(layout, grid, cosines[k], critical, counts[k] >= 0)
            find_contact_areas(tree, 2.0, wanted[: counts[k]], contact_area)


if __name__ == "__main__":
    main()
