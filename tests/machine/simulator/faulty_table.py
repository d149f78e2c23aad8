"""A probed table whose probe fails."""

from math import inf, nan
from typing import Any

from machine.simulator.contact import ProbedTable


class FaultyTable(ProbedTable):
    """From probing move number silent_from the probe never triggers, from early_from it triggers at once; counted from 1."""

    def __init__(self, *what: Any, silent_from: float = inf, early_from: float = inf, **more: Any) -> None:
        super().__init__(*what, **more)
        self._silent_from, self._early_from, self._moves = silent_from, early_from, 0

    def stop_z(self, positions: list[float], low_mm: float) -> float:
        self._moves += 1
        if self._moves >= self._early_from:
            return positions[2]
        return nan if self._moves >= self._silent_from else super().stop_z(positions, low_mm)
