"""Resume: where an interrupted print continues, and how the tip gets there.

Three cases, by the printer's own reports: it has finished its queue and is at the end of a line (nothing is repeated), it has not
restarted and knows its position (the tip travels back), or it has restarted (the axes are set to their last positions, the tip
rises along the nozzle, X and Y are homed). Z and the table are never homed onto a print.

A restart shows in the firmware's greeting, in line numbers that begin again, or in a position without homing: 0 0 0, or Marlin's
home positions (profiles.machine.Machine.home).
"""

from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from machine.firmware import dialect_of
from machine.gcode.modes import E_AXIS, ModalState, axes_of
from machine.kinematics.collision import Printed
from machine.link.journal import EVERY_LINES, Checkpoint
from machine.link.line_history import shifts
from machine.link.pause.park_moves import (
    axis_position,
    filament_commands,
    heat_commands,
    homed_return_moves,
    homes_z,
    return_moves,
)
from machine.link.pause.printed_bounds import PrintedBounds
from machine.link.pending_commands import KEEPS_OFFSET
from machine.link.print_state import PrintState, ProgramPosition
from machine.link.protocol.framing import command_of
from machine.link.status import SEVERAL, PrinterStatus
from machine.planning.stand import Turn
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.errors import FirmwareError, JournalError, PrinterError, SilenceError
from profiles.machine import Machine
from profiles.messages import key_name, option, phrase
from profiles.profile import Profile

TOO_LITTLE = "hardly anything was printed: the program begins again"
PARKED = (PrintState.PAUSED, PrintState.CANCELLED)  # states in which the journal's pose is the parking position
MOVING = (PrintState.PAUSING, PrintState.RESUMING)
HOME_IT = (
    f"state in {key_name('machine.gcode.resume')} of a profile of this machine how it is homed with a print on it "
    "(docs/serial.md), and name "
    f"that profile {phrase('homed as in', 'with --machine')}"
)
AGAIN = phrase("again", "resume can be tried again")
NO_ANSWER = (
    f"the printer did not answer when it was asked where it stands: is it switched on, is {option('baud')} the "
    "firmware's rate, does it "
    f"still heat or move? Nothing was changed: when it has come to rest, {AGAIN}"
)
FAULTY = (
    "the printer does not say where it stands, but reports: {}. Nothing was changed: when that is put right (Klipper's "
    f"FIRMWARE_RESTART, another firmware's reset), {AGAIN}"
)
UNSURE_MM = 0.005
SAME = 0.02  # mm or deg: M114 reports hundredths
HOME_KEYS = ("x.home_mm", "y.home_mm", "z.home_mm", "tilt.home_deg", "turn.home_deg")
NUMBERS_AHEAD = 4096  # least excess over the recorded line number that is implausible: queries have numbers too


@dataclass(frozen=True)
class ResumePoint:
    """The place where a resumed print continues."""

    line: int  # first line of the program to send
    before: tuple[str, ...]  # commands before it
    reason: str = ""  # in words
    homes: bool = False  # X and Y
    z_offset_mm: float = 0.0  # that the firmware has after these commands
    shifts_z: bool = True  # whether the firmware can change it

    def check_offset(self, babystep: str) -> None:
        """Raise PrinterError if the firmware cannot set the Z offset. babystep: its command for that, "": it has none."""
        if self.z_offset_mm and not babystep:
            offset = f"{self.z_offset_mm:+g} mm"
            raise PrinterError(f"the print had a Z offset of {offset}, which this firmware cannot set: nothing was moved")


@dataclass(frozen=True)
class InterruptedPrint:
    """An interrupted print, from its journal and its program."""

    line: int  # first line not surely executed
    last: int
    modal: ModalState  # before that line
    position: ProgramPosition
    printed: Printed
    stroked: bool  # anything was printed before
    ahead: Mapping[int, ModalState]  # line -> the state after its command, which may have been executed since
    checkpoint: Checkpoint
    stood_mm: float | None = None  # the tip's height that the user has measured


def read_interrupted_print(lines: Iterable[str], checkpoint: Checkpoint, profile: Profile, limit: int) -> InterruptedPrint:
    """Read a program up to its interruption."""
    modal, position, bounds = ModalState(axes_of(profile.machine)), ProgramPosition(), PrintedBounds(profile.machine)
    first, stroked = checkpoint.executed + 1, False
    before: tuple[ModalState, ProgramPosition] | None = None
    ahead: dict[int, ModalState] = {}
    for number, text in enumerate(lines, 1):
        command = command_of(text, number, limit)
        if before is None and (not command or number < first):
            position.read_comment(text)
        if not command:
            continue
        if number >= first and before is None:
            before = deepcopy(modal), deepcopy(position)
        if (
            before is not None
            and number > checkpoint.sent
            and (number >= checkpoint.sent + EVERY_LINES or shifts(command, modal.axes.letters))
        ):
            break
        _, extruded = bounds.track(modal, command)
        if before is None:
            stroked = stroked or extruded
        else:
            ahead[number] = deepcopy(modal)
    if before is None:
        raise JournalError("all of the program has been executed: there is nothing left to resume")
    last = max(ahead, default=first)
    return InterruptedPrint(first, last, before[0], before[1], bounds.corners(modal.follows), stroked, ahead, checkpoint)


def has_not_restarted(point: InterruptedPrint, status: PrinterStatus) -> bool | None:
    """Whether the printer has not restarted since; None when it does not report it."""
    if status.last_number is None:
        return None
    return point.checkpoint.number > 0 and 0 <= status.last_number - point.checkpoint.number < NUMBERS_AHEAD


def plan_resume(point: InterruptedPrint, status: PrinterStatus, profile: Profile) -> ResumePoint:
    """Choose the resume point. Raises JournalError if continuing would be a guess, FirmwareError or SilenceError if the printer
    has not reported its position."""
    if status.position is None and status.fault:
        raise FirmwareError(FAULTY.format(status.fault))
    if status.position is None and status.last_number is None:
        raise SilenceError(NO_ANSWER)
    offset_mm, babystep = point.checkpoint.z_offset_mm, dialect_of(profile.machine).babystep
    alive = has_not_restarted(point, status)
    begun = stands_as_begun(status, profile.machine)
    standing = _match_position(point, status) if alive or not (begun or status.greeted) else None
    if standing is not None:
        line, modal = standing
        before = (*heat_commands(modal, profile), *modal.lines())
        reason = f"the printer stands where this line begins: nothing is repeated{_offset_in_words(offset_mm)}"
        return ResumePoint(line + 1, before, reason, z_offset_mm=offset_mm, shifts_z=point.checkpoint.shifts_z)
    if not point.stroked:
        # homing resets the offset in most firmwares
        held_mm = offset_mm if babystep.endswith(KEEPS_OFFSET) and not (begun or status.greeted) else 0.0
        words = _offset_in_words(held_mm) if held_mm or not offset_mm else f"; set its Z offset of {offset_mm:+g} mm again"
        return ResumePoint(1, (), f"{TOO_LITTLE}, clear the plate first{words}", z_offset_mm=held_mm)
    _check(point, profile)
    span = f"lines {point.line} to {point.last} may have been printed already"
    at = _reported_position(point, status) if alive or (alive is None and not begun) else None
    if at is not None and not status.greeted:
        reason = f"the printer has not restarted and knows its place; {span}{_offset_in_words(offset_mm)}"
        before = _approach(point, profile, *at)
        return ResumePoint(point.line, before, reason, z_offset_mm=offset_mm, shifts_z=point.checkpoint.shifts_z)
    if not status.greeted:
        _check_begun(status, begun)
    before = _approach(point, profile, *position_at_interruption(point, profile), homes=True)
    again = homes_z(profile.machine)
    words = f"; its Z offset of {offset_mm:+g} mm is {'set again' if again else 'kept'}" if offset_mm else ""
    held_mm = offset_mm if again else 0.0  # else the axis itself has it
    reason = f"the printer has restarted; {span}{words}"
    shifts_z = again or not dialect_of(profile.machine).babystep_homed
    return ResumePoint(point.line, before, reason, homes=True, z_offset_mm=held_mm, shifts_z=shifts_z)


def _offset_in_words(offset_mm: float) -> str:
    """The Z offset that a running printer still has, for the question whether to continue."""
    return f"; it must still have the Z offset of {offset_mm:+g} mm: if you have undone that, answer no" if offset_mm else ""


def _check_begun(status: PrinterStatus, begun: bool) -> None:
    """Refuse a printer whose state is not that of a restart: it may have been homed or moved since. Raises JournalError."""
    if not begun:
        keys = ", ".join(f"{key_name(f'machine.{key}')}" for key in HOME_KEYS)
        raise JournalError(
            f"the printer's line numbers have restarted, but it reports the position {_in_words(status)}: "
            "it was homed or moved since; switch it off and on, move nothing, and resume again. "
            "If it says the same place then, that is where its firmware "
            f"starts: write it as {keys} into a profile of this machine and name that {phrase('homed as in', 'with --machine')}"
        )
    if status.last_number and _nonzero(status):  # at 0 0 0 nothing was homed
        raise JournalError(
            f"the printer has restarted and stands at its home positions, but another program has sent it "
            f"{status.last_number} lines since: it may have been homed; switch it off and on, move nothing, and resume again"
        )


def _check(point: InterruptedPrint, profile: Profile) -> None:
    missing = [letter for letter, value in zip("XYZ", point.modal.at[:3], strict=True) if value is None]
    if missing:
        raise JournalError(f"line {point.line}: where {' '.join(missing)} stand is unknown: the print cannot continue there")
    if profile.machine.coordinates == "workpiece":
        raise JournalError(
            f"{profile.machine.name} follows the table by itself: its print can continue only if the printer has not moved since"
        )


def _match_position(point: InterruptedPrint, status: PrinterStatus) -> tuple[int, ModalState] | None:
    """The first line, from the last surely executed one, that ends at the reported position, and the state after it; None for
    none."""
    if status.position is None:
        return None
    reported = status.position
    for line, modal in ((point.line - 1, point.modal), *point.ahead.items()):
        pairs = [(reported[letter], value) for letter, value in zip(modal.axes.letters, modal.at, strict=True)
                 if value is not None and letter in reported]  # fmt: skip
        known = all(value is not None for value in modal.at[:3])
        if known and all(abs(a - b) <= SAME for a, b in pairs) and sum(abs(b) > SAME for _, b in pairs) >= SEVERAL:
            return line, modal
    return None


def stands_as_begun(status: PrinterStatus, machine: Machine) -> bool:
    """Whether the printer reports the position of a firmware without homing: 0 0 0, or (Marlin) each axis at its home position.

    That is 0, an end of its limits or a value of the profile. True without a reported position. A firmware that does not count
    lines starts at 0 0 0 (Klipper, RepRapFirmware).
    """
    if not _nonzero(status) or status.position is None:
        return True
    if status.last_number is None:
        return False
    reported, letters = status.position, axes_of(machine).letters
    axes: list[tuple[float, ...]] = [(axis.home_mm,) if axis.home_mm is not None else (0.0, *axis.limits_mm)
                                     for axis in (machine.x, machine.y, machine.z)]  # fmt: skip
    for axis in (machine.tilt, machine.turn):
        axes.append((axis.home_deg,) if axis.home_deg is not None else (0.0, axis.zero_deg, *axis.limits_deg))
    axes.append((0.0,))
    pairs = [(reported[letter], starts) for letter, starts in zip(letters, axes, strict=True) if letter in reported]
    return all(any(abs(value - start) <= SAME for start in starts) for value, starts in pairs)


def _nonzero(status: PrinterStatus) -> bool:
    """Whether the printer reports another position than 0 0 0."""
    return status.position is not None and sum(abs(value) > SAME for value in status.position.values()) >= SEVERAL


def _in_words(status: PrinterStatus) -> str:
    return " ".join(f"{letter}{value:g}" for letter, value in (status.position or {}).items())


def _reported_position(point: InterruptedPrint, status: PrinterStatus) -> tuple[Floats, Pose] | None:
    """The position that the printer reports; None if an axis is missing."""
    if status.position is None:
        return None
    reported, letters = status.position, point.modal.axes.letters
    if any(letter not in reported for letter in letters[:3]):
        return None
    tilt, turn = (reported.get(letter, value) for letter, value in zip(letters[3:E_AXIS], point.modal.at[3:E_AXIS], strict=True))
    if tilt is None or turn is None:
        return None
    return np.array([reported[letter] for letter in letters[:3]]), Pose(tilt, turn)


def _goal(point: InterruptedPrint, profile: Profile) -> tuple[Floats, Pose]:
    standing = axis_position(profile.machine, point.modal.coordinates(), False)
    assert standing is not None  # checked by _check
    return standing


def _approach(point: InterruptedPrint, profile: Profile, at: Floats, pose: Pose, homes: bool = False) -> tuple[str, ...]:
    """Heat (the tip may be stuck in the plastic), up, back over the print, down, filament, modes.

    homes: after a restart the axes are set to their positions, the tip rises, X and Y are homed.
    """
    goal, goal_pose = _goal(point, profile)
    pull, push = filament_commands(point.modal, profile)
    heat, way = (*heat_commands(point.modal, profile), *pull, "G90"), Turn(pose, goal_pose, at, goal)
    if homes:
        path = homed_return_moves(profile, point.printed, way, heat, point.checkpoint.z_offset_mm)
    else:
        path = ["G21", "G90", *heat, *return_moves(profile, point.printed, way)]
    return (*path, *push, *point.modal.lines())


def position_at_interruption(point: InterruptedPrint, profile: Profile) -> tuple[Floats, Pose]:
    """Positions of the axes at the interruption, with the Z offset. Raises JournalError when tip or table may have been
    moving."""
    state, known = point.checkpoint.state, [value for value in point.checkpoint.pose[:E_AXIS] if value is not None]
    if state in PARKED and len(known) == E_AXIS:
        return np.array([*known[:2], known[2] + point.checkpoint.z_offset_mm]), Pose(*known[3:])
    if state in MOVING and not profile.machine.gcode.resume:
        raise JournalError(f"the tip was on its way between print and parking place, so its position is unknown; {HOME_IT}")
    states = [point.modal, *point.ahead.values()]
    for axis in (3, 4):
        if len({modal.at[axis] for modal in states}) > 1 and not profile.machine.gcode.resume:
            letter = point.modal.axes.letters[axis]
            where = f"lines {point.line} to {point.last}"
            raise JournalError(f"{where}: the table was turning about {letter}, so its position is unknown; {HOME_IT}")
    at, pose = _goal(point, profile)
    return np.array([at[0], at[1], heights_mm(point)[0]]), pose


def heights_mm(point: InterruptedPrint) -> tuple[float, ...]:
    """Possible heights Z of the tip, with its Z offset, rising; a single one if the user has measured it. Assumed too low, the
    tip prints too high; assumed too high, it ploughs through the print."""
    if point.stood_mm is not None:
        return (point.stood_mm,)
    modals, offset_mm = (point.modal, *point.ahead.values()), point.checkpoint.z_offset_mm
    heights = sorted(z + offset_mm for modal in modals if (z := modal.at[2]) is not None)
    return tuple(z for k, z in enumerate(heights) if k == 0 or z - heights[k - 1] > UNSURE_MM)


def is_in_doubt(way: ResumePoint, point: InterruptedPrint, profile: Profile) -> bool:
    """Whether the user must measure the height: Z is not homed, and the tip was neither parked nor at a single height."""
    parked = point.checkpoint.state in PARKED and None not in point.checkpoint.pose[:E_AXIS]
    return way.homes and not profile.machine.gcode.resume and not parked and len(heights_mm(point)) > 1
