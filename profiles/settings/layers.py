"""Layers: how a part itself is printed: the heights of its layers, walls, skins and infill."""

from typing import Literal

from profiles.frozen import Effect, Frozen, Vector, advanced, rare, simple

SkinPattern = Literal["monotonic", "rectilinear", "concentric"]


class Layers(Frozen):
    """Size and orientation of the model, layer heights, line widths."""

    name: str = rare("Name of the process", effect=Effect.NONE)(..., "its name")
    scale: float = advanced("Scale of the model", "size factor shrink enlarge", gt=0, le=100000, effect=Effect.FRONT)(
        1.0, "factor on the model's size"
    )
    rotate_deg: Vector = advanced("Turns of the model", "orientation rotation", effect=Effect.FRONT)(
        (0.0, 0.0, 0.0), "rotation about x, then y, then z, deg"
    )
    self_supporting_angle_deg: float = simple(
        "Steepest overhang without support", "threshold angle overhang angle supports", ge=0, le=85, effect=Effect.FRONT
    )(45.0, "steepest overhang without support, from the printing direction, deg")
    layer_height_mm: float = simple("Layer height", "resolution quality thickness", ge=0.02, le=2, effect=Effect.FRONT)(
        0.2, "height of a layer, mm"
    )
    first_layer_height_mm: float = simple("First layer height", "initial layer height thickness", ge=0.02, le=2)(
        0.2, "height of the first layer on the plate, mm"
    )
    adaptive_cusp_mm: float = advanced("Adaptive layers: deepest step", "variable layer height cusp stairs", ge=0, le=1)(
        0.0, "deepest step that adaptive layers leave, mm; 0: all layers alike"
    )
    least_layer_height_mm: float = advanced("Thinnest layer", "minimum layer height variable", ge=0.02, le=2)(
        0.08,
        "least height of adaptive layers and of the last under a top; layer_height_mm may be less: below a fifth of the "
        "nozzle a bead flows unevenly, mm",
    )
    most_layer_height_mm: float = advanced("Thickest adaptive layer", "maximum layer height variable", ge=0.02, le=2)(
        0.28, "greatest height of adaptive layers: seven tenths of the nozzle still bond well, mm"
    )
    line_width_mm: float = simple("Line width", "extrusion width", ge=0.1, le=4, effect=Effect.FRONT)(0.45, "width of a bead, mm")
    first_layer_line_width_mm: float | None = advanced("First layer line width", "initial layer extrusion width", ge=0.1, le=4)(
        None, "line width in the first layer: wide ones stick; absent: as elsewhere, mm"
    )
    first_layer_flow: float = advanced("First layer flow", "initial layer flow ratio extrusion multiplier", ge=0.5, le=1.5)(
        1.0, "flow factor of the first layer"
    )
    outer_wall_line_width_mm: float | None = advanced(
        "Outer wall line width", "external perimeter extrusion width", ge=0.1, le=4
    )(None, "width of outer walls: narrow ones show finer detail; absent: line_width_mm, mm")
    top_skin_line_width_mm: float | None = advanced("Top surface line width", "top solid infill extrusion width", ge=0.1, le=4)(
        None, "width of top skin lines; absent: line_width_mm, mm"
    )
    infill_line_width_mm: float | None = advanced("Infill line width", "sparse infill extrusion width", ge=0.1, le=4)(
        None, "width of infill lines; density stays the same; absent: line_width_mm, mm"
    )
    support_line_width_mm: float | None = advanced("Support line width", "support material extrusion width", ge=0.1, le=4)(
        None, "width of support: narrow lines break away more easily; absent: line_width_mm, mm"
    )
    slit_closing_mm: float = rare("Slits that are closed", "slice gap closing radius", ge=0, le=1)(
        0.018,
        "slits of a layer narrower than twice this are closed; the default keeps plastic within 4 % of a line of the model, "
        "0.049 heals coarser meshes, mm",
    )
    resolution_mm: float = rare("Resolution of paths", "gcode resolution slice simplify maximum deviation", ge=0, le=0.5)(
        0.02, "greatest deviation of simplified paths, mm"
    )


class Shell(Frozen):
    """Walls, seams and skins."""

    walls: int = simple("Walls", "perimeters shells wall loops wall count generator arachne classic", ge=0, le=50)(
        3, "number of walls"
    )
    overhang_extra_walls: int = advanced("Extra walls over overhangs", "extra perimeters if needed", ge=0, le=20)(
        0, "extra walls in layers with overhanging walls: the outer ones hang on the inner ones"
    )
    only_one_wall_top: bool = advanced("One wall on top surfaces", "single perimeter on top surfaces")(
        False,
        "one wall around top surfaces; skin replaces the others; not in layers that another part touches",
    )
    only_one_wall_first_layer: bool = advanced("One wall in the first layer", "single perimeter on initial layer")(
        False, "one wall in the first layer"
    )
    wall_order: Literal["inner-first", "outer-first"] = advanced(
        "Order of walls", "perimeters external perimeters first inner outer"
    )(
        "inner-first",
        "inner-first: best over overhangs (the outer wall leans on finished plastic); outer-first: best for fits (nothing "
        "pushes it outward)",
    )
    outer_bulge: float = rare("Bulge of outer walls", "external perimeters", ge=0, le=0.2)(
        0.04,
        "bulge of outer beads beyond the model, share of a line width; it gives the print the model's volume; 0: as other "
        "slicers",
    )
    top_layers: int = simple("Top layers", "top solid layers shell roof", ge=0, le=1000)(4, "solid layers under a top surface")
    bottom_layers: int = simple("Bottom layers", "bottom solid layers shell floor", ge=0, le=1000)(
        4, "solid layers over a bottom surface"
    )
    top_thickness_mm: float = advanced("Least top thickness", "minimum top shell thickness", ge=0, le=100)(
        0.7, "least thickness of the solid top, mm: thin layers are added until it is reached"
    )
    top_skin_pattern: SkinPattern = advanced("Top surface pattern", "top fill pattern monotonic lines sheen")(
        "monotonic",
        "pattern of top skins; monotonic: all lie on the same side of their neighbour, an even sheen; rectilinear: in any "
        "order, which is faster; concentric: along the outline",
    )
    bottom_skin_pattern: SkinPattern = advanced("Bottom surface pattern", "bottom fill pattern monotonic lines")(
        "rectilinear", "pattern of bottom skins and of the first layer: as top_skin_pattern"
    )
    skin_angle_deg: float | None = advanced("Skin angle", "solid infill direction top surface", ge=0, le=360)(
        None,
        "direction of skin lines in the part frame; every second layer is square to it; absent: infill_angle_deg; the first "
        "skin over sparse infill crosses the infill lines, deg",
    )
    bottom_thickness_mm: float = advanced("Least bottom thickness", "minimum bottom shell thickness", ge=0, le=100)(
        0.5, "least thickness of the solid bottom, mm"
    )
    solid_below_mm2: float = advanced("Solid infill in places below", "solid infill threshold area minimum sparse", ge=0, le=1e6)(
        70.0,
        "smaller areas of infill become solid: thin limbs gain strength, and travels cost more than the plastic saved, mm²",
    )
    gap_least_mm: float = advanced(
        "Shortest gap fill", "filter out tiny gaps gap fill enabled arachne wall generator", ge=0, le=1000
    )(0.0, "shorter gap fill is left out; 1000 leaves out all gap fill, mm")
    fuzzy_skin: Literal["none", "external", "all", "allwalls"] = simple("Fuzzy skin", "rough walls texture fuzzy_skin")(
        "none",
        "which walls are roughened; external: outer walls on the outside; all: those of holes, too; allwalls: inner walls as "
        "well. First layers, faces at cuts, single lines and the climbing wall of spiral_vase stay even",
    )
    fuzzy_skin_thickness_mm: float = advanced("Fuzzy skin thickness", gt=0, le=2)(
        0.3, "greatest displacement of rough walls, to either side, mm"
    )
    fuzzy_skin_point_distance_mm: float = advanced("Fuzzy skin point distance", "density", ge=0.1, le=5)(
        0.8, "distance of the points of rough walls, ± 25 %, mm"
    )
    seam: Literal["aligned", "corner", "rear", "nearest", "random"] = simple("Seam position", "z seam scar start of perimeters")(
        "aligned",
        "where walls begin: in one line over the layers where it is seen least, in corners rather than on faces; in inner then "
        "outer corners; at the rear; nearest to the tip; or scattered; never on the edge of an interface",
    )
    seam_gap: float = rare("Gap at the seam", "seam scarf blob", ge=0, le=1)(
        0.1, "gap between a wall's ends, share of a line width"
    )


class Finish(Frozen):
    """Sizes and smooth tops."""

    outline_compensation_mm: float = advanced(
        "Outline compensation", "xy size compensation contour horizontal expansion tolerance", ge=-0.5, le=0.5
    )(0.0, "outward offset of every layer's outside, mm; cut faces stay where they are")
    hole_compensation_mm: float = advanced(
        "Hole compensation", "xy hole compensation horizontal expansion tolerance fit", ge=-0.5, le=0.5
    )(0.0, "widening of holes to each side, mm: they print narrow; below 0: narrower")
    spiral_vase: bool = simple("Spiral vase", "vase mode spiralize outer contour")(
        False,
        "true: one wall climbs without a seam; there is no infill, top or support; the model is in one part, its layers one "
        "area without holes; a narrow tip at the top is left out",
    )
    ironing: bool = simple("Ironing", "smooth top surface iron")(
        False, "true: the nozzle smooths top skins; never where another part follows"
    )
    ironing_flow: float = advanced("Ironing flow", ge=0, le=1)(0.15, "flow of ironing, share of a full line")
    ironing_spacing_mm: float = advanced("Ironing line spacing", ge=0.02, le=1)(0.1, "distance of ironing lines, mm")
    ironing_speed_mm_s: float = advanced("Ironing speed", gt=0, le=1000)(15.0, "speed of ironing, mm/s")


class Infill(Frozen):
    """Pattern and density of the infill."""

    infill_density: float = simple("Infill density", "fill density sparse percent", ge=0, le=1)(
        0.2, "share of the inside that is filled"
    )
    infill_pattern: Literal["rectilinear", "grid", "triangles", "cubic", "gyroid", "honeycomb", "concentric", "lightning"] = (
        simple("Infill pattern", "fill pattern sparse lightning")(
            "grid",
            "pattern of the sparse infill: cubic and gyroid are equally stiff all ways, lightning only holds what is "
            "solid above it; 100 % is always solid",
        )
    )
    infill_angle_deg: float = advanced("Infill angle", "fill direction", ge=0, le=360)(
        45.0, "direction of infill lines in the part frame, deg"
    )
    infill_overlap: float = advanced("Infill overlap with walls", "perimeters encroachment", ge=0, le=0.5)(
        0.2, "overlap with the innermost wall, share of a line width"
    )
    infill_anchor_mm: float = rare("Infill anchor length", "anchor", ge=0, le=100)(
        2.5,
        "length along the wall that anchors a single infill line; it needs layers below; 0: ends only touch the wall, mm",
    )
    infill_joint_mm: float = rare("Infill lines joined up to", "maximum length of the infill anchor connect", ge=0, le=1000)(
        12.0, "infill lines with nearer ends are joined along the wall, mm"
    )
