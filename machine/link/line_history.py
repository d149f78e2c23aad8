"""Line history: how far a program has come; its lines sent, acknowledged and surely executed."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

from machine.firmware.marlin import BLOCK_BUFFER_SIZE
from machine.gcode.words import read_words, split_command

MOST_WAITING = 4096  # moves whose end is awaited; of further ones, without any word from the planner, nothing can be known


CHECK_S = 30.0  # between looks at the position where a layer ends
CHECK_MUTE_S = 10.0  # the same for a printer that does not report what it has executed


class SentLine(NamedTuple):
    """A command on its way: number on the wire, line of the program, whether it moves something, and the pose after it."""

    number: int
    line: int
    moves: bool
    pose: tuple[float | None, ...]


class LineHistory:
    """Lines of the program, from 1; 0 or the line before the first one sent means none.

    Acknowledged is not executed: a move may wait in the planner. What ADVANCED_OK reports of free places bounds how many do; of a
    printer that does not report them its firmware bounds it (waiting), or it is only known after a barrier (None).
    """

    def __init__(self, before: int = 0, waiting: int | None = None) -> None:
        self.before = self.sent = self.acknowledged = self.executed = before
        self.number = 0  # the newest wire number that is acknowledged
        self.commands = 0  # acknowledged commands of the program
        self.pose: tuple[float | None, ...] = ()  # after the newest acknowledged command
        self._flight: deque[SentLine] = deque()
        self._planned: deque[SentLine] = deque()
        self._blocks = BLOCK_BUFFER_SIZE  # a printer that reports more free places has more
        self._free, self._waiting = 0, waiting
        self.tracked = False  # the printer tells what it has executed

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
            self.acknowledged, self.pose = step.line, step.pose
            self.commands += 1
            if step.moves and len(planned) < MOST_WAITING:
                planned.append(step)
        if free is None:
            waiting = self._waiting
        else:
            self.tracked, waiting = True, self._waiting_beside(free)
        if waiting is None:
            return
        while len(planned) > waiting:
            planned.popleft()
        self.executed = max(self.executed, planned[0].line - 1 if planned else self.acknowledged)

    def _waiting_beside(self, free: int) -> int:
        """How many moves wait. The less of two answers counts: a damaged digit in one of them must not make a waiting move an
        executed one.
        """
        self._blocks = max(self._blocks, free + 1)
        least, self._free = min(free, self._free), free
        return self._blocks - least

    def end_moves(self) -> None:
        """Every move acknowledged so far is over."""
        self._planned.clear()
        self.executed = self.acknowledged


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
        """Where the position is to be looked at: at a layer's end, or in a travel where the printer reports little."""
        ended, self.layer_ended = self.layer_ended, False
        if tracked:
            due = ended and now_s - self._checked_s >= CHECK_S
        else:
            due = now_s - self._checked_s >= CHECK_MUTE_S and (ended or split_command(command.upper())[0] == "G0")
        self._checked_s = now_s if due else self._checked_s
        return due


def shifts(command: str, letters: Sequence[str]) -> bool:
    """Whether a command without filament takes the tip to another height or turns the table; letters: X Y Z tilt turn E.

    After a power cut X and Y are homed, but not these: a journal tells of such a line before it is sent.
    """
    text = command.upper()
    if not any(letter in text for letter in letters[2:5]):  # nearly every line
        return False
    name, rest = split_command(text)
    if name == "MANUAL_STEPPER":
        return True
    named = {letter for letter, _ in read_words(rest)} if name in ("G0", "G1") else set()
    return letters[5] not in named and not named.isdisjoint(letters[2:5])
