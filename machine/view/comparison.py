"""Comparison: what one way to print a model costs, to be held against other ways."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Alternative:
    """One way to print a model. risky_mm2: hanging faces that need support; unsupported_mm2: those that can get none; seam_mm:
    length of the seams between parts; message: why it cannot be printed so, or ""."""

    name: str
    orientation: str
    parts: int
    time_s: float | None
    filament_mm: float | None
    filament_g: float | None
    support_mm3: float | None
    risky_mm2: float
    message: str = ""
    unsupported_mm2: float | None = None
    seam_mm: float = 0.0
