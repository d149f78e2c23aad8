"""Laws of every support, checked by shapely from the printed areas alone."""

from collections.abc import Sequence
from math import radians, tan
from typing import Any

import numpy as np
import shapely

from mdp.decomposition import Part
from slicer.overhangs import Overhang, find_overhangs
from slicer.sectioning import section_part
from slicer.support.support import Supports, own_supports
from tests.slicer.hand import as_shapely, profile

ROUNDING_MM = 0.03
SPECK_MM2 = 0.02
LEDGE = 2.0  # self-supporting ledge, line widths


def supported(part: Part, *settings: str, earlier: Sequence[Part] = ()) -> tuple[list[Overhang], Supports]:
    """Overhangs of a part, and its own support."""
    sections = section_part(part, profile(*settings), earlier)
    overhangs = find_overhangs(sections)
    return overhangs, own_supports(sections, overhangs)


def assert_sound(overhangs: Sequence[Overhang], supports: Supports) -> None:
    """Gaps are kept, everything rests within the lean, every overhang is held or reported as missed."""
    sections, process = supports.sections, supports.sections.process
    solid, printed, missed, hanging = (
        [shapely.make_valid(as_shapely(area)) for area in places]
        for places in (sections.outlines, supports.areas, supports.missed, [overhang.hanging for overhang in overhangs])
    )
    top, bottom = sections.heights.tip_mm, sections.heights.bottom_mm
    slope = tan(radians(min(process.support_branch_angle_deg, process.self_supporting_angle_deg)))
    width = process.line_width_mm
    below = [] if sections.plastic_below is None else [_standing_room(as_shapely(sections.plastic_below), width)]
    for m in np.flatnonzero([not area.is_empty for area in printed]).tolist():
        _keeps_gaps(m, printed[m], solid, bottom, top, process)
        if m or below:
            lower = [printed[m - 1].buffer(slope * sections.heights.height_mm[m] + ROUNDING_MM)] if m else []
            stands = [_standing_room(solid[j], width) for j in range(m) if top[j] <= bottom[m] + 1e-6]
            loose = printed[m] - shapely.union_all([*lower, *stands[-6:], *below])
            assert loose.buffer(-ROUNDING_MM).area < SPECK_MM2, f"layer {m} hangs in the air: {loose.bounds}"
    unheld = {}
    for k in np.flatnonzero([not area.is_empty for area in hanging]).tolist():
        rest = hanging[k] - missed[k].buffer(0.02)
        deep = process.support_gap_mm + process.support_distance_mm + 2 * process.layer_height_mm
        near = [printed[m] for m in range(k) if 0 <= bottom[k] - top[m] + 1e-6 <= deep + 1e-6]
        sags = process.support_gap_mm + process.layer_height_mm + 1e-6
        near += [solid[j] for j in range(k - 1) if bottom[k] - top[j] <= sags]
        held = shapely.union_all(near).buffer(0.5 * width + ROUNDING_MM)
        reach = 0.5 * process.support_distance_mm + 0.06
        wall = solid[k - 1] if k else shapely.Polygon()
        spanned = shapely.union_all([held, wall]).buffer(reach, join_style="mitre").buffer(-reach, join_style="mitre")
        bare = rest - shapely.union_all([held, spanned.buffer(0.02)])
        bare = bare.buffer(-ROUNDING_MM) if bottom[k] > sags else shapely.Polygon()
        unheld[k] = (bare, shapely.union_all([held, wall]))
    above = shapely.union_all([bare for bare, _ in unheld.values()]).buffer(2 * ROUNDING_MM)
    for k, (bare, carrying) in unheld.items():
        wide = bare - (carrying - above).buffer(LEDGE * width + ROUNDING_MM, join_style="mitre")
        most = max((piece.area for piece in getattr(wide, "geoms", [wide])), default=0.0)
        assert most <= process.support_least_mm2, f"layer {k}: {most} mm2 are neither held nor missed {wide.bounds}"


def _standing_room(solid: Any, width_mm: float) -> Any:
    """Area of plastic on which support may rest."""
    return solid.buffer(width_mm + 4 * ROUNDING_MM, join_style="mitre")


def _keeps_gaps(m: int, area: Any, solid: list[Any], bottom: Any, top: Any, process: Any) -> None:
    assert area.distance(solid[m]) > process.support_distance_mm - ROUNDING_MM, f"layer {m} touches the part"
    for k in range(len(solid)):
        over = -1e-6 < bottom[k] - top[m] < process.support_gap_mm - 1e-6
        under = -1e-6 < bottom[m] - top[k] < process.support_bottom_gap_mm - 1e-6
        assert not (over or under) or (area & solid[k]).area < SPECK_MM2, f"layer {m} is too near layer {k}"
