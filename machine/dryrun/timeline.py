"""Timeline: what a dry run knows of any line of a program: where the axes stand after it, and how long the rest takes."""

import numpy as np

from machine.dryrun.dryrun import DryRun
from machine.gcode.reader.parsed import MoveKind


class Timeline:
    """What a dry run knows about the way of a print: where the table stands at a line, what is left to do, layers of a part."""

    beginning = "starting"  # as long as there is no part

    def __init__(self, run: DryRun) -> None:
        program = run.program
        self.letters = run.letters
        self._line, self._ends = program.line, program.end
        self._done_s = np.concatenate([[0.0], np.cumsum(run.times_s)])
        self._waits = list(run.waits)
        laying = program.kind == MoveKind.EXTRUDE  # the way to a part still counts to the layer before it
        self._layers = {part: len(np.unique(program.layer[laying & (program.part == part)])) for part in program.parts}

    def at(self, file_line: int) -> dict[str, float]:
        """Where the axes stand after a line of the program, by their letters, mm and deg; {} before the first move."""
        row = self._rows(file_line) - 1
        return {} if row < 0 else dict(zip(self.letters, self._ends[row].tolist(), strict=False))

    def remaining_s(self, file_line: int) -> float:
        """How long moves and waits after a line of the program take; heating before the print and homing are not counted."""
        waits_s = sum(wait_s for line, wait_s in self._waits if line > file_line)
        return float(self._done_s[-1] - self._done_s[self._rows(file_line)]) + waits_s

    def _rows(self, file_line: int) -> int:
        """How many moves there are up to a line."""
        return int(np.searchsorted(self._line, file_line, side="right"))

    def layers(self, part: int | None) -> int | None:
        """Layers of a part."""
        return None if part is None else self._layers.get(part)
