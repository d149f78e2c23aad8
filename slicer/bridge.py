"""Bridges: hanging places whose lines can span from bank to bank, and the direction in which they do."""

from dataclasses import dataclass

import numpy as np

from mdp.mesh import Floats
from slicer.polygons import Polygons, edges, grown
from slicer.scanline import all_inside, clipped

LONGEST_MM = 6.0  # spans up to this print without support; PLA with a fan manages more, PETG hardly
TURNS = 12  # directions tried, over half a turn
LEAST = 4.0  # in line widths squared: a smaller place is no bridge but an edge
ANCHOR = 2.0  # line widths that the lines of a bridge reach over its banks


@dataclass(frozen=True, eq=False)
class Bridge:
    """area: the hanging place with its anchors on the banks; angle_deg: direction of its lines."""

    area: Polygons
    angle_deg: float


def bridge(hanging: Polygons, banks: Floats, width_mm: float, longest_mm: float) -> Bridge | None:
    """The bridge over one connected hanging place, in the direction of the shortest span; None if it is none.

    banks: (n, 4) edges of the layer below, grown by a quarter of a line. Every line has both ends on a bank, and none is
    longer than longest_mm.
    """
    if hanging.area() < LEAST * width_mm**2 or not len(banks):
        return None
    around = edges(hanging).reshape(-1, 2)
    best, shortest = None, longest_mm
    for k in range(TURNS):
        angle = np.pi * k / TURNS
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        sides = np.ascontiguousarray((around @ turn).reshape(-1, 4))
        rows = clipped(sides, np.arange(sides[:, 1].min() + 0.5 * width_mm, sides[:, 1].max(), width_mm))
        span = float((rows[:, 1] - rows[:, 0]).max()) if len(rows) else np.inf
        if span < shortest and all_inside(banks, np.concatenate([rows[:, [0, 2]], rows[:, [1, 2]]]) @ turn.T):
            best, shortest = float(np.degrees(angle)), span
    return None if best is None else Bridge(grown(hanging, ANCHOR * width_mm), best)
