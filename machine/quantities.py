"""Figures of a print in customary units."""

from math import pi

from profiles.material import Material
from profiles.messages import three_digits


def duration(seconds: float) -> str:
    """Format as days, hours, minutes and seconds, such as 1h 6m 15s."""
    left = round(seconds)
    words: list[str] = []
    for letter, size in (("d", 86400), ("h", 3600), ("m", 60)):
        count, left = divmod(left, size)
        if count or words:
            words.append(f"{count}{letter}")
    return " ".join([*words, f"{left}s"])


def minutes(seconds: float) -> str:
    """Format an estimate to the minute, such as 1h 6m."""
    whole = round(seconds / 60.0)
    return f"{whole // 60}h {whole % 60}m" if whole >= 60 else f"{whole}m"


def about(seconds: float) -> str:
    """Format an estimate: to the minute, or to the second below one minute."""
    return minutes(seconds) if seconds >= 60.0 else duration(seconds)


def newtons(force_n: float) -> str:
    """Format an estimated force with two digits."""
    return f"{float(f'{force_n:.2g}'):.12g}"


def amount(value: float, decimals: int = 2) -> str:
    """Format like three_digits(); a negative value, which rounding leaves of 0, as 0."""
    return three_digits(max(value, 0.0), decimals)


def percent(share: float | None, digits: int = 0) -> str:
    """Format a share as percent without the sign, like three_digits(); a dash if None. digits: decimals below 100 %."""
    return "-" if share is None else three_digits(100.0 * share, digits)


def filament_cm3(filament_mm: float, material: Material) -> float:
    return filament_mm * pi * material.diameter_mm**2 / 4.0 / 1000.0


def filament_g(filament_mm: float, material: Material) -> float:
    return filament_cm3(filament_mm, material) * material.density_g_cm3


def price(filament_mm: float, material: Material) -> float | None:
    """Price of a length of filament, in the material's currency; None if the material has no price."""
    return None if material.price_per_kg is None else filament_g(filament_mm, material) / 1000.0 * material.price_per_kg


def price_in_words(filament_mm: float, material: Material) -> str:
    """Price of a length of filament with its currency, such as 0.42 EUR; "" if the material has no price."""
    costs = price(filament_mm, material)
    return "" if costs is None else f"{costs:.2f} {material.currency}".rstrip()


def price_json(filament_mm: float, material: Material) -> dict[str, float | str]:
    """`cost` and `currency` for a JSON report; {} if the material has no price."""
    costs = price(filament_mm, material)
    return {} if costs is None else {"cost": costs, "currency": material.currency}
