"""Sections: a part's layers as outlines, the first value on the way from a mesh to paths."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from mdp.decomposition import Part
from mdp.mesh import Mesh
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import with_line_width
from slicer.geometry.polygons import Polygons
from slicer.heights import Heights


@dataclass(frozen=True)
class Pin:
    """A hole, in the frame of the part that fills it: the middle of its mouth, and what it takes of the layers below."""

    x_mm: float
    y_mm: float
    volume_mm3: float


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Sections of the model's other parts in a part's frame; no later stage cuts their meshes again.

    beside: of later parts at the height at which each layer of the part is cut; above: of later parts over the last layer, as
    many as shells reach; below: of the model under the base plane, the nearest first, empty where earlier parts are not known.
    """

    beside: Sequence[Polygons]
    above: Sequence[Polygons] = ()
    below: Sequence[Polygons] = ()


@dataclass(frozen=True, eq=False)
class Sections:
    """A part's layers, one entry each, before anything is laid.

    The part is printed after `earlier` and before `later` ones, with `profile`, its own; mesh: in its frame. outlines: all of a
    layer; own: without the pedestal; ungrooved: own, before the grooves for later parts. plastic_below: just under the base
    plane, None on the platform; plate: its outline, of use to part 1. pedestal_layers: how many of the lowest ones the pedestal
    takes; pins: those that the part fills; too_thin: layers that hold something, but nothing that gets a line.
    """

    part: Part
    earlier: Sequence[Part]
    later: Sequence[Part]
    profile: Profile
    mesh: Mesh
    heights: Heights
    outlines: Sequence[Polygons]
    own: Sequence[Polygons]
    ungrooved: Sequence[Polygons]
    neighbours: Neighbours
    plastic_below: Polygons | None
    plate: Polygons
    pedestal_layers: int = 0
    too_thin: frozenset[int] = frozenset()
    pins: Sequence[Pin] = ()

    @property
    def on_platform(self) -> bool:
        """Whether the part is the first one."""
        return self.part.index == 1

    @property
    def process(self) -> Process:
        """The settings of the part."""
        return self.profile.process

    @cached_property
    def support_process(self) -> Process:
        """The settings of its support, with the width of its lines."""
        return with_line_width(self.process, self.process.support_line_width_mm)

    def below(self, layer: int) -> Polygons | None:
        """The plastic that a layer lies on; None for the platform."""
        return self.outlines[layer - 1] if layer else self.plastic_below

    def up_to(self, top_mm: float) -> "Sections":
        """The sections with empty layers on top as far as that height."""
        heights = self.heights.up_to(top_mm, self.process.layer_height_mm)
        count = len(heights.tip_mm) - len(self.heights.tip_mm)
        if count <= 0:
            return self
        outlines, own, ungrooved = ([*places, *[Polygons()] * count] for places in (self.outlines, self.own, self.ungrooved))
        around, known = self.neighbours, len(self.neighbours.above)
        higher = [*around.beside, *around.above, *[Polygons()] * count]  # the added layers are at the heights of `above`
        end = len(around.beside) + count
        around = replace(around, beside=higher[:end], above=higher[end : end + known])
        return replace(self, heights=heights, outlines=outlines, own=own, ungrooved=ungrooved, neighbours=around)
