"""Retracting: which travels pull the filament back, and which go round through plastic instead.

A travel may ooze where it stays inside the section, or over one and the same piece of support. All other ways lead through open
air or over a surface: what oozes there is a string from tree to tree, or a blob on a wall.
"""

import numpy as np
from numpy.typing import NDArray

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import outer_wall_width_mm
from slicer.geometry.polygons import Polygons
from slicer.travel.combing import Combing


def travels(
    since: Floats, to: Floats, section: Polygons, support: Polygons, process: Process
) -> tuple[NDArray[np.bool_], dict[int, Floats]]:
    """Which of the n travels, (n, 2) by two, retract, and the detours (k, 2) of some others, by the travel's number.

    Those no shorter than process.retract_travel_mm retract that leave the inside both of the section and of its support and
    find no short detour inside either.
    """
    long = np.hypot(*(to - since).T) >= process.retract_travel_mm
    retracts: NDArray[np.bool_] = long.copy()
    detours: dict[int, Floats] = {}
    if not long.any():
        return retracts, detours
    widths_mm = (
        min(process.line_width_mm, outer_wall_width_mm(process)),
        process.support_line_width_mm or process.line_width_mm,
    )
    inside = [Combing(area, width) for area, width in zip((section, support), widths_mm, strict=True) if not area.is_empty()]
    for combing in inside:
        at = np.flatnonzero(retracts)
        retracts[at] = combing.leaves(since[at], to[at])
    for combing in inside if process.combing else []:
        for k in np.flatnonzero(retracts).tolist():
            detour = combing.detour(since[k], to[k], process.combing_detour_mm)
            if detour is not None:
                retracts[k], detours[k] = False, detour
    return retracts, detours
