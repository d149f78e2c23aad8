"""Makes the small set of records that the tests learn from: `python tools/make_small_set.py [FOLDER]`, a minute or two.

The models are the demos and drawn variants of them (trees of round bars, pipe manifolds, lattices), some 20 in all, searched on
the paper's terms by a narrow beam; the four demos on ours as well.
"""

import sys
import tempfile
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from shutil import copyfile

import manifold3d as m3
import numpy as np

from mdp.learning.collect import main as collect
from tools.make_demos import DEMOS, along, bar, pipe, standing

FOLDER = Path(__file__).resolve().parents[1] / "tests" / "mdp" / "learning" / "data"
SCALES = {"bracket": 1.0, "figure": 0.7, "lattice": 1.0, "tree": 0.8}
MOST_FACES = 1500
BRANCHES, PIPES, LATTICES = 7, 5, 4


def drawn_tree(rng: np.random.Generator) -> m3.Manifold:
    """A trunk of 2 to 5 branches of round bars, each with a twig."""
    solid = m3.Manifold.cylinder(3.0, 11.0, 11.0, 32) + bar((0.0, 0.0, 3.0), (0.0, 0.0, 34.0), 4.0, 16)
    for turn in np.arange(count := int(rng.integers(2, 6))) * 360.0 / count:
        azimuth, lean, height, length = turn + rng.uniform(-20, 20), rng.uniform(45, 85), rng.uniform(20, 32), rng.uniform(14, 24)
        foot = (0.0, 0.0, float(height))
        knee = along(foot, azimuth, lean, length)
        solid += bar(foot, knee, float(rng.uniform(2.0, 3.2)), 16)
        solid += bar(knee, along(knee, azimuth + rng.uniform(-50, 50), rng.uniform(20, 100), 9.0), 1.8, 12)
    return solid


def drawn_manifold(rng: np.random.Generator) -> m3.Manifold:
    """An upright pipe on a foot with 1 to 3 flanged side pipes."""
    solid = m3.CrossSection([[(0, 0), (18, 0), (18, 4), (10, 8), (9, 42), (0, 42)]]).revolve(32)
    for turn in np.arange(count := int(rng.integers(1, 4))) * 360.0 / count:
        outer = float(rng.uniform(5.0, 7.0))
        side = pipe(float(rng.uniform(26, 38)), outer, outer + 4.0, 32).rotate((0.0, float(rng.uniform(55, 90)), 0.0))
        solid += side.rotate((0.0, 0.0, float(turn + rng.uniform(-25, 25)))).translate((0.0, 0.0, float(rng.uniform(22, 32))))
    return solid - m3.Manifold.cylinder(60.0, 5.0, 5.0, 24).translate((0, 0, -1.0))


def drawn_lattice(rng: np.random.Generator) -> m3.Manifold:
    """A mast on a plate with 1 or 2 storeys of 3 to 5 struts, inclined and horizontal."""
    floors = np.cumsum([14.0, *rng.uniform(11.0, 16.0, int(rng.integers(1, 3)))]).tolist()
    arms, cell, radius = int(rng.integers(3, 6)), float(rng.uniform(13, 19)), float(rng.uniform(1.8, 2.4))
    solid = m3.Manifold.cylinder(2.5, 12.0, 12.0, 32) + bar((0, 0, 1.0 + radius), (0, 0, floors[-1]), 2.8, 16)
    for arm in range(arms):
        for low, high in pairwise(floors):
            end = along((0, 0, high), 360.0 * arm / arms, 90, cell)
            solid += bar((0, 0, low), end, radius, 12) + bar((0, 0, high), end, radius, 12)
    return solid


DRAWN: dict[str, tuple[Callable[[np.random.Generator], m3.Manifold], int]] = {
    "branches": (drawn_tree, BRANCHES),
    "pipes": (drawn_manifold, PIPES),
    "struts": (drawn_lattice, LATTICES),
}


def models() -> dict[str, m3.Manifold]:
    """The solids by name."""
    solids = {name: DEMOS[name]().scale((scale, scale, scale)) for name, scale in SCALES.items()}
    for kind, (draw, count) in DRAWN.items():
        for number in range(count):
            solids[f"{kind}{number}"] = draw(np.random.default_rng([number, *kind.encode()]))
    return solids


def main(folder: Path) -> None:
    """Write the records into a folder and say how large they are."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        shapes, demos = Path(work, "models"), Path(work, "demos")
        shapes.mkdir()
        demos.mkdir()
        for name, solid in models().items():
            vertices, faces = standing(solid)
            np.savez(shapes / f"{name}.npz", vertices=vertices, faces=faces)
            if name in DEMOS:
                copyfile(shapes / f"{name}.npz", demos / f"{name}.npz")
        for models_, terms, width in ((shapes, "paper", "10"), (demos, "ours", "2")):
            records = Path(work, terms)
            words = ("--terms", terms, "--beam-width", width, "--faces", str(MOST_FACES))
            if collect([str(models_), "-o", str(records), *words]) != 0:
                raise SystemExit(f"{terms}: nothing was collected")
            for file in sorted(records.glob("*.npz")):
                copyfile(file, folder / file.name)
    sizes = [file.stat().st_size for file in folder.glob("*.npz")]
    print(f"{folder}: {len(sizes)} records, {sum(sizes) / 1000:.0f} kB, the largest {max(sizes) / 1000:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
