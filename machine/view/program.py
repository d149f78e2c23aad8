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
