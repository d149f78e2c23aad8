"""Sections: a part's layers as outlines, the first value on the way from a mesh to paths."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import with_line_width
from slicer.geometry.polygons import Polygons
from slicer.heights import Heights


@dataclass(frozen=True, eq=False)
class Sections:
    """A part's layers, one entry each, before anything is laid, and all that is known of the model's other parts around them.

    Part: printed after `earlier` and before `later` ones, with `profile`, its own; mesh: in its frame.
    Layers: `outlines` are all of each; `own` without the pedestal, `ungrooved` those before the grooves for later parts.
    Model around: later parts have `beside` of each layer and `above` of those over the last one, as many as shells reach; the
    model has `beneath` of those under the base plane, the nearest first, () where earlier parts are not known; earlier parts
    have `standing` of each layer of a limb. `plastic_below` lies just under the base plane, None on the platform; `plate` is its
    outline, of use to part 1. `joints`, (k, 6) segments, are where the part meets others on the surface.
    Interlock: `pins`, (k, 3) x, y and mm3, and the area of `grooves` that the part fills.
    Zones: no wall of a layer is to begin at its `no_seam`, (k, 6) segments; its `no_support` gets none, () for nowhere.
    pedestal_layers: how many of the lowest ones the pedestal takes; too_thin: layers that hold something, but nothing that gets a
    line.
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
    beside: Sequence[Polygons]
    plastic_below: Polygons | None
    plate: Polygons
    above: Sequence[Polygons] = ()
    beneath: Sequence[Polygons] = ()
    standing: Sequence[Polygons] = ()
    joints: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    pins: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    grooves: Polygons = field(default_factory=Polygons)
    no_seam: Sequence[Floats] = ()
    no_support: Sequence[Polygons] = ()
    pedestal_layers: int = 0
    too_thin: frozenset[int] = frozenset()

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
