"""Make our own versions of the shapes that hydra5x (maker-fab/hydra5x, docs/decisions.md) calls unprintable by planar cuts:
`python tools/docs/make_shapes.py FOLDER` writes STL files, `tiltprint export FOLDER/elbow.stl --as-is` prints one.
"""

import sys
from itertools import pairwise
from pathlib import Path

import manifold3d as m3
import numpy as np

from mdp.cut import mesh_of
from mdp.save import stl

SIDES = 64


def tube(points: np.ndarray, radius_mm: float) -> m3.Manifold:
    """Round rods between consecutive (n, 3) points."""
    pieces = []
    for a, b in pairwise(points):
        length = float(np.linalg.norm(b - a))
        x, y, z = (b - a) / length
        rod = m3.Manifold.cylinder(length, radius_mm, radius_mm, SIDES)
        turned = rod.rotate((0.0, float(np.degrees(np.arccos(z))), float(np.degrees(np.arctan2(y, x)))))
        pieces.append(turned.translate(tuple(map(float, a))))
    return m3.Manifold.batch_boolean(pieces, m3.OpType.Add)


def elbow() -> m3.Manifold:
    """A pipe, 24 mm outside and 18 mm inside diameter, that turns by 90 degrees with a radius of 40 mm."""
    ring = m3.CrossSection.circle(12.0, SIDES) - m3.CrossSection.circle(9.0, SIDES)
    quarter = m3.Manifold.revolve(ring.translate((40.0, 0.0)), 128, 90.0).rotate((90.0, 0.0, 0.0))
    foot = m3.Manifold.extrude(ring, 20.0).translate((40.0, 0.0, -20.0))
    return foot + quarter


def wye(lean_deg: float) -> m3.Manifold:
    """A stem of 20 mm diameter with two arms, 16 mm thick and 60 mm long, that lean to both sides."""
    arms = [m3.Manifold.cylinder(60.0, 8.0, 8.0, SIDES).rotate((0.0, side * lean_deg, 0.0)) for side in (-1.0, 1.0)]
    stem = m3.Manifold.cylinder(40.0, 10.0, 10.0, SIDES)
    return stem + (arms[0] + arms[1]).translate((0.0, 0.0, 36.0))


def channel_block() -> m3.Manifold:
    """A block of 60 x 40 x 50 mm with a channel of 14 mm from one side to the other, level in the middle."""
    block = m3.Manifold.cube((60.0, 40.0, 50.0)).translate((-30.0, -20.0, 0.0))
    way = np.array([[-40.0, 0.0, 12.0], [-12.0, 0.0, 12.0], [-12.0, 0.0, 36.0], [40.0, 0.0, 36.0]])
    return block - tube(way, 7.0)


SHAPES: dict[str, m3.Manifold] = {
    "elbow": elbow(),
    "y30": wye(30.0),
    "y60": wye(60.0),
    "t": wye(90.0),
    "channel": channel_block(),
}


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name, solid in SHAPES.items():
        (folder / f"{name}.stl").write_bytes(stl(mesh_of(solid.translate((0.0, 0.0, -solid.bounding_box()[2])))))
