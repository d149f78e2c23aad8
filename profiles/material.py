"""The material: filament, temperatures, cooling, retraction."""

from pydantic import Field

from profiles.frozen import Frozen


class Material(Frozen):
    """A filament and how it wants to be melted."""

    name: str = Field(description="what people call it")
    diameter_mm: float = Field(1.75, ge=1, le=4, description="filament diameter, mm")
    density_g_cm3: float = Field(1.24, gt=0, le=10, description="density, g/cm3")
    price_per_kg: float | None = Field(
        None, ge=0, le=1e6, description="what a kilogram costs, so that reports tell what a print costs; absent: they do not"
    )
    currency: str = Field("", max_length=12, description="what the price is counted in, as EUR; stands behind it in reports")
    nozzle_c: float = Field(ge=150, le=450, description="nozzle temperature, deg C")
    first_layer_nozzle_c: float = Field(ge=150, le=450, description="nozzle temperature of the first layer on the plate, deg C")
    homing_nozzle_c: float = Field(
        150.0, ge=0, le=450, description="nozzle while the machine homes and the bed heats, deg C: nothing may ooze at 150"
    )
    standby_c: float | None = Field(
        None, ge=0, le=450, description="nozzle while a print is paused, deg C; left out: as hot as it prints"
    )
    bed_c: float = Field(ge=0, le=200, description="bed temperature, deg C; 0: bed off")
    fan: float = Field(ge=0, le=1, description="part fan in layers that take least_layer_time_s or less, 0 to 1")
    fan_least: float = Field(
        0.35, ge=0, le=1, description="part fan in layers that take fan_layer_time_s or more, at most fan; between, in between"
    )
    fan_layer_time_s: float = Field(
        60.0, gt=0, le=3600, description="layers that take longer have cooled by themselves and need only fan_least, s"
    )
    fan_bridge: float | None = Field(None, ge=0, le=1, description="part fan on bridges and overhanging walls; absent: fan")
    fan_infill_bridge: float | None = Field(
        None, ge=0, le=1, description="part fan on the first solid layer over sparse infill; absent: fan_bridge"
    )
    fan_off_layers: int = Field(1, ge=0, le=1000, description="lowest layers on the plate without any fan: they must stick to it")
    fan_full_layer: int = Field(
        0,
        ge=0,
        le=1000,
        description="layer above the plate from which the fan may blow fully; it rises evenly from fan_off_layers to there",
    )
    interlayer_strength_mpa: float = Field(
        20.0,
        gt=0,
        le=500,
        description="tensile strength across layers, MPa; PLA printed well reaches 34, 3D Print. Addit. Manuf. 2020; ordinary "
        "prints and other filaments bond less",
    )
    cold_weld_factor: float = Field(
        0.6,
        gt=0,
        le=1,
        description="factor on interlayer_strength_mpa where a part stands on plastic that has cooled: an assumption, no such "
        "joint has been measured; strength across layers is 25 to 50 % below that along them, but 75 to 90 % with fibres or long "
        "times between layers, Duty and others, Solid Freeform Fabrication 2018",
    )
    bridge_longest_mm: float = Field(
        10.0,
        ge=1,
        le=100,
        description="level places spanned by straight lines up to this long, held at both ends, print without support, mm",
    )
    flow: float = Field(1.0, ge=0.5, le=1.5, description="factor on all extruded volume")
    retract_mm: float = Field(ge=0, le=15, description="filament pulled back before a travel that crosses outside, mm")
    retract_speed_mm_s: float = Field(35.0, gt=0, le=200, description="speed of retraction and priming, mm/s")
    wipe_mm: float = Field(
        2.0,
        ge=0,
        le=50,
        description="way back over the paths just printed while filament is pulled back, mm; 2 mm rub the drop off, 0: none",
    )
    coast_mm: float = Field(
        0.0,
        ge=0,
        le=10,
        description="last stretch of a path before a retraction that is printed by pressure alone, mm; 0: no coasting",
    )
    retract_prime_extra_mm: float = Field(
        0.0, ge=0, le=2, description="filament pushed beyond what was pulled back at the end of every retracted travel, mm"
    )
    prime_extra_mm: float = Field(
        0.0,
        ge=0,
        le=10,
        description="filament pushed beyond what was retracted after a reorientation, along the first stroke inside, mm",
    )
    pressure_advance: float | None = Field(
        None,
        ge=0,
        le=2,
        description="how much the extruder runs ahead of pressure, s: Marlin's M900 K, Klipper's SET_PRESSURE_ADVANCE, "
        "RepRapFirmware's M572; absent: what the firmware has",
    )
    volumetric_limit_mm3_s: float = Field(gt=0, le=200, description="most plastic the hot end melts, mm3/s")

    @property
    def cold_weld_mpa(self) -> float:
        """Tensile strength of a part's weld to cold plastic."""
        return self.interlayer_strength_mpa * self.cold_weld_factor
