"""Priming: filament that makes up for what oozed while the table turned is pushed during a stroke inside, not at standstill.

How much oozed is not known. Pushed at the beginning of a wall, what did not ooze would be a drop on the seam; spread over the
first stretch of infill or support it makes that a little thicker, where nobody sees or feels it.
"""

from dataclasses import replace
from math import pi

import numpy as np

from machine.planning.moves import Stroke
from machine.planning.travel import Tip
from profiles.profile import Profile
from slicer.paths import Kind, Layer, bead_area_mm2

RUN_MM = 20.0  # the filament of a turn is spread over so much of a stroke
MOST = 1.5  # of what the width and the height of a bead need: what did not ooze shall not fill the room twice
SEEN = (Kind.OUTER_WALL, Kind.OVERHANG, Kind.TOP_SKIN)


def run_in(stroke: Stroke, layer: Layer, tip: Tip, profile: Profile) -> Stroke:
    """The stroke with what is still to be pushed after a turn; half more than its width and height need, the rest waits.

    A stroke that is seen takes it only in a layer that has no other.
    """
    if tip.run_in_mm <= 0.0 or (stroke.kind in SEEN and not layer.is_of(*SEEN).all()):
        return stroke
    length = np.linalg.norm(np.diff(stroke.points_mm, axis=0), axis=1)
    run = np.where(np.cumsum(length) - length < RUN_MM, length, 0.0)
    filament_mm2 = 0.25 * pi * profile.material.diameter_mm**2
    needed_mm = bead_area_mm2(stroke.width_mm, layer.height_mm) * profile.material.flow * length / filament_mm2
    more = min(tip.run_in_mm, float((MOST * needed_mm - stroke.filament_mm)[run > 0.0].sum()))
    if more <= 0.0:
        return stroke
    tip.run_in_mm -= more
    filament_mm = stroke.filament_mm + more * run / run.sum()
    densest = float((filament_mm[length > 0.0] / length[length > 0.0]).max())
    material = profile.material
    fastest = min(material.volumetric_limit_mm3_s / filament_mm2, profile.machine.extruder_speed_mm_s)
    return replace(stroke, filament_mm=filament_mm, speed_mm_s=min(stroke.speed_mm_s, fastest / densest))
