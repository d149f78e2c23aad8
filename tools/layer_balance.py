"""The plastic between two layers of a part against the height that lies between them, where walls and skins are laid; and whether
the outer walls of a part that stands on others lie on plastic.

Sparse infill, bridges and supports have room beside them and are left out, as are columns with nothing just below.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import pi

import numpy as np

from machine.dryrun.interfaces import Bars, Interface, Lattice, Mask, laid, lattice_over
from machine.dryrun.strokes import Beads
from machine.gcode.reader.parsed import ParsedProgram
from mdp.mesh import Floats, Indices
from profiles.profile import Profile
from slicer.paths import Kind

CELL_MM = 0.1
LEAST, MOST = 0.9, 1.1  # plastic over room of a square millimetre that is as it should be
WINDOW_MM = 1.0
LEAST_MM2 = 0.5  # of a window: where less of it has room, as on the tip of a corner, a part of one bead decides
SOLID = (Kind.OUTER_WALL.value, Kind.INNER_WALL.value, Kind.SKIN.value, Kind.TOP_SKIN.value, Kind.GAP.value)
OTHERS = (Kind.SKIRT.value, Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value, Kind.PURGE.value, Kind.IRONING.value)
SAMPLE_MM, FAR_MM, AROUND_MM = 0.1, 1.5, 0.05  # of looks along outer walls, and across them
LEVEL_MM = 0.01  # a layer whose beads differ more in height climbs, as a vase does


@dataclass(frozen=True)
class LayerBalance:
    """A layer's number, its plastic over the room of what it covers, and the shares of its windows over MOST and under LEAST."""

    layer: int
    over_room: float
    over: float
    under: float


@dataclass(frozen=True)
class PartBalance:
    """The layers of a part that lie on others of its own."""

    part: int
    layers: tuple[LayerBalance, ...]

    @property
    def over_room(self) -> float:
        """Mean of the layers."""
        return float(np.mean([layer.over_room for layer in self.layers]))

    @property
    def over(self) -> float:
        """Mean share of windows with too much plastic."""
        return float(np.mean([layer.over for layer in self.layers]))

    @property
    def under(self) -> float:
        """Mean share of windows with too little plastic."""
        return float(np.mean([layer.under for layer in self.layers]))


def layer_balances(program: ParsedProgram, deposited: Beads, profile: Profile) -> Iterator[PartBalance]:
    """The balance of every part, layer by layer, where two layers lie on each other; places are the machine's at its pose."""
    part, layer = program.part[deposited.rows], program.layer[deposited.rows]
    own = ~program.rows_of_types(*OTHERS)[deposited.rows] & (part > 0)
    mm3 = program.e_mm[deposited.rows] * pi * profile.material.diameter_mm**2 / 4.0
    solid = program.rows_of_types(*SOLID)[deposited.rows]
    for index in sorted(set(part[own].tolist())):
        mine = np.flatnonzero(own & (part == index))
        order = mine[np.argsort(layer[mine], kind="stable")]
        groups = np.split(order, np.flatnonzero(np.diff(layer[order])) + 1)
        pairs = (_balance(program, deposited, pair, mm3, solid) for pair in pairwise(groups))
        balances = tuple(balance for balance in pairs if balance is not None)
        if balances:
            yield PartBalance(index, balances)


def _balance(
    program: ParsedProgram, deposited: Beads, pair: tuple[Indices, Indices], mm3: Floats, solid: Mask
) -> LayerBalance | None:
    """The solid beads of the second of a pair of layers on all of the first; None where nothing can be told."""
    before, laid_now = pair[0], pair[1][solid[pair[1]]]
    heights = [program.end[deposited.rows[group], 2] for group in pair]
    if not len(laid_now) or max(float(np.ptp(z_mm)) for z_mm in heights) > LEVEL_MM:
        return None
    layer, below = (_bars(program, deposited, group) for group in (laid_now, before))
    lattice = lattice_over(np.concatenate([layer.begin, layer.end])[:, :2], CELL_MM)
    plastic = laid(layer, mm3[laid_now], lattice)
    there = (plastic > 0.0) & (laid(below, np.ones(len(before)), lattice) > 0.0)
    column_mm3 = float(heights[1][0] - heights[0][0]) * lattice.column_mm2
    ratio = over_room(plastic, np.where(there, column_mm3, np.nan), lattice)
    told = ratio[np.isfinite(ratio)]
    if not len(told):
        return None
    whole = float(plastic[there].sum()) / (column_mm3 * float(there.sum()))
    number = int(program.layer[deposited.rows[laid_now[0]]])
    return LayerBalance(number, whole, float((told > MOST).mean()), float((told < LEAST).mean()))


def _bars(program: ParsedProgram, deposited: Beads, which: Indices) -> Bars:
    """Some beads as wide as they are told to be; the bars of neighbours overlap by what their round sides leave."""
    rows, up = deposited.rows[which], np.zeros((len(which), 3))
    return Bars(program.start[rows, :3], program.end[rows, :3], up, 0.5 * deposited.width_mm[which], deposited.height_mm[which])


def wall_edges(face: Interface) -> tuple[Mask, Floats]:
    """At places SAMPLE_MM apart along an interface's outer walls: (n,) whether an earlier part reaches up to them near their
    middle, and (n,) how far inside their outer edge it ends, mm; inf where it is farther than FAR_MM.
    """
    walls, side = face.walls, face.walls.end[:, :2] - face.walls.begin[:, :2]
    length = np.hypot(*side.T)
    counts = np.ceil(length / SAMPLE_MM).astype(np.int64)
    which = np.repeat(np.arange(len(length)), counts)
    share = (np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[which]
    middle = walls.begin[which, :2] + share[:, None] * side[which]
    across = np.column_stack([-side[:, 1], side[:, 0]])[which] / length[which, None]
    steps = np.arange(-FAR_MM, AROUND_MM, 0.5 * face.lattice.cell)
    held, ends = [], []
    for outward in (across, -across):
        edge = middle + walls.half[which, None] * outward
        outer = ~_at(face.section, edge + 2.0 * AROUND_MM * outward, face.lattice)
        way = edge[outer, None] + steps[:, None] * outward[outer, None]
        there = _at(face.touching, way, face.lattice)
        last = len(steps) - 1 - there[:, ::-1].argmax(axis=1)
        beside = middle[outer, None] + np.array([-2.0 * AROUND_MM, 0.0, 2.0 * AROUND_MM])[:, None] * outward[outer, None]
        held.append(_at(face.touching, beside, face.lattice).any(axis=1))
        ends.append(np.where(there.any(axis=1), np.maximum(-steps[last], 0.0), np.inf))
    return np.concatenate(held), np.concatenate(ends)


def _at(mask: Mask, points: Floats, lattice: Lattice) -> Mask:
    """Whether the columns of (..., 2) points are marked."""
    i, j = np.moveaxis(((points - lattice.origin) / lattice.cell).astype(np.int64), -1, 0)
    found: Mask = mask[i.clip(0, lattice.shape[0] - 1), j.clip(0, lattice.shape[1] - 1)]
    return found


def balance_map(face: Interface) -> Floats:
    """(nx, ny) plastic over room in the square millimetre around each column of an interface; nan outside."""
    return over_room(face.plastic, np.where(face.touching & face.section, face.room, np.nan), face.lattice)


def window_sums(values: Floats, lattice: Lattice) -> Floats:
    """For each column the sum over the square of WINDOW_MM around it."""
    reach = max(1, round(0.5 * (WINDOW_MM / lattice.cell - 1.0)))
    padded = np.pad(values, ((reach + 1, reach), (reach + 1, reach)))
    sums = padded.cumsum(axis=0).cumsum(axis=1)
    wide = 2 * reach + 1
    whole: Floats = sums[wide:, wide:] - sums[:-wide, wide:] - sums[wide:, :-wide] + sums[:-wide, :-wide]
    return whole


def over_room(plastic: Floats, room: Floats, lattice: Lattice) -> Floats:
    """Plastic over room in the square millimetre around each column with room, mm3 both; nan where there is too little to tell.

    room: mm3 of each column, nan where it is none.
    """
    there = np.isfinite(room)
    covered = window_sums(there * lattice.column_mm2, lattice)
    mm3 = window_sums(np.where(there, room, 0.0), lattice)
    enough = there & (covered >= LEAST_MM2 * WINDOW_MM**2) & (mm3 > 1e-9)
    return np.where(enough, window_sums(np.where(there, plastic, 0.0), lattice) / np.where(enough, mm3, 1.0), np.nan)
