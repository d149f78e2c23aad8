"""Overhangs: the stretches of walls and gap lines that hardly lie on the layer below, split off to be printed slowly."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from profiles.process import Process
from slicer.geometry.polygons import Polygons, offset
from slicer.paths import NUMBER, Kind
from slicer.strokes.split import split
from slicer.strokes.strokes import Strokes

SPLIT = (Kind.OUTER_WALL, Kind.INNER_WALL, Kind.GAP, Kind.OVERHANG)
STEPS = (0.75, 0.5, 0.25, 0.0)  # shares of a bead's width on plastic below which it is printed more slowly
SHORTEST = 2.0  # line widths: no stretch is split off for less, the speed would flicker
NOISE_MM = 0.02  # two sections of one upright surface differ by as much after their cleaning


def split_overhangs(strokes: Strokes, section: Polygons, below: Polygons | None, process: Process) -> Strokes:
    """The strokes of a layer with its walls and gap lines split where less and less of their width lies on plastic.

    below: what the layer lies on; None: the platform. A bead of width w whose centreline runs d outside what is below has the
    share 1/2 - d/w of its width on it; it overhangs where that is less than process.overhang_share.
    """
    if below is None or process.overhang_share <= 0.0:
        return strokes
    width_mm, shortest_mm = process.line_width_mm, SHORTEST * process.line_width_mm
    beyond = hanging_area(section, below, 0.5, width_mm)
    if beyond.area() < shortest_mm * NOISE_MM:
        return strokes  # the section barely overhangs: no centreline, half a line inside it, can
    for share in sorted({*STEPS, process.overhang_share}, reverse=True):
        hanging = beyond if share == 0.5 else hanging_area(section, below, share, width_mm)
        if hanging.area() < shortest_mm * NOISE_MM:
            break
        kinds = SPLIT if share <= 0.5 else (Kind.OUTER_WALL,)  # inner ones lie a line's width farther in
        strokes, within = split(strokes, hanging, strokes.is_of(*kinds), shortest_mm)
        kind, overhang = strokes.kind, np.where(within, sum(step >= share for step in STEPS), strokes.overhang)
        if share <= process.overhang_share:
            kind = np.where(within, NUMBER[Kind.OVERHANG], kind)
        strokes = replace(strokes, kind=kind.astype(np.int8), overhang=overhang.astype(np.int8))
    return strokes


def hanging_area(section: Polygons, below: Polygons, share: float, width_mm: float) -> Polygons:
    """Where the centreline of a bead has less than a share of its width on what is below."""
    return section - offset(below, (0.5 - share) * width_mm + NOISE_MM)


def strengthen_overhangs(
    processes: Sequence[Process], sections: Sequence[Polygons], first_below: Polygons | None
) -> list[Process]:
    """The process of every layer, with overhang_extra_walls more walls where any of them overhangs.

    first_below: plastic under the first layer; None: the platform.
    """
    if all(process.overhang_extra_walls == 0 for process in processes):
        return list(processes)
    lower = [first_below, *sections[:-1]]
    return [_strengthened(*row) for row in zip(processes, sections, lower, strict=True)]


def _strengthened(process: Process, section: Polygons, below: Polygons | None) -> Process:
    width = process.line_width_mm
    if below is None or not process.walls or hanging_area(section, below, process.overhang_share, width).area() < width**2:
        return process
    return process.model_copy(update={"walls": process.walls + process.overhang_extra_walls})
