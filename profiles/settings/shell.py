"""The shell: walls, their seams, and solid layers under and over a surface."""

from typing import Literal

from pydantic import Field

from profiles.frozen import Frozen

SkinPattern = Literal["monotonic", "rectilinear", "concentric"]


class Shell(Frozen):
    """Walls, seams and skins."""

    walls: int = Field(3, ge=0, le=50, description="number of walls")
    overhang_extra_walls: int = Field(
        0, ge=0, le=20, description="more walls in layers with overhanging walls: the outer ones hang on the inner ones"
    )
    only_one_wall_top: bool = Field(
        False,
        description="one wall round surfaces that face the printing direction, whose skin takes the place of the others; not in "
        "layers that another part touches",
    )
    only_one_wall_first_layer: bool = Field(False, description="one wall in the first layer on the plate")
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
    top_skin_pattern: SkinPattern = Field(
        "monotonic",
        description="lines of the uppermost skins; monotonic: all lie on the same side of their neighbour, an even sheen; "
        "rectilinear: in any order, which is faster; concentric: along the outline",
    )
    bottom_skin_pattern: SkinPattern = Field(
        "rectilinear",
        description="lines of the skins with nothing below, that of the first layer among them: as top_skin_pattern",
    )
    skin_angle_deg: float | None = Field(
        None,
        ge=0,
        le=360,
        description="direction of straight skin lines in the part's frame, across it in every second layer; absent: "
        "infill_angle_deg; the first skin over sparse infill crosses the infill lines, deg",
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
    gap_least_mm: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="gap fill shorter than this is left out, which saves travels; 1000 leaves out all gap fill, mm",
    )
    fuzzy_skin: Literal["none", "external", "all", "allwalls"] = Field(
        "none",
        description="which walls are roughened; external: outer walls on the outside; all: those of holes, too; allwalls: inner "
        "walls as well. First layers, faces at cuts, single lines and the climbing wall of spiral_vase stay even",
    )
    fuzzy_skin_thickness_mm: float = Field(
        0.3, gt=0, le=2, description="greatest distance by which points of rough walls are moved, inward or outward, mm"
    )
    fuzzy_skin_point_distance_mm: float = Field(
        0.8, ge=0.1, le=5, description="mean distance of the points of rough walls, by a quarter more or less, mm"
    )
    seam: Literal["aligned", "corner", "rear", "nearest", "random"] = Field(
        "aligned",
        description="where walls begin: in one line over the layers where it is seen least, in corners rather than on faces; in "
        "inner then outer corners; at the rear; nearest to the tip; or scattered; never on the edge of an interface",
    )
    seam_gap: float = Field(
        0.1,
        ge=0,
        le=1,
        description="walls stop this short of their beginning, so that the ends do not bulge, share of a line width",
    )
