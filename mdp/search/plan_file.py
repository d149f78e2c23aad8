"""Plan file: a decomposition as a small TOML file that a user can read, edit and use again.

docs/plan.md has an example and explains every key. A hand-written file of planes needs no sha256, and a part may omit `normal` or
`offset_mm`: the search completes it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import sha256

import numpy as np

from mdp.decomposition import Decomposition, FrontRow
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane
from mdp.zone import NO_ZONES, Zone, Zones
from profiles.errors import PlanError
from profiles.frozen import Vector
from profiles.part_settings import PartSettings

VERSION = 1  # version of the meaning of a plan's keys
GRID_MM, GRID_SHIFT = 1e-3, 0.3141  # resolution of a sha256; shifted, since coordinates lie on whole and half micrometres
ZONE_KINDS = ("keep", "no_seam", "no_support", "support")  # as in mdp.zone.Zones
KEYS = ("version", "model", "sha256", "orientation", "part", *ZONE_KINDS, "modifier", "front")
MOST_MM = 1e5  # fifty times the size of a printable model (mdp.read.MOST_MM)
ROW_FIGURES = ("support_area_mm2", "seam_mm", "stairs_mm2", "cost_mm2")


@dataclass(frozen=True)
class PlannedPart:
    """The base plane of a part, its normal of length 1; None for a value that the search must find. limbs_mm: a point on each
    piece above the plane that belongs to the part; empty if everything above does. remark: a comment for the reader.
    """

    normal: Vector | None
    offset_mm: float | None
    remark: str = field(default="", compare=False)
    limbs_mm: tuple[Vector, ...] = ()

    @classmethod
    def of(cls, plane: Plane, remark: str = "") -> "PlannedPart":
        """The part that stands on a plane."""
        limbs_mm = () if plane.limbs_mm is None else tuple(map(_vector, plane.limbs_mm))
        return cls(_vector(plane.normal), float(plane.offset_mm), remark, limbs_mm)

    @property
    def plane(self) -> Plane | None:
        """The plane if it is complete, else None."""
        if self.normal is None or self.offset_mm is None:
            return None
        return Plane(np.array(self.normal), self.offset_mm, np.array(self.limbs_mm) if self.limbs_mm else None)


@dataclass(frozen=True)
class PlanFile:
    """The content of a plan file. name: the file's name, "" if the user has no such file; sha256: hash of its model, "" if it was
    written by hand for any model; orientation: rows of the rotation applied to the model before cutting, None if there is none;
    parts: in print order, without part 1; front: one row for every number of parts; settings: of single parts, including part 1.
    """

    name: str
    model: str = ""
    sha256: str = ""
    orientation: tuple[Vector, ...] | None = None
    parts: tuple[PlannedPart, ...] = ()
    zones: Zones = NO_ZONES
    front: tuple[FrontRow, ...] = ()
    settings: tuple[PartSettings, ...] = ()

    @property
    def label(self) -> str:
        """Beginning of a sentence about a place in the plan; "" for a plan without a name, which is in no file."""
        return self.name and f"plan {self.name}: "

    def row(self, most_parts: int) -> tuple[PlannedPart, ...]:
        """The parts, from the second, of the row with the most parts up to a number. Raises PlanError."""
        rows = {row.parts: planned_parts(row) for row in self.front} | {len(self.parts) + 1: self.parts}
        allowed = [count for count in rows if count <= most_parts]
        if not allowed:
            counts = ", ".join(map(str, sorted(rows)))
            raise PlanError(f"{self.name} holds no decomposition into {most_parts} parts or fewer, only into {counts}")
        return rows[max(allowed)]


NO_PLAN = PlanFile("")


def height_range(low_mm: float, high_mm: float) -> Zone:
    """A zone between two heights that is unbounded in x and y."""
    return Zone((-MOST_MM, -MOST_MM, low_mm), (MOST_MM, MOST_MM, high_mm))


def mesh_sha256(mesh: Mesh) -> str:
    """A hash of a mesh's faces and of its vertices to the micrometre, equal on every machine."""
    vertices = np.floor(mesh.vertices / GRID_MM + GRID_SHIFT).astype("<i8")
    return sha256(vertices.tobytes() + mesh.faces.astype("<i4").tobytes()).hexdigest()


def plan_of(
    decomposition: Decomposition,
    zones: Zones = NO_ZONES,
    orientation: Floats | None = None,
    settings: Sequence[PartSettings] = (),
) -> PlanFile:
    """The plan of a decomposition."""
    parts = []
    for part in decomposition.parts[1:]:
        pose = f"tilt {part.pose.tilt_deg:.2f} and turn {part.pose.turn_deg:.2f} deg"
        parts.append(PlannedPart.of(part.base, f"part {part.index}: {part.volume_mm3 / 1000:.2f} cm³, printed at {pose}"))
    turned = None if orientation is None else tuple(_vector(row) for row in orientation)
    sha = mesh_sha256(decomposition.mesh)
    return PlanFile("plan.toml", decomposition.name, sha, turned, tuple(parts), zones, decomposition.front, tuple(settings))


def planned_parts(row: FrontRow) -> tuple[PlannedPart, ...]:
    """The parts of a front row from the second, in print order."""
    return tuple(map(PlannedPart.of, reversed(row.planes)))


def _vector(values: Floats) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
