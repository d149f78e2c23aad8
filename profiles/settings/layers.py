"""Layers: what a process does with the model first, how high its layers are and how wide its lines."""

from pydantic import Field

from profiles.frozen import Frozen, Vector


class Layers(Frozen):
    """Size and turn of the model, heights of layers, widths of lines."""

    name: str = Field(description="what people call it")
    scale: float = Field(1.0, gt=0, le=100000, description="factor on the model's size before anything else")
    rotate_deg: Vector = Field(
        (0.0, 0.0, 0.0), description="turns of the model about x, then y, then z before anything else, deg"
    )
    self_supporting_angle_deg: float = Field(
        45.0, ge=0, le=85, description="steepest overhang, from the printing direction, that prints without support, deg"
    )
    layer_height_mm: float = Field(0.2, ge=0.02, le=2, description="height of a layer, mm")
    first_layer_height_mm: float = Field(0.2, ge=0.02, le=2, description="height of the first layer on the plate, mm")
    adaptive_cusp_mm: float = Field(
        0.0,
        ge=0,
        le=1,
        description="layers are made as thick as steps of the surface no deeper than this allow, mm; 0: all layers alike",
    )
    least_layer_height_mm: float = Field(
        0.08,
        ge=0.02,
        le=2,
        description="no layer is thinner, adaptive or the last under a top, unless layer_height_mm is: below a fifth of the "
        "nozzle a bead flows unevenly, mm",
    )
    most_layer_height_mm: float = Field(
        0.28, ge=0.02, le=2, description="adaptive layers are not thicker: seven tenths of the nozzle still bond well, mm"
    )
    line_width_mm: float = Field(0.45, ge=0.1, le=4, description="width of a bead, mm")
    first_layer_line_width_mm: float | None = Field(
        None,
        ge=0.1,
        le=4,
        description="width of all beads of the first layer on the plate: wide ones stick; absent: as elsewhere, mm",
    )
    first_layer_flow: float = Field(1.0, ge=0.5, le=1.5, description="factor on extruded volume of the first layer on the plate")
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
    resolution_mm: float = Field(0.02, ge=0, le=0.5, description="printed paths are simplified by at most this, mm")
