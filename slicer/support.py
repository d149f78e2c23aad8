"""Support: columns straight down from hanging places to what stands below, and the lines that fill them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil

from profiles.process import Process
from slicer.bead import Bead, spacing_mm
from slicer.contact import RIM_MM
from slicer.hatch import hatched
from slicer.order import OUTSIDE
from slicer.paths import Kind
from slicer.polygons import RESOLUTION_MM, Polygons, closed, contours, grown, opened, sealed, united

LEAST_MM2 = 1.0  # a column thinner than this falls over, and so small a place holds itself
LEAST_LINES = 3  # an island with fewer lines gets its outline instead


@dataclass(frozen=True, eq=False)
class Supports:
    """areas: where each layer prints support; unsupported_mm2: hanging area, seen from above, that none could reach."""

    areas: tuple[Polygons, ...]
    unsupported_mm2: float


def supports(
    hanging: Sequence[Polygons],
    outlines: Sequence[Polygons],
    process: Process,
    below: Polygons | None,
    later: Callable[[], Sequence[Polygons]],
) -> Supports:
    """Support below the hanging places of each layer.

    A column goes straight down to the part itself, to `below` (plastic of earlier parts just under the base plane) or to
    the platform (below is None). It must not stand where a later part will be: later() gives their sections per layer.
    """
    if process.support == "none" or all(place.is_empty() for place in hanging):
        return Supports((Polygons(),) * len(outlines), 0.0)
    blocked = [s if s.is_empty() else grown(s, process.support_distance_mm) for s in later()]
    columns = _columns(hanging, outlines, blocked)
    if below is not None or any(not b.is_empty() for b in blocked):
        columns = _rooted(columns, outlines, below)
    missed = [hanging[0], *(h - grown(c, RIM_MM) for h, c in zip(hanging[1:], columns, strict=False) if not h.is_empty())]
    unsupported = sum(place.area() for place in missed)
    return Supports(_printed(columns, outlines, process, below), unsupported if unsupported >= LEAST_MM2 else 0.0)


def _columns(hanging: Sequence[Polygons], outlines: Sequence[Polygons], blocked: Sequence[Polygons]) -> list[Polygons]:
    """Everything below the hanging places down to the part's own surface."""
    column = Polygons()
    columns = [column] * len(outlines)
    for i in range(len(outlines) - 2, -1, -1):
        if not hanging[i + 1].is_empty():
            column = (column + grown(hanging[i + 1], RIM_MM)).simplify(RESOLUTION_MM)
        if not column.is_empty():
            column = column - outlines[i]
        if not column.is_empty() and not blocked[i].is_empty():
            column = column - blocked[i]
        columns[i] = column
    return columns


def _rooted(columns: Sequence[Polygons], outlines: Sequence[Polygons], below: Polygons | None) -> list[Polygons]:
    """What of the columns stands on the part, on earlier plastic or on the platform without a break."""
    rooted: list[Polygons] = []
    for i, column in enumerate(columns):
        if column.is_empty() or (i == 0 and below is None):
            rooted.append(column)
        else:
            ground = rooted[-1] + outlines[i - 1] if i else below
            rooted.append(column ^ sealed(ground, RIM_MM))
    return rooted


def _printed(
    columns: Sequence[Polygons], outlines: Sequence[Polygons], process: Process, below: Polygons | None
) -> tuple[Polygons, ...]:
    """Columns with their gaps to the part, without what is too small or stands on nothing."""
    gap = ceil(process.support_gap_mm / process.layer_height_mm - 1e-6)
    printed: list[Polygons] = []
    for i, column in enumerate(columns):
        if column.is_empty():
            printed.append(column)
            continue
        over, under = outlines[i + 1 : i + 1 + gap], list(outlines[max(i - gap, 0) : i])
        if below is not None and i < gap:
            under.append(below)
        free = column - united([grown(outlines[i], process.support_distance_mm), *over, *under])
        free = opened(free, 0.5 * process.line_width_mm)
        islands = [island for island in free.decompose() if island.area() >= LEAST_MM2]
        if i > 0:
            roots = list(outlines[max(i - gap - 1, 0) : i]) + ([below] if below is not None and i <= gap else [])
            footing = grown(united([printed[-1], *roots]), process.line_width_mm)
            if (free - footing).area() > 0.0:
                islands = [island for island in islands if not (island ^ footing).is_empty()]
        printed.append(Polygons.compose(islands) if islands else Polygons())
    return tuple(printed)


def support_beads(area: Polygons, process: Process, height_mm: float) -> list[Bead]:
    """Sparse zigzags, the same lines in every layer so that they stand on each other."""
    beads: list[Bead] = []
    if area.is_empty():
        return beads
    width = process.line_width_mm
    apart = spacing_mm(width, height_mm) / process.support_density
    for island in area.decompose():
        inner = grown(island, -0.5 * width)
        lines = hatched(inner, grown(island, -0.25 * width), process.infill_angle_deg, apart, 2.0 * apart)
        if sum(len(line) // 2 for line in lines) < LEAST_LINES:
            lines = [closed(loop) for loop in contours(inner)]
        beads += [Bead(Kind.SUPPORT, line, width, OUTSIDE) for line in lines]
    return beads
