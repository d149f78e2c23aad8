"""Stops: layers before which the print waits for the user, or for another filament."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from profiles.errors import SliceError
from profiles.messages import advice

if TYPE_CHECKING:
    from profiles.profile import Profile
    from slicer.paths import SlicedPart

WRITTEN = re.compile(r"(\d{1,6}):(?:(\d{1,6})|(\d{1,6}(?:\.\d{1,6})?)mm)")


@dataclass(frozen=True)
class Stop:
    """Layer of a part (both from 1), or height above its base plane, before which to stop; change: for another filament."""

    part: int
    layer: int | None
    height_mm: float | None
    change: bool

    @property
    def option(self) -> str:
        """Name of its command-line option."""
        return "filament-change" if self.change else "pause"

    @property
    def at(self) -> str:
        """Value of the option: PART:LAYER or PART:HEIGHTmm."""
        height = "" if self.height_mm is None else f"{self.height_mm:.6f}".rstrip("0").rstrip(".")
        return f"{self.part}:{f'{height}mm' if self.layer is None else self.layer}"


def parse_stops(pauses: Sequence[str], changes: Sequence[str]) -> tuple[Stop, ...]:
    """The stops of the options --pause and --filament-change. Raises SliceError for another form."""
    stops = []
    for text, change in (*((text, False) for text in pauses), *((text, True) for text in changes)):
        match = WRITTEN.fullmatch(text.strip())
        if match is None or 0 in (int(match[1]), int(match[2] or 1)):
            written = advice("filament-change" if change else "pause", text)
            raise SliceError(f"{written}: PART:LAYER or PART:HEIGHTmm is expected, counted from 1, such as 2:15 or 1:8.4mm")
        part, layer, height = match.groups()
        stops.append(Stop(int(part), int(layer) if layer else None, float(height) if height else None, change))
    return tuple(stops)


def parts_in_words(count: int, at_most: bool = False) -> str:
    """Which parts there are: "the parts are 1 to 3". at_most: `count` is the most there can be."""
    return "there is only part 1" if count == 1 else f"the parts are 1 to {count}{' at most' * at_most}"


def check_stop_parts(stops: Sequence[Stop], count: int, at_most: bool = False) -> None:
    """Raise SliceError for a stop in a part that does not exist. count: the number of parts, at_most: the most there can be."""
    for stop in stops:
        if stop.part > count:
            there = parts_in_words(count, at_most)
            raise SliceError(f"{advice(stop.option, stop.at)}: there is no part {stop.part}, {there}")


def check_stop_heights(stops: Sequence[Stop], heights_mm: Sequence[float], profile: "Profile") -> None:
    """Raise SliceError for a stop in a part, or at a layer or height, that cannot exist. heights_mm: greatest height of each
    part."""
    check_stop_parts(stops, len(heights_mm))
    for stop in stops:
        process, height_mm = profile.of_part(stop.part).process, heights_mm[stop.part - 1]
        most = int(height_mm / min(process.least_layer_height_mm, *(getattr(process, key) for key in process.heights))) + 1
        if (stop.layer or 0) > most or (stop.height_mm or 0.0) >= height_mm:
            layers = "" if stop.layer is None else f" and has at most {most} layers"
            raise SliceError(f"{advice(stop.option, stop.at)}: part {stop.part} is at most {height_mm:.3g} mm high{layers}")


def stops_by_layer(stops: Sequence[Stop], sliced: Sequence["SlicedPart"]) -> dict[tuple[int, int], bool]:
    """(part, layer) before which the print stops -> whether for another filament. Raises SliceError if it does not exist."""
    return {(stop.part, _layer_of(stop, sliced)): stop.change for stop in stops}


def _layer_of(stop: Stop, sliced: Sequence["SlicedPart"]) -> int:
    check_stop_parts((stop,), max(piece.index for piece in sliced))
    piece = next(piece for piece in sliced if piece.index == stop.part)
    if stop.layer is not None:
        if not 1 <= stop.layer <= len(piece.layers):
            raise SliceError(
                f"{advice(stop.option, stop.at)}: part {stop.part} has no layer {stop.layer}, its layers are 1 to "
                f"{len(piece.layers)}"
            )
        return stop.layer
    for number, layer in enumerate(piece.layers, start=1):
        if layer.z_mm - layer.height_mm >= (stop.height_mm or 0.0) - 1e-6:
            return number
    raise SliceError(f"{advice(stop.option, stop.at)}: part {stop.part} is only {piece.layers[-1].z_mm:.3g} mm high")
