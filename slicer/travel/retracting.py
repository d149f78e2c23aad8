"""Retracting: which travels pull the filament back, and which go round through plastic instead.

A travel may ooze where it stays inside the section, or over one and the same piece of support. All other ways lead through open
air or over a surface: what oozes there is a string from tree to tree, or a blob on a wall. Beside the edge of an interface, where
what it leaves is seen all along the joint, a travel does not pass over the outer walls either.
"""

import numpy as np
from numpy.typing import NDArray

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import outer_wall_width_mm
from slicer.geometry.cells import cells_of
from slicer.geometry.polygons import Polygons
from slicer.travel.combing import Combing, crosses, lie_within


def travels(
    since: Floats, to: Floats, section: Polygons, support: Polygons, process: Process, skin: Polygons | None = None
) -> tuple[NDArray[np.bool_], dict[int, Floats]]:
    """Which of the n travels, (n, 2) by two, retract, and the detours (k, 2) of some others, by the travel's number.

    Those no shorter than process.retract_travel_mm retract that leave the inside both of the section and of its support and
    find no short detour inside either. skin: outer walls beside an edge of an interface; short ones retract as well where they
    would pass over it, unless they begin or end on it.
    """
    retracts: NDArray[np.bool_] = np.hypot(*(to - since).T) >= process.retract_travel_mm
    detours: dict[int, Floats] = {}
    widths_mm = (
        min(process.line_width_mm, outer_wall_width_mm(process)),
        process.support_line_width_mm or process.line_width_mm,
    )
    if retracts.any():
        areas = zip((section, support), widths_mm, strict=True)
        inside = [Combing(area, width) for area, width in areas if not area.is_empty()]
        for combing in inside:
            at = np.flatnonzero(retracts)
            retracts[at] = combing.leaves(since[at], to[at])
        for combing in inside if process.combing else []:
            for k in np.flatnonzero(retracts).tolist():
                detour = combing.detour(since[k], to[k], process.combing_detour_mm)
                if detour is not None:
                    retracts[k], detours[k] = False, detour
    if skin is not None and not skin.is_empty():
        combing, border = Combing(section, widths_mm[0], skin), cells_of(skin)
        for k in np.flatnonzero(~retracts & ~lie_within(border, since) & ~lie_within(border, to)).tolist():
            way = np.vstack([since[k], detours.get(k, to[:0]), to[k]])
            if not crosses(border, way[:-1], way[1:]).any():
                continue
            detours.pop(k, None)
            detour = combing.detour(since[k], to[k], process.combing_detour_mm) if process.combing else None
            if detour is None:
                retracts[k] = True
            else:
                detours[k] = detour
    return retracts, detours
