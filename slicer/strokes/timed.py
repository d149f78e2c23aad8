"""Timed: the strokes of a layer in order get their speeds and the layer its fan, and become the table that is printed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from profiles.profile import Profile
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import lengthen_steps, mark_corners
from slicer.paths import SKINS, Kind, Layer
from slicer.strokes.speed import fan_share, melting_speeds_mm_s, own_fans, speeds_mm_s, travel_time_s
from slicer.strokes.strokes import Strokes, in_pieces
from slicer.strokes.travels import may_wipe_over

SHORTEST = 0.5  # line widths: the steps of skin lines are no shorter,
SHORTEST_STROKE = 4.0  # line widths of a stroke whose steps are lengthened
ASIDE, ASIDE_EXACT = 0.25, 0.15  # line widths that easing may move a line; exact: tops, whose gaps show, and bridges


def timed(
    strokes: Strokes,
    profile: Profile,
    height_mm: float,
    kind_mm_s: Floats | None,
    flow: float,
    of_places: Sequence[Process] = (),
) -> tuple[Strokes, Floats]:
    """The strokes, in pieces of one width and simplified, with their (k,) speeds; parameters as in speeds_mm_s."""
    strokes = in_pieces(strokes, height_mm)
    speeds = speeds_mm_s(strokes, profile, height_mm, kind_mm_s, flow, of_places)
    corners = mark_corners(strokes.points, strokes.starts, profile.process.resolution_mm)
    strokes = replace(strokes, points=strokes.points[corners], starts=np.append(0, np.cumsum(corners))[strokes.starts])
    eased = _without_short_steps(strokes)
    return eased, np.minimum(speeds, melting_speeds_mm_s(eased, profile, height_mm, flow))


def _without_short_steps(strokes: Strokes) -> Strokes:
    """The strokes, those of skins without short steps where that moves them little; the plastic of each stays the same."""
    # A shorter stroke is nothing but its two ends, which lie where the layer below holds them.
    eases = strokes.is_of(*SKINS) & (strokes.lengths_mm > SHORTEST_STROKE * strokes.width_mm)
    width_mm = np.where(eases, strokes.width_mm, 0.0)
    aside_mm = width_mm * np.where(strokes.is_of(Kind.TOP_SKIN, Kind.BRIDGE), ASIDE_EXACT, ASIDE)
    points, left = lengthen_steps(strokes.points, strokes.starts, SHORTEST * width_mm, aside_mm)
    eased = replace(strokes, points=points[left], starts=np.append(0, np.cumsum(left))[strokes.starts])
    return replace(eased, flow=strokes.flow * strokes.lengths_mm / np.maximum(eased.lengths_mm, 1e-9))


def layer_of(
    strokes: Strokes,
    speeds: Floats,
    profile: Profile,
    *,
    z_mm: float,
    height_mm: float,
    flow: float,
    fan: float,
    add_c: float = 0.0,
    skin: Polygons | None = None,
) -> Layer:
    """The layer of some strokes.

    flow: factor on that of all; fan: on the part fan; add_c: how much hotter it is printed; skin: outer walls beside the edges of
    interfaces.
    """
    process, material = profile.process, profile.material
    time_s = float((strokes.lengths_mm / speeds).sum()) + travel_time_s(strokes, profile)  # at least: accelerations are left out
    layer_fan = fan * fan_share(material, process, time_s)
    return Layer(
        z_mm=z_mm,
        height_mm=height_mm,
        fan=layer_fan,
        nozzle_add_c=add_c,
        points=np.ascontiguousarray(strokes.points[:, :2]),
        starts=strokes.starts,
        kind=strokes.kind,
        width_mm=strokes.width_mm,
        speed_mm_s=speeds,
        flow=strokes.flow * flow,
        own_fan=own_fans(strokes, material, fan, layer_fan),
        retract=strokes.retract,
        wiped=may_wipe_over(strokes, Polygons() if skin is None else skin, material.wipe_mm),
        below_mm=np.zeros((len(strokes), 2)),
        approach=strokes.approach,
        approach_starts=strokes.approach_starts,
    )
