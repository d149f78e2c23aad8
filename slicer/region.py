"""Regions: which places of each layer are solid skin and which are sparse infill."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

from profiles.process import Process
from slicer.geometry.polygons import Polygons, offset, opening


@dataclass(frozen=True, eq=False)
class Region:
    """A layer's inside: top is skin with nothing above it, solid is all other skin, sparse takes the infill."""

    top: Polygons
    solid: Polygons
    sparse: Polygons

    def without(self, area: Polygons, width_mm: float) -> "Region":
        """The region without the place of a bridge."""

        def rest(polygons: Polygons) -> Polygons:
            left = polygons - area
            return left if left.is_empty() or left.area() == polygons.area() else opening(left, 0.25 * width_mm)

        return Region(rest(self.top), rest(self.solid), rest(self.sparse))


def regions(
    sections: Sequence[Polygons], insides: Sequence[Polygons], beneath: Polygons | None, process: Process
) -> list[Region]:
    """Regions of every layer from the sections and what the walls enclose.

    A place is solid when one of the next top_layers sections above or bottom_layers below does not cover it: so every
    vertical line meets that many layers of wall or skin below a surface, on slopes too. beneath: plastic of earlier parts
    under the first layer, which is then solid throughout; None: the platform.
    """
    empty = Polygons()
    on_plastic = beneath is not None
    top, bottom = shell_layers(process)
    above = _common([*sections[1:], empty], top) if top else list(insides)
    below = _common([*reversed(sections[:-1]), beneath if on_plastic else empty], bottom, on_plastic)[::-1]
    layers = []
    for i, inside in enumerate(insides):
        if inside.is_empty():
            layers.append(Region(empty, empty, empty))
            continue
        whole = process.infill_density >= 1.0 or (on_plastic and i == 0)
        sparse = empty if whole else sparse_area(inside, above[i], below[i] if bottom else inside, process)
        next_section = sections[i + 1] if i + 1 < len(sections) else empty
        layers.append(_region(inside, sparse, next_section if top else inside, process.line_width_mm))
    return layers


def shell_layers(process: Process) -> tuple[int, int]:
    """Solid layers under and over a surface: as many as asked for, more where layers are thin; 0 stays 0."""
    counts = (process.top_layers, process.top_thickness_mm), (process.bottom_layers, process.bottom_thickness_mm)
    top, bottom = (max(count, ceil(mm / process.layer_height_mm - 1e-6)) if count else 0 for count, mm in counts)
    return top, bottom


def sparse_area(inside: Polygons, above: Polygons, below: Polygons, process: Process) -> Polygons:
    """The inside that is covered above and below, a line width away from every skin that is anchored in it."""
    width_mm = process.line_width_mm
    covered = inside ^ above ^ below
    sparse = inside
    if inside.area() - covered.area() > 1e-6:
        skin = opening(inside - covered, 0.25 * width_mm)
        sparse = inside if skin.is_empty() else opening(inside - offset(skin, width_mm), width_mm)
    if process.infill_density <= 0.0 or sparse.is_empty():
        return sparse
    islands = sparse.decompose()
    large = [island for island in islands if island.area() >= process.solid_below_mm2]
    return sparse if len(large) == len(islands) else Polygons.compose(large) if large else Polygons()


def _region(inside: Polygons, sparse: Polygons, next_section: Polygons, width_mm: float) -> Region:
    """Splits what is not sparse into what is bare above and the rest."""
    if sparse.is_empty():
        solid = inside
    elif abs(sparse.area() - inside.area()) < 1e-6:
        return Region(Polygons(), Polygons(), sparse)
    else:
        solid = inside - sparse
    top = solid - next_section
    top = top if top.is_empty() else opening(top, width_mm)
    if top.is_empty():
        return Region(top, solid, sparse)
    under = opening(solid - top, 0.25 * width_mm)
    return Region(solid - under, under, sparse)


def _common(layers: Sequence[Polygons], count: int, last_repeats: bool = False) -> list[Polygons]:
    """For each i the intersection of layers i .. i + count - 1; beyond the end nothing, or everything if last_repeats.

    Running intersections of blocks from both sides (van Herk 1992): three booleans a layer, however many are common.
    """
    if count <= 0 or not layers:
        return list(layers)
    n = len(layers)
    forward: list[Polygons] = []
    for i in range(n):
        forward.append(layers[i] if i % count == 0 else forward[-1] ^ layers[i])
    backward: list[Polygons] = list(layers)
    for i in range(n - 2, -1, -1):
        if (i + 1) % count:
            backward[i] = layers[i] ^ backward[i + 1]
    common = []
    for i in range(n):
        end = i + count - 1
        if end >= n and not last_repeats:
            common.append(Polygons())
        else:
            end = min(end, n - 1)
            same_block = i // count == end // count
            common.append((forward[end] if i % count == 0 else backward[i]) if same_block else backward[i] ^ forward[end])
    return common
