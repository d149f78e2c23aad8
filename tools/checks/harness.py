"""Shared by all checks: options, models from files and folders, a table with a row per model, and reading of tiltprint's
G-code."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import manifold3d as m3
import numpy as np
import shapely

from machine.dryrun.dryrun import DryRun, dry_run
from machine.pipeline.embedded_profile import read_embedded_profile
from mdp.decomposition import Decomposition
from mdp.formats.readers import READERS
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.read import read_mesh
from mdp.search.parts import one_piece
from profiles.errors import UserError
from profiles.profile import Profile, load


def options_of(doc: str) -> argparse.ArgumentParser:
    """Options of all checks."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+", metavar="MODEL|FOLDER")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every N-th file of a folder")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    return parser


def files(models: Sequence[str | Path], every: int = 1) -> list[Path]:
    """The named files and demos, and every N-th model of the folders."""
    chosen: list[Path] = []
    for name in models:
        model = locate(str(name))
        inside = (file for file in model.iterdir() if file.suffix.lower() in (".npz", *READERS)) if model.is_dir() else [model]
        chosen += sorted(inside)[::every]
    return chosen


def mesh_of(file: Path, profile: Profile) -> Mesh:
    """A model file, or an npz file of a collection (vertices in mm, faces)."""
    if file.suffix == ".npz":
        with np.load(file) as arrays:
            return Mesh(arrays["vertices"].astype(np.float64), arrays["faces"])
    return read_mesh(file, profile.process.scale, profile.process.rotate_deg)[0]


def undivided(name: str, mesh: Mesh, profile: Profile) -> Decomposition:
    """A model in one piece as it stands."""
    return Decomposition(name, mesh, (one_piece(mesh, profile.machine),), 1, "classic", 0.0, 0.0, 0, 0, 0.0)


def table(columns: Sequence[str], models: Sequence[Path], rows: Callable[[Path], Iterator[Sequence[object]]]) -> None:
    """Print the rows of every model after its name, as each is done; a refused model has its message."""
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)
    for model in models:
        try:
            for cells in rows(model):
                print(f"| {' | '.join(map(str, (model.name, *cells)))} |", flush=True)
        except UserError as error:
            print(f"| {model.name} | refused: {error} |", flush=True)


def played(file: Path) -> tuple[DryRun, Profile]:
    """The dry run of a G-code file of tiltprint, with the profile in it."""
    lines = tuple(file.read_text().split("\n"))
    profile, _ = read_embedded_profile(lines, load(), frozenset())
    return dry_run(lines, profile, known=()), profile


def section_of(loops: Sequence[np.ndarray]) -> shapely.Geometry:
    """A section of a mesh as shapely polygons."""
    islands = []
    for island in m3.CrossSection(loops, m3.FillRule.Positive).decompose():
        outer, *holes = sorted(island.to_polygons(), key=lambda loop: -abs(shapely.Polygon(loop).area))
        islands.append(shapely.Polygon(outer, holes).buffer(0))
    return shapely.union_all(islands)
