"""Priming: filament that makes up for what oozed while the table turned is pushed during a stroke inside, not at standstill.

How much oozed is not known. Pushed at the beginning of a wall, what did not ooze would be a drop on the seam; spread over the
first stretch of infill or support it makes that a little thicker, where nobody sees or feels it.
"""

from math import pi

import numpy as np

from machine.planning.moves import POINTS, SPEED, Moves
from profiles.profile import Profile
from slicer.paths import Kind, Layer, bead_area_mm2

RUN_MM = 20.0  # the filament of a turn is spread over so much of a stroke
MOST = 1.5  # of what the width and the height of a bead need: what did not ooze shall not fill the room twice
SEEN = (Kind.OUTER_WALL, Kind.OVERHANG, Kind.TOP_SKIN)


def run_in(strokes: Moves, layer: Layer, more_mm: float, profile: Profile) -> float:
    """Add filament that is still to be pushed after a turn to the strokes of a layer; how much they take, mm.

    A stroke takes half more than its width and height need, the next one some of the rest; one that is seen takes it only in a
    layer that has no other.
    """
    if more_mm <= 0.0:
        return 0.0
    seen, taken_mm = layer.is_of(*SEEN), 0.0
    filament_mm2 = 0.25 * pi * profile.material.diameter_mm**2
    fastest = min(profile.material.volumetric_limit_mm3_s / filament_mm2, profile.machine.extruder_speed_mm_s)
    needed_mm = bead_area_mm2(layer.width_mm, layer.height_mm) * profile.material.flow / filament_mm2  # for a millimetre
    ends = np.cumsum(strokes.rows[:, POINTS].astype(np.int64))
    for k in np.flatnonzero(~seen | seen.all()).tolist():
        if taken_mm >= more_mm:
            break
        way = strokes.ways[ends[k] - int(strokes.rows[k, POINTS]) : ends[k]]
        length, pushed = np.linalg.norm(np.diff(way[:, :3], axis=0), axis=1), way[1:, 3]
        run = np.where(np.cumsum(length) - length < RUN_MM, length, 0.0)
        more = min(more_mm - taken_mm, float((MOST * needed_mm[k] * length - pushed)[run > 0.0].sum()))
        if more > 0.0:
            taken_mm += more
            pushed += more * run / run.sum()
            densest = float((pushed[length > 0.0] / length[length > 0.0]).max())
            strokes.rows[k, SPEED] = min(strokes.rows[k, SPEED], fastest / densest)
    return taken_mm
