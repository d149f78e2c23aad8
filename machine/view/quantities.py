"""Quantities: figures of a print in the units that people know."""

from math import pi
from typing import Any

import numpy as np

from profiles.material import Material


def duration(seconds: float) -> str:
    """Seconds as 1h 6m 15s."""
    whole = round(seconds)
    hours, minutes, rest = whole // 3600, whole // 60 % 60, whole % 60
    return f"{hours}h {minutes}m {rest}s" if hours else f"{minutes}m {rest}s" if minutes else f"{rest}s"


def minutes(seconds: float) -> str:
    """Seconds as 1h 6m, to the minute as an estimate deserves; less than one as 0m."""
    whole = round(seconds / 60.0)
    return f"{whole // 60}h {whole % 60}m" if whole >= 60 else f"{whole}m"


def filament_g(filament_mm: Any, material: Material) -> float:
    """Weight of filament that was pushed; filament_mm: a length, or the steps that make it."""
    volume_mm3 = float(np.sum(filament_mm)) * pi * material.diameter_mm**2 / 4.0
    return volume_mm3 * material.density_g_cm3 / 1000.0
