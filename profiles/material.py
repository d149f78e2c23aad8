"""The material: filament, temperatures, cooling, retraction."""

from profiles.frozen import Effect, Frozen, advanced, rare, simple


class Material(Frozen):
    """A filament and how it wants to be melted."""

    name: str = rare("Name of the material", "filament", effect=Effect.NONE)(..., "its name")
    diameter_mm: float = simple("Filament diameter", ge=1, le=4)(1.75, "filament diameter, mm")
    density_g_cm3: float = advanced("Density", "filament weight grams", gt=0, le=10, effect=Effect.NONE)(1.24, "density, g/cm³")
    price_per_kg: float | None = simple("Price per kilogram", "filament cost spool money", ge=0, le=1e6, effect=Effect.NONE)(
        None, "price of a kilogram, for reports; absent: they have no price"
    )
    currency: str = simple("Currency of the price", "filament cost money euro dollar", max_length=12, effect=Effect.NONE)(
        "", "currency, such as EUR; follows the price in reports"
    )
    nozzle_c: float = simple("Nozzle temperature", "hotend extruder printing heat", ge=150, le=450, effect=Effect.NONE)(
        ..., "nozzle temperature, °C"
    )
    first_layer_nozzle_c: float = simple(
        "First layer nozzle temperature", "initial layer hotend extruder heat", ge=150, le=450, effect=Effect.NONE
    )(..., "nozzle temperature of the first layer on the plate, °C")
    homing_nozzle_c: float = advanced("Nozzle temperature while homing", "preheat ooze hotend", ge=0, le=450, effect=Effect.NONE)(
        150.0, "nozzle while homing and heating the bed, °C: nothing may ooze at 150"
    )
    standby_c: float | None = advanced(
        "Nozzle temperature while paused", "standby idle hotend", ge=0, le=450, effect=Effect.NONE
    )(None, "nozzle during a pause, °C; left out: as for printing")
    bed_c: float = simple("Bed temperature", "heatbed build plate heat", ge=0, le=200, effect=Effect.NONE)(
        ..., "bed temperature, °C; 0: bed off"
    )
    fan: float = simple("Part fan, at most", "cooling fan speed maximum", ge=0, le=1, effect=Effect.NONE)(
        ..., "fan in layers of least_layer_time_s or less"
    )
    fan_least: float = simple("Part fan, at least", "cooling fan speed minimum", ge=0, le=1, effect=Effect.NONE)(
        0.35, "fan in layers of fan_layer_time_s or more; interpolated for shorter ones; at most fan"
    )
    fan_layer_time_s: float = advanced(
        "Least fan in layers longer than", "cooling layer time", gt=0, le=3600, effect=Effect.NONE
    )(60.0, "longer layers need only fan_least, s")
    fan_bridge: float | None = advanced(
        "Part fan on bridges and overhangs", "cooling bridging bridges fan speed", ge=0, le=1, effect=Effect.NONE
    )(None, "fan on bridges and overhanging walls; absent: fan")
    fan_infill_bridge: float | None = rare(
        "Part fan over infill", "cooling internal bridge fan speed", ge=0, le=1, effect=Effect.NONE
    )(None, "fan on the first solid layer over infill; absent: fan_bridge")
    fan_off_layers: int = advanced(
        "First layers without fan", "cooling disable fan no cooling initial", ge=0, le=1000, effect=Effect.NONE
    )(1, "first layers without fan: they must stick to the plate")
    fan_full_layer: int = advanced("Full fan from layer", "cooling full fan speed at layer", ge=0, le=1000, effect=Effect.NONE)(
        0, "first layer with full fan; the limit rises evenly after fan_off_layers"
    )
    interlayer_strength_mpa: float = rare("Strength across layers", "tensile bond", gt=0, le=500, effect=Effect.FRONT)(
        20.0,
        "tensile strength across layers, MPa; PLA printed well reaches 34, 3D Print. Addit. Manuf. 2020; ordinary prints and "
        "other filaments bond less",
    )
    cold_weld_factor: float = rare("Strength on cold plastic", "tensile bond weld", gt=0, le=1, effect=Effect.FRONT)(
        0.6,
        "share of interlayer_strength_mpa at a joint: an assumption, no such joint has been measured; strength across layers "
        "is 25 to 50 % below that along them, but 75 to 90 % with fibres or long times between layers, Duty and others, Solid "
        "Freeform Fabrication 2018",
    )
    bridge_longest_mm: float = advanced(
        "Longest bridge of this material", "bridging supports", ge=1, le=100, effect=Effect.FRONT
    )(10.0, "longest bridge without support, mm")
    flow: float = simple("Flow", "extrusion multiplier flow ratio", ge=0.5, le=1.5)(1.0, "factor on all extruded volume")
    retract_mm: float = simple("Retraction", "retract length retraction distance stringing oozing", ge=0, le=15)(
        ..., "retraction before travels outside the part, mm"
    )
    retract_speed_mm_s: float = advanced("Retraction speed", "retract deretraction", gt=0, le=200)(
        35.0, "speed of retraction and priming, mm/s"
    )
    wipe_mm: float = advanced("Wipe", "retract retraction wipe while retracting stringing", ge=0, le=50)(
        2.0, "wipe along the printed path during retraction, mm; 2 mm remove the drop, 0: none"
    )
    coast_mm: float = advanced("Coasting", "coast end of path ooze", ge=0, le=10, effect=Effect.NONE)(
        0.0, "end of a path before a retraction, printed by pressure alone, mm; 0: no coasting"
    )
    retract_prime_extra_mm: float = advanced(
        "Extra filament after a retraction", "retract extra restart length deretraction", ge=0, le=2
    )(0.0, "extra filament after each retraction, mm")
    prime_extra_mm: float = advanced("Extra filament after a turn of the table", "retract restart length prime", ge=0, le=10)(
        0.0, "extra filament after a reorientation, in the first inner stroke, mm"
    )
    pressure_advance: float | None = advanced("Pressure advance", "linear advance K", ge=0, le=2, effect=Effect.NONE)(
        None,
        "pressure advance, s: Marlin's M900 K, Klipper's SET_PRESSURE_ADVANCE, RepRapFirmware's M572; absent: what the "
        "firmware has",
    )
    volumetric_limit_mm3_s: float = advanced("Most plastic melted", "maximum volumetric speed flow limit", gt=0, le=200)(
        ..., "greatest flow of the hot end, mm³/s"
    )

    @property
    def cold_weld_mpa(self) -> float:
        """Tensile strength of a part's weld to cold plastic."""
        return self.interlayer_strength_mpa * self.cold_weld_factor
