"""Parts made by hand, and helpers of the tests of the slicer."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import manifold3d as m3
import numpy as np
import pytest
import shapely

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.plane import PLATFORM, Plane
from mdp.pose import level, poses, rotation, unit
from mdp.topology.cross_section import cross_sections
from profiles.profile import Profile, load
from slicer.geometry.polygons import Polygons, clean
from slicer.heights import Heights
from slicer.paths import KINDS, Kind, SlicedPart
from slicer.paths import Path as Stroke
from slicer.sectioning import Sections
from slicer.strokes.strokes import Strokes
from tests.shapes import from_manifold

BARE = ("process.skirt_loops=0", "process.small_base_brim_mm=0", "process.support=none", "process.elephant_foot_mm=0")
SOLID = (*BARE, "process.infill_density=1")


def profile(*settings: str) -> Profile:
    """The standard profiles with settings."""
    return load(settings=settings)


def whole(mesh: Mesh) -> Part:
    """A mesh as the only part, on the build plate."""
    machine = profile().machine
    return Part(1, mesh, PLATFORM, level(machine), rotation(machine, level(machine)), mesh.volume_mm3, 0.0)


def cut(mesh: Mesh, *planes: tuple[Sequence[float], float]) -> list[Part]:
    """The parts of a mesh cut by planes (normal, offset); the part above the first plane is printed last."""
    machine = profile().machine
    rest = m3.Manifold(m3.Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    above = []
    for normal, offset in planes:
        top, rest = rest.split_by_plane(unit(normal), offset)
        above.append((from_manifold(top), Plane(unit(normal), offset)))
    parts = [whole(from_manifold(rest))]
    for index, (piece, base) in enumerate(reversed(above), 2):
        pose = poses(machine, base.normal)[0]
        parts.append(Part(index, piece, base, pose, rotation(machine, pose), piece.volume_mm3, 0.0))
    return parts


def sections_at(mesh: Mesh, cuts_mm: Floats, *settings: str) -> Sections:
    """The sections of a mesh on the build plate at some heights, with layers of 0.2 mm around them."""
    outlines = [clean(loops, 0.0) for loops in cross_sections(mesh, cuts_mm)]
    heights = Heights(cuts_mm + 0.1, np.full(len(cuts_mm), 0.2), cuts_mm)
    plate, empty, own = Polygons.square((400.0, 400.0), True), [Polygons()] * len(outlines), profile(*settings)
    return Sections(whole(mesh), (), (), own, mesh, heights, outlines, outlines, outlines, empty, None, plate, [Polygons()])


def section_at(mesh: Mesh, z_mm: float) -> Polygons:
    """The cleaned section at a height."""
    return clean(cross_sections(mesh, np.array([z_mm]))[0])


def of_kind(sliced: SlicedPart, *kinds: Kind) -> list[Stroke]:
    """All paths of some kinds."""
    return [path for layer in sliced.layers for path in layer.paths if path.kind in kinds]


def volume_mm3(sliced: SlicedPart, *kinds: Kind) -> float:
    """Plastic of some kinds."""
    return float(sum(layer.volumes_mm3[layer.is_of(*kinds)].sum() for layer in sliced.layers))


class Row(NamedTuple):
    """A stroke of a table; points (n, 2) as printed, approach (k, 2)."""

    kind: Kind
    points: Floats
    width_mm: float
    retract: bool
    approach: Floats


def rows_of(strokes: Strokes) -> list[Row]:
    """The strokes of a table one by one."""
    points = [strokes.points[a:b, :2] for a, b in pairwise(strokes.starts)]
    approaches = [strokes.approach[a:b] for a, b in pairwise(strokes.approach_starts)]
    kinds = [KINDS[number] for number in strokes.kind]
    columns = kinds, points, strokes.width_mm.tolist(), strokes.retract.tolist(), approaches
    return [Row(*row) for row in zip(*columns, strict=True)]


def content(sliced: SlicedPart) -> bytes:
    """Every number of a sliced part."""
    rows = [(layer.z_mm, layer.height_mm, layer.fan) for layer in sliced.layers]
    strokes = [p for layer in sliced.layers for p in layer.paths]
    marks = [(p.kind.value, p.width_mm, p.speed_mm_s, p.flow, p.retract) for p in strokes]
    return repr((rows, marks)).encode() + b"".join(p.points.tobytes() + p.approach.tobytes() for p in strokes)


def shared(name: str, height_mm: float) -> Mesh:
    """A real model from outside the project, scaled to a height; skips the test if the file is missing."""
    file = Path(__file__).resolve().parents[3] / "shared" / "meshes" / f"{name}.npz"
    if not file.exists():
        pytest.skip(f"{name} is not here")
    with np.load(file) as arrays:
        vertices, faces = np.asarray(arrays["vertices"], dtype=np.float64), arrays["faces"]
    return Mesh(vertices * (height_mm / np.ptp(vertices[:, 2])), faces)


def as_shapely(polygons: Polygons) -> shapely.Geometry:
    """Polygons converted to shapely's, holes by the even-odd rule."""
    rings = shapely.MultiLineString([np.vstack([loop, loop[:1]]) for loop in polygons.to_polygons()])
    return shapely.build_area(shapely.node(rings))


def distances_mm(polygons: Polygons, points: Floats) -> Floats:
    """Distance of each point to the polygons' boundary, positive inside, by shapely."""
    area = as_shapely(polygons)
    away = shapely.distance(area.boundary, shapely.points(points))
    signed: Floats = np.where(shapely.contains_xy(area, points), away, -away)
    return signed


def ragged(seed: int) -> Polygons:
    """A star with holes and an island in one of them."""
    random = np.random.default_rng(seed)
    turn = np.sort(random.uniform(0, 2 * np.pi, 25))
    star = Polygons([np.column_stack([np.cos(turn), np.sin(turn)]) * random.uniform(8, 30, (25, 1))])
    for centre in random.uniform(-15, 15, (6, 2)):
        star = star - Polygons.circle(random.uniform(1, 4), 12).translate(centre)
    return star + Polygons.circle(0.8, 8)
