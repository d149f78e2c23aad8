"""Ground: every move in order against the plastic laid before it: does the head run into it, does a bead lie on it or in it.

For each stretch of moves at one pose the earlier plastic is turned into the machine frame and laid into a field of heights; then
the stretch's own moves follow one by one. A bead is carried by what lies under it or beside it along the direction of that
moment; its room is taken when plastic already reaches its top along its middle and to one side at least.
"""

from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.field import NOTHING, Field, empty, laid, sloped_depth
from machine.dryrun.stretches import Stretch, stretches
from machine.kinematics.table import machine_points
from machine.parsed import MoveKind, ParsedProgram
from mdp.kernel import kernel, part
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.machine import Machine
from profiles.profile import Profile
from slicer.paths import Kind

STEP_MM = 0.5
ROUGH = 0.5  # of half a bead: by how much earlier plastic, seen from another side, may seem to stand higher than it does
SLACK_MM = 0.4  # the head may dip so deep without a finding: beads are round, their places rounded
INNER = 0.35  # of the bead's width: where what lies under it is looked for
OWN = 3.0  # so many widths back along its path the plastic is the bead's own beginning
MOST_TURNED = 100_000_000  # segments turned into the frames of all stretches together
HELD_OFF = (Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value, Kind.SKIRT.value)


@dataclass(frozen=True, eq=False)
class Laid:
    """What was deposited: (m, 2, 3) segments in the workpiece frame, (m,) their rows, widths and heights."""

    segments_mm: Floats
    rows: NDArray[np.int64]
    width_mm: Floats
    height_mm: Floats


@dataclass(frozen=True, eq=False)
class Ground:
    """(n,) for the rows of a program: depth of the head in earlier plastic, lengths in air and in taken room, mm.

    beside_mm: lengths that only what lies beside them carries.

    untested_row: the first row that was not tried, where the table turns too often; -1: all were.
    """

    depth_mm: Floats
    air_mm: Floats
    taken_mm: Floats
    beside_mm: Floats
    untested_row: int


def beads(program: ParsedProgram, segments: Floats, rows: NDArray[np.int64], profile: Profile) -> Laid:
    """Widths and heights as the program's comments tell, else by the profile's layer and the filament pushed."""
    process = profile.process
    first = segments[:, :, 2].max(axis=1, initial=0.0) <= process.first_layer_height_mm + 1e-3
    usual = np.where(first, process.first_layer_height_mm, process.layer_height_mm)
    height = np.where(program.height_mm[rows] > 0, program.height_mm[rows], usual)
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    area = program.e_mm[rows] * pi * profile.material.diameter_mm**2 / 4.0 / np.maximum(length, 1e-9)
    by_flow = np.clip(area / height + height * (1.0 - pi / 4.0), profile.machine.head.nozzle_mm, 4.0 * height + 2.0)
    width = np.where(program.width_mm[rows] > 0, program.width_mm[rows], by_flow)
    return Laid(segments, rows, width, height)


def walk(program: ParsedProgram, deposited: Laid, profile: Profile) -> Ground:
    """Go through all moves of a program in order."""
    machine, count = profile.machine, len(program.line)
    found = Ground(np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count), -1)
    if not len(deposited.rows):
        return found
    half, height = np.zeros(count), np.zeros(count)
    half[deposited.rows], height[deposited.rows] = 0.5 * deposited.width_mm, deposited.height_mm
    held = np.array([name in HELD_OFF for name in program.types], dtype=np.bool_)[program.type]
    extruded = program.kind == MoveKind.EXTRUDE
    joined = np.all(program.start[1:] == program.end[:-1], axis=1) & extruded[1:] & extruded[:-1]
    path = np.cumsum(np.concatenate([[True], ~joined])).astype(np.int32)
    done = np.cumsum(np.linalg.norm((program.end - program.start)[:, :3], axis=1))
    ups, turned = np.zeros((len(deposited.rows), 3)), 0
    process = profile.process
    gap = max(process.support_gap_mm, process.support_bottom_gap_mm, process.pedestal_gap_mm, process.brim_gap_mm)
    for stretch in stretches(program):
        before, after = np.searchsorted(deposited.rows, (stretch.rows[0], stretch.rows[-1] + 1))
        ups[before:after] = rotation(machine, stretch.pose)[2]
        turned += before
        if turned > MOST_TURNED:
            return replace(found, untested_row=int(stretch.rows[0]))
        field = _field(deposited, int(before), int(after), stretch, ups, machine)
        if field is not None:
            measured = (found.depth_mm, found.air_mm, found.taken_mm, found.beside_mm)
            plate, first = _plate(machine, stretch.pose), int(stretch.rows[0])
            told = (half, height, path, done, held)
            _walked(
                stretch.rows, program.start, program.end, extruded, *told, first, gap, plate, field, *head_of(machine), *measured
            )
    return found


def head_of(machine: Machine) -> tuple[Floats, Floats]:
    """(k, 2) silhouette and (j, 6) boxes as the kernels take them."""
    boxes = np.array([[*box.min_mm, *box.max_mm] for box in machine.head.boxes]).reshape(-1, 6)
    return np.array(machine.head.silhouette_mm, dtype=np.float64), boxes


def _field(deposited: Laid, before: int, after: int, stretch: Stretch, ups: Floats, machine: Machine) -> Field | None:
    """The field of a stretch with all earlier plastic in it; None where nothing was or will be laid."""
    if after == 0:
        return None
    ends = machine_points(machine, stretch.pose, deposited.segments_mm[:after].reshape(-1, 3)).reshape(-1, 2, 3)
    low, high = (
        edge - 3.0 * sign for edge, sign in ((ends[:, :, :2].min(axis=(0, 1)), 1), (ends[:, :, :2].max(axis=(0, 1)), -1))
    )
    field = empty(low, high)
    if before:
        now, width, height = rotation(machine, stretch.pose)[2], deposited.width_mm[:before], deposited.height_mm[:before]
        along = ups[:before] @ now
        across = np.sqrt(np.maximum(0.0, 1.0 - along**2))
        middle = rotation(machine, stretch.pose) @ (ups[:before] * (0.5 * height)[:, None]).T
        earlier = ends[:before] - middle.T[:, None, :]
        earlier[:, :, 2] += (0.5 * np.abs(along) * height + 0.5 * across * width)[:, None]
        _settled(earlier, np.minimum(0.5 * width, 0.5 * width * along**2 + 0.5 * height * across), deposited.rows[:before], field)
    return field


def _plate(machine: Machine, pose: Pose) -> Floats:
    """(3,) a, b, c of the table's surface z = a x + b y + c in the machine frame; far below where it stands too steep."""
    normal = rotation(machine, pose) @ UP
    if normal[2] < 0.5:
        return np.array([0.0, 0.0, NOTHING])
    centre = machine_points(machine, pose, np.zeros((1, 3)))[0]
    return np.array([-normal[0] / normal[2], -normal[1] / normal[2], float(normal @ centre) / normal[2]])


@kernel
def _settled(ends, half, rows, field):  # type: ignore[no-untyped-def]
    """Lay (m, 2, 3) beads into a field."""
    for i in range(len(ends)):
        laid(ends[i, 0], ends[i, 1], half[i], rows[i], field)


@part
def _lies(x, y, z, row, strict, first, gap, at, height, path, done, held, half, field):  # type: ignore[no-untyped-def]
    """Under a place of a bead whose top is z: 0 nothing, 1 plastic that carries it, 2 plastic that takes its room.

    strict: only what reaches into the bead's own layer carries it (what lies beside it). at: how far along all moves it is.
    """
    i, j = int(np.floor((x - field.origin[0]) / field.cell)), int(np.floor((y - field.origin[1]) / field.cell))
    if i < 0 or j < 0 or i >= field.shape[0] or j >= field.shape[1]:
        return 0
    k = i * field.shape[1] + j
    top, owner, h = field.top[k], field.owner[k], height[row]
    if owner >= first and path[owner] == path[row] and at - done[owner] < 2.0 * OWN * half[row] and top > z - 0.5 * h:
        top = field.below[k]
        if top < z - 4.0 * h:
            return 0
        owner = row
    if top > (z - 0.3 * h if owner >= first else z + ROUGH * half[row]):
        return 2
    reach = 0.6 * h if strict else 1.6 * h
    if not strict and owner >= 0 and owner < first:
        reach += half[row]
    if not strict and (held[row] or (owner >= 0 and held[owner])):
        reach += gap
    return 1 if top > z - reach else 0


@part
def _carried(x, y, z, nx, ny, row, first, gap, at, height, path, done, held, half, plate, field):  # type: ignore[no-untyped-def]
    """0: a bead hangs in air, 1: lies on something, 2: its room is taken, 3: only has a neighbour; nx, ny: to its side."""
    taken, carried = 0, 0
    for k in range(-1, 2):
        off = 2.0 * INNER * half[row] * k
        found = _lies(x + off * nx, y + off * ny, z, row, False, first, gap, at, height, path, done, held, half, field)
        taken += (2 if k == 0 else 1) if found == 2 else 0
        carried += 1 if found == 1 else 0
    if taken > 2:
        return 2
    if carried > 0 or abs(z - height[row] - plate[0] * x - plate[1] * y - plate[2]) < 0.6 * height[row]:
        return 1
    if taken > 0:
        return 3
    off = half[row] + 0.75 * field.cell + 0.1 * height[row]
    for k in range(-1, 2, 2):
        if _lies(x + k * off * nx, y + k * off * ny, z, row, True, first, gap, at, height, path, done, held, half, field) > 0:
            return 3
    return 0


@kernel
def _walked(rows, start, end, extruded, half, height, path, done, held, first, gap, plate, field, silhouette, boxes, depth, air, taken, next_to):  # type: ignore[no-untyped-def] # fmt: skip # noqa: E501
    """Try each row of a stretch against the field, then lay it."""
    for row in rows:
        a, b = start[row], end[row]
        slack = 2.0 * half[row] if extruded[row] else SLACK_MM
        depth[row] = sloped_depth(a, b, slack, field, silhouette, boxes)
        if not extruded[row]:
            continue
        dx, dy = b[0] - a[0], b[1] - a[1]
        across = np.sqrt(dx * dx + dy * dy)
        length = np.sqrt(across * across + (b[2] - a[2]) ** 2)
        count = int(length / STEP_MM) + 1
        if across > 1e-9:
            for k in range(count):
                t = (k + 0.5) / count
                x, y, z = a[0] + t * dx, a[1] + t * dy, a[2] + t * (b[2] - a[2])
                at = done[row] - (1.0 - t) * length
                found = _carried(
                    x, y, z, -dy / across, dx / across, row, first, gap, at, height, path, done, held, half, plate, field
                )
                if found == 0:
                    air[row] += length / count
                elif found == 2:
                    taken[row] += length / count
                elif found == 3:
                    next_to[row] += length / count
        laid(a, b, half[row], row, field)
