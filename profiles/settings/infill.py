"""Infill: what fills the inside."""

from typing import Literal

from pydantic import Field

from profiles.frozen import Frozen


class Infill(Frozen):
    """What fills the inside."""

    infill_density: float = Field(0.2, ge=0, le=1, description="share of the inside that is filled")
    infill_pattern: Literal["rectilinear", "grid", "triangles", "cubic", "gyroid", "honeycomb", "concentric", "lightning"] = (
        Field(
            "grid",
            description="pattern of the sparse infill: cubic and gyroid are equally stiff all ways, lightning only holds what is "
            "solid above it; a density of 1 is always solid",
        )
    )
    infill_angle_deg: float = Field(45.0, ge=0, le=360, description="direction of the infill lines in the part's frame, deg")
    infill_overlap: float = Field(0.2, ge=0, le=0.5, description="reach of infill into the innermost wall, share of a line width")
    infill_anchor_mm: float = Field(
        2.5,
        ge=0,
        le=100,
        description="run along the innermost wall that holds the end of a single infill line, as far as layers below carry it; "
        "0: ends only touch the wall, mm",
    )
    infill_joint_mm: float = Field(
        12.0, ge=0, le=1000, description="infill lines whose ends are nearer than this along the wall are joined there, mm"
    )
