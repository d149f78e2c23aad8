"""Twenty shapes for which one buys a 5-axis printer: arms, boughs, brackets and pipes whose undersides need support straight up.
`python tools/branching_shapes.py FOLDER` writes them as STL files, for tools/judge_parts.py and `decompose`."""

import sys
from pathlib import Path

import manifold3d as m3
import numpy as np
from limb_shapes import SIDES, elbow, tube, wye

from mdp.cut import mesh_of
from mdp.save import stl

Point = tuple[float, float, float]
ORIGIN: Point = (0.0, 0.0, 0.0)


def rod(radius_mm: float, *points: Point) -> m3.Manifold:
    """A rod through points."""
    return tube(np.array(points, dtype=np.float64), radius_mm)


def block(x: float, y: float, z: float, middle: Point) -> m3.Manifold:
    """A block about its middle."""
    return m3.Manifold.cube((x, y, z), True).translate(middle)


def post(height_mm: float, radius_mm: float, foot: Point = ORIGIN) -> m3.Manifold:
    """An upright rod."""
    return m3.Manifold.cylinder(height_mm, radius_mm, radius_mm, SIDES).translate(foot)


def ball(radius_mm: float, z: float) -> m3.Manifold:
    """A ball above the middle of the plate."""
    return m3.Manifold.sphere(radius_mm, 96).translate((0.0, 0.0, z))


def around(count: int, solid: m3.Manifold) -> m3.Manifold:
    """A solid repeated about the z axis."""
    return m3.Manifold.batch_boolean([solid.rotate((0.0, 0.0, 360.0 * k / count)) for k in range(count)], m3.OpType.Add)


def arms_on_ring() -> m3.Manifold:
    ring = post(60.0, 30.0) - post(20.0, 22.0, (0.0, 0.0, 41.0))
    return ring + block(50.0, 12.0, 10.0, (50.0, 0.0, 52.0)) + block(50.0, 12.0, 10.0, (-50.0, 0.0, 52.0))


def candelabra() -> m3.Manifold:
    arm = rod(5.0, (0.0, 0.0, 50.0), (35.0, 0.0, 52.0), (35.0, 0.0, 80.0)) + post(14.0, 10.0, (35.0, 0.0, 76.0))
    return post(12.0, 28.0) + post(90.0, 7.0) + around(3, arm)


def bracket_on_two_sides() -> m3.Manifold:
    wall = block(60.0, 60.0, 8.0, (0.0, 0.0, 4.0)) + block(10.0, 60.0, 70.0, (0.0, 0.0, 38.0))
    return wall + block(40.0, 40.0, 10.0, (22.0, 0.0, 60.0)) + block(40.0, 40.0, 10.0, (-22.0, 0.0, 60.0))


def flanged_arm() -> m3.Manifold:
    pipe = post(70.0, 14.0) - post(70.0, 9.0)
    return pipe + rod(10.0, (12.0, 0.0, 40.0), (60.0, 0.0, 40.0)) + rod(18.0, (58.0, 0.0, 40.0), (66.0, 0.0, 40.0))


def hook() -> m3.Manifold:
    way = ((0, 0, 6), (0, 0, 60), (15, 0, 75), (35, 0, 75), (48, 0, 60), (48, 0, 40))
    return block(40.0, 40.0, 8.0, (0.0, 0.0, 4.0)) + rod(7.0, *way)


def gallows() -> m3.Manifold:
    frame = block(60.0, 60.0, 10.0, (0.0, 0.0, 5.0)) + block(12.0, 12.0, 90.0, (0.0, 0.0, 50.0))
    return frame + block(80.0, 12.0, 12.0, (34.0, 0.0, 90.0)) + post(30.0, 6.0, (66.0, 0.0, 58.0))


def six_ways() -> m3.Manifold:
    ways = [((0, 0, 0), (0, 0, 100)), ((-50, 0, 50), (50, 0, 50)), ((0, -50, 50), (0, 50, 50))]
    return m3.Manifold.batch_boolean([ball(18.0, 50.0), *(rod(9.0, *way) for way in ways)], m3.OpType.Add)


def tripod_head() -> m3.Manifold:
    arms = [rod(8.0, (0, 0, 45), end) for end in ((55, 0, 50), (-28, 48, 70), (-28, -48, 50))]
    return m3.Manifold.batch_boolean([post(15.0, 25.0), post(60.0, 12.0), *arms], m3.OpType.Add)


def tree() -> m3.Manifold:
    boughs = [((0, 0, 35), (40, 0, 50)), ((0, 0, 50), (-35, 20, 62)), ((0, 0, 65), (10, -40, 72))]
    return m3.Manifold.batch_boolean([post(90.0, 8.0), *(rod(5.0, *bough) for bough in boughs)], m3.OpType.Add)


SHAPES = {
    "y60": lambda: wye(60.0),
    "y75": lambda: wye(75.0),
    "elbow": elbow,
    "t_post": lambda: post(60.0, 9.0) + rod(7.0, (-45, 0, 55), (45, 0, 55)),
    "t_square": lambda: block(20.0, 20.0, 60.0, (0, 0, 30)) + block(100.0, 20.0, 16.0, (0, 0, 62)),
    "one_arm": lambda: block(24.0, 24.0, 60.0, (0, 0, 30)) + block(50.0, 14.0, 14.0, (35, 0, 50)),
    "branching_pipe": lambda: post(80.0, 12.0) + rod(9.0, (0, 0, 40), (55, 0, 40)) + rod(7.0, (0, 0, 60), (0, -50, 62)),
    "tree": tree,
    "crossing_pipes": lambda: post(90.0, 10.0) + rod(8.0, (-45, 0, 50), (45, 0, 50)) + rod(8.0, (0, -45, 50), (0, 45, 50)),
    "arms_on_ring": arms_on_ring,
    "candelabra": candelabra,
    "shelves_on_two_sides": lambda: (
        block(12.0, 60.0, 90.0, (0, 0, 45)) + block(45.0, 60.0, 8.0, (25, 0, 70)) + block(45.0, 60.0, 8.0, (-25, 0, 40))
    ),
    "bracket_on_two_sides": bracket_on_two_sides,
    "flanged_arm": flanged_arm,
    "dumbbell": lambda: post(20.0, 12.0) + post(50.0, 12.0) + post(14.0, 35.0, (0, 0, 50)),
    "mushroom": lambda: post(60.0, 10.0) + ball(35.0, 55.0).trim_by_plane((0.0, 0.0, 1.0), 55.0),
    "hook": hook,
    "gallows": gallows,
    "six_ways": six_ways,
    "tripod_head": tripod_head,
}


def run(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in SHAPES.items():
        solid = make()
        (folder / f"{name}.stl").write_bytes(stl(mesh_of(solid.translate((0.0, 0.0, -solid.bounding_box()[2])))))


if __name__ == "__main__":
    run(Path(sys.argv[1]))
