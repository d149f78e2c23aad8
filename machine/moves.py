"""Moves: the machine program between the slicer and the G-code text, in machine coordinates."""

from dataclasses import dataclass

from mdp.mesh import Floats
from mdp.pose import Pose
from slicer.paths import Kind


@dataclass(frozen=True)
class BeginPart:
    """The moves after this print part `index` at `pose`; turn and tilt have been reached by a Reorient.

    unsupported_mm2: area of its risky faces that no support could be given; unsupported_layer: the layer with most of it.
    """

    index: int
    pose: Pose
    layers: int
    unsupported_mm2: float = 0.0
    unsupported_layer: int = 0


@dataclass(frozen=True)
class BeginLayer:
    """The strokes after this lie in one layer; z_mm is measured from the part's base plane, nozzle_add_c from the material's."""

    part: int
    index: int
    z_mm: float
    height_mm: float
    fan: float
    nozzle_add_c: float = 0.0


@dataclass(frozen=True, eq=False)
class Stroke:
    """Extruding: points_mm (n, 3) machine coordinates, the first is where the tip already stands; filament_mm (n - 1,).

    fan: 0..1 where it differs from the layer's. acceleration_mm_s2: where it differs from what the axes allow.
    """

    kind: Kind
    points_mm: Floats
    filament_mm: Floats
    speed_mm_s: float
    width_mm: float
    fan: float | None = None
    acceleration_mm_s2: float | None = None


@dataclass(frozen=True, eq=False)
class Travel:
    """Moving without extruding through points_mm (n, 3), machine coordinates, the first is where the tip stands."""

    points_mm: Floats
    speed_mm_s: float
    acceleration_mm_s2: float | None = None


@dataclass(frozen=True, eq=False)
class Wipe:
    """Moving over what was just printed while filament is pulled back: points_mm (n, 3), filament_mm (n - 1,) above 0."""

    points_mm: Floats
    filament_mm: Floats
    speed_mm_s: float


@dataclass(frozen=True)
class Retract:
    """Pull filament back (positive) or push it forward again (negative): a prime."""

    filament_mm: float
    speed_mm_s: float


@dataclass(frozen=True)
class Reorient:
    """Turn the table to `pose` at the slowest axis's pace; the tip stands still at a safe place."""

    pose: Pose
    speed_deg_s: float


Move = BeginPart | BeginLayer | Stroke | Travel | Wipe | Retract | Reorient


@dataclass(frozen=True, eq=False)
class MachineProgram:
    """All moves of a print in order, and the model's name for the file's head."""

    name: str
    moves: tuple[Move, ...]
