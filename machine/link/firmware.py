"""A firmware without I/O: bytes in, bytes out, time is virtual and handed in.

Its habits are those of the machine's dialect (machine.link.habits), Marlin's awkward ones above all: line numbers and checksums
with its exact words, a repeat of the last line swallowed in silence, `ok` = taken, withheld while the planner is full.
"""

import re
from collections import deque
from collections.abc import Callable, Iterator
from math import inf

from machine.dialects import DIALECTS
from machine.link.body import Body, Work, words_of
from machine.link.commands import TEXTS, commands_of
from machine.link.habits import Habits
from machine.link.macros import NAME, VALUE, command_of
from machine.link.moving import move
from machine.link.reception import Reception
from machine.link.record import Record, record_of
from machine.link.telling import introduce
from machine.link.urgent import Urgent
from profiles.machine import Machine

BUSY_S = 2.0  # Marlin's HOST_KEEPALIVE interval
UNREAD_LINES = 20
CHATTER_S = 3600.0  # of a longer wait only the last hour is talked through: a jump over years must not fill the memory
COMMAND = re.compile(r"([GMTSPR])\s*0*(\d+(?:\.\d+)?)")
EARLY = ("M108", "M112", "M410")
IDLE_S = 1.0  # Marlin's NO_TIMEOUTS: `wait` is said so often
MOVES = ("G0", "G1", "G2", "G3")
MACHINE_STATE = {True: "S_XYZ:5", False: "S_XYZ:3"}  # Marlin's M_RUNNING and M_IDLE

__all__ = ["BUSY_S", "Firmware", "Habits"]


class Firmware:
    """receive() hands bytes over, advance() lets time pass and returns what the printer says meanwhile.

    kept: how many moves stay on record, None: all. watch: told each line's count before it begins; True: advance() returns first.
    """

    def __init__(self, machine: Machine, habits: Habits | None = None, busy_s: float = BUSY_S, kept: int | None = None) -> None:
        self._habits = habits or Habits()
        self._said: list[str] = []
        self.body = Body(machine, self._said.append, kept)
        self.body.must_home = self._habits.must_home
        self._manner = self.body.manner
        self._commands, self._macros = commands_of(machine.dialect), DIALECTS[machine.dialect].macros
        self.body.busy_every_s = self._busy_default_s = busy_s if self._habits.busy and self._manner.options else 0.0
        self._reception = Reception(self._manner, DIALECTS[machine.dialect].longest_line, self._habits.rx_ring)
        self._room = (self._habits.queue if self._manner.options else None) or self._manner.pending
        self._urgent = Urgent(self._habits.realtime) if self._reads_bytes() else None
        self._busy_s = self._wait_s = inf
        self._queue: deque[tuple[str, str]] = deque()
        self._wake_s: float | None = None
        self._work: Iterator[float] | None = None
        self._waits = False  # the program itself waits for the command at work
        self._taken = self._watched = 0
        self.watch: Callable[[int], bool] | None = None
        self.dead = False

    def _reads_bytes(self) -> bool:
        return self._manner.urgent == "bytes" and (self._habits.emergency_parser or self._habits.realtime)

    def receive(self, data: bytes) -> None:
        """Bytes arrive on the line."""
        if self.dead and not self._manner.answers_dead:
            return
        if self._urgent is not None:
            for order in self._urgent.read(data):
                self._do_urgent(order)
            if self.dead:
                return
        lines = self._reception.receive(data)
        if self._manner.urgent == "lines" and any(line.strip() == b"M112" for line in lines):
            self._shut_down("M112", ())

    @property
    def has_ring(self) -> bool:
        """Whether bytes arrive in a ring that overflows; over USB the host waits instead."""
        return self._habits.rx_ring is not None

    @property
    def full(self) -> bool:
        """Over USB: nothing more is read until there is room again."""
        return not self.has_ring and len(self._reception) >= UNREAD_LINES

    def advance(self, until_s: float = inf) -> bytes:
        """Work until a virtual time; with inf until there is nothing to do, the clock jumping over all waits."""
        body = self.body
        while not self.dead:
            self._fetch()
            if self._wake_s is not None:
                if self._wake_s > until_s:
                    self._pass(until_s)
                    break
                self._pass(self._wake_s)
                self._wake_s = None
            elif self._queue:
                if self.watch is not None and self._work is None and self._watched == self._taken:
                    self._watched += 1
                    if self.watch(self._watched):
                        break
                self._run()
            else:
                if until_s < inf:
                    self._pass(until_s)
                break
        if until_s < inf:
            body.now_s = max(body.now_s, until_s)
        if self.dead:
            self._answer_dead()
        said = "".join([f"{line}\n" for line in self._said])
        self._said.clear()
        return said.encode("ascii", "replace")

    def next_s(self) -> float:
        """The virtual time at which something happens without further bytes; inf when nothing will."""
        if self.dead:
            return inf
        body = self.body
        due_s = min(body.report_s, body.place_s, body.nozzle.trip_s, body.bed.trip_s)
        if self._wake_s is None:
            return body.now_s if self._queue or len(self._reception) else min(due_s, self._wait_s)
        return min(self._wake_s, due_s, inf if body.waits_for_heat else self._busy_s)  # no busy while it tells temperatures

    def reset(self, banner: bool = True) -> None:
        """The board restarts: counter, queues, position and temperatures are lost."""
        body = self.body
        body.note("reset")
        body.off()
        body.forget()
        body.motion.forget()
        body.busy_every_s = self._busy_default_s
        self._forget()
        self._reception.last, self.dead = 0, False
        if banner:
            self._said += self._manner.banner

    @property
    def last_number(self) -> int:
        """Number of the last numbered line that was taken."""
        return self._reception.last

    @property
    def taken(self) -> int:
        """How many lines were executed."""
        return self._taken

    def record(self) -> Record:
        """What was done so far."""
        return record_of(self.body, self._taken, self._reception.lost_bytes)

    def kill(self, error: str) -> None:
        """The firmware stops for ever with its own words, heaters off."""
        self._shut_down(error, (f"Error:{error}",))

    def _shut_down(self, event: str, told: tuple[str, ...]) -> None:
        self.body.note(event)
        self.body.off()
        self._said += [*told, *self._manner.kill]
        self._forget()
        self.dead = True

    def _forget(self) -> None:
        self._reception.forget()
        self._queue.clear()
        if self._urgent is not None:
            self._urgent.forget()
        self._wake_s = self._work = None
        self._busy_s = self._wait_s = inf
        self._watched = self._taken

    def _answer_dead(self) -> None:
        """A firmware on a computer of its own still answers when it has stopped the machine: no, and ok."""
        while len(self._reception):
            if self._reception.take() is not None:
                self._said += [*self._manner.answers_dead, "ok"]

    def _do_urgent(self, order: str) -> None:
        body = self.body
        if order in ("S000", "P000", "R000"):
            if self._habits.realtime:
                self._said += [MACHINE_STATE[body.motion.planner.next_s() < inf], body.place()]
        elif self._habits.emergency_parser:
            self._act_at_once(order)

    def _act_at_once(self, order: str) -> None:
        body = self.body
        if order == "M112":
            self._shut_down("M112", ("echo:M112 Shutdown",))
        elif order == "M108":
            body.impatient = True
            if body.waits_for_heat or body.waits_for_person:
                self._wake_s = body.now_s
        elif order == "M410":
            body.motion.halt(body.now_s)
            body.note("M410")
            if self._wake_s is not None:
                self._wake_s = body.now_s

    def _fetch(self) -> None:
        """Move lines from the receive ring into the queue while it has room.

        Without an emergency parser Marlin looks for its orders here: a line is seen when it enters the queue.
        """
        reception, room = self._reception, self._room
        while len(reception) and len(self._queue) < room:
            taken = reception.take()
            if isinstance(taken, str):
                self._said += reception.ask_again(taken, self._habits.resend_ok)
                break
            if taken is not None:
                self._queue.append(taken)
                if self._urgent is None and self._manner.urgent == "bytes" and taken[1] in EARLY:
                    self._act_at_once(taken[1])
        if not len(reception) and len(self._queue) < room:
            reception.idle()

    def _run(self) -> None:
        """Begin or go on with the oldest line of the queue."""
        body = self.body
        label, text = self._queue[0]
        if self._work is None:
            name, rest = _parted(text)
            if name in MOVES[:2]:
                if not body.motion.planner.free(body.now_s):
                    self._sleep(body.motion.planner.next_s())
                    return
                answer = move(body, words_of(rest), text)
            else:
                answer = self._begin(text, name, rest)
                if self.dead:
                    return
            if answer is None or isinstance(answer, str):
                self._finish(label, answer)
                return
            self._work, self._waits = answer, name not in MOVES
        wake_s = next(self._work, None)
        if wake_s is None:
            self._work = None
            if self._waits:
                body.motion.planner.barrier(body.now_s)
            self._finish(label)
        else:
            self._sleep(wake_s)

    def _begin(self, text: str, name: str, rest: str) -> Work:
        if name == "M112":
            self._shut_down("M112", ("echo:M112 Shutdown",))
            return None
        if name == "M115":
            return introduce(self.body, self._habits)
        if self._macros and (found := NAME.match(text)):
            macro = command_of(found[0].upper())
            if macro is not None:
                return macro(self.body, dict(VALUE.findall(text[found.end() :])))
        command = self._commands.get(name)
        if command is None:
            if not (self._habits.realtime and name in ("S0", "P0", "R0")):
                self.body.unknown += 1
                self._said.append(self._manner.unknown.format(text))
            return None
        answer = command(self.body, {} if name in TEXTS else words_of(rest), name + rest)
        if self.body.number is not None:
            self._reception.last, self.body.number = self.body.number, None
        return answer

    def _finish(self, label: str, answer: str | None = None) -> None:
        """Answer the oldest line of the queue; B counts it as still there, so it is one too low (TFT #2819)."""
        self._queue.popleft()
        self._taken += 1
        self._busy_s = inf
        if self._habits.waits:
            self._wait_s = self.body.now_s + IDLE_S
        if answer is not None:
            self._said.append(answer)
        elif self._habits.advanced_ok and self._manner.options:
            free = self.body.motion.planner.free(self.body.now_s)
            self._said.append(f"ok{label} P{free} B{self._room - 1 - len(self._queue)}")
        else:
            self._said.append("ok")

    def _sleep(self, wake_s: float) -> None:
        if self._busy_s == inf and self.body.busy_every_s > 0:
            self._busy_s = self.body.now_s + self.body.busy_every_s
        if self._wake_s is None:
            self._wake_s = wake_s

    def _pass(self, to_s: float) -> None:
        """Let the clock run, saying on the way what is due."""
        body = self.body
        while not self.dead:
            busy_s = self._busy_s if self._wake_s is not None and not body.waits_for_heat else inf
            trip_s = min(body.nozzle.trip_s, body.bed.trip_s)
            wait_s = self._wait_s if self._wake_s is None and not self._queue else inf
            due_s = min(busy_s, wait_s, body.report_s, body.place_s, trip_s)
            if due_s > to_s or due_s == inf:
                break
            body.now_s = max(body.now_s, due_s, min(to_s - CHATTER_S, trip_s))
            self._tell(due_s, busy_s, trip_s)
        if to_s < inf and not self.dead:
            body.now_s = max(body.now_s, to_s)

    def _tell(self, due_s: float, busy_s: float, trip_s: float) -> None:
        """Say what is due now."""
        body = self.body
        if due_s == trip_s:
            heater, index = (body.nozzle, "0") if body.nozzle.trip_s == trip_s else (body.bed, "bed")
            heater.trip_s = inf
            self.kill(f"{heater.trip}, system stopped! Heater_ID: {index}")
        elif due_s == self._wait_s:
            self._said.append("wait")
            self._wait_s = body.now_s + IDLE_S
        elif due_s == busy_s:
            self._said.append(f"echo:busy: {'paused for user' if body.waits_for_person else 'processing'}")
            self._busy_s = body.now_s + body.busy_every_s
        elif due_s == body.report_s:
            self._said.append(f" {body.temperatures()}")
            body.report_s = body.now_s + body.report_every_s
        else:
            self._said.append(body.place())
            body.place_s = body.now_s + body.place_every_s


def _parted(text: str) -> tuple[str, str]:
    """Name and rest of a command; leading zeros and a missing blank are allowed: "G01X5" is G1."""
    if text[2:3] == " " and text[1:2].isdigit():
        return text[:2], text[2:]
    found = COMMAND.match(text)
    return (f"{found[1]}{found[2]}", text[found.end() :]) if found else ("", text)
