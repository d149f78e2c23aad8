"""Sampled part: the layers of a part that stand for all of them, with what their neighbours decide."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Mesh
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import first_layer_process
from slicer.estimate.choice import Choice, choose_layers
from slicer.estimate.hanging import ThickSupport, thick_support
from slicer.estimate.shell import Shell, shell_of
from slicer.geometry.polygons import Polygons, clean
from slicer.heights import Heights, layer_heights
from slicer.interface.interface import strengthen_interface
from slicer.plate import plate_outline
from slicer.region import shell_layers
from slicer.section import sections
from slicer.support.pedestal import pedestal_layers


@dataclass(frozen=True, eq=False)
class SampledPart:
    """A part in its own frame.

    processes: of every layer; sections: of the layers that were looked at; pedestal: how many of the lowest layers lift the
    model; floor: the plate's outline.
    """

    mesh: Mesh
    on_platform: bool
    heights: Heights
    processes: Sequence[Process]
    choice: Choice
    sections: Mapping[int, Polygons]
    support: ThickSupport
    pedestal: int
    floor: Polygons

    def shell(self, layer: int) -> Shell:
        """What a chosen layer prints of the part itself."""
        process = self.processes[layer]
        solid = process.infill_density >= 1.0 or (layer == 0 and not self.on_platform)
        above, below = (None, None) if solid else self._covers(layer)
        return shell_of(self.sections[layer], process, float(self.heights.height_mm[layer]), above, below)

    def _covers(self, layer: int) -> tuple[Polygons, Polygons]:
        """What of the layers above and below covers a layer, judged by the farthest of its skins and the middle one."""
        top, bottom = shell_layers(self.processes[layer])
        above = below = self.sections[layer]
        for step in {top, (top + 1) // 2} - {0}:
            above = above ^ self._section(layer + step)
        for step in {bottom, (bottom + 1) // 2} - {0}:
            below = below ^ self._section(layer - step)
        return above, below

    def _section(self, layer: int) -> Polygons:
        """The section of a layer; over the top and under the platform there is nothing, under a base plane plastic."""
        if layer < 0 and not self.on_platform:
            return self.sections[0]
        return self.sections[layer] if 0 <= layer < len(self.heights.tip_mm) else Polygons()


def sample_part(part: Part, profile: Profile) -> SampledPart:
    """The layers of a part that stand for all of them. Raises SliceError where its mesh is not closed or far too high."""
    process, mesh, on_platform = profile.process, part.in_part_frame(), part.index == 1
    pedestal_mm = profile.search.pedestal_mm if on_platform else 0.0
    heights = layer_heights(mesh, process, on_platform, pedestal_mm)
    pedestal = pedestal_layers(heights.tip_mm, pedestal_mm)
    choice = choose_layers(mesh, heights, process, max(1 if on_platform else process.interface_layers, pedestal))
    processes = strengthen_interface(process, not on_platform, len(heights.tip_mm))
    if on_platform:
        processes[0] = first_layer_process(process)
    floor = plate_outline(profile.machine.table)
    support = thick_support(mesh, heights, process, on_platform, floor)
    looked_at = _with_neighbours(choice, process, len(heights.tip_mm))
    loops = sections(mesh, heights.cut_mm[looked_at])
    outlines = {layer: clean(several, 0.0) for layer, several in zip(looked_at, loops, strict=True)}
    return SampledPart(mesh, on_platform, heights, processes, choice, outlines, support, pedestal, floor)


def _with_neighbours(choice: Choice, process: Process, count: int) -> list[int]:
    """The chosen layers, the lowest, and those that decide where the chosen ones are solid."""
    top, bottom = shell_layers(process)
    steps = np.array([0, top, (top + 1) // 2, -bottom, -((bottom + 1) // 2)])
    layers = np.unique(np.append(choice.layers[:, None] + steps, 0))
    return [int(layer) for layer in layers if 0 <= layer < count]
