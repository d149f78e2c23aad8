"""Estimate: print time and filament of parts from a few of their layers, sliced as for a print.

Sections and overhangs are those of the print, support grows in thick layers, and each layer has a rough length of lines. The
layers are divided into runs of about equal rough time. Two neighbouring layers of each run are sliced by the slicer's own code
and timed with the machine's acceleration; the whole run differs from its rough figures by the same factor. Seams lie where the
layer alone would have them. The estimate is for choosing between decompositions; the dry run has the exact figures.
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
from slicer.estimate.duration import strokes_s
from slicer.estimate.hanging import rough_supports, support_lengths_mm
from slicer.estimate.rough import choose_layers, rough_lengths_mm
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import lengths_mm
from slicer.overhangs import Overhang, find_overhangs
from slicer.paths import bead_area_mm2
from slicer.raft import raft_layers
from slicer.sectioning import section_parts
from slicer.shells import Shells, build_shells, lay_beads
from slicer.slice import order_layer
from slicer.strokes.order import SUPPORTS
from slicer.strokes.seam import NO_SEAMS, Surroundings, place_seams
from slicer.strokes.seam_plan import NO_LIMITS, rear_of
from slicer.support.support import Supports

SAMPLES = 12  # pairs of neighbouring layers of a print that are sliced: they miss 2 % (rms of 80 prints), 8 pairs 3 %
FEWEST = 8  # pairs of a part
RUN = 15  # layers a pair stands for, at least: with more of them a small print would take as long as slicing all of it
WAY_S = 0.3  # to a layer and to each of its outlines
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
    sections = section_parts(several, profile)
    overhangs = [find_overhangs(layers) for layers in sections]
    for supports, hanging in zip(rough_supports(sections, overhangs), overhangs, strict=True):
        samples = min(SAMPLES // len(several), len(supports.areas) // RUN)
        total += _estimate_part(supports, hanging, max(FEWEST, samples))
    return total


def _estimate_part(supports: Supports, overhangs: Sequence[Overhang], samples: int) -> Estimate:
    """A part, the turn of the table before it and the wait for its heat."""
    sections, profile, on_platform = supports.sections, supports.sections.profile, supports.sections.on_platform
    process, filament_mm2 = profile.process, 0.25 * pi * profile.material.diameter_mm**2
    drawn_mm, held_mm = rough_lengths_mm(sections), support_lengths_mm(supports)
    bead_mm2 = spacing_mm(process.line_width_mm, process.layer_height_mm) * sections.heights.height_mm
    outlines = [own.num_contour() + held.num_contour() for own, held in zip(sections.own, supports.areas, strict=True)]
    rough_s = _rough_s(np.hstack([drawn_mm, held_mm]), np.array(outlines), process)
    layers, begins = choose_layers(rough_s, samples)
    real = _sliced_layers(build_shells(supports, overhangs, layers.tolist()), layers)
    own_mm3, support_mm3 = drawn_mm.sum(axis=1) * bead_mm2 + TINY_MM3, held_mm.sum(axis=1) * bead_mm2
    time_s = float(_weights(rough_s, layers, begins) @ real[:, 0])
    own_mm3 = float(_weights(own_mm3, layers, begins) @ (real[:, 1] - real[:, 2]))
    support_mm3 = _support_mm3(support_mm3, real[:, 2], layers, _weights(np.ones(len(rough_s)), layers, begins))
    total = Estimate(time_s, (own_mm3 + support_mm3) / filament_mm2, support_mm3)
    if on_platform:
        return total + _purged(profile) + _raft(supports)
    heating_s = profile.machine.heating_s(process.interface_temperature_add_c, TURN_S)
    return total + Estimate(TURN_S + heating_s, profile.material.prime_extra_mm, 0.0)


def _sliced_layers(shells: Shells, layers: Indices) -> Floats:
    """(n, 3) seconds, mm3 and mm3 of support of each of some layers."""
    sections, figures = shells.sections, []
    rear = tip = rear_of(sections.mesh.bounds_mm)
    for layer in layers.tolist():
        own, auxiliary = lay_beads(shells, layer)
        beads, _ = place_seams(
            [*own, *auxiliary], sections.process, Surroundings(rear, NO_SEAMS, tip, NO_LIMITS, layer, NO_SEAMS)
        )
        strokes, speeds, flow = order_layer([*beads, *shells.layers[layer].ending], shells, layer, tip, Polygons())
        if not len(strokes):
            figures.append((0.0, 0.0, 0.0))
            continue
        height_mm, first = float(sections.heights.height_mm[layer]), layer == 0 and sections.on_platform
        mm3 = strokes.lengths_mm * bead_area_mm2(strokes.width_mm, height_mm) * strokes.flow * flow
        time_s = strokes_s(strokes, speeds, tip, sections.profile, first)
        figures.append((time_s, float(mm3.sum()), float(mm3[strokes.is_of(*SUPPORTS)].sum())))
        tip = strokes.points[-1, :2]
    return np.array(figures)


def _weights(rough: Floats, layers: Indices, begins: Indices) -> Floats:
    """How many times each sampled layer counts: a run takes as much more than its rough figures as its samples do."""
    run = np.searchsorted(begins, layers, side="right") - 1
    weights: Floats = (np.add.reduceat(rough, begins) / np.bincount(run, rough[layers]))[run]
    return weights


def _support_mm3(rough: Floats, real: Floats, layers: Indices, counts: Floats) -> float:
    """Support of all layers, mm3, from what the sampled ones have, each weighted by its count.

    Single layers may have none, so the factor between rough and real figures is one for all layers over the first.
    """
    known = float(counts[1:] @ rough[layers[1:]])
    factor = float(counts[1:] @ real[1:]) / known if known > 0.0 else 1.0
    return float(real[0] + factor * rough[1:].sum())


def _purged(profile: Profile) -> Estimate:
    """The line before a print."""
    process, material, length_mm = profile.process, profile.material, profile.machine.purge_mm
    mm3 = length_mm * bead_area_mm2(INTERFACE_WIDTH * process.line_width_mm, process.first_layer_height_mm) * material.flow
    return Estimate(length_mm / process.first_layer_speed_mm_s, mm3 / (0.25 * pi * material.diameter_mm**2), 0.0)


def _raft(supports: Supports) -> Estimate:
    """The raft under a part, if it has one; all of it counts as support."""
    layers, profile = raft_layers(supports), supports.sections.profile
    mm3 = float(sum(layer.volumes_mm3.sum() for layer in layers))
    time_s = float(sum((lengths_mm(layer.points, layer.starts) / layer.speed_mm_s).sum() for layer in layers))
    return Estimate(SLOWER * time_s + WAY_S * len(layers), mm3 / (0.25 * pi * profile.material.diameter_mm**2), mm3)


def _rough_s(drawn_mm: Floats, outlines: Indices, process: Process) -> Floats:
    """(n,) seconds of layers with (n, 5) mm of walls, skin, infill, support and dense support, and with (n,) outlines."""
    speeds = (
        process.inner_wall_speed_mm_s,
        process.skin_speed_mm_s,
        process.infill_speed_mm_s,
        process.support_speed_mm_s,
        process.support_interface_speed_mm_s,
    )
    least_s = np.minimum(process.least_layer_time_s, drawn_mm.sum(axis=1) / process.least_speed_mm_s)
    rough_s: Floats = WAY_S * (1 + outlines) + np.maximum(SLOWER * drawn_mm @ (1.0 / np.array(speeds)), least_s)
    return rough_s
