"""Makes the models that ship with the program: `python tools/docs/make_demos.py [FOLDER]` writes mdp/demos/NAME.ply and
NAME.png, the small picture that the workbench shows where nothing is open.

Every model is one closed solid standing on a flat base about the z axis whose limbs need several printing directions.
The organic ones are level sets of smoothly united round cones, the others exact boolean unions of cylinders and bars.
"""

import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

import manifold3d as m3
import numpy as np
from numpy.typing import NDArray

from machine.pipeline.pictures import PLAIN, small_picture
from mdp.kernels.kernel import kernel
from mdp.plane import Plane
from mdp.read import read_mesh
from mdp.search.plan_file import PlanFile, PlannedPart, mesh_sha256
from mdp.search.plan_writing import plan_text
from tools.docs.harness import ROOT

FOLDER = ROOT / "mdp" / "demos"
Point = tuple[float, float, float]
Knot = tuple[float, float, float, float]
Limb = list[Knot]  # x, y, z, radius of the knots of a chain of round cones


@kernel
def cone_distance(knots: NDArray[np.float64], k: int, x: float, y: float, z: float) -> float:
    """Distance of a point to the segment from knot k to the next, along which the radius varies linearly, mm."""
    a, b = knots[k], knots[k + 1]
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    share = ((x - a[0]) * dx + (y - a[1]) * dy + (z - a[2]) * dz) / (dx * dx + dy * dy + dz * dz)
    share = min(max(share, 0.0), 1.0)
    across = (x - a[0] - share * dx) ** 2 + (y - a[1] - share * dy) ** 2 + (z - a[2] - share * dz) ** 2
    return math.sqrt(across) - (a[3] + share * (b[3] - a[3]))


@kernel
def _united(knots: NDArray[np.float64], first: NDArray[np.int64], blend_mm: float, x: float, y: float, z: float) -> float:
    """The field of smooth_union; limb k has the knots first[k]:first[k + 1]."""
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
    branches = ((10, 70, 27, 22), (100, 74, 31, 20), (190, 66, 25, 23), (280, 76, 29, 20), (55, 48, 34, 21))
    for azimuth, lean, start, length in branches:
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
    sides = ((20, 84, 30, 34, 7, 4), (142, 62, 25, 40, 6.5, 4), (262, 76, 27, 29, 6, 3.5))
    for azimuth, lean, start, length, outer, bore in sides:
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
    rod = m3.Manifold.cylinder(length, radius_mm, radius_mm, segments).rotate((0, 0, 7.5))
    rod = rod.rotate((0, lean, 0)).rotate((0, 0, azimuth))
    ball = m3.Manifold.sphere(radius_mm, segments)
    return rod.translate(start) + ball.translate(start) + ball.translate(end)


def lattice() -> m3.Manifold:
    """Two storeys of four cells on a plate: a mast, inclined struts and horizontal ones outward, a ring around the top."""
    radius, cell, floors = 2.2, 17.0, (15.0, 28.0, 41.0)
    solid = m3.Manifold.cylinder(2.5, 12.0, 12.0, 64) + bar((0, 0, 1.0 + radius), (0, 0, floors[2]), 2.8)
    for azimuth in range(0, 360, 90):
        for low, high in pairwise(floors):
            here = along((0, 0, high), azimuth, 90, cell)
            solid += bar((0, 0, low), here, radius) + bar((0, 0, high), here, radius)
        solid += bar(along((0, 0, floors[2]), azimuth, 90, cell), along((0, 0, floors[2]), azimuth + 90, 90, cell), radius)
    return solid.simplify(0.005)


# The calibration piece, mm: on each of its faces u points right and v up the slope, from the centre of the face's scales.
SCALE_MM, FINER_MM = 2.0, 0.1  # pitch of the grooves across the slope, and difference of the notches above them
GRID_MM = 0.6  # whole layers of 0.1, 0.15, 0.2 and 0.3 mm: grooves along the layers begin and end there
ASIDE, UP = 4, 3  # marks on either side of the middle one
NOTCH_MM, DEEP_MM, LONG_MM, SHORT_MM, GAP_MM = 0.8, 1.0, 3.2, 2.2, 0.3
PADS, ARM_MM, EDGE_MM, OVER_MM = 4, 24.0, 1.2, 0.02
PAD_MM, PAD_HEIGHT_MM = ((-10.2, -8.6), (9.2, 8.6)), 1.2  # least and greatest u and v
DOT_MM = 1.5
ABOVE_MM = PAD_MM[1][1] + EDGE_MM  # from the centre of a face up to its edge


def calibration(lean_deg: float, clear_mm: float) -> m3.Manifold:
    """Four roofs about a square, each with a pad printed after the table has turned and tilted by lean_deg.

    Like a vernier, the pad's notches above the grooves of the roof show by how many tenths of a mm it is shifted aside and up.
    clear_mm: height above the plate below which no pad may reach.
    """
    lean, half = math.radians(lean_deg), 0.5 * ARM_MM
    below_mm = LONG_MM + GAP_MM - PAD_MM[0][1] + EDGE_MM
    middle_mm = _middle_mm(lean, clear_mm)
    low, high = middle_mm - below_mm * math.sin(lean), middle_mm + ABOVE_MM * math.sin(lean)
    run = (below_mm + ABOVE_MM) * math.cos(lean)
    outline = [(-half - run, 0), (half + run, 0), (half + run, low), (half, high), (-half, high), (-half - run, low)]
    roof = m3.Manifold.extrude(m3.CrossSection([outline]), ARM_MM).translate((0, 0, -half)).rotate((90, 0, 0))
    solid = roof + roof.rotate((0, 0, 90))
    place = (half + ABOVE_MM * math.cos(lean), 0.0, middle_mm)
    frame = np.column_stack([(0, 1, 0), (-math.cos(lean), 0, math.sin(lean)), (math.sin(lean), 0, math.cos(lean)), place])
    for k in range(PADS):
        grooves, pad = (piece.transform(frame).rotate((0, 0, 90.0 * k)) for piece in (_grooves(lean), _pad(lean, k + 1)))
        solid = solid - grooves + pad
    return solid


def roofs(lean_deg: float, clear_mm: float) -> list[Plane]:
    """The base planes of the pads: just above the roofs, which stay whole."""
    lean = math.radians(lean_deg)
    out, up = math.sin(lean), math.cos(lean)
    offset = (0.5 * ARM_MM + ABOVE_MM * math.cos(lean)) * out + _middle_mm(lean, clear_mm) * up + OVER_MM
    quarters = ((1, 0), (0, 1), (-1, 0), (0, -1))
    return [Plane(np.array([out * x, out * y, up]), offset) for x, y in quarters]


def _middle_mm(lean: float, clear_mm: float) -> float:
    """Height of the centre of a face above the plate, mm: the grooves around it begin and end between layers."""
    return GRID_MM * (math.ceil((clear_mm - PAD_MM[0][1] * math.sin(lean)) / GRID_MM) + 0.5)


def _grooves(lean: float) -> m3.Manifold:
    """The scales of a face, below its pad and to the right of it; those along the layers have a self-supporting ceiling."""
    (_, low), (right, _) = PAD_MM
    inside, half = GRID_MM + 0.5 * GRID_MM / math.tan(lean), 0.5 * GRID_MM
    slot = m3.CrossSection([[(-inside, -half), (DEEP_MM, -half), (DEEP_MM, half), (GRID_MM - inside, half)]])
    upright = np.array([(0, -math.cos(lean), math.sin(lean)), (0, math.sin(lean), math.cos(lean)), (-1, 0, 0)])
    cutters = []
    for k in range(-ASIDE, ASIDE + 1):
        groove = m3.Manifold.cube((NOTCH_MM, _long(k), 2 * DEEP_MM), True)
        cutters.append(groove.translate((k * SCALE_MM, low - GAP_MM - 0.5 * _long(k), 0)))
    for k in range(-UP, UP + 1):
        place = (right + GAP_MM + _long(k), k * _up_mm(lean), 0)
        cutters.append(m3.Manifold.extrude(slot, _long(k)).transform(np.column_stack([*upright, place])))
    return m3.Manifold.batch_boolean(cutters, m3.OpType.Add)


def _pad(lean: float, dots: int) -> m3.Manifold:
    """A pad with notches in its lower and right edges, and its number as holes."""
    (left, low), (right, high) = PAD_MM
    outline = m3.CrossSection.square((right - left, high - low)).translate((left, low))
    for k in range(-ASIDE, ASIDE + 1):
        notch = m3.CrossSection.square((NOTCH_MM, 2 * _long(k)), True)
        outline -= notch.translate((k * (SCALE_MM - FINER_MM), low))
    for k in range(-UP, UP + 1):
        notch = m3.CrossSection.square((2 * _long(k), NOTCH_MM), True)
        outline -= notch.translate((right, k * (_up_mm(lean) - FINER_MM)))
    for dot in range(dots):
        outline -= m3.CrossSection.circle(0.5 * DOT_MM, 24).translate((left + 2.5 * (dot + 1), high - 2.5))
    return m3.Manifold.extrude(outline, PAD_HEIGHT_MM + GAP_MM).translate((0, 0, -GAP_MM))  # rooted in the roof: one solid


def _up_mm(lean: float) -> float:
    """Pitch of the grooves along the slope, mm, a whole number of grids high."""
    return round(SCALE_MM * math.sin(lean) / GRID_MM) * GRID_MM / math.sin(lean)


def _long(mark: int) -> float:
    return LONG_MM if mark == 0 else SHORT_MM


def standing(solid: m3.Manifold) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Vertices and faces in an order that does not depend on the construction; base at z = 0, bounding box centred on the z
    axis."""
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
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    header = f"ply\nformat binary_little_endian 1.0\ncomment unit mm\nelement vertex {len(vertices)}\n{axes}"
    header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, faces
    return header.encode("ascii") + vertices.tobytes() + rows.tobytes()


# For each name the lean of the pads and their height above the plate: clear for most heads, and for the broadest.
LEANS = {"calibration": (60.0, 15.0), "calibration30": (30.0, 26.0)}
DEMOS: dict[str, Callable[[], m3.Manifold]] = {
    "bracket": bracket,
    "calibration": partial(calibration, *LEANS["calibration"]),
    "calibration30": partial(calibration, *LEANS["calibration30"]),
    "figure": figure,
    "lattice": lattice,
    "tree": tree,
}


def write_plan(folder: Path, name: str) -> None:
    """Write the plan by which a calibration piece is cut, beside it."""
    mesh, _ = read_mesh(folder / f"{name}.ply")
    parts = tuple(
        PlannedPart(tuple((plane.normal.round(9) + 0.0).tolist()), round(plane.offset_mm, 6), f"pad {number}")
        for number, plane in enumerate(roofs(*LEANS[name]), 1)
    )
    plan = PlanFile(f"{name}.toml", f"{name}.ply", mesh_sha256(mesh), None, parts)
    (folder / f"{name}.toml").write_text(plan_text(plan), encoding="utf-8")


def write_picture(folder: Path, name: str) -> None:
    """Write the small picture of a demo, on a transparent background, beside it."""
    mesh, _ = read_mesh(folder / f"{name}.ply")
    (folder / f"{name}.png").write_bytes(small_picture([mesh], [PLAIN]))


def main(folder: Path, names: Sequence[str] = tuple(DEMOS)) -> None:
    """Write demos into the folder and report them."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        vertices, faces = standing(DEMOS[name]())
        again = m3.Manifold(m3.Mesh(vertices, faces.astype(np.uint32)))
        if again.status() != m3.Error.NoError or len(again.decompose()) != 1:
            raise SystemExit(f"{name} is not one closed solid: {again.status()}, {len(again.decompose())} pieces")
        (folder / f"{name}.ply").write_bytes(ply(vertices, faces))
        if name in LEANS:
            write_plan(folder, name)
        else:
            write_picture(folder, name)
        size = np.ptp(vertices, axis=0)
        print(f"{name}: {len(faces)} faces, {size[0]:.1f} x {size[1]:.1f} x {size[2]:.1f} mm, {again.volume():.0f} mm3")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
