"""Beads of solid layers compared with the model's true sections: `python tools/checks/layers.py MODEL|FOLDER ... [--layers-every
7]`.

Models are one part, upright, at 100 % infill, without skirt, support and elephant's foot compensation. Every N-th layer is
measured: its beads are buffered lines in shapely, its section is a fresh cut of the mesh without cleaning; gaps narrower than
0.06 of a line are ignored. One row per model: layers measured; plastic over volume (all layers); the largest empty spot in
squared line widths and its layer; how many are larger than one; the farthest reach of a bead beyond the section, mm, and its
layer; core seconds of slicing.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from time import process_time

import numpy as np
import shapely

from mdp.search.parts import one_piece
from mdp.topology.cross_section import cross_sections
from profiles.profile import Profile, load
from slicer.heights import layer_heights
from slicer.paths import Layer
from slicer.slice import slice_part
from tools.checks.harness import files, mesh_of, options_of, section_of, table

BARE = ["process.skirt_loops=0", "process.small_base_brim_mm=0", "process.support=none"]
BARE += ["process.infill_density=1", "process.elephant_foot_mm=0"]
SLIT = 0.06  # of the line width: narrower gaps connect spots and are not counted
HEAD = ("model", "layers", "plastic / volume", "largest spot w2", "layer", "spots over 1 w2", "farthest out mm", "layer", "s")


def main() -> None:
    """Read the options, print the table."""
    parser = options_of(__doc__)
    parser.add_argument("--layers-every", type=int, default=7, metavar="N")
    given = parser.parse_args()
    profile = load(settings=[*BARE, *given.set])
    table(HEAD, files(given.models, given.every), lambda model: rows(model, given.layers_every, profile))


def rows(model: Path, every: int, profile: Profile) -> Iterator[Sequence[object]]:
    """A model's cells."""
    mesh = mesh_of(model, profile)
    began = process_time()
    sliced = slice_part(one_piece(mesh, profile.machine), profile)
    taken_s, width = process_time() - began, profile.process.line_width_mm
    at = layer_heights(mesh, profile, True)
    by_height = {round(layer.z_mm, 6): layer for layer in sliced.layers}
    spots, over, looked = [(0.0, 0)], [(0.0, 0)], 0
    for k in range(0, len(at.cut_mm), every):
        layer = by_height.get(round(float(at.tip_mm[k]), 6))
        loops = cross_sections(mesh, at.cut_mm[k : k + 1])[0]
        if layer is None or not loops:
            continue
        areas, farthest = looked_at(layer, section_of(loops), width)
        spots += [(area / width**2, k) for area in areas]
        over.append((farthest, k))
        looked += 1
    largest, out = max(spots), max(over)
    cells = [looked, f"{sliced.volume_mm3 / mesh.volume_mm3:.4f}", f"{largest[0]:.2f}", largest[1]]
    yield [*cells, sum(area > 1.0 for area, _ in spots), f"{out[0]:.3f}", out[1], f"{taken_s:.1f}"]


def looked_at(layer: Layer, section: shapely.Geometry, width_mm: float) -> tuple[list[float], float]:
    """Areas of a section without a bead, mm²; and the farthest reach of a bead beyond it, mm."""
    plastic = shapely.union_all([shapely.LineString(path.points).buffer(path.width_mm / 2) for path in layer.paths])
    slit = 0.5 * SLIT * width_mm
    empty = section.difference(plastic).buffer(-slit).buffer(slit)
    spots = [spot.area for spot in shapely.get_parts(empty)]
    over = [piece for piece in shapely.get_parts(plastic.difference(section)) if piece.area > 1e-6]
    corners = [shapely.distance(section, shapely.points(np.array(piece.exterior.coords))).max() for piece in over]
    return [area for area in spots if area > 0.05 * width_mm**2], max(corners, default=0.0)


if __name__ == "__main__":
    main()
