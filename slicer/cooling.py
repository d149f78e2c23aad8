"""Cooling: how hard the fan blows on a layer and on what hangs in the air."""

from profiles.material import Material
from profiles.process import Process
from slicer.bead import Bead
from slicer.paths import Kind

HANGING = (Kind.BRIDGE, Kind.OVERHANG)
STEP = 0.05  # the fan is set in such steps: finer ones would only fill the file


def fan_share(material: Material, process: Process, time_s: float) -> float:
    """Part fan (0..1) of a layer that takes time_s: the material's fan up to least_layer_time_s, then less and less.

    Straight from `fan` to `fan_least` between least_layer_time_s and fan_layer_time_s, as PrusaSlicer has it.
    """
    least = min(material.fan_least, material.fan)
    quick, slow = process.least_layer_time_s, material.fan_layer_time_s
    falling = max(0.0, (slow - time_s) / (slow - quick)) if slow > quick else 0.0
    share = 1.0 if time_s <= quick else falling
    return round((least + share * (material.fan - least)) / STEP) * STEP


def rising_fan(material: Material, layer: int) -> float:
    """Factor on the fan of part 1's layer (counted from 0): none up to fan_off_layers, then rising, 1 from fan_full_layer on."""
    if layer < material.fan_off_layers:
        return 0.0
    return min((layer + 1 - material.fan_off_layers) / max(material.fan_full_layer - material.fan_off_layers, 1), 1.0)


def hanging_fan(material: Material, bead: Bead, factor: float, layer_fan: float) -> float | None:
    """Part fan of a bead where it differs from the layer's: of bridges, overhanging walls, half way there of those that lean."""
    if bead.kind not in HANGING and not bead.overhang:
        return None
    fans = (material.fan_infill_bridge if bead.over_infill else None, material.fan_bridge, material.fan)
    hanging = factor * next(fan for fan in fans if fan is not None)
    return hanging if bead.kind in HANGING else round(0.5 * (layer_fan + hanging) / STEP) * STEP
