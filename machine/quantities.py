"""Quantities: figures of a print in the units that people know."""

from math import pi

from profiles.material import Material


def duration(seconds: float) -> str:
    """Days, hours, minutes and seconds as 1h 6m 15s."""
    left = round(seconds)
    words: list[str] = []
    for letter, size in (("d", 86400), ("h", 3600), ("m", 60)):
        count, left = divmod(left, size)
        if count or words:
            words.append(f"{count}{letter}")
    return " ".join([*words, f"{left}s"])


def minutes(seconds: float) -> str:
    """Seconds as 1h 6m, to the minute as an estimate deserves; less than one as 0m."""
    whole = round(seconds / 60.0)
    return f"{whole // 60}h {whole % 60}m" if whole >= 60 else f"{whole}m"


def about(seconds: float) -> str:
    """Seconds to the minute where there are some, as an estimate deserves."""
    return minutes(seconds) if seconds >= 60.0 else duration(seconds)


def newtons(force_n: float) -> str:
    """A force to two digits, as an estimate deserves."""
    return f"{float(f'{force_n:.2g}'):.12g}"


def percent(share: float | None, digits: int = 0) -> str:
    """A share in percent without the sign; a dash where it is not known."""
    return "-" if share is None else f"{100.0 * share:.{digits}f}"


def filament_cm3(filament_mm: float, material: Material) -> float:
    """Volume of a length of filament."""
    return filament_mm * pi * material.diameter_mm**2 / 4.0 / 1000.0


def filament_g(filament_mm: float, material: Material) -> float:
    """Weight of a length of filament."""
    return filament_cm3(filament_mm, material) * material.density_g_cm3


def price(filament_mm: float, material: Material) -> float | None:
    """What a length of filament costs, in the material's currency; None where its price is not set."""
    return None if material.price_per_kg is None else filament_g(filament_mm, material) / 1000.0 * material.price_per_kg


def price_in_words(filament_mm: float, material: Material) -> str:
    """The same as a person reads it, 0.42 EUR; "" where the price is not set."""
    amount = price(filament_mm, material)
    return "" if amount is None else f"{amount:.2f} {material.currency}".rstrip()


def price_json(filament_mm: float, material: Material) -> dict[str, float | str]:
    """`cost` and `currency` for a report in JSON; nothing where the price is not set."""
    amount = price(filament_mm, material)
    return {} if amount is None else {"cost": amount, "currency": material.currency}
