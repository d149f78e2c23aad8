"""Modifiers: the areas of a part's layers with modified settings, from volumes that the user defines.

Outside a modifier's volume, walls, skins and infill have the part's own settings, inside those of the modifier. They are split
along the volume: outer walls continue across, and no wall is added where only the settings change.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from mdp.cut import convex_hull
from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.topology.cross_section import cross_sections
from mdp.zone import MeshVolume, Volume
from profiles.errors import SliceError
from profiles.messages import key_name
from profiles.part_settings import process_of_part
from profiles.process import Process
from slicer.geometry.polygons import Polygons, clean, closing, offset, rectangle, union, unite_layers
from slicer.heights import SHELL_KEYS, shell_layers

AROUND_MM = 5.0  # margin beside a part, more than its outlines can extend beyond its mesh
LEAST_MM2 = 0.01  # smaller areas of a layer are rounding
SLIT_MM = 0.001  # adjoining areas are joined across the rounding of their borders


@dataclass(frozen=True, eq=False)
class Place:
    """Modified values of process settings, by key, and the areas of a part's layers in which they apply."""

    settings: Mapping[str, Any]
    areas: Sequence[Polygons]

    def over(self, process: Process) -> Process:
        """A process with these values overriding its own."""
        return process.model_copy(update=self.settings)


def modified_places(part: Part, mesh: Mesh, process: Process, cuts_mm: Floats) -> list[Place]:
    """The areas in a part's layers with modified settings, where later ones override earlier ones.

    mesh: the part's, in its frame; cuts_mm: mid-heights of the layers. Raises SliceError for settings that conflict with the
    part's process.
    """
    places = []
    (x0, y0, _), (x1, y1, _) = mesh.bounds_mm + np.array([[-AROUND_MM], [AROUND_MM]])
    window = rectangle(x0, y0, x1, y1)
    for own, modifiers in groupby(part.modifiers, key=lambda modifier: modifier.process):
        settings = process_of_part(process, own).model_dump(include=set(own))
        if process.spiral_vase:
            raise SliceError(
                f"{key_name('process.spiral_vase')} prints one wall all the way up: "
                "a [[modifier]] of the plan has no effect on it"
            )
        if process.walls == 0 and "walls" in settings:
            raise SliceError(
                f"{key_name('process.walls')} is 0: a [[modifier]] of the plan can only change the walls of a part that has some"
            )
        sections = [volume_sections(part, modifier.volume, cuts_mm) for modifier in modifiers]
        places.append(Place(settings, [union(layer) ^ window for layer in zip(*sections, strict=True)]))
    return [place for place in places if any(not area.is_empty() for area in place.areas)]


def combined(places: Sequence[Place], keys: Collection[str]) -> list[Place]:
    """The areas in which some keys have modified values, each with all of these values: disjoint, and with distinct values."""
    found = list[Place]()
    for place in places:
        settings = {key: value for key, value in place.settings.items() if key in keys}
        if settings:
            found = _with_place(found, Place(settings, place.areas))
    return found


def _with_place(found: Sequence[Place], new: Place) -> list[Place]:
    """Disjoint areas with another one laid over them: where they overlap, its values override theirs."""
    pieces, alone = list[Place](), list(new.areas)
    for old in found:
        both = [a ^ b for a, b in zip(old.areas, new.areas, strict=True)]
        if all(area.is_empty() for area in both):
            pieces.append(old)
            continue
        pieces.append(Place(old.settings, [a - b for a, b in zip(old.areas, both, strict=True)]))
        pieces.append(Place({**old.settings, **new.settings}, both))
        alone = [a - b for a, b in zip(alone, both, strict=True)]
    merged = list[Place]()
    for piece in (*pieces, Place(new.settings, alone)):
        same = next((k for k, place in enumerate(merged) if place.settings == piece.settings), None)
        if same is None:
            merged.append(piece)
        else:
            merged[same] = Place(piece.settings, unite_layers(merged[same].areas, piece.areas))
    return [place for place in merged if any(not area.is_empty() for area in place.areas)]


def volume_sections(part: Part, volume: Volume, cuts_mm: Floats) -> list[Polygons]:
    """The sections of a volume in each layer of a part, limited to its `room`, the box around its model."""
    mesh = volume.mesh if isinstance(volume, MeshVolume) else convex_hull(volume.corners)
    in_part = mesh.transform(part.rotation, (0.0, 0.0, -part.base.offset_mm))
    areas = [clean(loops, 0.0) for loops in cross_sections(in_part, cuts_mm)]
    if volume.room is None:
        return areas
    return [area ^ room for area, room in zip(areas, volume_sections(part, volume.room, cuts_mm), strict=True)]


def most_shell_layers(process: Process, places: Sequence[Place]) -> tuple[int, int]:
    """The greatest numbers of solid layers below a top and above a bottom, in the process or any modified area."""
    counts = [shell_layers(own) for own in (process, *(place.over(process) for place in combined(places, SHELL_KEYS)))]
    return max(top for top, _ in counts), max(bottom for _, bottom in counts)


def overlaid(base: Polygons, others: Sequence[tuple[Polygons, Polygons]]) -> Polygons:
    """An area replaced within some places by other areas; where places overlap the last one counts. others: places and areas."""
    there = [(place, area) for place, area in others if not place.is_empty()]
    for place, area in there:
        base = (base - place) + (area ^ place)
    return closing(base, SLIT_MM) if there else base


@dataclass(frozen=True, eq=False)
class WallCounts:
    """The number of walls of a layer, and the areas with another number; where they overlap the last one counts."""

    usual: int
    others: Sequence[tuple[Polygons, int]] = ()

    @property
    def all(self) -> list[int]:
        """All numbers of walls in the layer."""
        return [self.usual, *(count for _, count in self.others)]

    def overlaid(self, of_count: Callable[[int], Polygons]) -> Polygons:
        """One area composed of the areas for each number of walls."""
        return overlaid(of_count(self.usual), [(area, of_count(count)) for area, count in self.others])

    def where_more(self, level: int, within: Polygons, short_mm: float) -> Polygons:
        """The part of an area with more walls than a level, at a distance from areas with fewer."""
        if all(count > level for count in self.all):
            return within
        fewer = self.overlaid(lambda count: Polygons() if count > level else within)
        return within - offset(fewer, short_mm)


def wall_counts(sections: Sequence[Polygons], walls: Sequence[int], usual: int, places: Sequence[Place]) -> list[WallCounts]:
    """The number of walls of every layer, with deviating areas from modifiers. walls: of each layer; if it has more than usual,
    modified areas get as many more; if it has fewer, all of it has them.
    """
    several, counts = combined(places, ["walls"]), []
    for layer, (section, own) in enumerate(zip(sections, walls, strict=True)):
        others, everywhere = list[tuple[Polygons, int]](), own
        for place in several if own >= usual else ():
            count, area_mm2 = place.settings["walls"] + own - usual, (section ^ place.areas[layer]).area()
            if section.area() - area_mm2 < LEAST_MM2:
                others, everywhere = [], count
                break
            if area_mm2 >= LEAST_MM2 and count != own:
                others.append((place.areas[layer], count))
        counts.append(WallCounts(everywhere, others))
    return counts
