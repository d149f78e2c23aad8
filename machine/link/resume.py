"""Resume: where a print that was cut off goes on, and how the tip gets there.

Three cases, told apart by what the printer itself says: it has worked on and stands where a line of the program ends (nothing is
repeated), it has not restarted and knows its place (the tip travels back), it has restarted (the axes are taken to stand where
they stood, the tip rises along the nozzle, X and Y are homed). Z and the table are never homed onto a print.
"""

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from machine.collide import Printed
from machine.link.framing import command_of
from machine.link.inquiry import Found
from machine.link.job import Begin
from machine.link.journal import EVERY_LINES, LEFT, Moment
from machine.link.modal import E_AXIS, Modal, axes_of
from machine.link.park import Laid
from machine.link.progress import Place
from machine.link.retreat import heated, pushing
from machine.link.way import home_way, way_back
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.errors import JournalError, SilenceError
from profiles.profile import Profile

ANEW = "hardly anything was printed: the program begins anew"
AWAY = ("paused", LEFT)  # states in which the journal's pose is where the tip has been taken
ON_THE_WAY = ("pausing", "resuming")
HOME_IT = (
    "write into machine.gcode.resume of a profile of this machine how it is homed with a print on it (docs/serial.md), and name "
    "that profile with --machine"
)
UNHEARD = (
    "the printer did not answer when it was asked where it stands: is it switched on, is --baud the firmware's rate, does it "
    "still heat or move? Nothing was changed: when it has come to rest, resume can be tried again"
)
SEVERAL = 3  # coordinates that are not 0: so many do not agree by chance
SAME = 0.02  # mm or deg: M114 tells hundredths
NUMBERS_AHEAD = 4096  # a printer's last line number beyond the one on record: questions have numbers too


@dataclass(frozen=True)
class Reached:
    """The firmware's state after a command of the program."""

    line: int
    modal: Modal


@dataclass(frozen=True)
class Point:
    """What a journal and its program tell. line: the first one not surely executed; modal: the state before it; ahead: the states
    after the commands that may have been done since; stroked: whether anything was printed before.
    """

    line: int
    last: int
    modal: Modal
    place: Place
    printed: Printed
    stroked: bool
    ahead: tuple[Reached, ...]
    moment: Moment


@dataclass(frozen=True)
class Way:
    """How the print goes on: the first line sent, the commands before it, what is certain about it in words; homes: X and Y."""

    begin: Begin
    certain: str
    homes: bool = False


def point_of(lines: Iterable[str], moment: Moment, profile: Profile, limit: int) -> Point:
    """Read a program up to where its print was cut off."""
    modal, place, laid = Modal(axes_of(profile.machine)), Place(), Laid(profile.machine)
    first, stroked = moment.executed + 1, False
    before: tuple[Modal, Place] | None = None
    ahead: list[Reached] = []
    for number, text in enumerate(lines, 1):
        command = command_of(text, number, limit)
        if not command:
            if text.startswith(";") and before is None:
                place.comment(text)
            continue
        if number >= first and before is None:
            before = deepcopy(modal), deepcopy(place)
        if before is not None and number >= moment.sent + EVERY_LINES:
            break
        _, pushed = laid.follow(modal, command)
        if before is None:
            stroked = stroked or pushed
        else:
            ahead.append(Reached(number, deepcopy(modal)))
    if before is None:
        raise JournalError("all of the program has been executed: there is nothing left to resume")
    last = ahead[-1].line if ahead else first
    return Point(first, last, before[0], before[1], laid.printed(modal.follows), stroked, tuple(ahead), moment)


def alive(point: Point, found: Found) -> bool | None:
    """Whether the printer has not restarted since; None when it does not tell."""
    if found.last_number is None:
        return None
    return point.moment.number > 0 and 0 <= found.last_number - point.moment.number < NUMBERS_AHEAD


def way_on(point: Point, found: Found, profile: Profile) -> Way:
    """Decide. Raises JournalError where going on would be a guess, SilenceError where the printer has told nothing."""
    if found.position is None and found.last_number is None:
        raise SilenceError(UNHEARD)
    standing = _standing(point, found)
    if standing is not None:
        before = (*heated(standing.modal, profile), *standing.modal.lines())
        done = "the printer stands where this line begins: nothing is repeated"
        return Way(Begin(standing.line + 1, before), done)
    if not point.stroked:
        return Way(Begin(1, ()), f"{ANEW}, clear the table of the little there may be")
    _check(point, profile)
    lives = alive(point, found)
    span = f"lines {point.line} to {point.last} may have been printed already"
    at = _told(point, found) if lives or (lives is None and _nonzero(found)) else None
    if at is not None:
        before = _before(point, profile, *at)
        return Way(Begin(point.line, before), f"the printer has not restarted and knows its place; {span}")
    if lives is not None and _nonzero(found):
        raise JournalError(
            f"the printer has not counted its lines on since the print, but stands at {_in_words(found)}: it was moved; "
            "if it was not, switch the printer off and on first"
        )
    before = _before_homed(point, profile)
    return Way(Begin(point.line, before), f"the printer has restarted; {span}", homes=True)


def _check(point: Point, profile: Profile) -> None:
    missing = [letter for letter, value in zip("XYZ", point.modal.at[:3], strict=True) if value is None]
    if missing:
        raise JournalError(f"line {point.line}: the program does not tell where {' '.join(missing)} stand: it cannot go on there")
    if profile.machine.coordinates == "workpiece":
        raise JournalError(
            f"{profile.machine.name} follows the table by itself: its print can only go on while the printer still stands in it"
        )


def _standing(point: Point, found: Found) -> Reached | None:
    """The state whose place the printer tells: after the line before the first or one of those ahead; the first that fits."""
    if found.position is None:
        return None
    told = dict(found.position.axes)
    for reached in (Reached(point.line - 1, point.modal), *point.ahead):
        pairs = [(told[letter], value) for letter, value in zip(reached.modal.axes.letters, reached.modal.at, strict=True)
                 if value is not None and letter in told]  # fmt: skip
        known = all(value is not None for value in reached.modal.at[:3])
        if known and all(abs(a - b) <= SAME for a, b in pairs) and sum(abs(b) > SAME for _, b in pairs) >= SEVERAL:
            return reached
    return None


def _nonzero(found: Found) -> bool:
    """Whether the printer says that it stands somewhere; one that has just started stands at 0 0 0."""
    return found.position is not None and sum(abs(value) > SAME for _, value in found.position.axes) >= SEVERAL


def _in_words(found: Found) -> str:
    return " ".join(f"{letter}{value:g}" for letter, value in found.position.axes) if found.position is not None else ""


def _told(point: Point, found: Found) -> tuple[Floats, Pose] | None:
    """Where the printer says it stands; None where an axis is missing."""
    if found.position is None:
        return None
    told, letters = dict(found.position.axes), point.modal.axes.letters
    if any(letter not in told for letter in letters[:3]):
        return None
    tilt, turn = (told.get(letter, value) for letter, value in zip(letters[3:E_AXIS], point.modal.at[3:E_AXIS], strict=True))
    if tilt is None or turn is None:
        return None
    return np.array([told[letter] for letter in letters[:3]]), Pose(tilt, turn)


def _goal(point: Point, profile: Profile) -> tuple[Floats, Pose]:
    x, y, z, tilt, turn = (value if value is not None else np.nan for value in point.modal.at[:E_AXIS])
    machine = profile.machine
    pose = Pose(machine.tilt.zero_deg if np.isnan(tilt) else tilt, machine.turn.zero_deg if np.isnan(turn) else turn)
    return np.array([x, y, z]), pose


def _before(point: Point, profile: Profile, at: Floats, pose: Pose) -> tuple[str, ...]:
    """Heat (the tip may be stuck in the plastic), up, back over the print, down, filament, modes."""
    goal, wanted = _goal(point, profile)
    pull, push = pushing(point.modal, profile)
    ways = way_back(profile, point.printed, at, pose, goal, wanted)
    return ("G21", "G90", *heated(point.modal, profile), *pull, "G90", *ways, *push, *point.modal.lines())


def _before_homed(point: Point, profile: Profile) -> tuple[str, ...]:
    """The same after a restart: the axes are called what they stand at, the tip rises, X and Y are homed."""
    goal, wanted = _goal(point, profile)
    pull, push = pushing(point.modal, profile)
    homed = home_way(profile, point.printed, *stood(point, profile), goal, wanted, (*heated(point.modal, profile), *pull, "G90"))
    return (*homed, *push, *point.modal.lines())


def stood(point: Point, profile: Profile) -> tuple[Floats, Pose]:
    """Where the axes stood when the power went; raises JournalError when tip or table may have been on a way."""
    state, known = point.moment.state, [value for value in point.moment.pose[:E_AXIS] if value is not None]
    if state in AWAY and len(known) == E_AXIS:
        return np.array(known[:3]), Pose(*known[3:])
    if state in ON_THE_WAY and not profile.machine.gcode.resume:
        raise JournalError(f"the tip was on its way between print and parking place, so nobody knows where it stands; {HOME_IT}")
    states = [point.modal, *(reached.modal for reached in point.ahead)]
    for axis in (3, 4):
        if len({modal.at[axis] for modal in states}) > 1 and not profile.machine.gcode.resume:
            letter = point.modal.axes.letters[axis]
            where = f"lines {point.line} to {point.last}"
            raise JournalError(f"{where}: the table was turning about {letter}, so nobody knows where it stands; {HOME_IT}")
    at, pose = _goal(point, profile)
    low, _ = heights_mm(point)
    return np.array([at[0], at[1], low]), pose


def heights_mm(point: Point) -> tuple[float, float]:
    """Least and greatest Z at which the tip may have stood. The least is taken: a tip that is higher prints badly, one that is
    lower ploughs through the print.
    """
    found = [z for modal in (point.modal, *(reached.modal for reached in point.ahead)) if (z := modal.at[2]) is not None]
    return min(found), max(found)
