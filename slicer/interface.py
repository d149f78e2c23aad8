"""Interface: what a part finds beneath and beside it, in its own frame."""

from collections.abc import Sequence

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from slicer.polygons import Polygons, cleaned, united
from slicer.section import sections

BENEATH_MM = 0.02  # the section of earlier parts is taken this far below the base plane, where their cut faces lie


def beneath(part: Part, earlier: Sequence[Part], section: Polygons) -> Polygons | None:
    """Plastic just below the base plane; None on the platform. Parts not handed over are taken to fill the section."""
    if part.index == 1:
        return None
    if not earlier:
        return section
    return sections_of(earlier, part, np.array([-BENEATH_MM]))[0]


def sections_of(others: Sequence[Part], part: Part, cuts_mm: Floats) -> list[Polygons]:
    """For every height in the part's frame the sections of other parts together."""
    layers = [[cleaned(loops) for loops in sections(_in_frame_of(part, other), cuts_mm)] for other in others]
    return [united(layer) for layer in zip(*layers, strict=True)] if layers else [Polygons()] * len(cuts_mm)


def _in_frame_of(part: Part, other: Part) -> Mesh:
    return other.mesh.moved(part.rotation, (0.0, 0.0, -part.base.offset_mm))
