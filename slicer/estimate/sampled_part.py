"""Sampled part: the layers of a part that stand for all of them, with what their neighbours decide."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Ints, Mesh
from profiles.process import Process
from profiles.profile import Profile
from slicer.estimate.hanging import ThickSupport, thick_support
from slicer.estimate.shell import Shell, shell_of
from slicer.fill.region import shell_layers, solid_bottom_layers
from slicer.geometry.cross_section import cross_sections
from slicer.geometry.polygons import Polygons, clean, union
from slicer.heights import Heights, part_heights, pedestal_layers
from slicer.interface.cut_faces import joined
from slicer.interface.interface import near_parts, sections_of
from slicer.shells import layer_processes
from slicer.walls.brim import plate_outline

SAMPLES = 24  # of a part: mean error of 24 whole prints 2.6 %, with 16 layers 3.2 %, with 48 2.5 %


@dataclass(frozen=True, eq=False)
class Choice:
    """(k,) layers, rising, and how many layers, their own included, each of them stands for."""

    layers: Ints
    counts: Ints


def choose_layers(mesh: Mesh, heights: Heights, process: Process, special: int, samples: int = SAMPLES) -> Choice:
    """Layers of a mesh in its part frame: more of them where it has level surfaces, whose skins fill few layers.

    The first layer stands for itself; none of the first `special` stands for a later one.
    """
    count = len(heights.tip_mm)
    top, bottom = shell_layers(process)
    middle_mm = mesh.vertices[mesh.faces, 2].mean(axis=1)
    layer = np.minimum(np.searchsorted(heights.tip_mm, middle_mm), count - 1)
    level_mm2 = np.bincount(layer, weights=np.abs(mesh.normals[:, 2]) * mesh.areas_mm2, minlength=count)
    before = np.concatenate([[0.0], np.cumsum(level_mm2)])
    rank = np.arange(count)
    near = np.sqrt(before[np.minimum(rank + top + 1, count)] - before[np.maximum(rank - bottom, 0)])
    interest = np.cumsum(1.0 / count + near / max(float(near.sum()), 1e-9))
    cuts = np.searchsorted(interest, interest[-1] * np.arange(1, samples) / samples) + 1
    bounds = np.unique(np.concatenate([[0, 1, min(special, count), count], np.minimum(cuts, count)]))
    return Choice(((bounds[:-1] + bounds[1:] - 1) // 2).astype(np.int32), np.diff(bounds).astype(np.int32))


@dataclass(frozen=True, eq=False)
class SampledPart:
    """A part in its own frame.

    processes: of every layer; sections: of the layers that were looked at; others: of them and of those over the last one, what
    parts printed later take; pedestal: how many of the lowest layers lift the model; plate: its outline.
    """

    mesh: Mesh
    on_platform: bool
    heights: Heights
    processes: Sequence[Process]
    choice: Choice
    sections: Mapping[int, Polygons]
    others: Mapping[int, Polygons]
    support: ThickSupport
    pedestal: int
    plate: Polygons

    def shell(self, layer: int) -> Shell:
        """What a chosen layer prints of the part itself."""
        process, height_mm = self.processes[layer], float(self.heights.height_mm[layer])
        own, model = self.sections[layer], self._model(layer)
        solid = process.infill_density >= 1.0 or (not self.on_platform and layer < solid_bottom_layers(process))
        covers = None if solid else self._covers(layer, own if model is None else model)
        return shell_of(own, process, height_mm, covered=covers, model=model, ceiling=self._ceiling(layer))

    def _covers(self, layer: int, model: Polygons) -> Polygons:
        """What of a layer the model covers above and below, judged by the farthest of its skins and the middle one."""
        top, bottom = shell_layers(self.processes[layer])
        covered = model
        for step in {top, (top + 1) // 2, -bottom, -((bottom + 1) // 2)} - {0}:
            covered = covered ^ self._section(layer + step)
        return covered

    def _section(self, layer: int) -> Polygons:
        """The model in a layer; under the platform there is nothing, under a base plane plastic."""
        if layer < 0 and not self.on_platform:
            return self.sections[0]
        model = self._model(layer)
        return self.sections.get(layer, Polygons()) if model is None else model

    def _model(self, layer: int) -> Polygons | None:
        """The islands of the model to which a layer belongs; None where no other part touches it."""
        of_others = self.others.get(layer, Polygons())
        if of_others.is_empty() or layer >= len(self.heights.tip_mm):
            return None if of_others.is_empty() else of_others
        return joined(self.sections[layer], self.sections[layer], of_others)

    def _ceiling(self, layer: int) -> Polygons:
        """What parts printed later take of the layers above, as far as they need a floor."""
        reach = self.processes[layer].interface_top_layers
        return union([self.others.get(layer + step, Polygons()) for step in {1, (reach + 1) // 2, reach}])


def sample_part(part: Part, profile: Profile, later: Sequence[Part] = ()) -> SampledPart:
    """The layers of a part that stand for all of them. later: the parts printed after it.

    Raises SliceError where its mesh is not closed or far too high.
    """
    process, mesh, on_platform = profile.process, part.in_part_frame(), part.index == 1
    heights = part_heights(part, later, profile)
    count, pedestal = len(heights.tip_mm), pedestal_layers(heights, profile.search.pedestal_mm if on_platform else 0.0)
    choice = choose_layers(mesh, heights, process, max(1 if on_platform else process.interface_layers, pedestal))
    processes, plate = layer_processes(process, on_platform, count), plate_outline(profile.machine.table)
    support = thick_support(part, heights, profile, plate)
    looked_at = _with_neighbours(choice, process)
    own = [layer for layer in looked_at if layer < count]
    loops = cross_sections(mesh, heights.cut_mm[own])
    outlines = {layer: clean(several, 0.0) for layer, several in zip(own, loops, strict=True)}
    others = _others(part, later, heights, looked_at, process)
    return SampledPart(mesh, on_platform, heights, processes, choice, outlines, others, support, pedestal, plate)


def _others(part: Part, later: Sequence[Part], heights: Heights, layers: Sequence[int], process: Process) -> dict[int, Polygons]:
    """What of some layers, which may lie over the last one, later parts take."""
    near = near_parts(part, later, process.layer_height_mm * max(process.interface_top_layers, shell_layers(process)[0]))
    if not near:
        return {}
    count, last_mm = len(heights.tip_mm), float(heights.tip_mm[-1])
    over = [last_mm + (layer - count + 0.5) * process.layer_height_mm for layer in layers if layer >= count]
    cuts = np.array([*(float(heights.cut_mm[layer]) for layer in layers if layer < count), *over])
    return dict(zip(layers, sections_of(near, part, cuts), strict=True))


def _with_neighbours(choice: Choice, process: Process) -> list[int]:
    """The chosen layers, the lowest, and those that decide where the chosen ones are solid."""
    (top, bottom), reach = shell_layers(process), process.interface_top_layers
    steps = np.array([0, top, (top + 1) // 2, -bottom, -((bottom + 1) // 2), 1, reach, (reach + 1) // 2])
    return [int(layer) for layer in np.unique(np.append(choice.layers[:, None] + steps, 0)) if layer >= 0]
