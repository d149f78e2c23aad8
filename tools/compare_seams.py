"""Where outer walls begin, beside PrusaSlicer: `python tools/compare_seams.py MODEL ... [--set KEY=VALUE ...]`.

Every model stands as one part on the platform, with the settings of compare_walls.py, PrusaSlicer's seams aligned. The closed
ways of both G-code texts that hold external perimeter are read by the same lines. A seam belongs to the nearest place of the
mesh's true outline in the middle of its layer. One row a model and slicer: how many seams; their mean visibility, %: of 256
directions, spread evenly over the sphere, those in which nothing of the model stands before it, where a flat wall has 100; the
share that lies in concave corners, %, in convex ones, and on smooth wall: by the turn of the outline from 1.2 mm before to 1.2 mm
behind, 25 degrees and more; the mean way, mm, from a seam to the nearest one of the layer below, and the share of ways of more
than 1 mm. The last two rows are the means of all models. --without leaves PrusaSlicer out.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from compare_walls import BARE, Print, arachne, ours

from machine.gcode.reader.parsed import MoveKind
from mdp.cut import mesh_of, solid_of
from mdp.directions.unit_vectors import spread
from mdp.mesh import Floats, Mesh
from mdp.model_file import locate
from mdp.read import read_mesh
from mdp.sweep.rays import TriangleTree, blocked_shares, triangle_tree
from mdp.topology.cross_section import cross_sections
from profiles.profile import load
from slicer.paths import Kind

RAYS, LIFT_MM, FAR_MM = 256, 0.05, 1e4
NEAR_MM, ARM_MM = 0.4, 1.2  # a corner's turn is that between these places before and behind a seam
CORNER_DEG = 25.0
GAP_MM, LEAST_MM = 0.7, 2.0  # between the ends of a closed way; its length
JUMP_MM = 1.0
HEAD = ("model", "slicer", "seams", "visible %", "concave %", "convex %", "smooth %", "jump mm", "over 1 mm %", "core s")


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+")
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options.add_argument("--without", action="store_true")
    given = options.parse_args()
    profile = load(settings=[*BARE, *given.set])
    slicers = {"ours": ours} if given.without else {"ours": ours, "PrusaSlicer": arachne}
    table: dict[str, list[Sequence[float]]] = {name: [] for name in slicers}
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    for model in given.models:
        mesh = read_mesh(locate(model))[0]
        for name, printed in slicers.items():
            laid = printed(mesh, profile)
            figures = (*judged(mesh, seams_of(laid, profile.process.layer_height_mm)), laid.core_s)
            table[name].append(figures)
            print(row(Path(model).stem, name, figures), flush=True)
    for name, rows in table.items():
        print(row("mean", name, np.mean(rows, axis=0).tolist()))


def row(model: str, slicer: str, figures: Sequence[float]) -> str:
    """A line of the table."""
    count, visible, concave, convex, smooth, jump_mm, jumps, core_s = figures
    shares = [f"{100 * share:.1f}" for share in (visible, concave, convex, smooth)]
    cells = [model, slicer, f"{count:.0f}", *shares, f"{jump_mm:.2f}", f"{100 * jumps:.1f}", f"{core_s:.1f}"]
    return "| " + " | ".join(cells) + " |"


def seams_of(laid: Print, height_mm: float) -> Floats:
    """(n, 3) x, y and number of the layer where each closed way with external perimeter begins."""
    program = laid.program
    is_outer, is_either = (
        np.isin(program.type, [k for k, name in enumerate(program.types) if name in names])
        for names in ((Kind.OUTER_WALL.value,), (Kind.OUTER_WALL.value, Kind.OVERHANG.value))
    )
    rows = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & is_either)
    begin, end = program.start[rows, :3], program.end[rows, :3]
    apart = (np.diff(rows) != 1) | (np.abs(begin[1:] - end[:-1]).max(axis=1) > 1e-3)
    seams = []
    for way in np.split(np.arange(len(rows)), np.flatnonzero(apart) + 1):
        length = np.linalg.norm(end[way] - begin[way], axis=1).sum()
        gap = np.hypot(*(begin[way[0]] - end[way[-1]])[:2])
        if is_outer[rows[way]].any() and gap < GAP_MM and length > LEAST_MM:
            seams.append([*(begin[way[0], :2] - laid.origin_mm), np.round(begin[way[0], 2] / height_mm)])
    return np.array(seams)


def judged(mesh: Mesh, seams: Floats, height_mm: float = 0.2) -> tuple[float, ...]:
    """The figures of (n, 3) seams."""
    layers = np.unique(seams[:, 2]).astype(int)
    tree = triangle_tree(mesh_of(solid_of(mesh)))
    places, turns, jumps = [], [], []
    before = np.zeros((0, 2))
    for layer, loops in zip(layers, cross_sections(mesh, (layers - 0.5) * height_mm), strict=True):
        here = seams[seams[:, 2] == layer, :2]
        if len(before):
            jumps += np.hypot(*(here[:, None] - before[None]).transpose(2, 0, 1)).min(axis=1).tolist()
        before = here
        for seam in here if loops else ():
            place, turn_deg = on_outline(seam, loops)
            outward = place - seam
            lifted = place + LIFT_MM * outward / max(float(np.hypot(*outward)), 1e-9)
            places.append([*lifted, (layer - 0.5) * height_mm])
            turns.append(turn_deg)
    seen, turn, jump = visibility(tree, np.array(places)), np.array(turns), np.array(jumps)
    shares = [float(mask.mean()) for mask in (turn <= -CORNER_DEG, turn >= CORNER_DEG, np.abs(turn) < CORNER_DEG)]
    return (len(seams), float(seen.mean()), *shares, float(jump.mean()), float((jump > JUMP_MM).mean()))


def visibility(tree: TriangleTree, places: Floats) -> Floats:
    """(n,) of all directions those in which nothing stands before (n, 3) places beside a surface: 1 for half of them and more."""
    frames = np.tile(np.eye(3), (len(places), 1, 1))
    return np.minimum(2.0 * (1.0 - blocked_shares(tree, (places, frames), spread(RAYS), FAR_MM)), 1.0)


def on_outline(seam: Floats, loops: Sequence[Floats]) -> tuple[Floats, float]:
    """The place of outlines that is nearest to a point, and by how many degrees they turn left there."""
    best: tuple[float, Floats, int, float] | None = None
    for k, loop in enumerate(loops):
        side = np.roll(loop, -1, axis=0) - loop
        share = np.clip(((seam - loop) * side).sum(axis=1) / np.maximum((side**2).sum(axis=1), 1e-18), 0.0, 1.0)
        foot = loop + share[:, None] * side
        far = np.hypot(*(foot - seam).T)
        at = int(far.argmin())
        if best is None or far[at] < best[0]:
            best = float(far[at]), foot[at], k, float(np.hypot(*side[:at].T).sum() + share[at] * np.hypot(*side[at]))
    assert best is not None
    _, place, k, along = best
    closed = np.concatenate([loops[k], loops[k][:1]])
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    near, arm = (min(mm, 0.25 * lengths[-1]) for mm in (NEAR_MM, ARM_MM))
    a, b, c, d = (
        np.array([np.interp((along + mm) % lengths[-1], lengths, closed[:, axis]) for axis in (0, 1)])
        for mm in (-arm, -near, near, arm)
    )
    (ux, uy), (vx, vy) = b - a, d - c
    return place, float(np.degrees(np.arctan2(ux * vy - uy * vx, ux * vx + uy * vy)))


if __name__ == "__main__":
    main()
