"""Interfaces: how a part is printed on the parts before it."""

from typing import Any, Literal

from pydantic import Field, model_validator

from profiles.frozen import Frozen


class Interface(Frozen):
    """Layers on plastic that has cooled."""

    interface_overlap: float = Field(
        0.5,
        ge=0,
        le=0.9,
        description="by how much nearer to the part below the tip lays a part's first layer on plastic, share of a layer's "
        "height; the bead is as high as what remains: pressed on, and fitting; 0.1 mm nearer is usual (STE-Slicer, Rep5x-Orca)",
    )
    interface_flow: float = Field(
        1.1,
        ge=0.5,
        le=1.5,
        description="factor on extruded volume of a part's first layer on plastic, of the room between its tip and the part "
        "below: 1.10 fills the pores, 1.15 overfills (Scientific Reports, doi s41598-025-26253-0, fig. 14)",
    )
    interface_line_width_mm: float | None = Field(
        None,
        ge=0.1,
        le=4,
        description="width of all beads of a part's first layer on plastic, up to two nozzles; absent: 4/3 of line_width_mm, mm",
    )
    interface_speed_mm_s: float = Field(
        25.0,
        gt=0,
        le=1000,
        description="speed of a part's first layer on plastic, mm/s: as on a plate, slow beads are pressed on evenly",
    )
    interface_layers: int = Field(
        3, ge=1, le=100, description="layers of a part on plastic that get the interface's temperature and fan"
    )
    interface_temperature_add_c: float = Field(
        10.0,
        ge=0,
        le=50,
        description="how much hotter a part's layers on plastic are printed, deg C; asked for before the table turns and waited "
        "for after it. A bond welds as long as it is hot, seconds (Ai and Vogt, doi s40964-022-00275-w); heat above the glass "
        "transition added 15 % in PA-CF (PMC7284967)",
    )
    interface_first_layer_fan: float = Field(
        0.0,
        ge=0,
        le=1,
        description="factor on the part fan in a part's first layer on plastic: what is blown on is cold before it has welded "
        "(Ai and Vogt, doi s40964-022-00275-w)",
    )
    interface_fan: float = Field(
        0.3, ge=0, le=1, description="factor on the part fan in the other layers of a part on plastic: air chills the bond"
    )
    interface_extra_walls: int = Field(
        0,
        ge=0,
        le=50,
        description="more walls in a part's first layer on plastic; of use where interface_bottom_layers is 0: what bonds is "
        "area, and that near the edge bears most in bending",
    )
    interface_walls: int = Field(
        1,
        ge=1,
        le=50,
        description="walls along the face of a cut, inside the model, on which sparse infill ends; along the surface there are "
        "always as many as walls says",
    )
    interface_top_layers: int = Field(
        2, ge=1, le=1000, description="solid layers under the face of a cut: the floor on which the next part's first layer lies"
    )
    interface_bottom_layers: int = Field(
        1,
        ge=0,
        le=1000,
        description="solid layers of a part on the floor it stands on: a cold joint bears by its area in contact; 0: its sparse "
        "infill begins at once",
    )
    interface_seam_mm: float = Field(
        1.0, ge=0, le=20, description="walls begin no nearer than this to the edge of an interface, mm"
    )
    interlock: Literal["none", "grooves", "pins"] = Field(
        "none",
        description="what holds a part in the one below beside the weld: grooves that its first layer flows into, or pins, blind "
        "holes that it pours full first. Pins across layers bring PLA to 3.5 times its strength along Z, Duty and others, "
        "Additive Manufacturing 27, 2019; what they do at a joint is not measured",
    )
    interlock_mm: float = Field(
        0.2,
        ge=0,
        le=1,
        description="depth of the grooves of interlock = grooves, mm; a multiple of the layer height is met best. Where a "
        "profile has it and no interlock, as profiles of earlier versions do, it asks for grooves, 0 for none",
    )
    pin_width_nozzles: float = Field(
        2.5,
        ge=2,
        le=3,
        description="diameter of a pin, in diameters of the nozzle: the tip circles in the mouth; wider holes are not filled "
        "from there, narrower ones are stopped up before they are full",
    )
    pin_depth_mm: float = Field(
        3.0,
        ge=2,
        le=4,
        description="how deep a pin reaches into the part below, mm; plastic poured from the mouth falls no deeper",
    )
    pin_spacing_mm: float = Field(
        4.0,
        ge=1,
        le=100,
        description="least distance of the middles of pins, mm: they stand in a square grid about the middle of a face, so wide "
        "that there are no more than most_pins",
    )
    most_pins: int = Field(
        9,
        ge=1,
        le=1000,
        description="pins of a part at most: each takes 10 to 45 s and 40 to 75 mm3, mostly for the walls round it and its floor",
    )

    @model_validator(mode="before")
    @classmethod
    def _as_in_earlier_versions(cls, values: Any) -> Any:
        """What interlock_mm alone has meant before there was interlock."""
        if isinstance(values, dict) and isinstance(values.get("interlock_mm"), int | float) and "interlock" not in values:
            return values | {"interlock": "grooves" if values["interlock_mm"] > 0 else "none"}
        return values
