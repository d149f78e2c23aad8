"""Line history: how far a program has come; its lines sent, acknowledged and surely executed."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

from machine.firmware.marlin import PLANNED_BLOCKS
from machine.gcode.words import read_words, split_command

MOST_WAITING = 4096  # moves whose end is awaited; of further ones, without any word from the planner, nothing can be known
# Marlin drops a move of fewer than MIN_STEPS_PER_SEGMENT (6) steps on every axis and adds it to the next one (planner.cpp). One
# of twice as many has a block of its own whatever was dropped before: X Y Z and E in mm at 80 steps, tilt and turn in deg at 8.
OWN_BLOCK = (0.15, 0.15, 0.15, 1.5, 1.5, 0.15)
SMALLEST_PLANNER = 3  # places; a printer that reports fewer while nothing moves does not report what it means
CHECK_S = 30.0  # between looks at the position where a layer ends
CHECK_MUTE_S = 10.0  # the same for a printer that does not report what it has executed


class SentLine(NamedTuple):
    """A command on its way: number on the wire, line of the program, whether it moves something, and the pose after it."""

    number: int
    line: int
    moves: bool
    pose: tuple[float | None, ...]


class PlannerReports:
    """The free places of the planner (P of ADVANCED_OK), as reported right after a line was planned.

    As many as Marlin's by default, until it reports more, or the same number twice while nothing moves.
    """

    def __init__(self) -> None:
        self.reported = False
        self._places, self._free, self._idle_free = PLANNED_BLOCKS, 0, 0

    def waiting_beside(self, free: int) -> int:
        """The number of moves that wait. The lesser of two reports counts: a damaged digit in one of them must not make a waiting
        move an executed one.
        """
        self.reported, self._places = True, max(self._places, free)
        least, self._free = min(free, self._free), free
        return self._places - least

    def rest(self) -> None:
        """Nothing moves: all places are free."""
        if SMALLEST_PLANNER <= self._free == self._idle_free:
            self._places = self._free
        self._idle_free = self._free


class LineHistory:
    """Lines of the program, from 1; 0 or the line before the first one sent means none.

    Acknowledged is not executed: a move may wait in the planner. The planner's own reports bound how many do; where there are
    none the firmware does (waiting), or nothing is known until a barrier (None).
    """

    def __init__(self, before: int = 0, waiting: int | None = None, planner: PlannerReports | None = None) -> None:
        self.before = self.sent = self.acknowledged = self.executed = before
        self.number = 0  # the newest wire number that is acknowledged
        self.commands = 0  # acknowledged commands of the program
        self.pose: tuple[float | None, ...] = ()  # after the newest acknowledged command
        self._flight: deque[SentLine] = deque()
        self._planned: deque[int] = deque()  # of each place that the planner may still hold the first line that may be in it
        self._begins, self._begins_at = 0, tuple[float | None, ...]()  # the first line of the newest place, the pose before it
        self._has_block = True  # the newest place surely has one: the next move gets another
        self._loose = 0  # moves from this line on may be part of the next block only; 0: none
        self._planner, self._waiting = planner or PlannerReports(), waiting
        self._reported_by = 0  # the wire number of the newest line whose answer reported the planner

    @property
    def tracked(self) -> bool:
        """Whether the printer reports what it has executed."""
        return self._planner.reported

    @property
    def waiting(self) -> int:
        """The number of moves that may still wait in the planner."""
        return len(self._planned)

    @property
    def only_unanswered(self) -> SentLine | None:
        """The only command of the program that is not acknowledged; None when there is none, or more than one."""
        return self._flight[0] if len(self._flight) == 1 else None

    def send(self, step: SentLine) -> None:
        """A command has gone out."""
        self._flight.append(step)
        self.sent = step.line

    def acknowledge(self, number: int, free: int | None = None) -> None:
        """All lines up to this number of the wire have been taken; free: places of the planner right after it."""
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
        """A move is in the planner, with a block of its own or, where it is too short for one, perhaps with the next."""
        if self._has_block:
            self._planned.append(self._loose or step.line)
            self._begins, self._begins_at = step.line, self.pose or step.pose
        whole = _has_own_block(self.pose, step.pose)
        self._has_block = whole or _has_own_block(self._begins_at, step.pose)
        self._loose = 0 if whole else self._begins
        if not self._has_block:  # of an axis that was not known the way counts from here
            self._begins_at = tuple(b if a is None else a for a, b in zip(self._begins_at, step.pose, strict=True))

    def end_moves(self, since: int) -> None:
        """Every move acknowledged so far is over, and was when the line `since` of the wire was answered."""
        self._planned.clear()
        self._has_block, self._loose = True, 0
        if self._reported_by >= since:
            self._planner.rest()
        self.executed = self.acknowledged


def _has_own_block(before: Sequence[float | None], after: Sequence[float | None]) -> bool:
    """Whether the way between two poses is long enough on one axis; of axes that are not known it counts as none."""
    for a, b, least in zip(before, after, OWN_BLOCK, strict=False):
        if a is not None and b is not None and not -least < b - a < least:
            return True
    return False


class Barriers:
    """Before which commands of a program all moves are to be over, so that after a power cut it is known where the tip stood.

    layer_ended: a layer has ended since the last look at the position.
    """

    def __init__(self, letters: Sequence[str], now_s: float) -> None:
        self.layer_ended = False
        self._letters, self._shifted, self._checked_s = letters, False, now_s

    def due(self, command: str, prints: Callable[[str], bool], tracked: bool) -> bool:
        """Before the tip's height or the table changes, and before the first stroke after that.

        Of a printer that tells what it has executed it is known when the change is over: it needs the first of the two only.
        """
        shift = shifts(command, self._letters)
        stroke = self._shifted and not shift and prints(command)
        due = (shift and not self._shifted) or (stroke and not tracked)
        self._shifted = shift or (self._shifted and not stroke)
        return due

    def check_due(self, command: str, tracked: bool, now_s: float) -> bool:
        """Whether the position is to be checked: at a layer's end, or in a travel where the printer reports little."""
        ended, self.layer_ended = self.layer_ended, False
        if tracked:
            due = ended and now_s - self._checked_s >= CHECK_S
        else:
            due = now_s - self._checked_s >= CHECK_MUTE_S and (ended or split_command(command.upper())[0] == "G0")
        self._checked_s = now_s if due else self._checked_s
        return due


def shifts(command: str, letters: Sequence[str]) -> bool:
    """Whether a command without filament takes the tip to another height or turns the table; letters: X Y Z tilt turn E.

    After a power cut X and Y are homed, but not these: such a line is recorded in the journal before it is sent.
    """
    text = command.upper()
    if not any(letter in text for letter in letters[2:5]):  # nearly every line
        return False
    name, rest = split_command(text)
    if name == "MANUAL_STEPPER":
        return True
    named = {letter for letter, _ in read_words(rest)} if name in ("G0", "G1") else set()
    return letters[5] not in named and not named.isdisjoint(letters[2:5])
