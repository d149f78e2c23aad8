"""Site: a part as its support finds it: layers, what hangs in them, what lies beneath, where nothing may stand."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mdp.decomposition import Part
from mdp.overhang import PLATFORM_TOLERANCE_MM
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import first_layer_process, with_line_width
from slicer.finish.compensation import compensate
from slicer.finish.vase import vase_profile
from slicer.geometry.polygons import Polygons, clean, union
from slicer.heights import Heights, layer_heights
from slicer.interface.interface import plastic_beneath
from slicer.interface.interlock import cut_grooves
from slicer.plate import compensate_elephant_foot, lay_on_plate, plate_outline
from slicer.section import sections
from slicer.support.blocker import blocked_areas, far_mm
from slicer.support.missed import drop_small
from slicer.support.overhang import Overhang, detect_overhangs
from slicer.support.pedestal import pedestal_layers, without_pedestal
from slicer.support.support import Supports, generate_supports
from slicer.support.unwanted import shut_areas, without_unwanted
from slicer.walls.layer_walls import without_hairs


@dataclass(frozen=True, eq=False)
class Site:
    """A part's layers, one entry each, before anything is laid.

    outlines: whole sections; own: without the pedestal; uncut: own without the grooves for later parts; overhangs: what hangs
    and what bridges; beneath: the plastic under the first layer, None on the platform; floor: the plate's outline, of use to
    part 1; pedestal_layers: how many of the lowest layers the pedestal takes. profile: the part's own. left_out: of each layer
    what hangs and is not to be held up; empty: nothing does. hairs: layers that hold something, but nothing that gets a line.
    """

    part: Part
    earlier: Sequence[Part]
    later: Sequence[Part]
    profile: Profile
    heights: Heights
    outlines: Sequence[Polygons]
    own: Sequence[Polygons]
    uncut: Sequence[Polygons]
    overhangs: Sequence[Overhang]
    beneath: Polygons | None
    floor: Polygons
    pedestal_layers: int
    far_mm: float
    left_out: Sequence[Polygons] = ()
    hairs: frozenset[int] = frozenset()

    @property
    def process(self) -> Process:
        """The settings of support, with the width of its lines."""
        process = self.profile.process
        return with_line_width(process, process.support_line_width_mm)

    @cached_property
    def supports(self) -> Supports:
        """The support that stands on the platform, on the part itself and on what lies beneath its base plane."""
        blocked = blocked_areas(self.part, self.later, self.heights, self.process.support_distance_mm, self.far_mm)
        blocked = self.shut(blocked, self.heights)
        hanging = [overhang.hanging for overhang in self.overhangs]
        return generate_supports(hanging, self.outlines, self.heights, self.process, self.beneath, blocked, self.floor)

    def shut(self, blocked: list[Polygons], heights: Heights) -> list[Polygons]:
        """Where support cannot be, and where a person wants none."""
        if not self.part.no_support.anywhere:
            return blocked
        unwanted = shut_areas(self.part, heights, self.process)
        return [union([one, other]) for one, other in zip(blocked, unwanted, strict=True)]

    def up_to(self, top_mm: float) -> "Site":
        """The site with empty layers on top as far as that height."""
        tip, thick = self.heights.tip_mm, self.process.layer_height_mm
        count = int(np.ceil((top_mm - tip[-1]) / thick - 1e-9))
        if count <= 0:
            return self
        tips = tip[-1] + thick * np.arange(1, count + 1)
        heights = Heights(
            np.append(tip, tips),
            np.append(self.heights.height_mm, np.full(count, thick)),
            np.append(self.heights.cut_mm, tips - 0.5 * thick),
        )
        nothing = [Polygons()] * count
        return replace(
            self,
            heights=heights,
            outlines=[*self.outlines, *nothing],
            own=[*self.own, *nothing],
            uncut=[*self.uncut, *nothing],
            overhangs=[*self.overhangs, *[Overhang(Polygons(), ())] * count],
        )


def survey(part: Part, profile: Profile, earlier: Sequence[Part], later: Sequence[Part]) -> Site:
    """The site of a part that is printed after `earlier` and before `later` parts; profile: of the whole print."""
    profile = vase_profile(profile.of_part(part.index))
    process, mesh, on_platform = profile.process, part.in_part_frame(), part.index == 1
    pedestal_mm = profile.search.pedestal_mm if on_platform else 0.0
    heights = layer_heights(mesh, profile, on_platform, pedestal_mm)
    pedestal_count = pedestal_layers(heights.tip_mm, pedestal_mm)
    outlines = [clean(loops, process.slit_closing_mm) for loops in sections(mesh, heights.cut_mm)]
    nozzle_mm = profile.machine.head.nozzle_mm
    whole = outlines
    outlines = [without_hairs(each, process, process.layer_height_mm, nozzle_mm) for each in whole]
    hairs = frozenset(i for i, each in enumerate(outlines) if each.is_empty() and not whole[i].is_empty())
    if on_platform and not pedestal_count:
        base = clean(sections(mesh, np.array([PLATFORM_TOLERANCE_MM]))[0], process.slit_closing_mm)
        outlines = lay_on_plate(outlines, heights.cut_mm, base, process.line_width_mm)
    outlines = compensate(outlines, part, later, heights.cut_mm, process)
    if on_platform:
        outlines[0] = compensate_elephant_foot(outlines[0], process.elephant_foot_mm, first_layer_process(process).line_width_mm)
    uncut = without_pedestal(outlines, mesh, heights.cut_mm, pedestal_mm, pedestal_count) if pedestal_count else outlines
    own = cut_grooves(uncut, part, later, heights.cut_mm, process)
    outlines = cut_grooves(outlines, part, later, heights.cut_mm, process) if pedestal_count else own
    below = plastic_beneath(part, earlier, outlines[0])
    hanging = detect_overhangs(mesh, outlines, heights.cut_mm, process, below)
    overhangs = without_unwanted(hanging, part, heights.cut_mm)
    return Site(
        part=part,
        earlier=earlier,
        later=later,
        profile=profile,
        heights=heights,
        outlines=outlines,
        own=own,
        uncut=uncut,
        overhangs=overhangs,
        beneath=below,
        floor=plate_outline(profile.machine.table),
        pedestal_layers=pedestal_count,
        far_mm=far_mm(mesh),
        hairs=hairs,
        left_out=_left_out(hanging, overhangs, process) if part.no_support.anywhere else (),
    )


def _left_out(hanging: Sequence[Overhang], overhangs: Sequence[Overhang], process: Process) -> Sequence[Polygons]:
    """What hangs in each layer and would have got support, were it wanted; specks not."""
    if process.support == "none":
        return ()
    return drop_small(
        [whole.hanging - kept.hanging for whole, kept in zip(hanging, overhangs, strict=True)], process.support_least_mm2
    )
