"""Config: the settings of another slicer, each under the key that PrusaSlicer has for it, with the name and text of its own file.

The other programs name the same things otherwise; what each calls them is a table of its reader, so the rules of conversion are
written once.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
NOTHING = ("", "nil")  # PrusaSlicer's filament overrides are nil where the printer's value holds


@dataclass(frozen=True)
class Entry:
    """A setting as its file has it."""

    name: str
    text: str


@dataclass(frozen=True)
class Config:
    """What a file says. entries: by PrusaSlicer's key; unknown: names in the file that no key stands for; process, material: what
    the presets are called, empty where the file does not tell."""

    program: str
    entries: Mapping[str, Entry]
    unknown: tuple[str, ...] = ()
    process: str = ""
    material: str = ""

    def text(self, key: str) -> str | None:
        """The text of a key, of the first extruder where there are several; None where nothing is said."""
        entry = self.entries.get(key)
        if entry is None:
            return None
        text = first_of(entry.text)
        return None if text in NOTHING else text

    def number(self, key: str) -> float | None:
        """The number of a key; None where nothing is said, or a share, or no number."""
        return finite(self.text(key) or "")

    def share(self, key: str) -> float | None:
        """The percentage of a key as a share; None where it is none."""
        text = self.text(key)
        percent = finite(text[:-1]) if text is not None and text.endswith("%") else None
        return None if percent is None else percent / 100.0

    def flag(self, key: str) -> bool | None:
        """Whether a key is on."""
        text = self.text(key)
        return None if text is None else text.lower() in ("1", "true", "yes")


def finite(text: str) -> float | None:
    """The number that a text is; None where it is none, or too large for one."""
    stripped = text.strip()
    number = float(stripped) if NUMBER.fullmatch(stripped) else None
    return number if number is not None and isfinite(number) else None


def width_of_nozzle(text: str, nozzle: str) -> str:
    """A line's width that is in percent of the nozzle, in mm, "0" where the nozzle is not told; any other as it is."""
    percent = finite(text.strip()[:-1]) if text.strip().endswith("%") else None
    if percent is None:
        return text
    diameter_mm = finite(first_of(nozzle))
    return f"{percent / 100.0 * diameter_mm:g}" if diameter_mm is not None else "0"


def first_of(text: str) -> str:
    """The first extruder's value of a list; quoted texts stay whole."""
    stripped = text.strip()
    if stripped.startswith('"'):
        return stripped
    numbers = [NUMBER.fullmatch(item.strip().removesuffix("%")) or item.strip() in NOTHING for item in stripped.split(",")]
    return stripped.split(",")[0].strip() if all(numbers) else stripped
