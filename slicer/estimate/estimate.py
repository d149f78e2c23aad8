"""Estimate: print time and filament of parts from a few of their layers, sliced as for a print."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from mdp.decomposition import Part
from profiles.profile import Profile
from slicer.estimate.hanging import rough_support, thick_support
from slicer.estimate.layer import sections_near, sliced_layers
from slicer.estimate.rough import choose_layers, rough_layers
from slicer.sectioning import heights_of
from slicer.strokes.vase import vase_profile

SAMPLES = 12  # layers of a print
FEWEST = 4  # layers of a part
TURN_S = 2.0  # of the table before a part


@dataclass(frozen=True)
class Estimate:
    """Seconds of printing, mm of filament, and mm3 of it that is support."""

    time_s: float
    filament_mm: float
    support_mm3: float

    def __add__(self, other: "Estimate") -> "Estimate":
        return Estimate(self.time_s + other.time_s, self.filament_mm + other.filament_mm, self.support_mm3 + other.support_mm3)


def estimate(parts: Part | Sequence[Part], profile: Profile) -> Estimate:
    """What printing one part, or several one after the other, takes.

    The same on every machine. Raises SliceError where a part's mesh is not closed or it is too high to be meant.
    """
    several = (parts,) if isinstance(parts, Part) else tuple(parts)
    total = Estimate(0.0, 0.0, 0.0)
    for k, part in enumerate(several):
        total += _estimate_part(part, profile, several[k + 1 :], max(FEWEST, SAMPLES // len(several)))
    return total


def _estimate_part(part: Part, whole: Profile, later: Sequence[Part], samples: int) -> Estimate:
    """A part, the turn of the table before it and the wait for its heat."""
    heights, profile, on_platform = heights_of(part, whole, later), vase_profile(whole.of_part(part.index)), part.index == 1
    process, filament_mm2 = profile.process, 0.25 * pi * profile.material.diameter_mm**2
    support = thick_support(part, heights, profile, later)
    rough = rough_layers(part.in_part_frame(), heights, process, on_platform) + rough_support(support, heights, process)
    layers, begins = choose_layers(rough.time_s, 1, samples)
    real = sliced_layers(sections_near(part, whole, heights, layers, later), support, layers)
    scale_s = np.add.reduceat(rough.time_s, begins) / rough.time_s[layers]
    scale_mm3 = np.add.reduceat(rough.mm3, begins) / rough.mm3[layers]
    total = Estimate(float(scale_s @ real[:, 0]), float(scale_mm3 @ real[:, 1]) / filament_mm2, float(scale_mm3 @ real[:, 2]))
    if on_platform:
        return total
    heating_s = profile.machine.heating_s(process.interface_temperature_add_c, TURN_S)
    return total + Estimate(TURN_S + heating_s, profile.material.prime_extra_mm, 0.0)
