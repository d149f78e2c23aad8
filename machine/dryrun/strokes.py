"""Strokes: a program's rows for the replay: beads with places and sizes, and what each move may touch and span."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.gcode.reader.parsed import Indices32, MoveKind, ParsedProgram, pieces
from machine.kinematics.table import goes_on, workpiece_segments
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from mdp.pose import Pose, rotation
from profiles.machine import Machine
from profiles.profile import Profile
from slicer.bead import infill_cell_mm, support_cell_mm
from slicer.paths import Kind

ROUNDING_MM = 1e-6
SLACK_MM = 0.4  # depth of the head without a finding: beads are round, their positions rounded
LEVEL_SLACK_MM = 0.05  # a travel below the newest bead; plastic there was printed at the same pose
ON_PLATE = 1.5  # heights of a bead: greatest height of its top on the plate
CROSSING_MM = 0.2  # clearance above the print on the way to a turn of the table, or from it to the next bead
ACROSS_MM, WAY_MM = 0.5, 3.0  # a shorter move next to a bead is a wipe
FEWEST_LEVELS = 3  # levels of beads needed to infer a file's layers
SUPPORT = (Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value)
STANDS_OFF = (*SUPPORT, Kind.SKIRT.value)
FILLING = (Kind.SKIN.value, Kind.TOP_SKIN.value, Kind.GAP.value)
# spans: infill that turns at a wall may have a line's end, the joint and the next line's end beyond the cell it crosses
ZIGZAG = 3.0


@dataclass(frozen=True, eq=False)
class Beads:
    """The beads that (m,) rows of a program deposit; their ends and sizes are computed on demand, to save memory.

    sizes: (k, 2) widths and heights, mm; size: (m,) index of each bead's size.
    """

    program: ParsedProgram
    machine: Machine
    rows: NDArray[np.int64]
    sizes: Floats
    size: Indices32

    def segments(self, some: Indices | slice = slice(None)) -> Floats:
        """(k, 2, 3) ends of some beads in the workpiece frame, mm."""
        return workpiece_segments(self.machine, self.program.start, self.program.end, self.rows[some])

    def directions(self, some: Indices | slice = slice(None)) -> Floats:
        """(k, 3) printing directions of some beads in the workpiece frame."""
        begins, ups = self._runs
        which = np.arange(*some.indices(len(self.rows))) if isinstance(some, slice) else some
        printing: Floats = ups[np.searchsorted(begins, which, side="right") - 1]
        return printing

    @cached_property
    def _runs(self) -> tuple[Indices, Floats]:
        """(j,) first beads of runs at one pose, and (j, 3) the printing direction of each run."""
        begins = np.flatnonzero(np.append(True, self.program.turned_between(self.rows))[: len(self.rows)])
        poses = self.program.end[self.rows[begins], 3:].tolist()
        return begins, np.array([rotation(self.machine, Pose(*pose))[2] for pose in poses]).reshape(-1, 3)

    @property
    def width_mm(self) -> Floats:
        """(m,) widths, mm."""
        width_mm: Floats = self.sizes[self.size, 0]
        return width_mm

    @property
    def height_mm(self) -> Floats:
        """(m,) heights, mm."""
        height_mm: Floats = self.sizes[self.size, 1]
        return height_mm

    @property
    def length_mm(self) -> Floats:
        """(m,) lengths, mm."""
        return self._measures[0]

    def boxes(self, count: int | None = None) -> Iterator[tuple[slice, Floats]]:
        """The first `count` beads, by default all, in pieces, each with its bounding box: (2, 3) least and greatest X Y Z."""
        last = len(self.rows) if count is None else count
        return ((slice(some.start, min(some.stop, last)), box) for some, box in self._measures[1] if some.start < last)

    @cached_property
    def _measures(self) -> tuple[Floats, list[tuple[slice, Floats]]]:
        length_mm, boxes = np.empty(len(self.rows)), list[tuple[slice, Floats]]()
        for some in pieces(len(length_mm)):
            segments = self.segments(some)
            length_mm[some] = lengths_of(segments)
            ends = segments.reshape(-1, 3).T
            boxes.append((some, np.transpose([(axis.min(), axis.max()) for axis in ends])))
        return length_mm, boxes


class Strokes(NamedTuple):
    """(n,) for each row: its path, the length of all moves up to its end, and whether it is support, which keeps a gap."""

    path: NDArray[np.int32]
    way: Floats
    stands_off: NDArray[np.bool_]


class Moves(NamedTuple):
    """(n, 5) start and end of each row; (n,) its kind, whether it is below the newest bead, whether it leads to or from a turn of
    the table, and its remark.

    spans: allowed span of beads over sparse infill or support, by remark. rows, sizes, size: of the beads. Separate from Strokes,
    which the innermost functions take: each additional array there slows everything down.
    """

    start: Floats
    end: Floats
    kind: NDArray[np.int8]
    low: NDArray[np.bool_]
    crossing: NDArray[np.bool_]
    remark: Indices32
    spans: Floats
    rows: NDArray[np.int64]
    sizes: Floats
    size: Indices32


def beads_of(program: ParsedProgram, rows: NDArray[np.int64], profile: Profile) -> Beads:
    """The beads of some rows; widths and heights come from the program's comments, else from its layers or the profile, and from
    the filament pushed."""
    remarks, size = program.remarks, program.remark[rows]
    sizes = np.column_stack([remarks.width_mm, remarks.height_mm])
    unsized = np.flatnonzero((np.minimum(remarks.width_mm, remarks.height_mm) <= 0.0)[size])
    beads = Beads(program, profile.machine, rows, sizes, size)
    if not len(unsized):
        return beads
    first_mm, layer_mm = _layers_mm(beads, bool((remarks.height_mm > 0)[size].any()), profile)
    own = np.empty((len(unsized), 2))
    for some in pieces(len(unsized)):
        mine, ends = unsized[some], beads.segments(unsized[some])
        width_mm, height_mm = sizes[size[mine]].T
        usual = np.where(highest_of(ends) <= first_mm + 1e-3, first_mm, layer_mm)
        height = np.where(height_mm > 0, height_mm, usual)
        area = program.e_mm[rows[mine]] * pi * profile.material.diameter_mm**2 / 4.0 / np.maximum(lengths_of(ends), 1e-9)
        by_flow = np.clip(area / height + height * (1.0 - pi / 4.0), profile.machine.head.nozzle_mm, 4.0 * height + 2.0)
        own[some, 0], own[some, 1] = np.where(width_mm > 0, width_mm, by_flow), height
    size[unsized] = len(sizes) + np.arange(len(unsized), dtype=np.int32)
    return replace(beads, sizes=np.concatenate([sizes, own]))


def parts_on_plate(program: ParsedProgram, deposited: Beads) -> list[int]:
    """The parts after part 1 with a first layer on the plate: each begins another model."""
    part, layer = program.remarks[:2]
    used = np.unique(program.remark[deposited.rows])
    lowest = np.full(int(part.max(initial=0)) + 1, np.iinfo(np.int64).max)
    np.minimum.at(lowest, part[used], layer[used])
    begins = (part > 1) & (layer == lowest[part])
    first = np.flatnonzero(begins[program.remark[deposited.rows]])
    of_part = part[program.remark[deposited.rows[first]]]
    high = highest_of(deposited.segments(first)) > ON_PLATE * deposited.sizes[deposited.size[first], 1]
    return sorted(set(of_part.tolist()) - set(of_part[high].tolist()))


def turned_box(box: Floats, turn: Floats) -> Floats:
    """(2, 3) bounding box of a box rotated by a (3, 3) matrix, or transformed by a (3, 4) one."""
    middle = turn[:, :3] @ box.mean(axis=0) + turn[:, 3:].sum(axis=1)
    reach = np.abs(turn[:, :3]) @ np.ptp(box, axis=0) / 2.0 + ROUNDING_MM
    return np.stack([middle - reach, middle + reach])


def highest_of(segments: Floats) -> Floats:
    """(k,) greatest heights of (k, 2, 3) segments."""
    highest_mm: Floats = np.maximum(segments[:, 0, 2], segments[:, 1, 2])
    return highest_mm


def lengths_of(segments: Floats) -> Floats:
    """(k,) lengths of (k, 2, 3) segments."""
    lengths_mm: Floats = np.sqrt(((segments[:, 1] - segments[:, 0]) ** 2).sum(axis=1))
    return lengths_mm


def _layers_mm(beads: Beads, has_heights: bool, profile: Profile) -> tuple[float, float]:
    """Heights of the first and the other layers for beads without a height comment. They are the profile's, or in a file without
    any such comment those of its own level beads."""
    process, most = profile.process, profile.machine.head.nozzle_mm  # a higher step is not a layer
    first, usual = process.first_layer_height_mm, process.layer_height_mm
    if has_heights:
        return first, usual
    levels = np.zeros(0)
    for some in pieces(len(beads.rows)):
        z_mm = beads.segments(some)[:, :, 2]
        levels = np.unique([*levels, *np.round(z_mm[z_mm[:, 0] == z_mm[:, 1], 1], 3)])
    if len(levels) < FEWEST_LEVELS:
        return first, usual
    step = float(np.median(np.diff(levels)))
    return (float(levels[0]) if 0.0 < levels[0] <= most else first), (step if step <= most else usual)


def strokes_of(program: ParsedProgram) -> Strokes:
    """The strokes of a program."""
    path, way = _along(program.start, program.end, program.kind == MoveKind.EXTRUDE)
    return Strokes(path, way, program.rows_of_types(*STANDS_OFF))


@kernel
def _along(start: Floats, end: Floats, extruded: NDArray[np.bool_]) -> tuple[Indices32, Floats]:
    """Columns path and way of Strokes."""
    path, way, paths, way_mm = np.empty(len(start), np.int32), np.empty(len(start)), 0, 0.0
    for row in range(len(start)):
        same_path = extruded[row] and extruded[row - 1] and goes_on(start, end, row)
        x, y, z = end[row, 0] - start[row, 0], end[row, 1] - start[row, 1], end[row, 2] - start[row, 2]
        paths += not same_path
        way_mm += np.sqrt(x * x + y * y + z * z)
        path[row], way[row] = paths, way_mm
    return path, way


def moves_of(program: ParsedProgram, deposited: Beads, profile: Profile) -> Moves:
    """The moves of a program."""
    others = np.flatnonzero(program.kind != MoveKind.EXTRUDE)
    across = np.hypot(*(program.end[others] - program.start[others])[:, :2].T)
    low, crossing = np.zeros((2, len(program.line)), dtype=np.bool_)
    low[_below_last_bead(program, others[across > ACROSS_MM], deposited.rows)] = True
    crossing[_ways_to_turns(program, others[across > WAY_MM], deposited.rows)] = True
    spans, beads = _spans(program, profile), (deposited.rows, deposited.sizes, deposited.size)
    return Moves(program.start, program.end, program.kind, low, crossing, program.remark, spans, *beads)


def _spans(program: ParsedProgram, profile: Profile) -> Floats:
    """Allowed span of a bead, by remark: skin, the cells of sparse infill; support, its own lines; any bead, its own width, as
    walls also bridge slots and teeth narrower than themselves."""
    process = profile.process
    infill_mm, support_mm = infill_cell_mm(process), support_cell_mm(process)
    of_type = {**dict.fromkeys(FILLING, infill_mm), Kind.INFILL.value: ZIGZAG * infill_mm, **dict.fromkeys(SUPPORT, support_mm)}
    of_types = np.array([of_type.get(name, 0.0) for name in program.types])
    spans: Floats = np.maximum(of_types[program.remarks.type], program.remarks.width_mm)
    return spans


def _below_last_bead(program: ParsedProgram, rows: NDArray[np.int64], beads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Travels among some rows that go below the last bead, at the same pose."""
    after = np.searchsorted(beads, rows)
    rows, last = rows[after > 0], beads[after[after > 0] - 1]
    height = np.maximum(program.start[last, 2], program.end[last, 2])
    same_pose = (program.end[rows, 3] == program.end[last, 3]) & (program.end[rows, 4] == program.end[last, 4])
    below: NDArray[np.int64] = rows[
        same_pose & (np.minimum(program.start[rows, 2], program.end[rows, 2]) < height - LEVEL_SLACK_MM)
    ]
    return below


def _ways_to_turns(program: ParsedProgram, rows: NDArray[np.int64], beads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Travels among some rows between the last bead before a turn of the table and the first one after it."""
    turns = np.flatnonzero(program.kind == MoveKind.ROTATE)
    rows = rows[(program.kind[rows] == MoveKind.TRAVEL) & (program.e_mm[rows] >= 0.0)]
    after = np.searchsorted(beads, rows)
    within = (after > 0) & (after < len(beads))
    rows, after = rows[within], after[within]
    next_turn, last_turn = (np.searchsorted(turns, beads[at]) for at in (after, after - 1))
    return rows[next_turn > last_turn]
