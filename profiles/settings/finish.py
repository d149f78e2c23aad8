"""Finish: what makes the sizes of a print right and its tops smooth."""

from pydantic import Field

from profiles.frozen import Frozen


class Finish(Frozen):
    """Sizes and smooth tops."""

    outline_compensation_mm: float = Field(
        0.0,
        ge=-0.5,
        le=0.5,
        description="the outside of every layer lies this farther out, below 0 farther in, mm; cut faces stay where they are",
    )
    hole_compensation_mm: float = Field(
        0.0,
        ge=-0.5,
        le=0.5,
        description="the holes of every layer are wider by this to each side, for they print narrow; below 0 narrower, mm",
    )
    spiral_vase: bool = Field(
        False,
        description="true: above the bottom one wall climbs round without a seam, without inside, top or support; the model is "
        "in one part, its layers one area without holes; a narrow tip at the top is left out",
    )
    ironing: bool = Field(
        False, description="true: the nozzle goes over uppermost skins once more, in dense lines; never where another part comes"
    )
    ironing_flow: float = Field(
        0.15, ge=0, le=1, description="plastic that ironing adds, share of what its lines would be filled with"
    )
    ironing_spacing_mm: float = Field(0.1, ge=0.02, le=1, description="distance of the lines of ironing, mm")
    ironing_speed_mm_s: float = Field(15.0, gt=0, le=1000, description="speed of ironing, mm/s: it melts what it goes over")
