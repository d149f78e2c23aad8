"""What every support must obey, judged by shapely from the printed areas alone."""

from collections.abc import Sequence
from math import radians, tan
from typing import Any

import numpy as np
import shapely

from mdp.decomposition import Part
from slicer.geometry.polygons import Polygons, clean
from slicer.heights import layer_heights
from slicer.interface.interface import plastic_beneath
from slicer.section import sections
from slicer.support.blocker import blocked_areas, far_mm
from slicer.support.overhang import detect_overhangs
from slicer.support.support import Supports, generate_supports
from tests.slicer.hand import as_shapely, profile

ROUNDING_MM = 0.03
SPECK_MM2 = 0.02
LEDGE = 2.0  # line widths that carry themselves


def supported(part: Part, *settings: str, earlier: Sequence[Part] = (), later: Sequence[Part] = ()) -> tuple[Any, Supports]:
    """What the support of a part is made from, and the support."""
    given, mesh = profile(*settings), part.in_part_frame()
    process, heights = given.process, layer_heights(mesh, given, part.index == 1)
    outlines = [clean(loops) for loops in sections(mesh, heights.cut_mm)]
    below = plastic_beneath(part, earlier, outlines[0])
    blocked = blocked_areas(part, later, heights, process.support_distance_mm, far_mm(mesh))
    hanging = [overhang.hanging for overhang in detect_overhangs(mesh, outlines, heights.cut_mm, process, below)]
    values: dict[str, Any] = {
        "hanging": hanging,
        "outlines": outlines,
        "heights": heights,
        "process": process,
        "below": below,
        "blocked": blocked,
    }
    return values, generate_supports(**values, floor=Polygons.square((400.0, 400.0), True))


def assert_sound(values: Any, found: Supports) -> None:
    """Gaps are kept, everything stands within the lean, every hanging place is held or told."""
    process, heights = values["process"], values["heights"]
    solid, printed, missed, hanging = (
        [shapely.make_valid(as_shapely(place)) for place in places]
        for places in (values["outlines"], found.areas, found.missed, values["hanging"])
    )
    top = heights.tip_mm
    bottom = top - heights.height_mm
    slope = tan(radians(min(process.support_branch_angle_deg, process.self_supporting_angle_deg)))
    width = process.line_width_mm
    for m in np.flatnonzero([not place.is_empty for place in printed]).tolist():
        _keeps_gaps(m, printed[m], solid, bottom, top, process)
        if m or values["below"] is not None:
            carried = [printed[m - 1].buffer(slope * heights.height_mm[m] + ROUNDING_MM)] if m else []
            stands = [
                solid[j].buffer(width + 4 * ROUNDING_MM, join_style="mitre") for j in range(m) if top[j] <= bottom[m] + 1e-6
            ]
            base = (
                [as_shapely(values["below"]).buffer(width + 4 * ROUNDING_MM, join_style="mitre")]
                if values["below"] is not None
                else []
            )
            loose = printed[m] - shapely.union_all([*carried, *stands[-6:], *base])
            assert loose.buffer(-ROUNDING_MM).area < SPECK_MM2, f"layer {m} hangs in the air: {loose.bounds}"
    untold = {}
    for k in np.flatnonzero([not place.is_empty for place in hanging]).tolist():
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
        untold[k] = (bare, shapely.union_all([held, wall]))
    above = shapely.union_all([bare for bare, _ in untold.values()]).buffer(2 * ROUNDING_MM)
    for k, (bare, carrying) in untold.items():
        wide = bare - (carrying - above).buffer(LEDGE * width + ROUNDING_MM, join_style="mitre")
        most = max((piece.area for piece in getattr(wide, "geoms", [wide])), default=0.0)
        assert most <= process.support_least_mm2, f"layer {k}: {most} mm2 are neither held nor told {wide.bounds}"


def _keeps_gaps(m: int, area: Any, solid: list[Any], bottom: Any, top: Any, process: Any) -> None:
    assert area.distance(solid[m]) > process.support_distance_mm - ROUNDING_MM, f"layer {m} touches the part"
    for k in range(len(solid)):
        over = -1e-6 < bottom[k] - top[m] < process.support_gap_mm - 1e-6
        under = -1e-6 < bottom[m] - top[k] < process.support_bottom_gap_mm - 1e-6
        assert not (over or under) or (area & solid[k]).area < SPECK_MM2, f"layer {m} is too near layer {k}"
