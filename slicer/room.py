"""Room: where support may stand in each layer, and from where it finds ground within the angle that it may lean.

Everything here is about the middle of a branch: a place is free when a disc of the branch's least radius around it keeps
all gaps, and reached when a chain of such places, each within the lean of the one below, leads down to ground.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians, tan

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.heights import Heights
from slicer.polygons import Polygons, grown, rounded, united

COARSE_MM = 0.03  # sections are simplified by this before they are grown
MARGIN_MM = 0.08  # and grown by this more, which leaves room for simplified support
FINE_MM = 0.005  # reached places are simplified by this
SPARE = 0.15  # share of the lean that reached places keep in reserve, so that more than a point of the layer below is near
SMOOTH_MM = 0.05  # support is simplified by this: its edges come from single faces, and nobody needs them
SLIVER_MM = 0.02  # what is narrower than twice this and has no place has neighbours that do
EVEN_MM = 1e-6  # heights nearer than this are equal
SPECK_MM2 = 4.0 * SLIVER_MM**2  # no place that is no sliver is smaller
LEAST_MM2 = 1e-5  # places smaller than this are rounding
STEPS = (0.3, 0.6, 1.0)  # of the lean: how far support goes aside, no farther than needed, for it gets wider by as much
SEGMENTS = 12  # of a full turn in round corners; corners lie on the circle, so the lean is never exceeded


@dataclass(frozen=True, eq=False)
class Room:
    """Per layer: free, ground to stand on (grown by the radius), what is reached, and the lean from the layer below, mm."""

    radius_mm: float
    bottom_mm: Floats
    top_mm: Floats
    lean_mm: Floats
    ground: tuple[Polygons, ...]
    reached: tuple[Polygons, ...]


def leaning(area: Polygons, distance_mm: float) -> Polygons:
    """The area grown with round corners by at most a distance."""
    return rounded(area, distance_mm, SEGMENTS) if distance_mm > 0.0 else area


def slivers(places: Polygons) -> bool:
    """Whether the places are nothing but slivers."""
    return bool(places.area() < SPECK_MM2 or grown(places, -SLIVER_MM).is_empty())


def solid(places: Polygons) -> Polygons:
    """Without slivers."""
    core = Polygons() if places.area() < SPECK_MM2 else grown(places, -SLIVER_MM)
    return core if core.is_empty() else grown(core, 1.5 * SLIVER_MM) ^ places


def carried(places: Polygons, reached: Polygons, ground: Polygons, lean_mm: float) -> Polygons:
    """Reached places of a layer that carry places of the layer above: straight below where that can be, aside where it
    must. Places on ground need nothing.
    """
    straight = places ^ reached
    rest = places - reached
    if rest.area() >= LEAST_MM2:
        rest = rest - ground
    if rest.area() >= LEAST_MM2:
        rest = rest - leaning(grown(straight, -SLIVER_MM), lean_mm)
    if rest.area() < LEAST_MM2:
        return straight
    for share in STEPS:
        aside = leaning(rest, share * lean_mm) ^ reached
        if share == STEPS[-1] or (rest - leaning(aside, lean_mm)).area() < LEAST_MM2:
            break
    return straight + aside


def rooms(
    outlines: Sequence[Polygons],
    at: Heights,
    process: Process,
    below: Polygons | None,
    forbidden: Sequence[Polygons],
    floor: Polygons,
) -> Room:
    """The room of as many layers as there are `forbidden`, for the part with these outlines.

    below: plastic just under the base plane, None: the platform, all of whose floor is ground.
    """
    count, radius = len(forbidden), process.line_width_mm
    top = at.tip_mm
    bottom = top - at.height_mm
    angle = min(process.support_branch_angle_deg, process.self_supporting_angle_deg)
    lean = at.height_mm[:count] * tan(radians(angle))
    plain = [s if s.is_empty() else s.simplify(COARSE_MM) for s in outlines]
    wide = [s if s.is_empty() else grown(s, radius + MARGIN_MM) for s in plain]
    tall = [s if s.is_empty() else grown(s, radius + process.support_distance_mm + MARGIN_MM) for s in plain[:count]]
    base = None if below is None else grown(below, radius)
    root = int(np.searchsorted(np.maximum(bottom, 0.0), process.support_bottom_gap_mm - EVEN_MM))
    ground: list[Polygons] = []
    reached: list[Polygons] = []
    for m in range(count):
        near = min(int(np.searchsorted(top, bottom[m] - process.support_bottom_gap_mm + EVEN_MM, side="right")), m)
        over = int(np.searchsorted(bottom, top[m] + process.support_gap_mm - EVEN_MM))
        shut = forbidden[m] if forbidden[m].is_empty() else grown(forbidden[m], radius + MARGIN_MM)
        blocked = [tall[m], *wide[near:m], *wide[m + 1 : over], shut]
        whole = united([b for b in blocked if not b.is_empty()])
        stands = [wide[near - 1]] if near > 0 and process.support_on_part else []
        if base is not None and m == root:
            stands.append(base)
        ground.append(united(stands))
        if m == 0 and below is None:
            start = grown(floor, -radius)
        else:
            start = ground[m] if m == 0 or reached[-1].is_empty() else _leant(reached[-1], float(lean[m])) + ground[m]
        reached.append(start if start.is_empty() else (start - whole).simplify(FINE_MM))
    return Room(radius, bottom, top, lean, tuple(ground), tuple(reached))


def _leant(reached: Polygons, lean_mm: float) -> Polygons:
    return leaning(reached, (1.0 - SPARE) * lean_mm)
