"""Interfaces: how a part is printed on the parts before it."""

from pydantic import Field

from profiles.machine import Frozen


class Interface(Frozen):
    """Layers on plastic that has cooled."""

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
