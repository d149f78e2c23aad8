"""Lay every bead of solid layers over the model's true sections: what stays empty, what sticks out.

    python tools/check_layers.py FOLDER [--every N] [--set KEY=VALUE ...] [--only NAME ...]

Models stand as one part, upright, at 100 % infill, without skirt, support and elephant's foot. Every N-th layer (7 unless told)
is measured: its beads are buffered lines in shapely, its section is cut from the mesh anew and not cleaned; slits narrower
than 0.06 of a line are no spots. One row a model: layers looked at; plastic over the volume (all layers); the largest empty
spot in line widths squared and its layer; how many are larger than one; how far the farthest bead reaches over the section,
mm, and its layer; core seconds of slicing.
"""

import argparse
from pathlib import Path
from time import process_time

import manifold3d as m3
import numpy as np
import shapely

from mdp.decomposition import Part
from mdp.plane import PLATFORM
from mdp.pose import level
from mdp.read import read_mesh
from mdp.topology.cross_section import cross_sections
from profiles.profile import Profile, load
from slicer.heights import layer_heights
from slicer.paths import Layer
from slicer.slice import slice_part

SUFFIXES = {".stl", ".obj", ".off", ".ply", ".3mf", ".glb"}
BARE = ["process.skirt_loops=0", "process.small_base_brim_mm=0", "process.support=none"]
BARE += ["process.infill_density=1", "process.elephant_foot_mm=0"]
SLIT = 0.06  # of the line width: what is narrower joins spots to one another and is none itself
HEAD = ("model", "layers", "plastic / volume", "largest spot w2", "layer", "spots over 1 w2", "farthest out mm", "layer", "s")


def section_of(loops: list[np.ndarray]) -> shapely.Geometry:
    """The raw section as shapely polygons."""
    islands = []
    for island in m3.CrossSection(loops, m3.FillRule.Positive).decompose():
        outer, *holes = sorted(island.to_polygons(), key=lambda loop: -abs(shapely.Polygon(loop).area))
        islands.append(shapely.Polygon(outer, holes).buffer(0))
    return shapely.union_all(islands)


def looked_at(layer: Layer, section: shapely.Geometry, width_mm: float) -> tuple[list[float], float]:
    """Areas, mm2, of the places of a section that no bead covers; how far the farthest bead reaches over it, mm."""
    plastic = shapely.union_all([shapely.LineString(path.points).buffer(path.width_mm / 2) for path in layer.paths])
    slit = 0.5 * SLIT * width_mm
    empty = section.difference(plastic).buffer(-slit).buffer(slit)
    spots = [spot.area for spot in shapely.get_parts(empty)]
    over = [piece for piece in shapely.get_parts(plastic.difference(section)) if piece.area > 1e-6]
    corners = [shapely.distance(section, shapely.points(np.array(piece.exterior.coords))).max() for piece in over]
    return [area for area in spots if area > 0.05 * width_mm**2], max(corners, default=0.0)


def row(file: Path, every: int, profile: Profile) -> str:
    """One model's line of the table."""
    mesh, _ = read_mesh(file, profile.process.scale, profile.process.rotate_deg)
    part = Part(1, mesh, PLATFORM, level(profile.machine), np.eye(3), mesh.volume_mm3, 0.0)
    began = process_time()
    sliced = slice_part(part, profile)
    taken_s, width = process_time() - began, profile.process.line_width_mm
    at = layer_heights(mesh, profile, True)
    by_height = {round(layer.z_mm, 6): layer for layer in sliced.layers}
    volume = sliced.volume_mm3
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
    cells = [
        file.name, looked, f"{volume / mesh.volume_mm3:.4f}", f"{largest[0]:.2f}", largest[1],
        sum(area > 1.0 for area, _ in spots), f"{out[0]:.3f}", out[1], f"{taken_s:.1f}",
    ]  # fmt: skip
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def main() -> None:
    """Read the options, print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--every", type=int, default=7)
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options.add_argument("--only", nargs="+", default=[], metavar="NAME")
    given = options.parse_args()
    profile = load(settings=[*BARE, *given.set])
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    for file in sorted(given.folder.iterdir()):
        if file.suffix.lower() in SUFFIXES and (not given.only or file.stem in given.only):
            print(row(file, given.every, profile), flush=True)


if __name__ == "__main__":
    main()
