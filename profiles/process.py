"""The process: how a part is sliced and printed."""

from typing import Literal, Self

from pydantic import Field, model_validator

from profiles.machine import Frozen, Vector

HEIGHTS = ("layer_height_mm", "first_layer_height_mm")
WIDTHS = (
    "line_width_mm",
    "first_layer_line_width_mm",
    "outer_wall_line_width_mm",
    "top_skin_line_width_mm",
    "infill_line_width_mm",
    "support_line_width_mm",
)


class Process(Frozen):
    """Slicing and printing settings."""

    name: str = Field(description="what people call it")
    scale: float = Field(1.0, gt=0, le=100000, description="factor on the model's size before anything else")
    rotate_deg: Vector = Field(
        (0.0, 0.0, 0.0), description="turns of the model about x, then y, then z before anything else, deg"
    )
    self_supporting_angle_deg: float = Field(
        45.0, ge=0, le=85, description="steepest overhang, from the printing direction, that prints without support, deg"
    )
    layer_height_mm: float = Field(0.2, ge=0.02, le=2, description="height of a layer, mm")
    first_layer_height_mm: float = Field(0.2, ge=0.02, le=2, description="height of part 1's first layer, mm")
    adaptive_cusp_mm: float = Field(
        0.0,
        ge=0,
        le=1,
        description="layers are made as thick as steps of the surface no deeper than this allow, mm; 0: all layers alike",
    )
    least_layer_height_mm: float = Field(
        0.08, ge=0.02, le=2, description="adaptive layers are not thinner: below a fifth of the nozzle a bead flows unevenly, mm"
    )
    most_layer_height_mm: float = Field(
        0.28, ge=0.02, le=2, description="adaptive layers are not thicker: seven tenths of the nozzle still bond well, mm"
    )
    line_width_mm: float = Field(0.45, ge=0.1, le=4, description="width of a bead, mm")
    first_layer_line_width_mm: float | None = Field(
        None, ge=0.1, le=4, description="width of all beads of part 1's first layer: wide ones stick; absent: as elsewhere, mm"
    )
    outer_wall_line_width_mm: float | None = Field(
        None, ge=0.1, le=4, description="width of outer walls: narrow ones show finer detail; absent: line_width_mm, mm"
    )
    top_skin_line_width_mm: float | None = Field(
        None, ge=0.1, le=4, description="width of the uppermost skins' lines; absent: line_width_mm, mm"
    )
    infill_line_width_mm: float | None = Field(
        None, ge=0.1, le=4, description="width of sparse infill, which keeps its density; absent: line_width_mm, mm"
    )
    support_line_width_mm: float | None = Field(
        None, ge=0.1, le=4, description="width of support: narrow lines break away more easily; absent: line_width_mm, mm"
    )
    slit_closing_mm: float = Field(
        0.018,
        ge=0,
        le=1,
        description="slits of a layer narrower than twice this are closed; the default keeps plastic within 4 % of a line of the "
        "model, 0.049 heals coarser meshes, mm",
    )
    walls: int = Field(3, ge=0, le=50, description="number of walls")
    wall_order: Literal["inner-first", "outer-first"] = Field(
        "inner-first",
        description="inner-first: the outer wall leans on finished plastic, best over overhangs; outer-first: nothing pushes it "
        "outward, best for fits",
    )
    outer_bulge: float = Field(
        0.04,
        ge=0,
        le=0.2,
        description="outer beads carry more plastic than their round sides hold and may bulge over the model by this, so that "
        "the print has the model's volume, share of a line width; 0: as other slicers",
    )
    top_layers: int = Field(4, ge=0, le=1000, description="solid layers under a surface that faces the printing direction")
    bottom_layers: int = Field(4, ge=0, le=1000, description="solid layers over a surface that faces away from it")
    top_thickness_mm: float = Field(
        0.7,
        ge=0,
        le=100,
        description="least thickness of the layers under a surface, however thin they are: more layers then, mm",
    )
    bottom_thickness_mm: float = Field(
        0.5, ge=0, le=100, description="least thickness of the layers over a surface that faces away, mm"
    )
    solid_below_mm2: float = Field(
        70.0,
        ge=0,
        le=1e6,
        description="places of sparse infill smaller than this become solid: thin limbs gain strength, and travels cost more "
        "than the plastic saved, mm2",
    )
    infill_density: float = Field(0.2, ge=0, le=1, description="share of the inside that is filled")
    infill_pattern: Literal["rectilinear", "grid", "triangles", "cubic", "gyroid", "honeycomb", "concentric"] = Field(
        "grid",
        description="pattern of the sparse infill, cubic and gyroid are equally stiff all ways; a density of 1 is always solid",
    )
    infill_angle_deg: float = Field(45.0, ge=0, le=360, description="direction of the infill lines in the part's frame, deg")
    infill_overlap: float = Field(
        0.15, ge=0, le=0.5, description="reach of infill into the innermost wall, share of a line width"
    )
    infill_anchor_mm: float = Field(
        2.5,
        ge=0,
        le=100,
        description="run along the innermost wall that holds the end of a single infill line; 0: ends only touch the wall, mm",
    )
    infill_joint_mm: float = Field(
        12.0, ge=0, le=1000, description="infill lines whose ends are nearer than this along the wall are joined there, mm"
    )
    seam: Literal["aligned", "corner", "rear", "nearest", "random"] = Field(
        "aligned",
        description="where walls begin: in one line over the layers, in inner then outer corners, at the rear, nearest to the "
        "tip, or scattered; never on the edge of an interface",
    )
    seam_gap: float = Field(
        0.1,
        ge=0,
        le=1,
        description="walls stop this short of their beginning, so that the ends do not bulge, share of a line width",
    )
    overhang_share: float = Field(
        0.5, ge=0, le=1, description="walls with less than this share of their width on plastic below count as overhanging"
    )
    bridge_longest_mm: float = Field(
        6.0, ge=0, le=100, description="spans up to this print without support; PLA with a fan manages more, PETG hardly, mm"
    )
    arch_longest_mm: float = Field(
        6.0,
        ge=0,
        le=100,
        description="arches whose flat crown is no wider than this print without support, for each layer reaches little further "
        "than the one below; the crown of a level hole is 0.7 of its diameter wide, mm",
    )
    first_layer_flow: float = Field(1.0, ge=0.5, le=1.5, description="factor on extruded volume of part 1's first layer")
    bridge_flow: float = Field(
        1.0, ge=0.3, le=2, description="factor on extruded volume of bridges; 1: as much plastic as the layer has room for"
    )
    infill_bridge_flow: float = Field(
        1.0, ge=0.3, le=2, description="factor on extruded volume of the first solid layer over sparse infill, which spans it"
    )
    support: Literal["none", "auto"] = Field("auto", description="auto: support what the decomposition left risky")
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
    support_branch_growth_deg: float = Field(
        1.0, ge=0, le=20, description="branches get thicker downward, each side leaning by this, deg: tall ones must not sway"
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
        2.0, ge=0, le=20, description="support is wider by this in its first layer on the platform, so that it sticks, mm"
    )
    support_foot_density: float = Field(
        0.7, gt=0, le=1, description="share of the support's first layer on the platform that is filled"
    )
    support_least_mm2: float = Field(
        1.0, ge=0, le=1000, description="a hanging place smaller than this, seen from above, holds itself, mm2"
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
    interface_overlap: float = Field(
        0.5, ge=0, le=0.9, description="how deep a part's first layer is pressed into the part it stands on, share of its height"
    )
    interface_flow: float = Field(
        1.05, ge=0.5, le=1.5, description="factor on extruded volume of a part's first layer on plastic"
    )
    interface_speed_mm_s: float = Field(25.0, gt=0, le=1000, description="speed of a part's first layer on plastic, mm/s")
    interface_layers: int = Field(
        3, ge=1, le=100, description="layers of a part on plastic that get the interface's temperature, fan and extra walls"
    )
    interface_temperature_add_c: float = Field(
        5.0,
        ge=0,
        le=50,
        description="how much hotter a part's layers on plastic are printed, so that they weld to what has cooled, deg C",
    )
    interface_fan: float = Field(
        0.3, ge=0, le=1, description="factor on the part fan in a part's layers on plastic: air chills the bond"
    )
    interface_extra_walls: int = Field(
        1, ge=0, le=20, description="more walls in a part's layers on plastic, where bending stresses it most"
    )
    interface_seam_mm: float = Field(
        1.0, ge=0, le=20, description="walls begin no nearer than this to the edge of an interface, mm"
    )
    interlock_mm: float = Field(
        0.0,
        ge=0,
        le=1,
        description="depth of grooves that a part leaves for the next to flow into, mm; 0: none, their worth is not measured; "
        "a multiple of the layer height is met best",
    )
    outer_wall_speed_mm_s: float = Field(40.0, gt=0, le=1000, description="speed of outer walls, mm/s")
    inner_wall_speed_mm_s: float = Field(60.0, gt=0, le=1000, description="speed of inner walls, mm/s")
    skin_speed_mm_s: float = Field(60.0, gt=0, le=1000, description="speed of solid skins, mm/s")
    overhang_speed_mm_s: float = Field(
        20.0, gt=0, le=1000, description="speed of overhanging walls, mm/s: slow, so that they set before they sag"
    )
    bridge_speed_mm_s: float = Field(
        30.0, gt=0, le=1000, description="speed of bridges, mm/s: faster strands tear, slower ones sag"
    )
    infill_bridge_speed_mm_s: float = Field(
        40.0, gt=0, le=1000, description="speed of the first solid layer over sparse infill, mm/s: it hangs between the lines"
    )
    infill_speed_mm_s: float = Field(80.0, gt=0, le=1000, description="speed of sparse infill, mm/s")
    support_speed_mm_s: float = Field(60.0, gt=0, le=1000, description="speed of support, mm/s")
    support_interface_speed_mm_s: float = Field(
        40.0, gt=0, le=1000, description="speed of the dense layers of support, mm/s: their lines span the sparse ones"
    )
    first_layer_speed_mm_s: float = Field(20.0, gt=0, le=1000, description="speed of part 1's first layer, mm/s")
    gap_speed_mm_s: float = Field(
        30.0, gt=0, le=1000, description="speed of the lines in gaps between walls, mm/s: their width changes all the time"
    )
    top_skin_monotonic: bool = Field(
        True, description="the lines of the uppermost skins all lie on the same side of their neighbour: an even sheen"
    )
    top_skin_speed_mm_s: float = Field(40.0, gt=0, le=1000, description="speed of the uppermost skins, mm/s: they are seen")
    small_wall_mm: float = Field(
        40.0, ge=0, le=1000, description="closed walls no longer than this are small, mm; 40: a hole of 13 mm"
    )
    small_wall_speed_mm_s: float = Field(
        25.0, gt=0, le=1000, description="greatest speed of small walls, mm/s: on a tight curve a fast head rings and pulls"
    )
    travel_speed_mm_s: float = Field(150.0, gt=0, le=2000, description="speed of travels, mm/s")
    lift_speed_mm_s: float = Field(10.0, gt=0, le=500, description="speed of lifts along the nozzle, mm/s")
    retract_travel_mm: float = Field(1.5, ge=0, le=100, description="shortest travel that is worth a retraction, mm")
    combing: bool = Field(
        True, description="true: travels go round through the inside of the layer where that avoids a retraction"
    )
    combing_detour_mm: float = Field(
        8.0,
        ge=0,
        le=1000,
        description="how much longer than straight such a way may be; 8 mm take as long as pulling back and priming 0.8 mm, mm",
    )
    lift_mm: float = Field(
        0.2,
        ge=0,
        le=10,
        description="lift along the nozzle for travels that retract, mm; a layer's height clears what has curled up",
    )
    acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of every stroke; absent: what the axes allow, mm/s2"
    )
    outer_wall_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of outer walls; absent: acceleration_mm_s2, mm/s2"
    )
    infill_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of sparse infill and support; absent: acceleration_mm_s2, mm/s2"
    )
    bridge_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of bridges and overhanging walls; absent: acceleration_mm_s2, mm/s2"
    )
    first_layer_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of part 1's first layer; absent: acceleration_mm_s2, mm/s2"
    )
    travel_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of travels; absent: acceleration_mm_s2, mm/s2"
    )
    least_layer_time_s: float = Field(5.0, ge=0, le=600, description="layers printed faster than this are slowed down, s")
    least_speed_mm_s: float = Field(10.0, gt=0, le=1000, description="slowing for the layer time stops here, mm/s")

    @model_validator(mode="after")
    def _check(self) -> Self:
        adaptive = ("least_layer_height_mm", "most_layer_height_mm") if self.adaptive_cusp_mm > 0 else ()
        for wide, width in ((wide, getattr(self, wide)) for wide in WIDTHS):
            first = wide == "first_layer_line_width_mm"
            for key in ("first_layer_height_mm",) if first else (*HEIGHTS, *adaptive):
                if width is not None and getattr(self, key) > 0.9 * width:
                    raise ValueError(f"{key} is {getattr(self, key):g} mm: at most 0.9 of {wide} ({0.9 * width:g} mm) is allowed")
        if self.interlock_mm > self.line_width_mm - self.layer_height_mm + 1e-9:
            raise ValueError(
                f"interlock_mm is {self.interlock_mm:g} mm: at most line_width_mm less layer_height_mm "
                f"({self.line_width_mm - self.layer_height_mm:g} mm) is filled by one bead"
            )
        if adaptive and self.least_layer_height_mm > self.most_layer_height_mm:
            raise ValueError(
                f"least_layer_height_mm is {self.least_layer_height_mm:g} mm: at most most_layer_height_mm "
                f"({self.most_layer_height_mm:g} mm) is allowed"
            )
        return self
