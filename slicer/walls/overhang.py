"""Overhangs: the stretches of walls that hardly lie on the layer below, split off so that they are printed slowly."""

from collections.abc import Sequence
from dataclasses import replace

from profiles.process import Process
from slicer.geometry.polygons import Polygons, offset
from slicer.paths import Kind
from slicer.travel.order import Placed
from slicer.travel.split import split

WALLS = (Kind.OUTER_WALL, Kind.INNER_WALL)
SHORTEST = 2.0  # line widths: no stretch is split off for less, the speed would flicker
NOISE_MM = 0.02  # two sections of one upright surface differ by as much after their cleaning


def split_overhangs(placed: Sequence[Placed], section: Polygons, bank: Polygons | None, process: Process) -> list[Placed]:
    """The beads of a layer with its walls split where they begin and cease to overhang, in the same order.

    bank: what the layer lies on; None: the platform. A bead of width w whose centreline runs d outside the bank has the
    share 1/2 - d/w of its width on it; it overhangs where that is less than process.overhang_share.
    """
    if bank is None or process.overhang_share <= 0.0:
        return list(placed)
    width = process.line_width_mm
    hanging = section - offset(bank, max((0.5 - process.overhang_share) * width, NOISE_MM))
    if hanging.area() < SHORTEST * width * NOISE_MM:
        return list(placed)
    return split(placed, hanging, WALLS, SHORTEST * width, lambda bead: replace(bead, kind=Kind.OVERHANG))
