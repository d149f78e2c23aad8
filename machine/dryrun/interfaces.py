"""Interfaces: how much of a part's section touches earlier parts, and the ratio of its plastic to the space for it.

The space of a column reaches from the tip at that first layer down to the top of earlier parts, in the part's frame: bars as high
as their layers and as wide as their plastic makes them, at the slant at which they were printed. This shares no code with the
slicer's computation of bead volumes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, at_row
from machine.dryrun.strokes import Beads, parts_on_plate, turned_box
from machine.gcode.reader.parsed import ParsedProgram
from mdp.kernels.arrays import table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.pose import Pose, rotation
from profiles.profile import Profile
from slicer.paths import Kind

CELL_MM = 0.05
AT_THE_EDGE = (Kind.OUTER_WALL.value, Kind.OVERHANG.value)
NO_PART = (Kind.SKIRT.value, Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value, Kind.PURGE.value, Kind.IRONING.value)
NEAR = 1.5  # heights of a bead: it does not touch plastic farther below its tip
LEAST_TOLD, MOST_TOLD, LEAST_TOLD_MM2 = 0.75, 1.4, 10.0  # shares of the whole: steps of sloped layers leave a tenth open or taken
LEAN, RICH = 0.1, 1.1  # the leanest tenth of a layer's beads; an excess by this factor replaces what oozed
REACH_MM = 2.0  # from the plane of the tip, of plastic that can matter
NOTHING = -1e9
ROUNDING_MM = 1e-6
MOST_COLUMNS = 4_000_000
MARGIN_MM = 1.5

Mask = NDArray[np.bool_]


class Lattice(NamedTuple):
    """A lattice. shape: (2,) columns along X and Y, squares of side cell; origin: (2,) mm, the least corner."""

    origin: Floats
    cell: float
    shape: NDArray[np.int64]

    @property
    def column_mm2(self) -> float:
        """Area of a column, mm²."""
        return self.cell * self.cell


class Bars(NamedTuple):
    """Straight pieces of plastic: (m, 3) centres of the ends of their tops, (m, 3) up, (m,) half widths and heights."""

    begin: Floats
    end: Floats
    up: Floats
    half: Floats
    height: Floats


@dataclass(frozen=True, eq=False)
class Interface:
    """Surroundings of a part's first layer; row: of its first stroke. Arrays are (nx, ny), one entry per column of the lattice.

    section: enclosed by the layer's walls or covered by its beads; touching: where earlier parts reach its beads; bead: where its
    beads are; room, plastic: mm³ of space under the tip, and of plastic. walls: the beads that may be at the section's edge.
    """

    part: int
    row: int
    lattice: Lattice
    section: Mask
    touching: Mask
    bead: Mask
    room: Floats
    plastic: Floats
    walls: Bars


@dataclass(frozen=True)
class InterfaceBalance:
    """Sums over an interface. area_mm2: of its section; contact: fraction of the section with a bead on an earlier part.

    over_room: plastic over space in the section above earlier parts; beads_over_room: only under beads; touching_mm2: area of the
    section that earlier parts reach.
    """

    part: int
    row: int
    area_mm2: float
    contact: float
    over_room: float
    beads_over_room: float
    touching_mm2: float


def balance_of(face: Interface) -> InterfaceBalance:
    """Sums over an interface."""
    section, beads, column_mm2 = face.touching & face.section, face.touching & face.bead, face.lattice.column_mm2
    return InterfaceBalance(
        part=face.part,
        row=face.row,
        area_mm2=float(face.section.sum()) * column_mm2,
        contact=float(beads.sum() / max(1, face.section.sum())),
        over_room=_over_room(face, section),
        beads_over_room=_over_room(face, beads),
        touching_mm2=float(section.sum()) * column_mm2,
    )


def _over_room(face: Interface, there: Mask) -> float:
    """Plastic over space of some columns."""
    return float(face.plastic[there].sum() / max(float(face.room[there].sum()), 1e-9))


def findings(program: ParsedProgram, balances: Sequence[InterfaceBalance], profile: Profile) -> Iterator[Finding]:
    """Warnings of code room for parts whose first layer has far more or less plastic than its flow should put into its space."""
    for face in balances:
        share = face.beads_over_room / (profile.of_part(face.part).process.interface_flow * profile.material.flow)
        if face.touching_mm2 >= LEAST_TOLD_MM2 and not LEAST_TOLD <= share <= MOST_TOLD:
            message = (
                f"the first layer of part {face.part} gets {share:.2f} of the plastic that its room on earlier parts is to have, "
                f"{LEAST_TOLD:g} to {MOST_TOLD:g} are expected"
            )
            yield at_row(program, face.row, "warning", "room", message)


def interfaces(program: ParsedProgram, deposited: Beads, profile: Profile) -> Iterator[Interface]:
    """The interface of every part that stands on others, in print order."""
    on_plate = parts_on_plate(program, deposited)
    (part, layer), remark = program.remarks[:2], program.remark[deposited.rows]
    own = ~np.isin(program.remarks.type, [k for k, name in enumerate(program.types) if name in NO_PART]) & (part > 0)
    for index in np.unique(part[remark[own[remark]]])[1:].tolist():
        if index in on_plate:
            continue
        mine = np.flatnonzero((own & (part == index))[remark])
        first = mine[layer[remark[mine]] == layer[remark[mine]].min()]
        turn = rotation(profile.machine, Pose(*program.end[deposited.rows[first[0]], 3:].tolist()))
        earlier = (own & (part < index))[remark[: first[0]]]
        yield _interface(program, deposited, (first, earlier), turn, profile)


def _interface(
    program: ParsedProgram, deposited: Beads, which: tuple[Indices, Mask], turn: Floats, profile: Profile
) -> Interface:
    """An interface. which: beads of the first layer, and a mask of earlier parts' beads; turn: rotation into the part's frame."""
    first, near = which
    layer = _bars(program, deposited, first, turn, profile)
    mm3 = program.e_mm[deposited.rows[first]] * _filament_mm2(profile)
    spare_mm3 = profile.material.prime_extra_mm * _filament_mm2(profile)
    tip_mm = float(np.median(layer.end[:, 2]))
    lattice = lattice_over(np.concatenate([layer.begin, layer.end])[:, :2], CELL_MM)
    wide = layer._replace(half=0.5 * deposited.sizes[deposited.size[first], 0])
    bead = tops(wide, lattice, NOTHING) > NOTHING
    section = bead | inside_loops(_outer_loops(wide, program, deposited.rows[first]), lattice)
    for some, box in deposited.boxes(len(near)):
        least, most = turned_box(box, turn)[:, 2] - tip_mm
        near[some] &= bool(least < REACH_MM and most > -REACH_MM)
        if near[some].any():
            near[some] &= (np.abs((deposited.segments(some) @ turn[2]) - tip_mm) < REACH_MM).any(axis=1)
    near_mm = NEAR * max(float(np.median(layer.height)), 0.2)
    room = tops(_bars(program, deposited, np.flatnonzero(near), turn, profile), lattice, tip_mm - near_mm)
    np.maximum(np.subtract(tip_mm, room, out=room), 0.0, out=room)  # in place, because a lattice is large
    touching = room < near_mm
    room[~touching] = 0.0
    room *= lattice.column_mm2
    return Interface(
        part=int(program.part[deposited.rows[first[0]]]),
        row=int(deposited.rows[first[0]]),
        lattice=lattice,
        section=section,
        touching=touching,
        bead=bead,
        room=room,
        plastic=laid(wide, mm3 - _run_in(deposited, first, mm3, spare_mm3), lattice),
        walls=Bars(*(values[program.rows_of_types(*AT_THE_EDGE)[deposited.rows[first]]] for values in wide)),
    )


def _run_in(deposited: Beads, first: Indices, mm3: Floats, spare_mm3: float) -> Floats:
    """(m,) excess of the first strokes of a layer over its leanest ones, up to the amount that oozed during the turn. It refills
    the nozzle and takes no space in the layer."""
    width_mm, height_mm = deposited.sizes[deposited.size[first]].T
    nominal_mm3 = width_mm * height_mm * deposited.length_mm[first]
    lean = float(np.quantile(mm3 / np.maximum(nominal_mm3, 1e-9), LEAN))
    beyond = np.maximum(mm3 - RICH * lean * nominal_mm3, 0.0).cumsum()
    return np.diff(np.minimum(beyond, spare_mm3), prepend=0.0)


def _filament_mm2(profile: Profile) -> float:
    return pi * profile.material.diameter_mm**2 / 4.0


def _bars(program: ParsedProgram, deposited: Beads, which: Indices, turn: Floats, profile: Profile) -> Bars:
    """Beads as bars in a rotated frame, as wide as their plastic makes them at their height."""
    segments, rows = deposited.segments(which), deposited.rows[which]
    begin, end = (segments[:, side] @ turn.T for side in (0, 1))
    height, length = deposited.sizes[deposited.size[which], 1], np.maximum(deposited.length_mm[which], 1e-9)
    mm3 = program.e_mm[rows] * _filament_mm2(profile)
    return Bars(begin, end, deposited.directions(which) @ turn.T, 0.5 * mm3 / length / height, height)


def _outer_loops(bars: Bars, program: ParsedProgram, rows: Indices) -> Floats:
    """(n, 4) sides of the closed loops of outer walls, including their overhanging pieces."""
    outer, sides = program.rows_of_types(Kind.OUTER_WALL.value)[rows], []
    at = np.flatnonzero(program.rows_of_types(*AT_THE_EDGE)[rows])
    if not len(at):
        return np.zeros((0, 4))
    apart = np.abs(bars.begin[at[1:]] - bars.end[at[:-1]]).max(axis=1) > 1e-6
    for way in np.split(at, np.flatnonzero((np.diff(rows[at]) != 1) | apart) + 1):
        gap = bars.begin[way[0], :2] - bars.end[way[-1], :2] if len(way) > 2 and outer[way].any() else np.full(2, np.inf)
        if np.hypot(*gap) <= 2.0 * bars.half[way[0]]:
            sides.append(np.hstack([bars.begin[way, :2], bars.end[way, :2]]))
            sides.append(np.hstack([bars.end[way[-1], :2], bars.begin[way[0], :2]])[None])
    return np.concatenate(sides) if sides else np.zeros((0, 4))


def lattice_over(points: Floats, cell_mm: float) -> Lattice:
    """A lattice over (n, 2) points and a margin; its columns grow to limit their number."""
    low, high = points.min(axis=0) - MARGIN_MM, points.max(axis=0) + MARGIN_MM
    cell = max(cell_mm, float(np.sqrt((high - low).prod() / MOST_COLUMNS)))
    return Lattice(low, cell, np.ceil((high - low) / cell).astype(np.int64))


@kernel
def laid(bars: Bars, mm3: Floats, lattice: Lattice) -> Floats:
    """Plastic in each column, mm³: each level bar spread evenly over the columns whose centres it covers.

    A bar that covers none counts in the column at its centre, so that nothing over the lattice is lost.
    """
    plastic = table(lattice.shape[0], lattice.shape[1])
    for k in range(len(mm3)):
        a, b = bars.begin[k], bars.end[k]
        count = _spread(a, b, bars.half[k], 0.0, lattice, plastic)
        if count:
            _spread(a, b, bars.half[k], mm3[k] / count, lattice, plastic)
        else:
            i = int((0.5 * (a[0] + b[0]) - lattice.origin[0]) / lattice.cell)
            j = int((0.5 * (a[1] + b[1]) - lattice.origin[1]) / lattice.cell)
            if 0 <= i < lattice.shape[0] and 0 <= j < lattice.shape[1]:
                plastic[i, j] += mm3[k]
    return plastic


@helper
def _spread(a: Floats, b: Floats, half: float, mm3: float, lattice: Lattice, plastic: Floats) -> int:
    """Add mm3 to every column whose centre is within half of the line from a to b; returns their number."""
    dx, dy, count = b[0] - a[0], b[1] - a[1], 0
    length = np.sqrt(dx * dx + dy * dy)
    if length <= 0.0:
        return 0
    dx, dy = dx / length, dy / length
    i0, i1 = _columns(0.5 * (a[0] + b[0]), 0.5 * length * abs(dx) + half * abs(dy), 0, lattice)
    j0, j1 = _columns(0.5 * (a[1] + b[1]), 0.5 * length * abs(dy) + half * abs(dx), 1, lattice)
    for i in range(i0, i1 + 1):
        x = lattice.origin[0] + (i + 0.5) * lattice.cell - a[0]
        for j in range(j0, j1 + 1):
            y = lattice.origin[1] + (j + 0.5) * lattice.cell - a[1]
            along, aside = x * dx + y * dy, x * dy - y * dx
            if 0.0 <= along < length and -half <= aside < half:
                count += 1
                plastic[i, j] += mm3
    return count


@helper
def _columns(middle: float, reach: float, axis: int, lattice: Lattice) -> tuple[int, int]:
    """First and last column whose centre is within reach of a position along an axis."""
    first = int(np.ceil((middle - reach - lattice.origin[axis]) / lattice.cell - 0.5))
    last = int(np.floor((middle + reach - lattice.origin[axis]) / lattice.cell - 0.5))
    return max(first, 0), min(last, lattice.shape[axis] - 1)


@kernel
def tops(bars: Bars, lattice: Lattice, least: float) -> Floats:
    """Height of the top of the uppermost bar in each column, NOTHING for none. Bars may have any slant; their ends are round,
    like beads at corners. Heights below `least` may be returned as any lower height, or as NOTHING."""
    top = table(lattice.shape[0], lattice.shape[1])
    for i in range(lattice.shape[0]):
        for j in range(lattice.shape[1]):
            top[i, j] = NOTHING
    for k in range(len(bars.half) - 1, -1, -1):  # from the last one down, to skip bars below
        a, b, up, half, height = bars.begin[k], bars.end[k], bars.up[k], bars.half[k], bars.height[k]
        length = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
        if length <= 0.0:
            continue
        d = ((b[0] - a[0]) / length, (b[1] - a[1]) / length, (b[2] - a[2]) / length)
        s = (up[1] * d[2] - up[2] * d[1], up[2] * d[0] - up[0] * d[2], up[0] * d[1] - up[1] * d[0])
        slabs = ((d[0], d[1], d[2], 0.0, length), (s[0], s[1], s[2], -half, half), (up[0], up[1], up[2], -height, 0.0))
        sines = [np.sqrt(max(0.0, 1.0 - up[n] * up[n])) for n in range(3)]
        reach = [0.5 * (length * abs(d[n]) + height * abs(up[n])) + half * sines[n] for n in range(2)]
        ceiling = max(a[2], b[2]) + half * sines[2] + height * max(0.0, -up[2]) + ROUNDING_MM
        if abs(d[0] * up[0] + d[1] * up[1] + d[2] * up[2]) > ROUNDING_MM:
            ceiling = -NOTHING  # its sides are not a rectangle
        if ceiling < least:
            continue
        i0, i1 = _columns(0.5 * (a[0] + b[0] - height * up[0]), reach[0], 0, lattice)
        j0, j1 = _columns(0.5 * (a[1] + b[1] - height * up[1]), reach[1], 1, lattice)
        for i in range(i0, i1 + 1):
            x = lattice.origin[0] + (i + 0.5) * lattice.cell - a[0]
            for j in range(j0, j1 + 1):
                if top[i, j] >= ceiling:
                    continue
                y = lattice.origin[1] + (j + 0.5) * lattice.cell - a[1]
                highest = max(
                    a[2] + _leaves(x, y, slabs),
                    a[2] + _leaves_end(x, y, up, half, height),
                    b[2] + _leaves_end(x + a[0] - b[0], y + a[1] - b[1], up, half, height),
                )
                if highest > max(top[i, j], 0.5 * NOTHING):
                    top[i, j] = highest
    return top


@no_nrt
def _leaves_end(x: float, y: float, up: Floats, half: float, height: float) -> float:
    """Height at which a vertical line leaves the round end of a bar: a cylinder below the end of its top, relative to that end.

    The points p = (x, y, z) on the line satisfy |p|^2 - (p . up)^2 <= half^2, a quadratic in z, and -height <= p . up <= 0.
    """
    along, free = x * up[0] + y * up[1], 1.0 - up[2] * up[2]
    rest = x * x + y * y - along * along - half * half
    low, high = NOTHING, -NOTHING
    if free > 1e-12:
        root = along * along * up[2] * up[2] - free * rest
        if root < 0.0:
            return NOTHING
        low, high = (along * up[2] - np.sqrt(root)) / free, (along * up[2] + np.sqrt(root)) / free
    elif rest > 0.0:
        return NOTHING
    if abs(up[2]) > 1e-9:
        low = max(low, min(-along / up[2], (-height - along) / up[2]))
        high = min(high, max(-along / up[2], (-height - along) / up[2]))
    elif along > 0.0 or along < -height:
        return NOTHING
    return high if low <= high else NOTHING


@helper
def _leaves(x: float, y: float, slabs: tuple[tuple[float, float, float, float, float], ...]) -> float:
    """Height at which a vertical line leaves the intersection of slabs, each the points p with least <= n . p <= most."""
    low, high = NOTHING, -NOTHING
    for nx, ny, nz, least, most in slabs:
        across = x * nx + y * ny
        if abs(nz) > 1e-9:
            low = max(low, min((least - across) / nz, (most - across) / nz))
            high = min(high, max((least - across) / nz, (most - across) / nz))
        elif across < least or across > most:
            return NOTHING
    return high if low <= high else NOTHING


def inside_loops(sides: Floats, lattice: Lattice) -> Mask:
    """Columns whose centre an odd number of loops enclose; sides: (n, 4) x y of the beginning and end of each side."""
    count = _crossings(sides, lattice)
    np.cumsum(count[:, ::-1], axis=1, out=count[:, ::-1])
    within: Mask = np.mod(count, 2.0, out=count) > 0.5
    return within


@kernel
def _crossings(sides: Floats, lattice: Lattice) -> Floats:
    """Number of sides that pass above each column's centre and not above that of the next one."""
    crossings = table(lattice.shape[0], lattice.shape[1])
    for k in range(len(sides)):
        x0, y0, x1, y1 = sides[k, 0], sides[k, 1], sides[k, 2], sides[k, 3]
        first, last = _columns(0.5 * (x0 + x1), 0.5 * abs(x1 - x0) + 1e-9, 0, lattice)
        for i in range(first, last + 1):
            x = lattice.origin[0] + (i + 0.5) * lattice.cell
            if min(x0, x1) <= x < max(x0, x1):
                y = y0 + (x - x0) / (x1 - x0) * (y1 - y0)
                j = int(np.ceil((y - lattice.origin[1]) / lattice.cell - 0.5)) - 1
                if j >= 0:
                    crossings[i, min(j, lattice.shape[1] - 1)] += 1.0
    return crossings
