"""Shells: what every layer of a part consists of: walls, skins and sparse places, before any bead is laid."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mdp.kernels.processes import in_order
from profiles.process import Process
from slicer.bead import Bead, first_layer_process, interface_process, with_line_width
from slicer.fill.bridge import Bridge
from slicer.fill.infill import pattern_density
from slicer.fill.ironing import ironed_areas
from slicer.fill.region import Region, regions
from slicer.geometry.polygons import Polygons, settled
from slicer.interface.cut_walls import CutWalls, cover, cut_walls
from slicer.interface.model import model_around
from slicer.overhangs import Overhang, bridges_of_layers
from slicer.sections import Sections
from slicer.strokes.overhanging import strengthen_overhangs
from slicer.support.support import Supports
from slicer.walls.walls import Walls

FEWEST_LAYERS = 60  # from which on a part's layers are worked out by several processes


@dataclass(frozen=True, eq=False)
class Shell:
    """One layer of the part itself.

    process: the settings, with the extra walls of interfaces and overhangs and the widths of part 1's first layer; ending: inner
    walls that end on the face of a cut, and what fills between them; ironed: tops that are smoothed.
    """

    process: Process
    walls: Walls
    ending: tuple[Bead, ...]
    region: Region
    bridges: tuple[Bridge, ...]
    ironed: Polygons


@dataclass(frozen=True, eq=False)
class Shells:
    """A part's layers with the support planned for it; density: of the sparse infill's pattern."""

    supports: Supports
    layers: Sequence[Shell]
    density: float

    @property
    def sections(self) -> Sections:
        """The layers as outlines."""
        return self.supports.sections

    @property
    def regions(self) -> list[Region]:
        """What is skin and what is sparse of each layer."""
        return [shell.region for shell in self.layers]


def build_shells(supports: Supports, overhangs: Sequence[Overhang]) -> Shells:
    """The shells of a part with the support that was planned for it."""
    sections = supports.sections
    process, nozzle_mm = sections.process, sections.profile.machine.head.nozzle_mm
    processes = layer_processes(process, sections.on_platform, len(sections.outlines))
    processes = strengthen_overhangs(processes, sections.own, sections.plastic_below)
    model = model_around(sections)
    heights_mm = sections.heights.height_mm.tolist()

    def walls_of(layer: int) -> CutWalls:
        around, own = (sections.own[layer], model.sections[layer]), processes[layer]
        return _settled(cut_walls(*around, own, height_mm=heights_mm[layer], nozzle_mm=nozzle_mm, usual=process.walls))

    walled = list(in_order(walls_of, len(processes), FEWEST_LAYERS))
    covers = cover(model, sections.own, walled)
    filled = regions([layer.walls.inside for layer in walled], covers, not sections.on_platform, process)
    bridges = bridges_of_layers(sections, overhangs, supports.areas)
    around = sections.neighbours
    ironed = ironed_areas(filled, [*around.beside, *around.above[:1]], process)
    infill = with_line_width(process, process.infill_line_width_mm)
    return Shells(
        supports,
        [
            Shell(own, layer.walls, layer.ending, region, spans, smooth)
            for own, layer, region, spans, smooth in zip(processes, walled, filled, bridges, ironed, strict=True)
        ],
        pattern_density([region.sparse for region in filled], infill, process.layer_height_mm),
    )


def _settled(walled: CutWalls) -> CutWalls:
    """The same whether another process has worked it out or this one."""
    walls = replace(walled.walls, inside=settled(walled.walls.inside), narrow=settled(walled.walls.narrow))
    inside = walls.inside if walled.model_inside is walled.walls.inside else settled(walled.model_inside)
    return CutWalls(walls, walled.ending, inside)


def layer_processes(process: Process, on_platform: bool, layers: int) -> list[Process]:
    """The settings of every layer: the first has widths of its own, and on plastic more walls, if it has any."""
    first = first_layer_process(process) if on_platform else interface_process(process)
    return [first if i == 0 else process for i in range(layers)]
