"""Estimate: print time and filament of parts from a few of their layers, sliced as for a print, in tenths of a second.

A rough length of lines is known for every layer, from the mesh and from the support of thick layers. The layers are divided into
runs of equal rough time. One layer of each run is sliced by the slicer's own code and timed with the machine's acceleration; the
whole run differs from its rough figures by the same factor. The estimate is for choosing between decompositions: half of all
prints are off by less than 3 %, most by less than 8, ironing aside, which is left out; the dry run has the exact figures.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Indices
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import INTERFACE_WIDTH, spacing_mm
from slicer.estimate.hanging import ThickSupport, support_lengths_mm, thick_supports
from slicer.estimate.layer import sections_near, sliced_layers
from slicer.estimate.rough import choose_layers, rough_lengths_mm
from slicer.paths import bead_area_mm2
from slicer.sectioning import vase_profile

SAMPLES = 7  # layers of a print that are sliced: the error of 23 parts by it is 1 % in the median, with 12 layers 0.7 %
FEWEST = 4  # layers of a part
LAYER_S = 0.3  # for the ways between strokes of even the smallest layer
SLOWER = 1.4  # strokes with their accelerations and travels than their lengths at their speeds
TINY_MM3 = 1e-6
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
    for k, support in enumerate(thick_supports(several, profile)):
        total += _estimate_part(several[k], profile, several[k + 1 :], support, max(FEWEST, SAMPLES // len(several)))
    return total


def _estimate_part(part: Part, whole: Profile, later: Sequence[Part], support: ThickSupport, samples: int) -> Estimate:
    """A part, the turn of the table before it and the wait for its heat."""
    heights, profile, on_platform = support.heights, vase_profile(whole.of_part(part.index)), part.index == 1
    process, filament_mm2 = profile.process, 0.25 * pi * profile.material.diameter_mm**2
    drawn_mm = rough_lengths_mm(part.in_part_frame(), heights, process, on_platform)
    held_mm = support_lengths_mm(support, process, on_platform)
    bead_mm2 = spacing_mm(process.line_width_mm, process.layer_height_mm) * heights.height_mm
    rough_s = _rough_s(np.hstack([drawn_mm, held_mm]), process)
    layers, begins = choose_layers(rough_s, samples)
    real = sliced_layers(sections_near(part, whole, layers, later, heights), support, layers)
    time_s = _over_all(rough_s, real[:, 0], layers, begins)
    own_mm3 = _over_all(drawn_mm.sum(axis=1) * bead_mm2 + TINY_MM3, real[:, 1] - real[:, 2], layers, begins)
    support_mm3 = _support_mm3(held_mm.sum(axis=1) * bead_mm2, real[:, 2], layers, np.diff(begins, append=len(bead_mm2)))
    total = Estimate(time_s, (own_mm3 + support_mm3) / filament_mm2, support_mm3)
    if on_platform:
        return total + _purged(profile)
    heating_s = profile.machine.heating_s(process.interface_temperature_add_c, TURN_S)
    return total + Estimate(TURN_S + heating_s, profile.material.prime_extra_mm, 0.0)


def _over_all(rough: Floats, real: Floats, layers: Indices, begins: Indices) -> float:
    """What all layers take: each run of them as much more than its rough figures as the layer that stands for it."""
    return float((np.add.reduceat(rough, begins) / rough[layers]) @ real)


def _support_mm3(rough: Floats, real: Floats, layers: Indices, counts: Indices) -> float:
    """The same of support, of which single layers may have none: over the first layer by the same factor everywhere."""
    known = float(counts[1:] @ rough[layers[1:]])
    factor = float(counts[1:] @ real[1:]) / known if known > 0.0 else 1.0
    return float(real[0] + factor * rough[1:].sum())


def _purged(profile: Profile) -> Estimate:
    """The line before a print."""
    process, material, length_mm = profile.process, profile.material, profile.machine.purge_mm
    mm3 = length_mm * bead_area_mm2(INTERFACE_WIDTH * process.line_width_mm, process.first_layer_height_mm) * material.flow
    return Estimate(length_mm / process.first_layer_speed_mm_s, mm3 / (0.25 * pi * material.diameter_mm**2), 0.0)


def _rough_s(drawn_mm: Floats, process: Process) -> Floats:
    """(n,) seconds of layers with (n, 5) mm of walls, skin, infill, support and dense support."""
    speeds = (
        process.inner_wall_speed_mm_s,
        process.skin_speed_mm_s,
        process.infill_speed_mm_s,
        process.support_speed_mm_s,
        process.support_interface_speed_mm_s,
    )
    least_s = np.minimum(process.least_layer_time_s, drawn_mm.sum(axis=1) / process.least_speed_mm_s)
    rough_s: Floats = LAYER_S + np.maximum(SLOWER * drawn_mm @ (1.0 / np.array(speeds)), least_s)
    return rough_s
