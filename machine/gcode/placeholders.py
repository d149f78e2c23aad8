"""Placeholders: what the profile's G-code blocks may name in braces, the values, and the blocks with them filled in."""

import re
from collections.abc import Mapping, Sequence

from machine.firmware.dialect import Dialect
from machine.firmware.klipper import stepper_name
from machine.firmware.line import FRAME_CHARACTERS
from machine.gcode.line_text import plain_line, read_line
from machine.planning.moves import BeginPart
from machine.quantities import duration, filament_g
from mdp.mesh import Floats
from mdp.pose import Pose, level
from profiles.errors import GcodeError, ProfileError
from profiles.machine import Machine
from profiles.profile import Profile

PLACEHOLDER = re.compile(r"\{(\w+)\}")


def placeholders(name: str, profile: Profile, parts: list[BeginPart], seconds: float, filament_mm: float) -> dict[str, object]:
    """What the blocks may name; the part's values change from part to part."""
    machine, material, process = profile.machine, profile.material, profile.process
    first = parts[0] if parts else None
    pose = first.pose if first else level(machine)
    return {
        **_axes(machine),
        "nozzle_c": material.nozzle_c,
        "first_layer_nozzle_c": material.first_layer_nozzle_c,
        "homing_nozzle_c": material.homing_nozzle_c,
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
        "time": duration(seconds),
        "time_s": round(seconds),
        "filament_mm": round(filament_mm, 2),
        "filament_g": round(filament_g(filament_mm, material), 2),
        "model": "".join(c if "!" <= c <= "~" and c not in "(){};*" else "_" for c in name),
        "material": material.name,
        "process": process.name,
        "machine": machine.name,
    }


def resume_placeholders(machine: Machine, tip_mm: Sequence[float] | Floats, pose: Pose, clear_z_mm: float) -> dict[str, object]:
    """What the block may name that goes on with a print after a power cut: where the tip was, the table's pose, a safe height."""
    return {
        "x_mm": float(tip_mm[0]), "y_mm": float(tip_mm[1]), "z_mm": float(tip_mm[2]),
        "tilt_deg": pose.tilt_deg, "turn_deg": pose.turn_deg, "clear_z_mm": clear_z_mm, **_axes(machine),
    }  # fmt: skip


def _axes(machine: Machine) -> dict[str, object]:
    """What all blocks may say of the rotary axes."""
    return {
        "tilt": machine.tilt.letter,
        "turn": machine.turn.letter,
        "tilt_stepper": stepper_name(machine.tilt),
        "turn_stepper": stepper_name(machine.turn),
        "tilt_speed": machine.tilt.speed_deg_s,
        "turn_speed": machine.turn.speed_deg_s,
        "tilt_acceleration": machine.tilt.acceleration_deg_s2,
        "turn_acceleration": machine.turn.acceleration_deg_s2,
    }


def fill_block(block: str, name: str, values: Mapping[str, object], dialect: Dialect) -> list[str]:
    """The block's lines with {placeholders} replaced, empty lines left out.

    A firmware on a serial line gets them without remarks in parentheses, whose words it would execute. Raises ProfileError for an
    unknown placeholder, for a line whose text firmwares read differently and for a command too long for the firmware.
    """
    lines, longest = [], dialect.longest_line
    for line in block.splitlines():
        text = PLACEHOLDER.sub(lambda match: _value(match[1], name, values), line).rstrip()
        text = text if dialect.statements else text.strip()  # RepRapFirmware tells by the indent what an `if` holds
        try:
            command = read_line(text).command
            text = plain_line(text) if dialect.serial else text
        except GcodeError as error:
            raise ProfileError(f"{name}: {error}") from None
        if len(command) + FRAME_CHARACTERS > longest:
            raise ProfileError(
                f"{name}: the line {command[:40]!r}... has {len(command)} characters, "
                f"at most {longest - FRAME_CHARACTERS} are allowed (the firmware's {longest} less line number and checksum)"
            )
        if text:
            lines.append(text)
    return lines


def _value(word: str, name: str, values: Mapping[str, object]) -> str:
    if word not in values:
        raise ProfileError(f"{name}: placeholder {{{word}}} is not known: allowed are {', '.join(sorted(values))}")
    value = values[word]
    if isinstance(value, float):
        return f"{value:.4f}".rstrip("0").rstrip(".") if abs(value) >= 5e-5 else "0"
    return str(value)
