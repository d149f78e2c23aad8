"""Support: what hangs, what spans, what stands below it."""

from typing import Literal

from pydantic import Field

from profiles.frozen import Frozen

ANY_MATERIAL_MM = 5.0  # what bridges in whatever is printed


class Support(Frozen):
    """Overhangs, bridges and support."""

    overhang_share: float = Field(
        0.5, ge=0, le=1, description="walls with less than this share of their width on plastic below count as overhanging"
    )
    bridge_longest_mm: float | None = Field(
        None,
        ge=1,
        le=100,
        description="level places spanned by straight lines up to this long, held at both ends, print without support, mm; "
        "absent: the material's; 1: next to nothing is left without support",
    )
    arch_longest_mm: float = Field(
        6.0,
        ge=0,
        le=100,
        description="arches whose flat crown is no wider than this print without support, for each layer reaches little further "
        "than the one below; the crown of a level hole is 0.7 of its diameter wide, mm",
    )
    bridge_flow: float = Field(
        1.0, ge=0.3, le=2, description="factor on extruded volume of bridges; 1: as much plastic as the layer has room for"
    )
    bridge_angle_deg: float = Field(
        0.0,
        ge=0,
        le=360,
        description="direction of the lines of bridges in the part's frame; 0: that in which they sag least, 180: along x, deg",
    )
    thick_bridges: bool = Field(
        False,
        description="bridges are round threads of the nozzle's diameter, which pull tight over long spans but look coarser; "
        "not those over infill",
    )
    infill_bridge_flow: float = Field(
        1.0, ge=0.3, le=2, description="factor on extruded volume of the first solid layer over sparse infill, which spans it"
    )
    support: Literal["none", "auto", "enforced"] = Field(
        "auto",
        description="auto: support what the decomposition left risky; enforced: only what overhangs in a plan's [[support]]",
    )
    support_style: Literal["tree", "grid"] = Field(
        "tree",
        description="tree: what hangs is gathered into branches, which saves plastic and time; grid: columns straight down where "
        "they find ground, sturdier under heavy flat places",
    )
    support_on_part: bool = Field(
        True, description="false: support stands on the platform or on the part's base only, so that it scars no surface"
    )
    support_branch_angle_deg: float = Field(
        40.0,
        ge=0,
        le=60,
        description="support leans no farther than this from the printing direction, nor than self_supporting_angle_deg, deg; "
        "40: a sparse branch holds itself less well than a wall",
    )
    support_branch_mm: float = Field(
        2.0, ge=0.2, le=20, description="diameter of a branch at its top, mm; thinner ones are knocked over by the nozzle"
    )
    support_branch_diameter_angle_deg: float = Field(
        5.0,
        ge=0,
        le=15,
        description="branches get thicker downward until they meet, each side leaning by this, deg; 0: evenly thick",
    )
    support_trunk_mm: float = Field(
        3.0,
        ge=0.2,
        le=25,
        description="diameter up to which branches get thicker by their angle, mm; where the part leaves room they have at least "
        "a twelfth of the height that stands on them: tall ones must not sway",
    )
    support_pattern: Literal["lines", "grid"] = Field("lines", description="what fills support: lines are easily broken away")
    support_density: float = Field(0.15, gt=0, le=1, description="share of the support's inside that is filled")
    support_walls: int = Field(
        1, ge=0, le=10, description="outlines around support; leaning support needs one for its lines to end on"
    )
    support_interface_layers: int = Field(
        3, ge=0, le=100, description="dense layers of support under the part: a floor even enough to lay a skin on"
    )
    support_bottom_interface_layers: int = Field(
        2, ge=0, le=100, description="dense layers of support that stands on the part, so that it comes off in one piece"
    )
    support_interface_density: float = Field(
        0.7, gt=0, le=1, description="share of the dense layers that is filled; a closed floor would weld to the part"
    )
    support_gap_mm: float = Field(
        0.2, ge=0, le=2, description="gap along the printing direction between support and the part over it, mm; 0: it welds"
    )
    support_bottom_gap_mm: float = Field(
        0.2, ge=0, le=2, description="gap along the printing direction between support and what it stands on, mm"
    )
    support_distance_mm: float = Field(
        0.3,
        ge=0,
        le=5,
        description="gap across the printing direction between support and part, and to where later parts will be, mm; "
        "two thirds of a line: near enough to hold the edges",
    )
    support_foot_mm: float = Field(
        2.0,
        ge=0,
        le=20,
        description="support is wider by up to this in its first layer on the platform, to stick better; no wider than twice "
        "its own height, mm",
    )
    support_foot_density: float = Field(
        0.85,
        gt=0,
        le=1,
        description="share of the support's first layer on the platform that is filled; from 0.85 on its lines lie so near each "
        "other that whatever stands on it has plastic under it",
    )
    support_least_mm2: float = Field(
        1.0, ge=0, le=1000, description="a hanging place smaller than this, seen from above, holds itself, mm2"
    )

    @property
    def bridge_mm(self) -> float:
        """The longest bridge without support; a profile that was loaded has put the material's where nothing was asked for."""
        return ANY_MATERIAL_MM if self.bridge_longest_mm is None else self.bridge_longest_mm
