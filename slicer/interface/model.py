"""Model: what of the whole model lies around each layer of a part, so that its surface is told from the faces of cuts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mdp.decomposition import Part
from slicer.fill.region import shell_layers
from slicer.geometry.polygons import CLOSING_MM, Polygons, closing, islands, union
from slicer.interface.interface import sections_of, touching
from slicer.sections import Sections

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


def model_around(sections: Sections) -> Model:
    """The model around the layers of a part.

    Earlier parts that are not handed over are taken to fill the first section.
    """
    process, part, own, heights = sections.process, sections.part, sections.own, sections.heights
    top, bottom = shell_layers(process)
    step = process.layer_height_mm
    over = float(heights.tip_mm[-1]) + step * (np.arange(max(top, process.interface_top_layers)) + 0.5)
    reach_mm = step * max(top, bottom, process.interface_top_layers)
    earlier, later = (touching(part, others, reach_mm) for others in (sections.earlier, sections.later))
    others = sections_of(later, part, np.concatenate([heights.cut_mm, over]))
    whole = [joined(*three) for three in zip(sections.ungrooved, own, others[: len(own)], strict=True)]
    beside = [model - mine if model is not None else Polygons() for model, mine in zip(whole, own, strict=True)]
    above = others[len(own) :]
    below = _below(part, None if sections.earlier else own[0], [*earlier, *later], step, bottom)
    return Model(whole, [*beside, *above], below, above[:top])


def _below(part: Part, first: Polygons | None, others: Sequence[Part], step: float, count: int) -> list[Polygons]:
    """The model under a base plane, first where that is given; under the platform is nothing."""
    if part.index == 1:
        return [Polygons()] * count
    if first is not None:
        return [first] * count
    deep = np.asarray(-step * (np.arange(count)[::-1] + 0.5), dtype=np.float64)
    return [closing(model, CLOSING_MM) for model in sections_of(others, part, deep)[::-1]]


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
