"""Model: the parts of the whole model around each layer, so that its surface is distinguished from the faces of cuts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mdp.decomposition import Part
from profiles.process import Process
from slicer.fill.region import shell_layers
from slicer.geometry.polygons import CLOSING_MM, Polygons, closing, islands, union
from slicer.heights import Heights
from slicer.interface.compensation import reach_mm
from slicer.interface.interface import sections_of, touching
from slicer.sections import Neighbours, Sections

TOUCHING_MM2 = 1e-3  # a section that gains less by its neighbours has none


@dataclass(frozen=True, eq=False)
class Model:
    """Sections of the model in a part's frame, one for each of its layers and as many beyond as its shells look.

    sections: islands of the model that the part belongs to, None where they are its own section. others: what of them belongs
    to parts printed later, continued above the last layer. below: under the first layer, the nearest first; above: over the
    last one.
    """

    sections: Sequence[Polygons | None]
    others: Sequence[Polygons]
    below: Sequence[Polygons]
    above: Sequence[Polygons]

    @property
    def is_cut(self) -> bool:
        """Whether any later part touches this one."""
        return any(not area.is_empty() for area in self.others)


def neighbours_of(part: Part, earlier: Sequence[Part], later: Sequence[Part], heights: Heights, process: Process) -> Neighbours:
    """Sections of the other parts around the layers of a part, as many layers away as its shells reach."""
    top, bottom = shell_layers(process)
    step = process.layer_height_mm
    over = float(heights.tip_mm[-1]) + step * (np.arange(max(top, process.interface_top_layers)) + 0.5)
    reach = max(step * max(top, bottom, process.interface_top_layers), reach_mm(process))
    before, after = (touching(part, others, reach) for others in (earlier, later))
    others = sections_of(after, part, np.concatenate([heights.cut_mm, over]))
    below: list[Polygons] = []
    if earlier:
        deep = np.asarray(-step * (np.arange(bottom)[::-1] + 0.5), dtype=np.float64)
        below = [closing(model, CLOSING_MM) for model in sections_of([*before, *after], part, deep)[::-1]]
    count = len(heights.cut_mm)
    return Neighbours(others[:count], others[count:], below)


def model_around(sections: Sections) -> Model:
    """The model around the layers of a part.

    Earlier parts that are not known are taken to fill the first section; under the platform is nothing.
    """
    own, around = sections.own, sections.neighbours
    top, bottom = shell_layers(sections.process)
    whole = [joined(*three) for three in zip(sections.ungrooved, own, around.beside, strict=True)]
    beside = [model - mine if model is not None else Polygons() for model, mine in zip(whole, own, strict=True)]
    below = around.below or [Polygons() if sections.on_platform else own[0]] * bottom
    return Model(whole, [*beside, *around.above], below, around.above[:top])


def joined(ungrooved: Polygons, own: Polygons, beside: Polygons) -> Polygons | None:
    """The islands of the model that hold some of a section; None where they are the part's own. beside: what other parts have."""
    alone = None if own is ungrooved or ungrooved.area() < own.area() + TOUCHING_MM2 else ungrooved
    if own.is_empty() or beside.is_empty() or not _boxes_meet(own, beside):
        return alone
    whole = closing(union([ungrooved, beside]), CLOSING_MM)
    touched = [island for island in islands(whole) if not (island ^ own).is_empty()]
    return alone if sum(island.area() for island in touched) < ungrooved.area() + TOUCHING_MM2 else Polygons.compose(touched)


def _boxes_meet(own: Polygons, beside: Polygons) -> bool:
    x0, y0, x1, y1 = own.bounds()
    u0, v0, u1, v1 = beside.bounds()
    reach = CLOSING_MM
    return bool(x0 < u1 + reach and u0 < x1 + reach and y0 < v1 + reach and v0 < y1 + reach)
