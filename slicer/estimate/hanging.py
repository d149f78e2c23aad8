"""Hanging: the support of a print from few thick layers, by the rules of the real ones.

A thick layer stands for several of the real ones. What hangs in any of these hangs in it, and its section is that of its middle
one: so small places that hang are not lost between two sections, and what carries itself is known from the real layers.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.mesh import Floats
from slicer.bead import spacing_mm
from slicer.geometry.polygons import Polygons, edges, union
from slicer.heights import Heights
from slicer.overhangs import LEAST_MM2, Overhang
from slicer.sectioning import Sections
from slicer.support.handed_down import plan_supports, up_to
from slicer.support.support import Supports, own_supports, wanted_places

STEP = 3  # layers that a thick one stands for: growing support from so few takes a third of the time
FEW = 40  # layers up to the highest place that hangs whose support is grown as it is


def rough_supports(sections: Sequence[Sections], overhangs: Sequence[Sequence[Overhang]]) -> list[Supports]:
    """The support of all parts of a print, in print order: of every layer that of the thick one it belongs to."""
    wanted = [wanted_places(*pair) for pair in zip(sections, overhangs, strict=True)]
    tops = [max((k + 1 for k, area in enumerate(places) if not area.is_empty()), default=0) for places in wanted]
    thick = []
    for k, (layers, hanging) in enumerate(zip(sections, overhangs, strict=True)):
        top = len(layers.outlines) if any(tops[k + 1 :]) else tops[k]  # a later part's support may be printed with this one
        thick.append(own_supports(layers, hanging) if top < FEW else _grown(layers, wanted[k]))
    return [_of_layers(*pair) for pair in zip(sections, plan_supports(thick), strict=True)]


def _grown(sections: Sections, wanted: Sequence[Polygons]) -> Supports:
    """The support that a part has of its own, in thick layers; the first layer stands for itself."""
    process, heights = sections.process, sections.heights
    begins = np.array([0, *range(1, len(heights.tip_mm), STEP)])
    ends = np.append(begins[1:], len(heights.tip_mm))
    middles = (begins + ends - 1) // 2
    # Hanging places lie anywhere in a thick layer, and support ends below it: the gaps are lost in that.
    coarse = {
        "support": "auto",  # the wanted places are chosen already
        "support_interface_layers": -(-process.support_interface_layers // STEP),
        "support_bottom_interface_layers": -(-process.support_bottom_interface_layers // STEP),
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
    """The support of real layers from that of thick ones."""
    tips_mm = thick.sections.heights.tip_mm
    standing = [float(tips_mm[k]) for k, area in enumerate(thick.areas) if not area.is_empty()]
    sections = up_to(sections, max(standing, default=0.0))
    which = np.searchsorted(tips_mm, sections.heights.cut_mm).tolist()
    areas, dense, hollow = ([[*places, Polygons()][k] for k in which] for places in (thick.areas, thick.dense, thick.hollow))
    nothing = [Polygons()] * len(which)
    return Supports(sections, areas, dense, hollow, nothing, nothing, nothing)


def support_lengths_mm(supports: Supports) -> Floats:
    """(n, 2) sparse and dense lines of the support of every layer of a part."""
    sections, process = supports.sections, supports.sections.support_process
    several = zip(supports.areas, supports.dense, supports.hollow, strict=True)
    extents = [(whole.area(), _around_mm(whole), dense.area(), (whole - hollow).area()) for whole, dense, hollow in several]
    area, around, close, filled = np.array(extents).T
    spacing = spacing_mm(process.line_width_mm, process.layer_height_mm)
    walls_mm, density = process.support_walls * around, np.full(len(area), process.support_density)
    if sections.on_platform:
        density[0] = process.support_foot_density
    inside = np.maximum(area - walls_mm * spacing, 0.0)
    dense = np.minimum(close, inside)
    sparse = (inside - dense) * filled / np.maximum(area, LEAST_MM2)
    lengths_mm = np.column_stack([walls_mm + sparse * density / spacing, dense * process.support_interface_density / spacing])
    if sections.on_raft:
        lengths_mm[0] = 0.0  # what lies beside the first layer there is the raft's
    return lengths_mm


def _around_mm(area: Polygons) -> float:
    sides = edges(area)
    return float(np.hypot(sides[:, 2] - sides[:, 0], sides[:, 3] - sides[:, 1]).sum())
