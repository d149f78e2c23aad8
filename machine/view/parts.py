"""Parts in pictures and on pages: their colours, risky faces before and after the cuts, and the front of the search."""

import shlex
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.quantities import about, amount
from mdp.decomposition import ORDER_TOLERANCE_MM, Decomposition, FrontRow, Part
from mdp.mesh import Floats
from mdp.overhang import risky_above, risky_upright
from mdp.save import front_values, plane_values
from profiles.profile import Profile

# Okabe and Ito's colours for colour-blind readers, without vermilion, which is too close to the red of risky faces.
PALETTE = np.array([[86, 180, 233], [230, 159, 0], [0, 158, 115], [204, 121, 167], [240, 228, 66], [0, 114, 178]], dtype=float)


def part_colours(count: int) -> Floats:
    """(count, 3) colours of parts 1, 2, ..., 0 to 255; after six parts the palette repeats in paler shades."""
    places = np.arange(count)
    paler = np.minimum(places // len(PALETTE), 2)[:, None] * 0.38
    colours: Floats = PALETTE[places % len(PALETTE)] * (1.0 - paler) + 255.0 * paler
    return colours


def page_colours(count: int) -> list[str]:
    """The colours of part_colours() as #rrggbb."""
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in np.rint(part_colours(count)).astype(int).tolist()]


def residual_faces(part: Part, profile: Profile) -> NDArray[np.bool_]:
    """(m,) faces of a part that need support in its own direction."""
    if part.needing is not None:
        return part.needing
    angle, counted = profile.process.self_supporting_angle_deg, profile.search.count_platform_faces
    return risky_upright(part.in_part_frame(), angle, counted) if part.on_plate else risky_above(part.mesh, part.base, angle)


def risky_before(part: Part, angle_deg: float, count_platform_faces: bool) -> NDArray[np.bool_]:
    """(m,) risky faces of a part if the model is printed straight up, without the cut below it."""
    if part.needing_upright is not None:
        return part.needing_upright
    down = risky_upright(part.mesh, angle_deg, count_platform_faces)
    cut = np.all(np.abs(part.base.heights_mm(part.mesh.vertices))[part.mesh.faces] <= ORDER_TOLERANCE_MM, axis=1)
    return down if part.on_plate else down & ~cut


def risky_before_mm2(part: Part, angle_deg: float, count_platform_faces: bool) -> float:
    """Area of risky_before() faces, mm²."""
    return float(part.mesh.areas_mm2[risky_before(part, angle_deg, count_platform_faces)].sum())


def front_record(row: FrontRow) -> dict[str, Any]:
    """A row of a front for pages. planes: in print order, beginning with part 2; why: reason of the chosen row, or flaw."""
    planes = [plane_values(plane) for plane in reversed(row.planes)]
    return front_values(row) | {"why": row.reason or row.flaw, "planes": planes, "figures": front_figures(row)}


def front_figures(row: FrontRow) -> list[tuple[str, str, str]]:
    """Names, values and units of the costs of a row of a front; "" for an unknown value."""
    return [
        ("area to support", amount(row.support_area_mm2, 1), "mm²"),
        ("seams", amount(row.seam_mm, 0), "mm"),
        ("stair-stepping", amount(row.stairs_mm2, 1), "mm²"),
        ("takes about", "" if row.time_s is None else about(row.time_s), ""),
        ("plastic", "" if row.filament_mm is None else amount(row.filament_mm / 1000.0, 1), "m"),
    ]


def front_records(decomposition: Decomposition) -> list[dict[str, Any]]:
    """The rows of a front with the colours of their parts, and the command that selects each."""
    return [
        {
            **front_record(row),
            "colours": page_colours(row.parts),
            "command": f"tiltprint decompose {shlex.quote(decomposition.name)} --parts {row.parts}",
        }
        for row in decomposition.front
    ]
