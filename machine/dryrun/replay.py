"""Replay: plays every move against the plastic before it: collisions of the head, beads in air and overlapping beads.

For each run of moves at one pose the earlier plastic is rotated into the machine frame and put into a height field; then the
moves of the run follow one by one. Plastic below a bead or beside it, along its direction, carries it; a bead overlaps if plastic
already reaches its top along its centre and on at least one side.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.height_field import NOTHING, Field, depth_of, empty_field, highest_first, lay_bead
from machine.dryrun.strokes import CROSSING_MM, LEVEL_SLACK_MM, SLACK_MM, Beads, Moves, Strokes, moves_of, strokes_of, turned_box
from machine.gcode.reader.parsed import Indices32, MoveKind, ParsedProgram, pose_runs
from machine.kinematics.table import machine_points
from mdp.head import Head, head_of
from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation, shift
from profiles.machine import Machine
from profiles.profile import Profile

STEP_MM = 0.5
EVEN = 1e-6
ROUGH = 0.5  # share of half a bead: height by which earlier plastic may appear too high from another direction
INNER = 0.35  # share of the bead's width: where support below it is sought
OWN = 3.0  # widths back along its path within which plastic is the bead's own beginning
FEW_TURNS = 16  # turns of the table; with more, segments are kept in memory, 48 bytes per bead
FARTHEST = 3.0  # heights below a bead, besides half its width and a gap, beyond which plastic surely does not carry it (_under)
ROTATE = int(MoveKind.ROTATE)
MOST_TURNED = 100_000_000  # segments rotated into the frames of all runs together
FREE_END = 0.5  # share of a span: reach of a bead that is held at one end only


class Contacts(NamedTuple):
    """(n,) for the rows of a program: depth of the head in earlier plastic, lengths in air and of overlapping extrusion, mm.

    beside_mm: lengths carried only from the side. Neither includes spans between lines of sparse infill or support below, which
    are bridges. close_mm: missing part of the distance CROSSING_MM between tip and plastic in moves to or from a turn of the
    table. untested_row: the first row that was not tested, because the table turns too often; -1: none.
    """

    depth_mm: Floats
    air_mm: Floats
    overlapping_mm: Floats
    beside_mm: Floats
    close_mm: Floats
    untested_row: int = -1


class Surroundings(NamedTuple):
    """Surroundings of the moves at one pose: its rows begin at `first` and its beads at `first_bead`. gap: distance kept by
    support; plate: (3,) of a x + b y + c; head: the bodies that may collide."""

    field: Field
    head: Head
    first: int
    first_bead: int
    gap: float
    plate: Floats


def replay(program: ParsedProgram, deposited: Beads, profile: Profile) -> Contacts:
    """Replay all moves of a program in order."""
    machine, count = profile.machine, len(program.line)
    contacts = Contacts(*np.zeros((5, count)))
    if not len(deposited.rows):
        return contacts
    strokes, moves, head = strokes_of(program), moves_of(program, deposited, profile), head_of(machine)
    turned = 0
    many_turns = np.count_nonzero(program.kind == MoveKind.ROTATE) > FEW_TURNS
    segments = deposited.segments() if many_turns else None  # computed once for all runs; else for each, which saves memory
    process = profile.process
    raft_gap_mm = process.raft_contact_distance_mm if process.raft_layers else 0.0
    gap = max(process.support_gap_mm, process.support_bottom_gap_mm, process.pedestal_gap_mm, process.brim_gap_mm, raft_gap_mm)
    width_mm, height_mm = deposited.sizes.max(axis=0)
    below_mm = CROSSING_MM + 0.5 * width_mm + FARTHEST * height_mm + gap  # lower plastic does not affect the moves of a run
    for run, pose in pose_runs(program):
        before, after = (int(at) for at in np.searchsorted(deposited.rows, (run.start, run.stop)))
        turned += before
        if turned > MOST_TURNED:
            return contacts._replace(untested_row=run.start)
        if after:
            least_mm = min(float(side[run, 2].min()) for side in (program.start, program.end)) - below_mm
            field = _field(deposited, segments, (before, after), (pose, least_mm), machine)
            about = Surroundings(field, head, run.start, before, gap, _plate(machine, pose))
            _replay_run(moves, strokes, about, contacts, np.zeros((run.stop - run.start, 2)))
            del field, about  # before the next one is made
    return contacts


def _field(
    deposited: Beads, segments: Floats | None, laid: tuple[int, int], place: tuple[Pose, float], machine: Machine
) -> Field:
    """The height field of a run at one pose with all earlier plastic that the run may meet.

    segments: of all beads, None: computed here. laid: numbers of beads before the run and after it. place: its pose, and the
    height below which plastic is omitted.
    """
    (before, after), (pose, least_mm) = laid, place
    turn = np.column_stack([rotation(machine, pose), shift(machine, pose)])
    extent = np.array([[np.inf] * 2, [-np.inf] * 2])
    for some, box in deposited.boxes(after):
        least, most = turned_box(box, turn)[:, :2]
        if (least >= extent[0]).all() and (most <= extent[1]).all():
            continue
        _widen(extent, deposited.segments(some) if segments is None else segments[some], turn)
    field = empty_field(extent[0] - 3.0, extent[1] + 3.0)
    thick_mm = np.array([0.5, 1.0]) @ deposited.sizes.max(axis=0)
    for some, box in deposited.boxes(before):
        if turned_box(box, turn)[1, 2] + thick_mm < least_mm:
            continue
        own = deposited.segments(some) if segments is None else segments[some]
        mine = (own, deposited.rows[some], deposited.sizes, deposited.size[some])
        _lay_turned(*mine, deposited.directions(some), turn, least_mm, field)
    return highest_first(field)


@kernel
def _widen(extent: Floats, segments: Floats, turn: Floats) -> None:
    """Widen (2, 2) least and greatest X Y to the ends of segments transformed by (3, 4)."""
    for i in range(len(segments)):
        for side in range(2):
            x, y, z = segments[i, side, 0], segments[i, side, 1], segments[i, side, 2]
            for k in range(2):
                place = x * turn[k, 0] + y * turn[k, 1] + z * turn[k, 2] + turn[k, 3]
                extent[0, k] = min(extent[0, k], place)
                extent[1, k] = max(extent[1, k], place)


def _plate(machine: Machine, pose: Pose) -> Floats:
    """(3,) a, b, c of the table's surface z = a x + b y + c in the machine frame; far below if it is too steep."""
    normal = rotation(machine, pose) @ UP
    if normal[2] < 0.5:
        return np.array([0.0, 0.0, NOTHING])
    centre = machine_points(machine, pose, np.zeros((1, 3)))[0]
    return np.array([-normal[0] / normal[2], -normal[1] / normal[2], float(normal @ centre) / normal[2]])


@kernel
def _lay_turned(
    segments: Floats,
    rows: NDArray[np.int64],
    sizes: Floats,
    size: Indices32,
    ups: Floats,
    turn: Floats,
    least_mm: float,
    field: Field,
) -> None:
    """Put (m,) beads into a field, transformed by (3, 4), except those below a height; ups: (m, 3) printing directions."""
    ends, middle = table(2, 3), floats(3, 0.0)
    for i in range(len(rows)):
        up = (ups[i, 0], ups[i, 1], ups[i, 2])
        width, height, highest = sizes[size[i], 0], sizes[size[i], 1], -np.inf
        for side in range(2):
            x, y, z = segments[i, side, 0], segments[i, side, 1], segments[i, side, 2]
            highest = max(highest, x * turn[2, 0] + y * turn[2, 1] + z * turn[2, 2] + turn[2, 3])
        if highest + 0.5 * width + height < least_mm:
            continue
        for k in range(3):
            middle[k] = 0.5 * height * (up[0] * turn[k, 0] + up[1] * turn[k, 1] + up[2] * turn[k, 2])
        along = up[0] * turn[2, 0] + up[1] * turn[2, 1] + up[2] * turn[2, 2]
        across = np.sqrt(max(0.0, 1.0 - along * along))
        for side in range(2):
            x, y, z = segments[i, side, 0], segments[i, side, 1], segments[i, side, 2]
            for k in range(3):
                ends[side, k] = x * turn[k, 0] + y * turn[k, 1] + z * turn[k, 2] + turn[k, 3] - middle[k]
            ends[side, 2] += 0.5 * abs(along) * height + 0.5 * across * width
        half = min(0.5 * width, 0.5 * width * along * along + 0.5 * height * across)
        lay_bead(ends[0], ends[1], half, rows[i], field)


@no_nrt
def _under(
    place: tuple[float, float, float, float],
    size: tuple[float, float],
    row: int,
    strict: bool,
    strokes: Strokes,
    about: Surroundings,
) -> int:
    """Test below a position of a bead: 0 nothing, 1 plastic that carries it, 2 plastic in the bead's own place.

    place: x, y, z of the bead's top, and length of all moves up to it. size: half its width, and its height. strict: only plastic
    in the bead's own layer counts (beside it).
    """
    x, y, z, at = place
    field, (half, height) = about.field, size
    i, j = int(np.floor((x - field.origin[0]) / field.cell)), int(np.floor((y - field.origin[1]) / field.cell))
    if i < 0 or j < 0 or i >= field.shape[0] or j >= field.shape[1]:
        return 0
    k = i * field.shape[1] + j
    column = field.cells[k]
    top, owner = column.top, column.owner - 1
    if owner < 0:
        return 0
    same_path = owner >= about.first and strokes.path[owner] == strokes.path[row]
    if same_path and at - strokes.way[owner] < 2.0 * OWN * half and top > z - 0.5 * height:
        top = column.below
        if top < z - 4.0 * height:
            return 0
        owner = row
    if top > (z - 0.3 * height if owner >= about.first else z + ROUGH * half):
        return 2
    reach = 0.6 * height if strict else 1.6 * height
    if not strict and owner < about.first:
        reach += half
    if not strict and (strokes.stands_off[row] or strokes.stands_off[owner]):
        reach += height * np.ceil(about.gap / height - EVEN)  # support ends with a layer: its gap is rounded up to whole layers
    return 1 if top > z - reach else 0


@no_nrt
def _classify_support(
    place: tuple[float, float, float, float],
    size: tuple[float, float],
    side: tuple[float, float],
    row: int,
    strokes: Strokes,
    about: Surroundings,
) -> int:
    """Classify a bead: 0 in air, 1 carried, 2 overlapping, 3 with only a neighbour; side: unit vector across."""
    x, y, z, at = place
    (half, height), plate = size, about.plate
    middle = _under(place, size, row, False, strokes, about)
    if middle == 1:  # nearly everywhere: the sides do not matter then
        return 1
    overlapping, bearing = (1 if middle == 2 else 0), 0
    for k in range(-1, 2, 2):
        off = 2.0 * INNER * half * k
        under = _under((x + off * side[0], y + off * side[1], z, at), size, row, False, strokes, about)
        overlapping += 1 if under == 2 else 0
        bearing += 1 if under == 1 else 0
    if middle == 2 and overlapping > 1:
        return 2
    if bearing > 0 or abs(z - height - plate[0] * x - plate[1] * y - plate[2]) < 0.6 * height:
        return 1
    if overlapping > 0:
        return 3
    off = half + 0.75 * about.field.cell + 0.1 * height
    for k in range(-1, 2, 2):
        if _under((x + k * off * side[0], y + k * off * side[1], z, at), size, row, True, strokes, about) > 0:
            return 3
    return 0


@no_nrt
def _free_mm(most: float, held: float) -> float:
    """Allowed length of the last stretch of a path; 0 for a path that is carried nowhere."""
    return FREE_END * most if held == 1.0 else 0.0


@no_nrt
def _settle(stretch: tuple[int, int, float], begin: int, pending: Floats, contacts: Contacts) -> None:
    """End a stretch of beads with nothing below them. stretch: its first and last row, and the excess of its length over the
    allowed span. pending: (n, 2) for each row from `begin` its length in air, and with only a neighbour."""
    first, last, over_mm = stretch
    for row in range(first, last + 1):
        for k in range(2):
            mm = pending[row - begin, k]
            if mm == 0.0:  # memory that is not written is not used
                continue
            pending[row - begin, k] = 0.0
            if over_mm > 0.0:
                if k == 0:
                    contacts.air_mm[row] += mm
                else:
                    contacts.beside_mm[row] += mm


@kernel
def _replay_run(moves: Moves, strokes: Strokes, about: Surroundings, contacts: Contacts, pending: Floats) -> None:
    """Test each row of a run against the field, then lay it; pending: (n, 2) zeros, one for each."""
    _replay_rows(moves, strokes, about, contacts, pending, table(2, 3))


@no_nrt
def _replay_rows(
    moves: Moves, strokes: Strokes, about: Surroundings, contacts: Contacts, pending: Floats, lowered: Floats
) -> None:
    """Kernel of _replay_run; lowered: (2, 3) scratch space for the lowered ends of a move."""
    begin, bead = about.first, about.first_bead
    first, open_mm, most, held = begin, 0.0, 0.0, FREE_END
    for row in range(begin, begin + len(pending)):
        if moves.kind[row] == ROTATE:
            continue
        a, b = moves.start[row], moves.end[row]
        extruded = bead < len(moves.rows) and moves.rows[bead] == row
        slack = moves.sizes[moves.size[bead], 0] if extruded else LEVEL_SLACK_MM if moves.low[row] else SLACK_MM
        depth = depth_of(a, b, slack, about.field, about.head)
        if depth > 0.0:
            contacts.depth_mm[row] = depth
        if moves.crossing[row]:
            for axis in range(3):
                lowered[0, axis], lowered[1, axis] = a[axis] - CROSSING_MM * (axis == 2), b[axis] - CROSSING_MM * (axis == 2)
            contacts.close_mm[row] = depth_of(lowered[0], lowered[1], 0.0, about.field, about.head)
        if not extruded:
            continue
        size = (0.5 * moves.sizes[moves.size[bead], 0], moves.sizes[moves.size[bead], 1])
        bead += 1
        if row > begin and strokes.path[row] != strokes.path[row - 1]:
            _settle((first, row, open_mm - _free_mm(most, held)), begin, pending, contacts)
            first, open_mm, held = row, 0.0, FREE_END
        dx, dy = b[0] - a[0], b[1] - a[1]
        across = np.sqrt(dx * dx + dy * dy)
        length = np.sqrt(across * across + (b[2] - a[2]) ** 2)
        count = int(length / STEP_MM) + 1
        if across > 1e-9:
            side = (-dy / across, dx / across)
            for k in range(count):
                t = (k + 0.5) / count
                way = strokes.way[row] - (1.0 - t) * length
                support = _classify_support(
                    (a[0] + t * dx, a[1] + t * dy, a[2] + t * (b[2] - a[2]), way), size, side, row, strokes, about
                )
                if support in (0, 3):
                    span = moves.spans[moves.remark[row]]
                    most = span if open_mm == 0.0 else min(most, span)
                    pending[row - begin, support // 3] += length / count
                    open_mm += length / count
                else:
                    _settle((first, row, open_mm - held * most), begin, pending, contacts)
                    first, open_mm, held = row, 0.0, 1.0
                    if support == 2:
                        contacts.overlapping_mm[row] += length / count
        lay_bead(a, b, size[0], row, about.field)
    _settle((first, begin + len(pending) - 1, open_mm - _free_mm(most, held)), begin, pending, contacts)
