"""Placeholders: what the profile's G-code blocks may name in braces, and the values."""

from math import pi

from machine.moves import BeginPart
from machine.settings import clock
from mdp.pose import level
from profiles.machine import RotaryAxis
from profiles.profile import Profile


def stepper(axis: RotaryAxis) -> str:
    """Klipper's name of a rotary axis's stepper."""
    return axis.stepper or f"stepper_{axis.letter.lower()}"


def placeholders(name: str, profile: Profile, parts: list[BeginPart], seconds: float, filament_mm: float) -> dict[str, object]:
    """What the blocks may name; the part's values change from part to part."""
    machine, material, process = profile.machine, profile.material, profile.process
    first = parts[0] if parts else None
    pose = first.pose if first else level(machine)
    return {
        "tilt": machine.tilt.letter,
        "turn": machine.turn.letter,
        "tilt_stepper": stepper(machine.tilt),
        "turn_stepper": stepper(machine.turn),
        "tilt_speed": machine.tilt.speed_deg_s,
        "turn_speed": machine.turn.speed_deg_s,
        "tilt_acceleration": machine.tilt.acceleration_deg_s2,
        "turn_acceleration": machine.turn.acceleration_deg_s2,
        "nozzle_c": material.nozzle_c,
        "first_layer_nozzle_c": material.first_layer_nozzle_c,
        "bed_c": material.bed_c,
        "nozzle_mm": machine.head.nozzle_mm,
        "layer_height_mm": process.layer_height_mm,
        "parts": len(parts),
        "layers": sum(part.layers for part in parts),
        "part": first.index if first else 0,
        "part_layers": first.layers if first else 0,
        "tilt_deg": pose.tilt_deg,
        "turn_deg": pose.turn_deg,
        "z_mm": 0.0,
        "time": clock(seconds),
        "time_s": round(seconds),
        "filament_mm": round(filament_mm, 2),
        "filament_g": round(filament_mm * pi * material.diameter_mm**2 / 4000.0 * material.density_g_cm3, 2),
        "model": "".join(c if "!" <= c <= "~" and c not in "(){};*" else "_" for c in name),
        "material": material.name,
        "process": process.name,
        "machine": machine.name,
    }
