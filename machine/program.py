"""Program: a print's G-code with its dry run and parts, and alternative ways to print a model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from machine.dryrun.dryrun import DryRun
from profiles.profile import Profile
from slicer.paths import SlicedPart

if TYPE_CHECKING:
    from mdp.decomposition import Decomposition
    from mdp.joint import Joint


@dataclass(frozen=True, eq=False)
class Program:
    """The G-code of a print, its dry run, and its parts if it was made from a model."""

    lines: Sequence[str]
    run: DryRun
    decomposition: "Decomposition | None"
    sliced: tuple[SlicedPart, ...] = ()

    @property
    def interface_mm3(self) -> dict[int, float]:
        """Plastic that the interfaces add, mm³, by the part above; {} if unknown."""
        more: dict[int, float] = {}
        for piece in self.sliced:
            for index, mm3 in piece.interface_mm3.items():
                more[index] = more.get(index, 0.0) + mm3
        return dict(sorted(more.items()))


def joints_of_print(program: Program, profile: Profile) -> "tuple[Joint, ...]":
    """The joints of a print with the contact of their first layers from the dry run; () if the model is unknown."""
    if program.decomposition is None:
        return ()
    from mdp.joint import joints_of  # not needed for a G-code file

    laid = {face.part: face for face in program.run.interfaces}
    return tuple(
        replace(joint, contact_share=laid[joint.part].contact, plastic_over_room=laid[joint.part].over_room)
        if joint.part in laid
        else joint
        for joint in joints_of(program.decomposition.parts, profile)
    )


@dataclass(frozen=True)
class Alternative:
    """One way to print a model, with its figures. They are None if it cannot be printed this way, and message says why.

    risky_mm2: overhanging area that needs support; unsupported_mm2: its share that can get none; seam_mm: length of the cut
    seams; stairs_mm2: area blemished by stair-stepping; interface_mm3: plastic that the interfaces add, by the part above;
    joints: their loads; findings: their number in the dry run.
    """

    name: str
    orientation: str
    parts: int
    time_s: float | None = None
    filament_mm: float | None = None
    filament_g: float | None = None
    support_mm3: float | None = None
    risky_mm2: float = 0.0
    message: str = ""
    unsupported_mm2: float | None = None
    seam_mm: float = 0.0
    stairs_mm2: float = 0.0
    interface_mm3: Mapping[int, float] = field(default_factory=dict)
    joints: "tuple[Joint, ...]" = ()
    findings: int = 0
