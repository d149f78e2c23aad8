"""Material rules: what of another slicer's filament becomes which key of a material."""

import re

from profiles.foreign.config import Config
from profiles.foreign.conversion import Convert, Converted, Left, Value, above_zero, number, share, whole

FIRMWARE = "the firmware's own"
ADVANCE = re.compile(r"^(?:M900 K|M572 (?:D\d+ )?S|SET_PRESSURE_ADVANCE (?:EXTRUDER=\S+ )?ADVANCE=)([0-9.]+)")
BASES = {"PLA": "pla", "PETG": "petg", "PET": "petg", "ABS": "abs", "ASA": "abs", "TPU": "tpu", "FLEX": "tpu", "TPE": "tpu"}
USUAL_BASE = "pla"


def base_of(config: Config) -> tuple[str, str]:
    """The shipped material that one inherits from, and what the file says that it is."""
    kind = (config.text("filament_type") or "").strip('"').upper()
    return next((BASES[word] for word in re.split(r"[^A-Z]+", kind) if word in BASES), USUAL_BASE), kind


def _fan_least(config: Config, key: str) -> Converted:
    """The fan's least in layers that take long: none where it is not kept on."""
    if config.flag("fan_always_on") is False:
        return Value(0.0, "fan_always_on is off: long layers have none")
    return share(config, key)


def _fan_most(config: Config, key: str) -> Converted:
    """The fan's most: where nothing is cooled by layer time, the least that is always there."""
    if config.flag("cooling") is False and config.text("fan_always_on") is not None:
        least = _fan_least(config, "min_fan_speed")
        return Value(least.value, "cooling is off: the fan stays at its least") if isinstance(least, Value) else least
    return share(config, key)


def _bridge_fan(config: Config, key: str) -> Converted:
    """The fan over bridges; below 0 SuperSlicer has it as elsewhere."""
    return Left("below 0: as elsewhere") if (config.number(key) or 0.0) < 0.0 else share(config, key)


def _override(own: str, convert: Convert = number) -> Convert:
    """The filament's own value where it has one, else the printer's."""

    def converted(config: Config, key: str) -> Converted:
        if config.text(own) is None:
            return convert(config, key)
        value = convert(config, own)
        return Value(value.value, f"the filament's own {own}") if isinstance(value, Value) else value

    return converted


def _advance(config: Config, key: str) -> Converted:
    """Pressure advance out of a filament's G-code, where a line says nothing else."""
    blocks = (config.text(key) or "").strip('"').replace("\\n", "\n").split("\n")
    found = [match[1] for line in blocks if (match := ADVANCE.match(line.split(";")[0].strip()))]
    if found:
        return Value(float(found[-1]), "out of the filament's G-code")
    asks = any(word in line for line in blocks for word in ("M900", "M572", "SET_PRESSURE_ADVANCE"))
    return Left("sets pressure advance on a condition: look at it, and set material.pressure_advance") if asks else Left(GCODE)


def _pressure(config: Config, key: str) -> Converted:
    if config.flag("enable_pressure_advance") is False:
        return Left("enable_pressure_advance is off")
    return number(config, key)


def _wipe(config: Config, key: str) -> Converted:
    if config.flag(key) is False:
        return Value(0.0, "off")
    distance = config.number("wipe_distance")
    return Left("on: how far is ours") if distance is None else Value(distance, "wipe_distance")


GCODE = "G-code blocks belong to the machine"

RULES: tuple[tuple[str, str, Convert], ...] = (
    ("material.diameter_mm", "filament_diameter", number),
    ("material.density_g_cm3", "filament_density", above_zero("not told")),
    ("material.price_per_kg", "filament_cost", above_zero("not told")),
    ("material.nozzle_c", "temperature", number),
    ("material.first_layer_nozzle_c", "first_layer_temperature", number),
    ("material.bed_c", "bed_temperature", number),
    ("material.flow", "extrusion_multiplier", number),
    ("material.fan", "max_fan_speed", _fan_most),
    ("material.fan_least", "min_fan_speed", _fan_least),
    ("material.fan_layer_time_s", "fan_below_layer_time", above_zero("no layer is cooled by its time")),
    ("material.fan_bridge", "bridge_fan_speed", _bridge_fan),
    ("material.fan_off_layers", "disable_fan_first_layers", whole),
    ("material.fan_full_layer", "full_fan_speed_layer", whole),
    ("material.retract_mm", "retract_length", _override("filament_retract_length")),
    ("material.retract_speed_mm_s", "retract_speed", _override("filament_retract_speed", above_zero(FIRMWARE))),
    ("material.retract_prime_extra_mm", "retract_restart_extra", _override("filament_retract_restart_extra")),
    ("material.wipe_mm", "wipe", _wipe),
    ("material.volumetric_limit_mm3_s", "filament_max_volumetric_speed", above_zero("no limit; ours stays")),
    ("material.pressure_advance", "start_filament_gcode", _advance),
    ("material.pressure_advance", "pressure_advance", _pressure),
)
