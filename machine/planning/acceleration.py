"""Acceleration: what each kind of stroke is printed with, where the process asks for less than the axes allow."""

from profiles.process import Process
from profiles.profile import Profile
from slicer.paths import Kind

KEYS = tuple(key for key in Process.model_fields if key.endswith("acceleration_mm_s2"))


def stroke_accelerations(profile: Profile, first_layer: bool) -> dict[Kind, float] | None:
    """mm/s2 by kind; None where the process sets no acceleration at all, so that the firmware's own rule."""
    process = profile.process
    if not sets_acceleration(process):
        return None
    usual = process.acceleration_mm_s2 or axes_mm_s2(profile)
    if first_layer:
        return dict.fromkeys(Kind, process.first_layer_acceleration_mm_s2 or usual)
    infill = process.infill_acceleration_mm_s2 or usual
    hanging = process.bridge_acceleration_mm_s2 or usual
    return dict.fromkeys(Kind, usual) | {
        Kind.OUTER_WALL: process.outer_wall_acceleration_mm_s2 or usual,
        Kind.INFILL: infill,
        Kind.SUPPORT: infill,
        Kind.SUPPORT_INTERFACE: infill,
        Kind.BRIDGE: hanging,
        Kind.OVERHANG: hanging,
    }


def travel_mm_s2(profile: Profile) -> float | None:
    """mm/s2 of travels; None as for strokes."""
    return (profile.process.travel_acceleration_mm_s2 or axes_mm_s2(profile)) if sets_acceleration(profile.process) else None


def sets_acceleration(process: Process) -> bool:
    """Whether the process sets any acceleration."""
    return any(getattr(process, key) is not None for key in KEYS)


def axes_mm_s2(profile: Profile) -> float:
    """mm/s2 that both X and Y allow."""
    return min(profile.machine.x.acceleration_mm_s2, profile.machine.y.acceleration_mm_s2)
