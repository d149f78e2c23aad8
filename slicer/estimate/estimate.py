"""Estimate: print time and filament of parts from a few of their layers, sliced as for a print.

Sections and overhangs are those of the print. Support is grown in thick layers by the ordinary rules: a thick layer has the
overhangs of all the layers that it represents, so small overhangs are not lost between two sections, and self-supporting areas
are known from the real layers. Each layer has a rough length of lines, from sums over the mesh and areas of support.

The layers are divided into runs of about equal rough time. Two neighbouring layers of each run are sliced by the slicer's own
code and timed with the machine's acceleration; the whole run is scaled from its rough figures by the same factor. Seams are
placed as if each layer were alone, and a spiral vase counts as ordinary walls. The estimate is for choosing between
decompositions; the dry run has the exact figures.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, pi, sqrt

import numpy as np

from mdp.decomposition import Part
from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel
from mdp.kernels.sorting import rank
from mdp.mesh import Floats, Indices, Ints
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import INTERFACE_WIDTH, spacing_mm
from slicer.estimate.timing import strokes_s
from slicer.geometry.polygons import Polygons, perimeter_mm, union
from slicer.heights import Heights, shell_layers
from slicer.modifiers import combined
from slicer.overhangs import LEAST_MM2, Overhang, find_overhangs
from slicer.paths import Kind, bead_area_mm2
from slicer.raft import raft_layers
from slicer.sectioning import Sections, section_parts
from slicer.shells import Shells, build_shells, lay_beads
from slicer.slice import order_layer
from slicer.strokes.order import SUPPORTS
from slicer.strokes.seam import NO_SEAMS, Surroundings, place_seams
from slicer.strokes.seam_plan import NO_LIMITS, rear_of
from slicer.strokes.speed import SPEED_KEYS
from slicer.support.from_earlier_part import plan_supports, up_to
from slicer.support.support import Supports, own_supports, wanted_places

SAMPLES = 24  # pairs of neighbouring layers of a print that are sliced; the error for 44 prints is then 2 % (rms)
FEWEST = 12  # least number of pairs for a part
RUN = 8  # least number of layers represented by a pair; fewer would make the estimate of a small print as slow as slicing it
STEP = 2  # least number of layers in a thick layer: growing support in half of the layers takes half the time
MOST_THICK = 200  # greatest number of thick layers of a part; a higher part has thicker ones
FEW = 40  # number of layers up to the highest overhang below which support is grown in real layers
WAY_S = 0.3  # for reaching a layer and each of its outlines
SLOWER = 1.4  # factor for accelerations and travels on the time of strokes at their nominal speeds
TINY_MM2, TINY_MM3 = 1e-9, 1e-6
TURN_S = 2.0  # turn of the table before a part


@dataclass(frozen=True)
class Estimate:
    """Printing time, s, filament, mm, and volume of support, mm3."""

    time_s: float
    filament_mm: float
    support_mm3: float


def estimate(parts: Part | Sequence[Part], profile: Profile) -> Estimate:
    """Time and filament of one part, or of several printed one after the other.

    The result does not depend on the computer. Raises SliceError if a part's mesh is not closed or it is implausibly high.
    """
    several = (parts,) if isinstance(parts, Part) else tuple(parts)
    total, sections = np.zeros(3), section_parts(several, profile)
    overhangs = [find_overhangs(layers) for layers in sections]
    for supports, hanging in zip(_rough_supports(sections, overhangs), overhangs, strict=True):
        samples = min(SAMPLES // len(several), len(supports.areas) // RUN)
        total += _of_part(supports, hanging, max(FEWEST, samples))
    return Estimate(*total.tolist())


def _of_part(supports: Supports, overhangs: Sequence[Overhang], samples: int) -> Floats:
    """(3,) seconds, mm of filament and mm3 of support of a part, including the turn of the table and the heating before it."""
    sections, profile = supports.sections, supports.sections.profile
    process, filament_mm2 = profile.process, 0.25 * pi * profile.material.diameter_mm**2
    drawn_mm, held_mm = rough_lengths_mm(sections), support_lengths_mm(supports)
    bead_mm2 = spacing_mm(process.line_width_mm, process.layer_height_mm) * sections.heights.height_mm
    outlines = [own.num_contour() + held.num_contour() for own, held in zip(sections.own, supports.areas, strict=True)]
    rough_s = _rough_s(np.hstack([drawn_mm, held_mm]), np.array(outlines), process)
    layers, begins = choose_layers(rough_s, samples)
    real = _sliced_layers(build_shells(supports, overhangs, layers.tolist()), layers)
    own_mm3, support_mm3 = drawn_mm.sum(axis=1) * bead_mm2 + TINY_MM3, held_mm.sum(axis=1) * bead_mm2
    time_s = float(_weights(rough_s, layers, begins) @ real[:, 0])
    own = float(_weights(own_mm3, layers, begins) @ (real[:, 1] - real[:, 2]))
    # Single layers may have no support, so one factor between rough and real figures serves all layers above the first.
    counts = _weights(np.ones(len(rough_s)), layers, begins)[1:]
    known = float(counts @ support_mm3[layers[1:]])
    factor = float(counts @ real[1:, 2]) / known if known > 0.0 else 1.0
    support = float(real[0, 2] + factor * support_mm3[1:].sum())
    total: Floats = np.array([time_s, (own + support) / filament_mm2, support])
    if sections.on_plate:
        total = total + _line_before(profile, filament_mm2) + _raft(supports, filament_mm2)
    else:
        heating_s = profile.machine.heating_s(process.interface_temperature_add_c, TURN_S)
        total = total + np.array([TURN_S + heating_s, profile.material.prime_extra_mm, 0.0])
    return total


def _rough_s(drawn_mm: Floats, outlines: Indices, process: Process) -> Floats:
    """(n,) rough seconds of layers with (n, 5) mm of walls, skin, infill, support and dense support, and (n,) outlines."""
    kinds = (Kind.INNER_WALL, Kind.SKIN, Kind.INFILL, *SUPPORTS)
    speeds = np.array([getattr(process, SPEED_KEYS[kind]) for kind in kinds])
    least_s = np.minimum(process.least_layer_time_s, drawn_mm.sum(axis=1) / process.least_speed_mm_s)
    rough_s: Floats = WAY_S * (1 + outlines) + np.maximum(SLOWER * drawn_mm @ (1.0 / speeds), least_s)
    return rough_s


def choose_layers(weight: Floats, samples: int) -> tuple[Indices, Indices]:
    """Sample layers that represent runs of layers, and the start of each run: the first layer alone, then runs of equal weight.

    The difference between the weights of successive layers counts as well, so runs are short where weights vary, and begin at
    large jumps. A run's samples are the two neighbours in its middle, whose line directions differ.
    """
    count = len(weight)
    done = np.cumsum(weight[1:] + np.abs(np.diff(weight[1:], append=weight[-1:])))
    cuts = np.searchsorted(done, done[-1] * np.arange(1, samples) / samples) + 2 if count > 1 else np.zeros(0, np.int64)
    begins = np.unique(np.concatenate([[0, 1], cuts]))
    begins = begins[begins < count]
    ends, whole = np.append(begins[1:], count), np.concatenate([[0.0], np.cumsum(weight)])
    middle = 0.5 * (whole[begins] + whole[ends])
    upper = np.minimum(np.searchsorted(whole, middle, side="right") - 1, ends - 1)
    return np.union1d(upper, np.maximum(upper - 1, begins)), begins


def _sliced_layers(shells: Shells, layers: Indices) -> Floats:
    """(n, 3) seconds, mm3 and mm3 of support of some layers, sliced."""
    sections, figures = shells.sections, np.zeros((len(layers), 3))
    rear = tip = rear_of(sections.mesh.bounds_mm)
    for row, layer in zip(figures, layers.tolist(), strict=True):
        own, auxiliary = lay_beads(shells, layer)
        around = Surroundings(rear, NO_SEAMS, tip, NO_LIMITS, layer)
        beads, _ = place_seams([*own, *auxiliary], sections.process, around)
        strokes, speeds, flow = order_layer([*beads, *shells.layers[layer].ending], shells, layer, tip, Polygons())
        if len(strokes):
            height_mm, first = float(sections.heights.height_mm[layer]), layer == 0 and sections.on_plate
            mm3 = strokes.lengths_mm * bead_area_mm2(strokes.width_mm, height_mm) * strokes.flow * flow
            time_s = strokes_s(strokes, speeds, tip, sections.profile, first)
            row[:] = time_s, mm3.sum(), mm3[strokes.is_of(*SUPPORTS)].sum()
            tip = strokes.points[-1, :2]
    return figures


def _weights(rough: Floats, layers: Indices, begins: Indices) -> Floats:
    """(n,) weight of each sampled layer: a run is scaled from its rough figures like its samples."""
    run = np.searchsorted(begins, layers, side="right") - 1
    weights: Floats = (np.add.reduceat(rough, begins) / np.bincount(run, rough[layers]))[run]
    return weights


def _line_before(profile: Profile, filament_mm2: float) -> Floats:
    """(3,) figures of the purge line before a print."""
    process, length_mm = profile.process, profile.machine.purge_mm
    bead_mm2 = bead_area_mm2(INTERFACE_WIDTH * process.line_width_mm, process.first_layer_height_mm)
    return np.array(
        [length_mm / process.first_layer_speed_mm_s, length_mm * bead_mm2 * profile.material.flow / filament_mm2, 0.0]
    )


def _raft(supports: Supports, filament_mm2: float) -> Floats:
    """(3,) figures of the raft under a part, zero without one; all of it counts as support."""
    layers, profile = raft_layers(supports), supports.sections.profile
    time_s, tip = 0.0, rear_of(supports.sections.mesh.bounds_mm)
    for k, layer in enumerate(layers):
        if len(layer):
            time_s += strokes_s(layer, layer.speed_mm_s, tip, profile, k == 0)
            tip = layer.points[-1]
    mm3 = float(sum(layer.volumes_mm3.sum() for layer in layers))
    return np.array([time_s, mm3 / filament_mm2, mm3])


def _rough_supports(sections: Sequence[Sections], overhangs: Sequence[Sequence[Overhang]]) -> list[Supports]:
    """The supports of all parts of a print, in print order, with real layers filled from thick ones."""
    wanted = [wanted_places(*pair) for pair in zip(sections, overhangs, strict=True)]
    tops = [max((k + 1 for k, area in enumerate(places) if not area.is_empty()), default=0) for places in wanted]
    thick = []
    for k, (layers, hanging) in enumerate(zip(sections, overhangs, strict=True)):
        top = len(layers.outlines) if any(tops[k + 1 :]) else tops[k]  # a later part's support may be printed with this one
        thick.append(own_supports(layers, hanging) if top < FEW else _grown(layers, wanted[k]))
    return [_of_layers(*pair) for pair in zip(sections, plan_supports(thick), strict=True)]


def _grown(sections: Sections, wanted: Sequence[Polygons]) -> Supports:
    """The part's own support in thick layers; the first layer stays separate."""
    process, heights = sections.process, sections.heights
    step = max(STEP, ceil(len(heights.tip_mm) / MOST_THICK))
    begins = np.array([0, *range(1, len(heights.tip_mm), step)])
    ends = np.append(begins[1:], len(heights.tip_mm))
    middles = (begins + ends - 1) // 2
    # Overhangs lie anywhere in a thick layer, and support ends below it, so gaps do not matter.
    coarse = {
        "support": "auto",  # the supported areas are already chosen
        "support_interface_layers": -(-process.support_interface_layers // step),
        "support_bottom_interface_layers": -(-process.support_bottom_interface_layers // step),
        "support_gap_mm": 0.0,
        "support_bottom_gap_mm": 0.0,
    }

    def of_middles(places: Sequence[Polygons]) -> list[Polygons]:
        return [places[k] for k in middles.tolist()] if places else []

    thick = replace(
        sections,
        profile=sections.profile.model_copy(update={"process": process.model_copy(update=coarse)}),
        heights=Heights(heights.tip_mm[ends - 1], heights.tip_mm[ends - 1] - heights.bottom_mm[begins], heights.cut_mm[middles]),
        outlines=of_middles(sections.outlines),
        own=of_middles(sections.own),
        ungrooved=of_middles(sections.ungrooved),
        beside=of_middles(sections.beside),
        above=(),
        standing=of_middles(sections.standing),
        no_support=of_middles(sections.no_support),
        enforced=of_middles(sections.enforced),
        places=(),
    )
    hanging = [Overhang(union([area for area in wanted[a:b] if not area.is_empty()])) for a, b in zip(begins, ends, strict=True)]
    return own_supports(thick, hanging)


def _of_layers(sections: Sections, thick: Supports) -> Supports:
    """The support of real layers from that of thick layers."""
    tips_mm = thick.sections.heights.tip_mm
    standing = [float(tips_mm[k]) for k, area in enumerate(thick.areas) if not area.is_empty()]
    sections = up_to(sections, max(standing, default=0.0))
    which = np.searchsorted(tips_mm, sections.heights.cut_mm).tolist()
    areas, dense, hollow = ([[*places, Polygons()][k] for k in which] for places in (thick.areas, thick.dense, thick.hollow))
    nothing = [Polygons()] * len(which)
    return Supports(sections, areas, dense, hollow, nothing, nothing, nothing)


def support_lengths_mm(supports: Supports) -> Floats:
    """(n, 2) lengths of sparse and dense lines of support in every layer of a part, mm."""
    sections, process = supports.sections, supports.sections.support_process
    several = zip(supports.areas, supports.dense, supports.hollow, strict=True)
    extents = [(whole.area(), perimeter_mm(whole), dense.area(), (whole - hollow).area()) for whole, dense, hollow in several]
    area, around, close, filled = np.array(extents).T
    spacing = spacing_mm(process.line_width_mm, process.layer_height_mm)
    walls_mm, density = process.support_walls * around, np.full(len(area), process.support_density)
    if sections.on_plate:
        density[0] = process.support_foot_density
    inside = np.maximum(area - walls_mm * spacing, 0.0)
    dense = np.minimum(close, inside)
    sparse = (inside - dense) * filled / np.maximum(area, LEAST_MM2)
    lengths_mm = np.column_stack([walls_mm + sparse * density / spacing, dense * process.support_interface_density / spacing])
    if sections.on_raft:
        lengths_mm[0] = 0.0  # beside the first layer lies the raft
    return lengths_mm


def rough_lengths_mm(sections: Sections) -> Floats:
    """(n, 3) rough lengths of walls, skin and sparse infill in every layer of a part, mm."""
    mesh, process = sections.mesh, sections.process
    (top, bottom), width = shell_layers(process), process.line_width_mm
    area, around, over, under = _measure(mesh.vertices, mesh.faces, sections.heights.cut_mm)
    if not sections.on_plate:
        under[0] = 0.0
    seen, hung, at = np.append(0.0, np.cumsum(over)), np.append(0.0, np.cumsum(under)), np.arange(len(area))
    bare = seen[np.minimum(at + top, len(at))] - seen[at] + hung[at + 1] - hung[np.maximum(at + 1 - bottom, 0)]
    spacing = spacing_mm(width, process.layer_height_mm)
    walls, density = (_by_places(sections, key, float(getattr(process, key))) for key in ("walls", "infill_density"))
    inside = np.maximum(area - walls * spacing * around, 0.0)
    skin = np.where(inside < process.solid_below_mm2, inside, inside * np.minimum(bare / np.maximum(area, TINY_MM2), 1.0))
    return np.column_stack([(area - inside) / spacing, skin / spacing, (inside - skin) * density / spacing])


def _by_places(sections: Sections, key: str, usual: float) -> Floats:
    """(n,) mean of a process value over every layer, where modifiers may override it."""
    values = np.full(len(sections.own), usual)
    for place in combined(sections.places, [key]):
        for layer, (area, section) in enumerate(zip(place.areas, sections.own, strict=True)):
            if not area.is_empty() and not section.is_empty():
                values[layer] += (section ^ area).area() / section.area() * (place.settings[key] - values[layer])
    return values


@kernel
def _measure(vertices: Floats, faces: Ints, cuts: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """(n,) area and perimeter of the sections, and the upward- and downward-facing surface that belongs to each layer,
    projected.
    """
    n = len(cuts)
    area, around, over, under = floats(n, 0.0), floats(n, 0.0), floats(n, 0.0), floats(n, 0.0)
    ends = floats(4, 0.0)
    for f in range(len(faces)):
        z0, z1, z2 = vertices[faces[f, 0], 2], vertices[faces[f, 1], 2], vertices[faces[f, 2], 2]
        first, last = rank(cuts, min(z0, z1, z2), True), rank(cuts, max(z0, z1, z2), True) - 1
        ax, ay = vertices[faces[f, 1], 0] - vertices[faces[f, 0], 0], vertices[faces[f, 1], 1] - vertices[faces[f, 0], 1]
        bx, by = vertices[faces[f, 2], 0] - vertices[faces[f, 0], 0], vertices[faces[f, 2], 1] - vertices[faces[f, 0], 1]
        shadow = 0.5 * (ax * by - ay * bx)
        low, high = min(first, n - 1), max(min(last, n - 1), min(first, n - 1))
        for layer in range(low, high + 1):
            if shadow > 0.0:
                over[max(first - 1, 0) if last < first else layer] += shadow / (high - low + 1)
            else:
                under[layer] -= shadow / (high - low + 1)
        for layer in range(first, last + 1):
            z = cuts[layer]
            for k in range(3):
                tail, head = faces[f, k], faces[f, (k + 1) % 3]
                tz, hz = vertices[tail, 2], vertices[head, 2]
                if (tz < z) != (hz < z):
                    share = (z - hz) / (tz - hz)
                    # the outline enters over the edge that goes down and leaves over the one that goes up
                    at = 0 if hz < z else 2
                    ends[at] = vertices[head, 0] + share * (vertices[tail, 0] - vertices[head, 0])
                    ends[at + 1] = vertices[head, 1] + share * (vertices[tail, 1] - vertices[head, 1])
            area[layer] += 0.5 * (ends[0] * ends[3] - ends[1] * ends[2])
            around[layer] += sqrt((ends[2] - ends[0]) ** 2 + (ends[3] - ends[1]) ** 2)
    return area, around, over, under
