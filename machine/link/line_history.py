"""Line history: the lines of a program sent, acknowledged and surely executed."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

from machine.firmware.marlin import PLANNED_BLOCKS
from machine.gcode.words import read_words, split_command

MOST_WAITING = 4096  # moves whose end is awaited; without reports of the planner nothing can be known of further ones
# Marlin drops a move of fewer than MIN_STEPS_PER_SEGMENT (6) steps on every axis and adds it to the next one (planner.cpp). A
# move of twice as many has its own block whatever was dropped before: X Y Z and E in mm at 80 steps, tilt and turn in deg at 8.
OWN_BLOCK = (0.15, 0.15, 0.15, 1.5, 1.5, 0.15)
SMALLEST_PLANNER = 3  # places; a printer that reports fewer at standstill does not report its planner
CHECK_S = 30.0  # between checks of the position at the end of a layer
CHECK_MUTE_S = 10.0  # for a printer that does not report what it has executed


class SentLine(NamedTuple):
    """A command in flight: wire number, line of the program, whether it moves an axis, and the pose after it."""

    number: int
    line: int
    moves: bool
    pose: tuple[float | None, ...]


class PlannerReports:
    """Free places of the planner (P of ADVANCED_OK), reported right after a line was planned.

    The planner has Marlin's default size until more are reported, or the same number twice at standstill.
    """

    def __init__(self) -> None:
        self.reported = False
        self._places, self._free, self._idle_free = PLANNED_BLOCKS, 0, 0

    def waiting_beside(self, free: int) -> int:
        """Number of moves waiting. The smaller of the last two reports counts: one damaged digit must not make a waiting move an
        executed one."""
        self.reported, self._places = True, max(self._places, free)
        least, self._free = min(free, self._free), free
        return self._places - least

    def rest(self) -> None:
        """Note a standstill: all places are free."""
        if SMALLEST_PLANNER <= self._free == self._idle_free:
            self._places = self._free
        self._idle_free = self._free


class LineHistory:
    """Progress through the lines of a program, from 1; 0 or the line before the first one sent means none.

    An acknowledged move may still wait in the planner. The planner's reports limit how many do; without reports the firmware's
    size does (waiting), or nothing is known until a barrier (None).
    """

    def __init__(self, before: int = 0, waiting: int | None = None, planner: PlannerReports | None = None) -> None:
        self.before = self.sent = self.acknowledged = self.executed = before
        self.number = 0  # newest acknowledged wire number
        self.commands = 0  # acknowledged commands of the program
        self.pose: tuple[float | None, ...] = ()  # after the newest acknowledged command
        self._flight: deque[SentLine] = deque()
        self._planned: deque[int] = deque()  # for each place that the planner may still hold, the first line that may be in it
        # the first line of the newest place, and the pose before it
        self._begins, self._begins_at = 0, tuple[float | None, ...]()
        self._has_block = True  # the newest place surely has a block: the next move gets another
        self._loose = 0  # moves from this line may only be part of the next block; 0: none
        self._planner, self._waiting = planner or PlannerReports(), waiting
        self._reported_by = 0  # newest wire number whose answer reported the planner

    @property
    def tracked(self) -> bool:
        """Whether the printer reports what it has executed."""
        return self._planner.reported

    @property
    def waiting(self) -> int:
        """Number of moves that may still wait in the planner."""
        return len(self._planned)

    @property
    def only_unanswered(self) -> SentLine | None:
        """The only unacknowledged command of the program; None for none or several."""
        return self._flight[0] if len(self._flight) == 1 else None

    def send(self, step: SentLine) -> None:
        """Note a command that was sent."""
        self._flight.append(step)
        self.sent = step.line

    def acknowledge(self, number: int, free: int | None = None) -> None:
        """Note that all lines up to a wire number were accepted. free: free places of the planner right after that."""
        if number > self.number:
            self.number = number
        flight, planned = self._flight, self._planned
        while flight and flight[0].number <= number:
            step = flight.popleft()
            if step.moves and len(planned) < MOST_WAITING:
                self._plan(step)
            self.acknowledged, self.pose = step.line, step.pose
            self.commands += 1
        waiting = self._waiting
        if free is not None:
            waiting, self._reported_by = self._planner.waiting_beside(free), number
        if waiting is None:
            return
        while len(planned) > waiting + (not self._has_block):
            planned.popleft()
        surely = planned[0] - 1 if planned else self._loose - 1 if self._loose else self.acknowledged
        self.executed = max(self.executed, surely)

    def _plan(self, step: SentLine) -> None:
        """Add a move to the planner: as a block of its own or, if too short, perhaps as part of the next one."""
        if self._has_block:
            self._planned.append(self._loose or step.line)
            self._begins, self._begins_at = step.line, self.pose or step.pose
        whole = _has_own_block(self.pose, step.pose)
        self._has_block = whole or _has_own_block(self._begins_at, step.pose)
        self._loose = 0 if whole else self._begins
        if not self._has_block:  # the length of a move on an unknown axis counts from here
            self._begins_at = tuple(b if a is None else a for a, b in zip(self._begins_at, step.pose, strict=True))

    def end_moves(self, since: int) -> None:
        """Note that all acknowledged moves have ended, and had when the line with wire number `since` was answered."""
        self._planned.clear()
        self._has_block, self._loose = True, 0
        if self._reported_by >= since:
            self._planner.rest()
        self.executed = self.acknowledged


def _has_own_block(before: Sequence[float | None], after: Sequence[float | None]) -> bool:
    """Whether a move is long enough for a block on some axis; unknown axes do not count."""
    for a, b, least in zip(before, after, OWN_BLOCK, strict=False):
        if a is not None and b is not None and not -least < b - a < least:
            return True
    return False


class Barriers:
    """Decides before which commands all moves must end, so that the tip's position after a power cut is known.

    layer_ended: a layer has ended since the last check of the position.
    """

    def __init__(self, letters: Sequence[str], now_s: float) -> None:
        self.layer_ended = False
        self._letters, self._shifted, self._checked_s = letters, False, now_s

    def due(self, command: str, prints: Callable[[str], bool], tracked: bool) -> bool:
        """Whether to wait for all moves: before the tip's height or the table changes, and before the first stroke after that.

        A printer that reports what it has executed needs only the former: the end of the change is known.
        """
        shift = shifts(command, self._letters)
        stroke = self._shifted and not shift and prints(command)
        due = (shift and not self._shifted) or (stroke and not tracked)
        self._shifted = shift or (self._shifted and not stroke)
        return due

    def check_due(self, command: str, tracked: bool, now_s: float) -> bool:
        """Whether to check the position: at the end of a layer, or in a travel if the printer reports little."""
        ended, self.layer_ended = self.layer_ended, False
        if tracked:
            due = ended and now_s - self._checked_s >= CHECK_S
        else:
            due = now_s - self._checked_s >= CHECK_MUTE_S and (ended or split_command(command.upper())[0] == "G0")
        self._checked_s = now_s if due else self._checked_s
        return due


def shifts(command: str, letters: Sequence[str]) -> bool:
    """Whether a command without filament changes the tip's height or turns the table; letters: X Y Z tilt turn E.

    After a power cut only X and Y are homed, so such a line is recorded in the journal before it is sent.
    """
    text = command.upper()
    if not any(letter in text for letter in letters[2:5]):  # nearly every line
        return False
    name, rest = split_command(text)
    if name == "MANUAL_STEPPER":
        return True
    named = {letter for letter, _ in read_words(rest)} if name in ("G0", "G1") else set()
    return letters[5] not in named and not named.isdisjoint(letters[2:5])
