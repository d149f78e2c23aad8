"""The plate: what helps a print to stick to it and to come off."""

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
    skirt_loops: int = Field(
        1,
        ge=0,
        le=20,
        description="loops around the first layer on the plate, not touching it; with complete_objects of the first model",
    )
    skirt_distance_mm: float = Field(4.0, gt=0, le=50, description="distance of the skirt from the first layer on the plate, mm")
    brim_mm: float = Field(
        0.0,
        ge=0,
        le=50,
        description="width of the brim around the first layer on the plate, mm; 0: only where a base is too small; a raft "
        "has none",
    )
    small_base_brim_mm: float = Field(
        5.0,
        ge=0,
        le=50,
        description="width of the brim where a push of 1 N at the print's top would tip it off the plate, mm; 0: none",
    )
    brim_gap_mm: float = Field(
        0.0, ge=0, le=5, description="gap between the first layer and its brim, mm; 0.1 comes off more easily"
    )
    elephant_foot_mm: float = Field(
        0.0,
        ge=0,
        le=1,
        description="the first layer on the plate is this much smaller all round, as a warm plate squeezes it out, mm; "
        "none on a raft",
    )
    raft_layers: int = Field(
        0,
        ge=0,
        le=50,
        description="layers of a raft, which carries a model and the support that stands on the plate and is peeled off: one "
        "that sticks, sparse ones, and dense ones in the upper half; 0: none",
    )
    raft_contact_distance_mm: float = Field(
        0.1, ge=0, le=0.4, description="gap between a raft and the model on it, so that it comes off, mm; 0: it welds"
    )
    raft_expansion_mm: float = Field(
        1.5, ge=0, le=50, description="a raft reaches this far beyond what stands on it, all round, mm"
    )
    raft_first_layer_density: float = Field(
        0.9, ge=0.1, le=1, description="share of a raft's first layer that is filled: less is easier to take off the plate"
    )
    raft_first_layer_expansion_mm: float = Field(
        3.0, ge=0, le=50, description="how much farther a raft's first layer reaches than the others, so that it sticks, mm"
    )
    pedestal_gap_mm: float = Field(
        0.1, ge=0, le=1, description="gap between a pedestal and the model on it, so that it breaks away, mm"
    )
