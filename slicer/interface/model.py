"""Model: what of the whole model lies around each layer of a part, so that its surface is told from the faces of cuts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mdp.decomposition import Part
from profiles.process import Process
from slicer.geometry.polygons import CLOSING_MM, Polygons, closing, islands, union
from slicer.heights import Heights
from slicer.interface.interface import sections_of, touching
from slicer.region import shell_layers

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
        return any(not other.is_empty() for other in self.others)


def model_around(
    part: Part,
    uncut: Sequence[Polygons],
    own: Sequence[Polygons],
    heights: Heights,
    earlier: Sequence[Part],
    later: Sequence[Part],
    process: Process,
) -> Model:
    """The model around the layers of a part. uncut, own: its sections without and with grooves.

    Earlier parts that are not handed over are taken to fill the first section.
    """
    top, bottom = shell_layers(process)
    step = process.layer_height_mm
    over = float(heights.tip_mm[-1]) + step * (np.arange(max(top, process.interface_top_layers)) + 0.5)
    reach_mm, alone = step * max(top, bottom, process.interface_top_layers), not earlier
    earlier, later = touching(part, earlier, reach_mm), touching(part, later, reach_mm)
    others = sections_of(later, part, np.concatenate([heights.cut_mm, over]))
    sections = [joined(*three) for three in zip(uncut, own, others[: len(own)], strict=True)]
    beside = [whole - mine if whole is not None else Polygons() for whole, mine in zip(sections, own, strict=True)]
    above = others[len(own) :]
    return Model(
        sections, [*beside, *above], _below(part, own[0] if alone else None, [*earlier, *later], step, bottom), above[:top]
    )


def _below(part: Part, first: Polygons | None, others: Sequence[Part], step: float, count: int) -> list[Polygons]:
    """The model under a base plane, first where that is given; under the platform is nothing."""
    if part.index == 1:
        return [Polygons()] * count
    if first is not None:
        return [first] * count
    deep = np.asarray(-step * (np.arange(count)[::-1] + 0.5), dtype=np.float64)
    return [closing(each, CLOSING_MM) for each in sections_of(others, part, deep)[::-1]]


def joined(uncut: Polygons, own: Polygons, other: Polygons) -> Polygons | None:
    """The islands of the model that hold some of a section; None where they are the part's own."""
    alone = None if own is uncut or uncut.area() < own.area() + TOUCHING_MM2 else uncut
    if own.is_empty() or other.is_empty() or not _boxes_meet(own, other):
        return alone
    whole = closing(union([uncut, other]), CLOSING_MM)
    touched = [island for island in islands(whole) if not (island ^ own).is_empty()]
    return alone if sum(island.area() for island in touched) < uncut.area() + TOUCHING_MM2 else Polygons.compose(touched)


def _boxes_meet(one: Polygons, other: Polygons) -> bool:
    x0, y0, x1, y1 = one.bounds()
    u0, v0, u1, v1 = other.bounds()
    reach = CLOSING_MM
    return bool(x0 < u1 + reach and u0 < x1 + reach and y0 < v1 + reach and v0 < y1 + reach)
