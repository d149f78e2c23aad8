"""Program: the G-code of a print with its dry run, and the parts it was made of where it was made from a model."""

from dataclasses import dataclass

from machine.dryrun.dryrun import DryRun
from mdp.decomposition import Decomposition
from slicer.paths import SlicedPart


@dataclass(frozen=True, eq=False)
class Program:
    """The G-code of a print, its dry run, and its parts where it was made from a model."""

    lines: tuple[str, ...]
    run: DryRun
    decomposition: Decomposition | None
    sliced: tuple[SlicedPart, ...] = ()

    @property
    def interface_mm3(self) -> dict[int, float]:
        """Plastic that there would not be if the model were in one piece, by the part that stands on it; {} where not known."""
        more: dict[int, float] = {}
        for piece in self.sliced:
            for index, mm3 in piece.interface_mm3.items():
                more[index] = more.get(index, 0.0) + mm3
        return dict(sorted(more.items()))
