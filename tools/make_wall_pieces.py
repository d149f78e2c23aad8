"""Makes pieces with thin walls: `python tools/make_wall_pieces.py FOLDER` writes comb, text, vase, cylinder, pins as STL."""

import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import manifold3d as m3
import numpy as np

from mdp.cut import mesh_of
from mdp.save import stl

STROKE_MM = 0.8
Strokes = list[list[tuple[float, float]]]
LETTERS: dict[str, Strokes] = {
    "T": [[(0, 8), (5, 8)], [(2.5, 8), (2.5, 0)]],
    "I": [[(0, 8), (0, 0)]],
    "L": [[(0, 8), (0, 0), (4, 0)]],
    "P": [[(0, 0), (0, 8), (3, 8), (4.2, 7), (4.2, 5.2), (3, 4), (0, 4)]],
    "R": [[(0, 0), (0, 8), (3, 8), (4.2, 7), (4.2, 5.2), (3, 4), (0, 4)], [(2, 4), (4.4, 0)]],
    "N": [[(0, 0), (0, 8), (4.6, 0), (4.6, 8)]],
}


def comb() -> m3.Manifold:
    """Ten teeth, 0.3 to 1.2 mm thick, on a bar of 3 mm."""
    whole = m3.Manifold.cube((25.0, 3.0, 4.0))
    for k in range(10):
        whole += m3.Manifold.cube((0.3 + 0.1 * k, 10.0, 4.0)).translate((1.0 + 2.3 * k, 2.5, 0.0))
    return whole


def text() -> m3.Manifold:
    """TILTPRINT in strokes of 0.8 mm on nothing."""
    shape, x = m3.CrossSection(), 0.0
    for letter in "TILTPRINT":
        for line in LETTERS[letter]:
            for (ax, ay), (bx, by) in pairwise(line):
                ends = [m3.CrossSection.circle(0.5 * STROKE_MM, 24).translate((x + px, py)) for px, py in ((ax, ay), (bx, by))]
                shape += m3.CrossSection.batch_hull(ends)
        x += max(px for line in LETTERS[letter] for px, _ in line) + 2.0
    return m3.Manifold.extrude(shape, 2.0)


def vase() -> m3.Manifold:
    """A belly with a wall of 1.0 mm without a bottom."""
    z = np.linspace(0.0, 40.0, 41)
    radius = 14.0 + 5.0 * np.sin(z / 40.0 * np.pi)
    outline = [*zip(radius, z, strict=True), *zip(radius[::-1] - 1.0, z[::-1], strict=True)]
    return m3.Manifold.revolve(m3.CrossSection([np.array(outline)]), 128)


def cylinder() -> m3.Manifold:
    """A wall of 0.6 mm."""
    return m3.Manifold.cylinder(20.0, 10.0, 10.0, 128) - m3.Manifold.cylinder(30.0, 9.4, 9.4, 128).translate((0.0, 0.0, -5.0))


def pins() -> m3.Manifold:
    """Twelve pins, 0.4 to 2.6 mm thick, on a plate."""
    whole = m3.Manifold.cube((40.0, 4.0, 1.0))
    for k in range(12):
        whole += m3.Manifold.cylinder(6.0, 0.2 + 0.1 * k, 0.2 + 0.1 * k, 48).translate((2.0 + 3.2 * k, 2.0, 0.5))
    return whole


PIECES: dict[str, Callable[[], m3.Manifold]] = {"comb": comb, "text": text, "vase": vase, "cylinder": cylinder, "pins": pins}


def main(folder: Path) -> None:
    """Write every piece."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, piece in PIECES.items():
        (folder / f"{name}.stl").write_bytes(stl(mesh_of(piece())))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
