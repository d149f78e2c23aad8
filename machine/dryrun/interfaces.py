"""Interfaces: where a part stands on others: how much of its section is in contact, and the plastic that its room gets.

The room of a column reaches from the tip of that first layer down to what earlier parts have left there, in the part's own
frame: bars as high as their layers and as wide as their plastic makes them, at whatever slant they were laid.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from machine.dryrun.columns import NOTHING, Bars, Lattice, Mask, inside_loops, laid, lattice_over, tops
from machine.dryrun.findings import Finding, at_row
from machine.dryrun.strokes import Beads, parts_on_plate, turned_box
from machine.gcode.reader.parsed import ParsedProgram
from mdp.mesh import Floats, Indices
from mdp.pose import Pose, rotation
from profiles.profile import Profile
from slicer.paths import Kind

CELL_MM = 0.05
AT_THE_EDGE = (Kind.OUTER_WALL.value, Kind.OVERHANG.value)
NO_PART = (Kind.SKIRT.value, Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value, Kind.PURGE.value, Kind.IRONING.value)
NEAR = 1.5  # heights of a bead: what lies farther below its tip it does not touch
LEAST_TOLD, MOST_TOLD, LEAST_TOLD_MM2 = 0.75, 1.4, 10.0  # of all of it: steps of slanted layers leave a tenth open or taken
LEAN, RICH = 0.1, 1.1  # the leanest tenth of a layer's beads; what has so much more makes up for what oozed
REACH_MM = 2.0  # from the plane of the tip, of plastic that can matter


@dataclass(frozen=True, eq=False)
class Interface:
    """What lies below a part's first layer; row: of its first stroke. Arrays are (nx, ny), one entry a column of the lattice.

    section: what the layer's walls enclose and its beads cover; touching: where earlier parts reach up to its beads; bead:
    where one of those lies; room, plastic: mm3 under the tip, and laid. walls: the beads that may lie at the section's edge.
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
    """The sums over an interface. area_mm2: of its section; contact: share of the section where a bead lies on an earlier part;
    over_room: plastic over room of all of the section that has something below it; beads_over_room: of the beads alone that lie
    on something; touching_mm2: area of the section that earlier parts reach up to."""

    part: int
    row: int
    area_mm2: float
    contact: float
    over_room: float
    beads_over_room: float
    touching_mm2: float


def balance_of(face: Interface) -> InterfaceBalance:
    """The sums over an interface."""
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
    """Plastic over room of some columns."""
    return float(face.plastic[there].sum() / max(float(face.room[there].sum()), 1e-9))


def findings(program: ParsedProgram, balances: Sequence[InterfaceBalance], profile: Profile) -> Iterator[Finding]:
    """A warning of code room for every part whose first layer has far more or less plastic than its flow puts into its room."""
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
    """which: beads of the first layer, and which of the beads before it belong to earlier parts; turn: into the part's frame."""
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
    """(m,) what the first strokes of a layer have beyond its leanest ones, up to what oozed while the table turned: that is
    missing in the nozzle and fills no room.
    """
    width_mm, height_mm = deposited.sizes[deposited.size[first]].T
    nominal_mm3 = width_mm * height_mm * deposited.length_mm[first]
    lean = float(np.quantile(mm3 / np.maximum(nominal_mm3, 1e-9), LEAN))
    beyond = np.maximum(mm3 - RICH * lean * nominal_mm3, 0.0).cumsum()
    return np.diff(np.minimum(beyond, spare_mm3), prepend=0.0)


def _filament_mm2(profile: Profile) -> float:
    return pi * profile.material.diameter_mm**2 / 4.0


def _bars(program: ParsedProgram, deposited: Beads, which: Indices, turn: Floats, profile: Profile) -> Bars:
    """Some beads as bars in a turned frame, as wide as their plastic makes them at their height."""
    segments, rows = deposited.segments(which), deposited.rows[which]
    begin, end = (segments[:, side] @ turn.T for side in (0, 1))
    height, length = deposited.sizes[deposited.size[which], 1], np.maximum(deposited.length_mm[which], 1e-9)
    mm3 = program.e_mm[rows] * _filament_mm2(profile)
    return Bars(begin, end, deposited.directions(which) @ turn.T, 0.5 * mm3 / length / height, height)


def _outer_loops(bars: Bars, program: ParsedProgram, rows: Indices) -> Floats:
    """(n, 4) sides of the closed ways that outer walls take, pieces of them that hang over included."""
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
