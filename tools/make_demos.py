"""Makes the models that ship with the program: `python tools/make_demos.py [FOLDER]` writes mdp/demos/NAME.ply.

Every model is one closed solid standing on a flat base about the z axis whose limbs need several printing directions.
The organic ones are level sets of smoothly united round cones, the others exact boolean unions of cylinders and bars.
"""

import math
import sys
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import manifold3d as m3
import numpy as np
from numpy.typing import NDArray

from mdp.kernels.kernel import kernel

FOLDER = Path(__file__).resolve().parents[1] / "mdp" / "demos"
Point = tuple[float, float, float]
Knot = tuple[float, float, float, float]
Limb = list[Knot]  # x, y, z, radius of the knots of a chain of round cones


@kernel
def cone_distance(knots: NDArray[np.float64], k: int, x: float, y: float, z: float) -> float:
    """Distance of a point to the segment from knot k to the next, along which the radius runs linearly, mm."""
    a, b = knots[k], knots[k + 1]
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    share = ((x - a[0]) * dx + (y - a[1]) * dy + (z - a[2]) * dz) / (dx * dx + dy * dy + dz * dz)
    share = min(max(share, 0.0), 1.0)
    across = (x - a[0] - share * dx) ** 2 + (y - a[1] - share * dy) ** 2 + (z - a[2] - share * dz) ** 2
    return math.sqrt(across) - (a[3] + share * (b[3] - a[3]))


@kernel
def _united(knots: NDArray[np.float64], first: NDArray[np.int64], blend_mm: float, x: float, y: float, z: float) -> float:
    """The field of smooth_union; limb k has the knots first[k] to before first[k + 1]."""
    union = np.inf
    for limb in range(len(first) - 1):
        d = np.inf
        for k in range(first[limb], first[limb + 1] - 1):
            d = min(d, cone_distance(knots, k, x, y, z))
        mix = max(blend_mm - abs(union - d), 0.0) / blend_mm
        union = min(union, d) - mix * mix * blend_mm / 4.0
    return -union


def smooth_union(limbs: Sequence[Limb], blend_mm: float) -> Callable[[float, float, float], float]:
    """The signed field (positive inside) of limbs blended by the quadratic smooth minimum over blend_mm."""
    knots = np.array([knot for limb in limbs for knot in limb], dtype=np.float64)
    first = np.concatenate(([0], np.cumsum([len(limb) for limb in limbs])))
    return lambda x, y, z: _united(knots, first, blend_mm, x, y, z)


def grown(limbs: Sequence[Limb], blend_mm: float, edge_mm: float, tolerance_mm: float) -> m3.Manifold:
    """The level set of the limbs, trimmed flat at z = 0 and simplified within tolerance_mm."""
    knots = np.array([knot for limb in limbs for knot in limb])
    reach = knots[:, 3:] + blend_mm
    box = [*(knots[:, :3] - reach).min(axis=0), *(knots[:, :3] + reach).max(axis=0)]
    solid = m3.Manifold.level_set(smooth_union(limbs, blend_mm), box, edge_mm, 0.0, 0.01)
    return solid.trim_by_plane((0.0, 0.0, 1.0), 0.0).simplify(tolerance_mm)


def figure() -> m3.Manifold:
    """A dancer on one leg on a plinth: the other leg stretched backward, the arms to both sides, the head bent forward."""
    limbs: list[Limb] = [
        [(0, 0, 3, 4.2), (0, 0, 7, 2.9), (0, -0.6, 15, 3.7), (0, 0.2, 22, 3.1), (0, 0, 33, 4.7)],
        [(0, 0, 33, 5.2), (0, 2.2, 38.5, 4.4), (0, 4.4, 43, 3.9), (0, 7.4, 49, 5.0), (0, 9, 52.5, 4.2)],
        [(-5.4, 9, 53, 3.1), (5.4, 9, 53, 3.1)],
        [(0, 9, 52, 2.6), (0, 11, 58, 2.3)],
        [(0, 12.2, 61.2, 4.1), (0, 13.4, 64, 4.4)],
        [(0, 9.4, 66.4, 2.2), (0, 8.9, 66.9, 2.2)],
        [(0, -1, 34, 4.6), (0, -10, 36.3, 3.9), (0, -17, 38, 3.0), (0, -23, 39.8, 2.9), (0, -28, 42, 2.0), (0, -32, 44.5, 1.6)],
        [(-5, 9, 53, 3.0), (-12, 10, 53.8, 2.6), (-19, 12.5, 54, 2.2), (-27, 19, 55.5, 1.9), (-31.5, 23.5, 57.2, 1.7)],
        [(5, 9, 53, 3.0), (12, 11, 53.8, 2.6), (18, 14.5, 54.2, 2.2), (26.5, 22, 56.5, 1.9), (31, 27.5, 58.6, 1.7)],
    ]
    plinth = m3.CrossSection([[(0, 0), (14, 0), (14, 3), (12.5, 4.5), (0, 4.5)]]).revolve(72)
    return grown(limbs, 2.5, 1.2, 0.015) + plinth


def tree() -> m3.Manifold:
    """A trunk with five branches leaning 48 to 76 degrees outward; each forks into two twigs."""
    limbs: list[Limb] = [[(0, 0, -9, 18), (0, 0, 12, 5.6), (0, 0, 22, 5), (0, 0, 35, 4.6)]]
    for azimuth, lean, start, length in (
        (10, 70, 27, 22),
        (100, 74, 31, 20),
        (190, 66, 25, 23),
        (280, 76, 29, 20),
        (55, 48, 34, 21),
    ):
        foot = (0.0, 0.0, float(start))
        fork = along(foot, azimuth, lean, length)
        limbs.append([(*foot, 4.2), (*fork, 2.7)])
        for aside, more in ((-26, 5), (24, -12)):
            knee = along(fork, azimuth + aside, lean + more, 8.0)
            limbs.append([(*fork, 2.6), (*knee, 2.2), (*along(knee, azimuth + 0.6 * aside, lean + more - 10, 7.0), 2.0)])
    return grown(limbs, 3.0, 1.6, 0.02)


def along(start: Point, azimuth_deg: float, lean_deg: float, length_mm: float) -> Point:
    """The point at a distance from start in the direction that leans from upright towards an azimuth."""
    a, t = math.radians(azimuth_deg), math.radians(lean_deg)
    step = (math.sin(t) * math.cos(a), math.sin(t) * math.sin(a), math.cos(t))
    return (start[0] + length_mm * step[0], start[1] + length_mm * step[1], start[2] + length_mm * step[2])


def pipe(length_mm: float, outer_mm: float, flange_mm: float, segments: int = 64) -> m3.Manifold:
    """A pipe along +z from the origin that ends in a welding-neck flange: its back is a 40 degree cone."""
    rise = (flange_mm - outer_mm) / math.tan(math.radians(40.0))
    plate_mm = length_mm - 3.0
    profile = [(0, 0), (outer_mm, 0), (outer_mm, plate_mm - rise), (flange_mm, plate_mm), (flange_mm, length_mm), (0, length_mm)]
    return m3.CrossSection([profile]).revolve(segments)


def bracket() -> m3.Manifold:
    """A pipe manifold: a round foot with bolt holes, an upright pipe and three side pipes with flanges."""
    profile = [(0, 0), (19, 0), (19, 5), (13, 5), (10, 12), (10, 44), (0, 44)]
    body = m3.CrossSection([profile]).revolve(64)
    bores = m3.Manifold.cylinder(60.0, 6.0, 6.0, 48).translate((0, 0, -1.0))
    for azimuth, lean, start, length, outer, bore in (
        (20, 84, 30, 34, 7, 4),
        (142, 62, 25, 40, 6.5, 4),
        (262, 76, 27, 29, 6, 3.5),
    ):
        turn = (0.0, float(lean), 0.0)
        side = pipe(length, outer, outer + 4.0).rotate(turn).rotate((0, 0, azimuth)).translate((0, 0, start))
        hole = m3.Manifold.cylinder(length + 1, bore, bore, 40).rotate(turn).rotate((0, 0, azimuth)).translate((0, 0, start))
        body, bores = body + side, bores + hole
    for k in range(4):
        bores += m3.Manifold.cylinder(9.0, 1.7, 1.7, 24).translate((16.2, 0, -1.0)).rotate((0, 0, 45 + 90 * k))
    return body - bores


def bar(start: Point, end: Point, radius_mm: float, segments: int = 24) -> m3.Manifold:
    """A round bar between two points with a ball at each end."""
    step = np.subtract(end, start)
    length = float(np.linalg.norm(step))
    lean, azimuth = math.degrees(math.acos(step[2] / length)), math.degrees(math.atan2(step[1], step[0]))
    rod = (
        m3.Manifold.cylinder(length, radius_mm, radius_mm, segments)
        .rotate((0, 0, 7.5))
        .rotate((0, lean, 0))
        .rotate((0, 0, azimuth))
    )
    ball = m3.Manifold.sphere(radius_mm, segments)
    return rod.translate(start) + ball.translate(start) + ball.translate(end)


def lattice() -> m3.Manifold:
    """Two storeys of four cells on a plate: a mast, struts inclined and horizontal outward, a ring around the top."""
    radius, cell, floors = 2.2, 17.0, (15.0, 28.0, 41.0)
    solid = m3.Manifold.cylinder(2.5, 12.0, 12.0, 64) + bar((0, 0, 1.0 + radius), (0, 0, floors[2]), 2.8)
    for azimuth in range(0, 360, 90):
        for low, high in pairwise(floors):
            here = along((0, 0, high), azimuth, 90, cell)
            solid += bar((0, 0, low), here, radius) + bar((0, 0, high), here, radius)
        solid += bar(along((0, 0, floors[2]), azimuth, 90, cell), along((0, 0, floors[2]), azimuth + 90, 90, cell), radius)
    return solid.simplify(0.005)


def standing(solid: m3.Manifold) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Vertices and faces in an order that does not depend on how the solid was made; base at z = 0, box about the z axis."""
    x0, y0, z0, x1, y1, _ = solid.bounding_box()
    mesh = solid.translate((-(x0 + x1) / 2, -(y0 + y1) / 2, -z0)).to_mesh64()
    vertices = np.asarray(mesh.vert_properties)[:, :3].astype("<f4") + np.float32(0.0)
    order = np.lexsort(vertices.T)
    rank = np.empty(len(order), dtype="<i4")
    rank[order] = np.arange(len(order))
    faces = rank[np.asarray(mesh.tri_verts)]
    first = faces.argmin(axis=1)
    faces = faces[np.arange(len(faces))[:, None], (first[:, None] + np.arange(3)) % 3]
    return vertices[order], faces[np.lexsort(faces.T[::-1])]


def ply(vertices: NDArray[np.float32], faces: NDArray[np.int32]) -> bytes:
    """A binary little-endian PLY file."""
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "comment unit mm",
        f"element vertex {len(vertices)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    return "\n".join(header).encode("ascii") + vertices.tobytes() + rows.tobytes()


DEMOS: dict[str, Callable[[], m3.Manifold]] = {"bracket": bracket, "figure": figure, "lattice": lattice, "tree": tree}


def main(folder: Path, names: Sequence[str] = tuple(DEMOS)) -> None:
    """Write demos into the folder and say what they are."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        vertices, faces = standing(DEMOS[name]())
        again = m3.Manifold(m3.Mesh(vertices, faces.astype(np.uint32)))
        if again.status() != m3.Error.NoError or len(again.decompose()) != 1:
            raise SystemExit(f"{name} is not one closed solid: {again.status()}, {len(again.decompose())} pieces")
        (folder / f"{name}.ply").write_bytes(ply(vertices, faces))
        size = np.ptp(vertices, axis=0)
        print(f"{name}: {len(faces)} faces, {size[0]:.1f} x {size[1]:.1f} x {size[2]:.1f} mm, {again.volume():.0f} mm3")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
