"""The plate: what helps part 1 to stick to it and to come off."""

from pydantic import Field

from profiles.frozen import Frozen

FARTHEST_MM = 1000.0  # no plate reaches so far from its turn axis
MIDDLE = (0.0, 0.0)


class Plate(Frozen):
    """Part 1 on the plate."""

    place_mm: tuple[float, float] = Field(
        MIDDLE,
        description="where the middle of the model stands on the plate: x and y from the turn axis; several stand about it, mm",
    )
    complete_objects: bool = Field(
        False, description="several models on one plate are printed one after the other, each whole, not layer by layer together"
    )
    skirt_loops: int = Field(1, ge=0, le=20, description="loops around part 1's first layer, not touching it")
    skirt_distance_mm: float = Field(4.0, gt=0, le=50, description="distance of the skirt from part 1, mm")
    brim_mm: float = Field(
        0.0, ge=0, le=50, description="width of the brim around part 1's first layer, mm; 0: only where its base is too small"
    )
    small_base_brim_mm: float = Field(
        5.0,
        ge=0,
        le=50,
        description="width of part 1's brim where a push of 1 N at the print's top would tip it off the plate, mm; 0: none",
    )
    brim_gap_mm: float = Field(0.0, ge=0, le=5, description="gap between part 1 and its brim, mm; 0.1 comes off more easily")
    elephant_foot_mm: float = Field(
        0.0, ge=0, le=1, description="part 1's first layer is this much smaller all round, as a warm plate squeezes it out, mm"
    )
    pedestal_gap_mm: float = Field(
        0.1, ge=0, le=1, description="gap between a pedestal and the model on it, so that it breaks away, mm"
    )
