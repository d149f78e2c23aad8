"""Support: what a part rests on: support, the build plate, or earlier parts."""

from typing import Any, Literal

from pydantic import model_validator

from profiles.frozen import Effect, Frozen, advanced, rare, simple

ANY_MATERIAL_MM = 5.0  # a length that any material can bridge
FARTHEST_MM = 1000.0  # larger than the distance of any plate from its turn axis
MIDDLE = (0.0, 0.0)


class Support(Frozen):
    """Overhangs, bridges and support."""

    overhang_share: float = rare("Walls overhang with less on plastic than", "overhangs threshold", ge=0, le=1)(
        0.5, "walls with less of their width on plastic count as overhanging"
    )
    bridge_longest_mm: float | None = advanced(
        "Longest bridge without support", "bridging max bridge length don't support bridges", ge=1, le=100, effect=Effect.FRONT
    )(
        None,
        "longest bridge without support, mm; absent: the material's; 1: next to nothing is left without support",
    )
    arch_longest_mm: float = advanced("Widest arch without support", "arches holes", ge=0, le=100, effect=Effect.FRONT)(
        6.0,
        "widest flat crown of an arch without support; the crown of a level hole is 0.7 of its diameter wide, mm",
    )
    bridge_flow: float = advanced("Bridge flow", "bridge flow ratio bridging", ge=0.3, le=2)(
        1.0, "flow factor of bridges; 100 %: as much plastic as the layer has room for"
    )
    bridge_angle_deg: float = advanced("Bridge angle", "bridging angle override direction", ge=0, le=360)(
        0.0, "direction of bridges in the part frame; 0: that in which they sag least, 180: along x, deg"
    )
    thick_bridges: bool = advanced("Thick bridges", "bridging round threads external bridge")(
        False,
        "bridges are round threads as thick as the nozzle: tighter over long spans, but coarser; not those over infill",
    )
    infill_bridge_flow: float = rare("Flow of the first solid layer over infill", "internal bridge flow ratio", ge=0.3, le=2)(
        1.0, "flow factor of the first solid layer over infill"
    )
    support: Literal["none", "auto", "enforced"] = simple(
        "Support", "supports enable generate support material enforcers only", effect=Effect.FRONT
    )("auto", "auto supports what the decomposition left risky, enforced only what overhangs in a plan's [[support]]")
    support_style: Literal["tree", "grid"] = simple("Support style", "supports tree organic grid snug type")(
        "tree",
        "tree: branches, which save plastic and time; grid: columns straight down where they find ground, sturdier under "
        "heavy flat places",
    )
    support_on_part: bool = simple("Support may stand on the part", "supports on build plate only everywhere")(
        True, "false: support stands only on plate or base; it leaves no marks on the part"
    )
    support_branch_angle_deg: float = advanced("Support lean at most", "tree support branch angle supports", ge=0, le=60)(
        40.0,
        "greatest lean of support, and at most self_supporting_angle_deg, deg; 40: a sparse branch holds itself less well "
        "than a wall",
    )
    support_branch_mm: float = advanced("Branch diameter", "tree support branch diameter supports", ge=0.2, le=20)(
        2.0, "diameter of a branch at its top, mm; thinner ones are knocked over by the nozzle"
    )
    support_branch_diameter_angle_deg: float = rare("Branch diameter angle", "tree support taper thicker downward", ge=0, le=15)(
        5.0, "angle at which a branch's sides widen downward, deg; 0: evenly thick"
    )
    support_trunk_mm: float = rare("Trunk diameter", "tree support branch maximum diameter widest", ge=0.2, le=25)(
        3.0,
        "diameter at which branches stop widening, mm; where the part leaves room they have at least a twelfth of the height "
        "that stands on them: tall ones must not sway",
    )
    support_pattern: Literal["lines", "grid"] = advanced("Support pattern", "supports base pattern")(
        "lines", "pattern of support: lines are easily broken away"
    )
    support_density: float = advanced("Support density", "supports spacing base pattern", gt=0, le=1)(
        0.15, "filled share of support"
    )
    support_walls: int = advanced("Walls around support", "supports perimeters sheath loops", ge=0, le=10)(
        1, "outlines around support; leaning support needs one for its lines to end on"
    )
    support_interface_layers: int = advanced(
        "Dense layers under the part", "supports top interface layers roof contact", ge=0, le=100
    )(3, "dense layers of support under the part: a floor even enough to lay a skin on")
    support_bottom_interface_layers: int = advanced(
        "Dense layers on the part", "supports bottom interface layers floor contact", ge=0, le=100
    )(2, "dense layers where support stands on the part")
    support_interface_density: float = advanced("Density of the dense layers", "supports interface pattern spacing", gt=0, le=1)(
        0.7, "filled share of the dense layers; a closed floor would weld to the part"
    )
    support_gap_mm: float = simple(
        "Gap between support and part above", "supports top z distance contact distance removal", ge=0, le=2
    )(0.2, "gap between support and the part over it, mm; 0: it welds")
    support_bottom_gap_mm: float = advanced(
        "Gap between support and part below", "supports bottom z distance contact distance", ge=0, le=2
    )(0.2, "gap between support and what it stands on, mm")
    support_distance_mm: float = advanced("Gap beside support", "supports xy distance separation object", ge=0, le=5)(
        0.3,
        "sideways gap between support and the part or later parts, mm; two thirds of a line: near enough to hold the edges",
    )
    support_foot_mm: float = rare("Wider foot on the plate", "supports first layer expansion", ge=0, le=20)(
        2.0,
        "width added to support in the first layer; no wider than twice its own height, mm",
    )
    support_foot_density: float = rare("Density of the foot", "supports first layer density", gt=0, le=1)(
        0.85,
        "filled share of support in the first layer; at 85 % or more its lines are so close together that everything on it "
        "has plastic beneath",
    )
    support_least_mm2: float = advanced(
        "Smallest place that is supported", "supports minimum area remove small overhangs", ge=0, le=1000, effect=Effect.FRONT
    )(1.0, "smaller overhangs, seen from above, hold themselves, mm²")

    @property
    def bridge_mm(self) -> float:
        """The longest bridge without support; a loaded profile has the material's value if the process sets none."""
        return ANY_MATERIAL_MM if self.bridge_longest_mm is None else self.bridge_longest_mm


class Plate(Frozen):
    """Part 1 on the plate."""

    place_mm: tuple[float, float] = advanced(
        "Place on the plate", "position move offset centre center xy arrange", effect=Effect.REACH
    )(MIDDLE, "position of the model's middle on the plate: x and y from the turn axis; several stand about it, mm")
    complete_objects: bool = advanced(
        "One model after the other", "complete individual objects sequential print sequence by object"
    )(False, "models are printed one by one, not layer by layer together")
    skirt_loops: int = simple("Skirt loops", "skirts outline", ge=0, le=20)(
        1, "loops around the first layer; with complete_objects of the first model"
    )
    skirt_distance_mm: float = advanced("Skirt distance", "skirts from object", gt=0, le=50)(4.0, "distance of the skirt, mm")
    brim_mm: float = simple("Brim width", "adhesion", ge=0, le=50)(
        0.0, "width of the brim, mm; 0: only where a base is too small; a raft has none"
    )
    small_base_brim_mm: float = advanced("Brim width of a small base", "adhesion auto brim", ge=0, le=50)(
        5.0, "width of the brim if 1 N at the top would tip the print, mm; 0: none"
    )
    brim_gap_mm: float = advanced("Gap between brim and part", "adhesion brim separation object gap", ge=0, le=5)(
        0.0, "gap between model and brim, mm; 0.1 comes off more easily"
    )
    elephant_foot_mm: float = advanced(
        "Elephant foot compensation", "elefant first layer squish initial layer horizontal expansion", ge=0, le=1
    )(0.0, "inward offset of the first layer, mm; a warm plate squeezes it out; none on a raft")
    raft_layers: int = simple("Raft layers", "raft adhesion base", ge=0, le=50)(
        0,
        "layers of a raft under model and support: one that sticks, sparse ones, and dense ones in the upper half; 0: none",
    )
    raft_contact_distance_mm: float = advanced("Gap between raft and model", "raft contact z distance air gap", ge=0, le=0.4)(
        0.1, "gap between raft and model, mm; 0: it welds"
    )
    raft_expansion_mm: float = advanced("Raft expansion", "raft margin extra", ge=0, le=50)(
        1.5, "width of the raft beyond model and support, mm"
    )
    raft_first_layer_density: float = advanced("Density of the raft's first layer", "raft base line spacing", ge=0.1, le=1)(
        0.9, "filled share of a raft's first layer: less is easier to take off the plate"
    )
    raft_first_layer_expansion_mm: float = advanced(
        "Expansion of the raft's first layer", "raft base margin adhesion", ge=0, le=50
    )(3.0, "extra width of a raft's first layer, mm")
    pedestal_gap_mm: float = advanced("Gap between pedestal and model", "contact z distance air gap", ge=0, le=1)(
        0.1, "gap between pedestal and model, mm"
    )


class Interface(Frozen):
    """Layers on plastic that has cooled."""

    interface_overlap: float = advanced("Press of the first layer on plastic", "bond weld overlap squish", ge=0, le=0.9)(
        0.5,
        "lowering of the tip in the first interface layer, share of a layer height; the bead is as high as what remains: "
        "pressed on, and fitting; 0.1 mm nearer is usual (STE-Slicer, Rep5x-Orca)",
    )
    interface_flow: float = advanced("Flow of the first layer on plastic", "bond weld extrusion multiplier", ge=0.5, le=1.5)(
        1.1,
        "flow factor of the first interface layer, on the gap below the tip: 110 % fills the pores, 115 % overfills "
        "(Scientific Reports, doi s41598-025-26253-0, fig. 14)",
    )
    interface_line_width_mm: float | None = advanced(
        "Line width of the first layer on plastic", "bond weld extrusion width", ge=0.1, le=4
    )(None, "line width in the first interface layer, up to two nozzles; absent: 4/3 of line_width_mm, mm")
    interface_speed_mm_s: float = advanced("Speed of the first layer on plastic", "bond weld", gt=0, le=1000)(
        25.0, "speed of the first interface layer, mm/s: as on a plate, slow beads are pressed on evenly"
    )
    interface_layers: int = advanced("Warm layers on plastic", "bond weld temperature", ge=1, le=100)(
        3, "interface layers of a part; they have their own temperature and fan"
    )
    interface_temperature_add_c: float = simple("Hotter on plastic by", "bond weld temperature adhesion strength", ge=0, le=50)(
        10.0,
        "temperature added in interface layers, °C; set before the table turns, reached before printing continues. A bond welds "
        "as long as it is hot, seconds (Ai and Vogt, doi s40964-022-00275-w); heat above the glass transition added 15 % in "
        "PA-CF (PMC7284967)",
    )
    interface_first_layer_fan: float = advanced(
        "Fan in the first layer on plastic", "bond weld cooling", ge=0, le=1, effect=Effect.NONE
    )(
        0.0,
        "factor on the fan in the first interface layer: what is blown on is cold before it has welded (Ai and Vogt, doi "
        "s40964-022-00275-w)",
    )
    interface_fan: float = advanced("Fan in the next layers on plastic", "bond weld cooling", ge=0, le=1, effect=Effect.NONE)(
        0.3, "factor on the fan in the other interface layers: air chills the bond"
    )
    interface_extra_walls: int = advanced("Extra walls on plastic", "bond perimeters strength", ge=0, le=50)(
        0,
        "extra walls in the first interface layer; of use where interface_bottom_layers is 0: what bonds is area, and that "
        "near the edge bears most in bending",
    )
    interface_walls: int = rare("Walls along a cut inside", "perimeters", ge=1, le=50)(
        1,
        "walls along a cut face, on which infill ends; along the surface there are always as many as walls says",
    )
    interface_top_layers: int = advanced("Solid layers under a cut", "floor of the next part", ge=1, le=1000)(
        2, "solid layers under a cut face: the floor on which the next part's first layer lies"
    )
    interface_bottom_layers: int = advanced("Solid layers on a cut", "bond strength", ge=0, le=1000)(
        1,
        "solid layers of a part on a cut face: a cold joint bears by its area in contact; 0: its sparse infill begins at once",
    )
    interface_seam_mm: float = rare("Seams stay away from a cut's edge by", "seam position", ge=0, le=20)(
        1.0, "least distance of z-seams from an interface's edge, mm"
    )
    interlock: Literal["none", "grooves", "pins"] = simple(
        "Interlock of parts", "pins grooves dowels pegs connectors strength joint"
    )(
        "none",
        "what holds parts together besides the weld: grooves that its first layer flows into, or pins, blind holes that it "
        "pours full first. Pins across layers bring PLA to 3.5 times its strength along Z, Duty and others, Additive "
        "Manufacturing 27, 2019; what they do at a joint is not measured",
    )
    interlock_mm: float = advanced("Groove depth", "interlock connectors", ge=0, le=1)(
        0.2,
        "depth of grooves, mm; a multiple of the layer height is met best. Where a profile has it and no interlock, as "
        "profiles of earlier versions do, it asks for grooves, 0 for none",
    )
    pin_width_nozzles: float = advanced("Pin diameter, in nozzles", "dowels pegs connectors", ge=2, le=3)(
        2.5,
        "pin diameter, in nozzle diameters: the tip circles in the mouth; wider holes are not filled from there, narrower "
        "ones are stopped up before they are full",
    )
    pin_depth_mm: float = advanced("Pin depth", "dowels pegs connectors", ge=2, le=4)(
        3.0, "depth of a pin, mm; plastic poured from the mouth falls no deeper"
    )
    pin_spacing_mm: float = advanced("Pin spacing", "dowels pegs connectors", ge=1, le=100)(
        4.0,
        "least distance between pin centres, mm: they stand in a square grid about the middle of a face, so wide that there "
        "are no more than most_pins",
    )
    most_pins: int = advanced("Most pins of a part", "dowels pegs connectors", ge=1, le=1000)(
        9, "most pins of a part: each takes 10 to 45 s and 40 to 75 mm³, mostly for the walls round it and its floor"
    )

    @model_validator(mode="before")
    @classmethod
    def _as_in_earlier_versions(cls, values: Any) -> Any:
        """Read interlock_mm alone, as in versions before interlock existed."""
        if isinstance(values, dict) and isinstance(values.get("interlock_mm"), int | float) and "interlock" not in values:
            return values | {"interlock": "grooves" if values["interlock_mm"] > 0 else "none"}
        return values
