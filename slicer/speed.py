"""Speed: how fast each kind of bead is laid and how hard it is accelerated, as the process asks for it."""

from profiles.process import Process
from profiles.profile import Profile
from slicer.paths import Kind

KEYS = tuple(key for key in Process.model_fields if key.endswith("acceleration_mm_s2"))
INSIDE = (Kind.INFILL, Kind.SKIN, Kind.TOP_SKIN)


def stroke_speeds(process: Process) -> dict[Kind, float]:
    """mm/s by kind of bead."""
    return {
        Kind.OUTER_WALL: process.outer_wall_speed_mm_s,
        Kind.INNER_WALL: process.inner_wall_speed_mm_s,
        Kind.OVERHANG: process.overhang_75_speed_mm_s,
        Kind.GAP: process.gap_speed_mm_s,
        Kind.INFILL: process.infill_speed_mm_s,
        Kind.SKIN: process.skin_speed_mm_s,
        Kind.TOP_SKIN: process.top_skin_speed_mm_s,
        Kind.BRIDGE: process.bridge_speed_mm_s,
        Kind.IRONING: process.ironing_speed_mm_s,
        Kind.SKIRT: process.first_layer_speed_mm_s,
        Kind.PURGE: process.first_layer_speed_mm_s,
        Kind.SUPPORT: process.support_speed_mm_s,
        Kind.SUPPORT_INTERFACE: process.support_interface_speed_mm_s,
    }


def first_layer_speeds(process: Process, on_platform: bool) -> dict[Kind, float]:
    """mm/s by kind of a part's first layer, on the platform or on plastic."""
    if not on_platform:
        return dict.fromkeys(Kind, process.interface_speed_mm_s)
    inside = process.first_layer_infill_speed_mm_s or process.first_layer_speed_mm_s
    return dict.fromkeys(Kind, process.first_layer_speed_mm_s) | dict.fromkeys(INSIDE, inside)


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
