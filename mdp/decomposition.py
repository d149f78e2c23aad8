"""Decomposition: the ordered parts of a model, with the invariants that hold wherever one is made."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mdp.mesh import Floats, Mesh
from mdp.overhang import Mask
from mdp.plane import UP, Plane
from mdp.pose import Pose
from mdp.zone import UNMARKED, Marked, Modifier
from profiles.errors import UserError

VOLUME_TOLERANCE = 1e-6  # share of the model's volume: 200 random cuts lost at most 4e-16 of it; a lost sliver is larger
ORDER_TOLERANCE_MM = 1e-4  # 200 random cuts left corners 5e-14 mm off their planes; no print shows 0.1 µm


@dataclass(frozen=True, eq=False)
class Part:
    """One part: printed at one pose of the table, upward from its base plane.

    mesh lies in the workpiece frame. rotation (3, 3) turns the workpiece frame into the part frame's orientation at the pose, so
    rotation @ direction = +z and a point w has part coordinates rotation @ w - (0, 0, base.offset_mm). seam_mm is the visible
    length of its base's rim; feather_share the share of the rim at which base and surface meet at less than 20 degrees. needing
    (m,): faces that need support; needing_upright (m,): faces that would need it if the model were printed straight up in one
    piece; None: all overhangs. no_seam, no_support: user-marked zones without layer seams and without support; support: zones in
    which every overhang is supported; modifiers: zones with other settings. of: which part of which model on the plate this is,
    in words; "" on a plate with one model, or for parts of several. lifted_mm: height of its base plane above the build plate,
    for a part on a raft.
    """

    index: int
    mesh: Mesh
    base: Plane
    pose: Pose
    rotation: Floats
    volume_mm3: float
    risky_area_mm2: float
    seam_mm: float = 0.0
    feather_share: float = 0.0
    needing: Mask | None = None
    needing_upright: Mask | None = None
    no_seam: Marked = UNMARKED
    no_support: Marked = UNMARKED
    modifiers: tuple[Modifier, ...] = ()
    support: Marked = UNMARKED
    of: str = ""
    lifted_mm: float = 0.0

    @property
    def direction(self) -> Floats:
        """Unit printing direction in the workpiece frame, which is the base plane's normal."""
        return self.base.normal

    @property
    def on_plate(self) -> bool:
        """Whether the part stands on the build plate or on a raft there, as the first part of each model does."""
        return self.base.offset_mm == self.lifted_mm and bool((self.base.normal == UP).all())

    def with_marks(self, change: Callable[[Marked], Marked], change_modifier: Callable[[Modifier], Modifier]) -> "Part":
        """The part with its marks and modifiers changed."""
        return replace(
            self,
            no_seam=change(self.no_seam),
            no_support=change(self.no_support),
            support=change(self.support),
            modifiers=tuple(map(change_modifier, self.modifiers)),
        )

    def in_part_frame(self) -> Mesh:
        """The part's mesh in the part frame: direction is +z, base plane is z = 0."""
        return self.in_frame_of(self)

    def in_frame_of(self, part: "Part") -> Mesh:
        """The part's mesh in the frame of another part."""
        return self.mesh.transform(part.rotation, (0.0, 0.0, -part.base.offset_mm))


@dataclass(frozen=True, eq=False)
class FrontRow:
    """A decomposition on the Pareto front: its planes in the order of the cuts, and its cost.

    seam_mm: length of the rims of all cuts; stairs_mm2: cost of the stair-stepping of all parts; time_s, filament_mm: estimates,
    None if not estimated; total_mm2: cost with time, filament and the charge for further parts, None if these do not count;
    reason: why it was chosen, as it follows that word; flaw: why it is chosen only on request, empty if nothing speaks against
    it.
    """

    planes: tuple[Plane, ...]
    support_area_mm2: float
    seam_mm: float
    cost_mm2: float
    chosen: bool = False
    time_s: float | None = None
    filament_mm: float | None = None
    reason: str = ""
    stairs_mm2: float = 0.0
    flaw: str = ""
    total_mm2: float | None = None

    @property
    def parts(self) -> int:
        """The number of parts."""
        return len(self.planes) + 1


@dataclass(frozen=True, eq=False)
class Decomposition:
    """A model, or several on one plate, and their parts in print order (index 1, 2, ...); the first part of each model stands on
    the build plate.

    risky_area_mm2 is the area that needs support when the whole model is printed straight up, residual_area_mm2 the area that the
    parts leave. rejected says why a search that cut nothing has rejected its candidates. folded_mm3 is how far the mesh's volume
    may differ from the parts' total, because its surface intersects itself. uncut is each model as one part with its marks,
    centred about the turn axis; () if unknown, which means without marks.
    """

    name: str
    mesh: Mesh
    parts: tuple[Part, ...]
    beam_width: int
    ranker: str
    risky_area_mm2: float
    residual_area_mm2: float
    candidates_evaluated: int
    rounds: int
    search_s: float
    notes: tuple[str, ...] = ()
    rejected: tuple[str, ...] = ()
    folded_mm3: float = 0.0
    front: tuple[FrontRow, ...] = ()
    uncut: tuple[Part, ...] = ()

    def __post_init__(self) -> None:
        whole, together = self.mesh.volume_mm3, self.volume_mm3
        if abs(together - whole) > VOLUME_TOLERANCE * whole + self.folded_mm3:
            raise UserError(f"the parts of {self.name} add up to {together:.6g} mm³, the model has {whole:.6g} mm³")
        self._check_order()

    @property
    def reduction(self) -> float:
        """Share of the risky area that the decomposition saves, 0 to 1; 0 for a model without risky faces."""
        return 1.0 - self.residual_area_mm2 / self.risky_area_mm2 if self.risky_area_mm2 > 0 else 0.0

    @property
    def chosen(self) -> FrontRow | None:
        """The chosen row of the front; None if the parts do not come from a search."""
        return next((row for row in self.front if row.chosen), None)

    @property
    def cost_mm2(self) -> float:
        """Cost of the chosen row, mm2: area that needs support plus blemishes; the area alone if the parts do not come from a
        search.
        """
        return self.residual_area_mm2 if self.chosen is None else self.chosen.cost_mm2

    @property
    def seam_mm(self) -> float:
        """Visible length of the cut seams, mm."""
        return 0.0 if self.chosen is None else self.chosen.seam_mm

    @property
    def stairs_mm2(self) -> float:
        """Cost of the stair-stepping of all parts, mm2."""
        return 0.0 if self.chosen is None else self.chosen.stairs_mm2

    @property
    def volume_mm3(self) -> float:
        """Total volume of the parts, mm3."""
        return sum(part.volume_mm3 for part in self.parts)

    def _check_order(self) -> None:
        """Check that each part lies above its base plane, and everything printed before it lies below, unless it is a limb."""
        for position, part in enumerate(self.parts):
            if part.index != position + 1:
                raise UserError(f"part {part.index} of {self.name} stands at place {position + 1} of the print order")
            lowest = float(part.base.heights_mm(part.mesh.vertices).min())
            if lowest < -ORDER_TOLERANCE_MM:
                raise UserError(f"part {part.index} of {self.name} reaches {-lowest:.4g} mm below its base plane")
            for earlier in self.parts[:position] if part.base.limbs_mm is None else ():
                highest = float(np.max(part.base.heights_mm(earlier.mesh.vertices)))
                if highest > ORDER_TOLERANCE_MM:
                    raise UserError(
                        f"part {earlier.index} of {self.name} stands {highest:.4g} mm above the base plane of part {part.index}"
                    )
