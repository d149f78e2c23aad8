"""Simulated firmware without I/O: bytes in, bytes out, with virtual time as an argument.

It follows the rules of the machine's dialect (machine.firmware), above all Marlin's awkward ones: line numbers and checksums with
its exact messages, a repeat of the last line silently dropped, `ok` = accepted, withheld while the planner is full.
"""

from collections import deque
from collections.abc import Callable, Iterator
from math import inf

from machine.firmware import dialect_of
from machine.gcode.commands import PATHS, URGENT
from machine.gcode.words import read_words, split_command
from machine.simulator.board import Board, BuildOptions, Order, Work
from machine.simulator.commands import command_of, move
from machine.simulator.contact import ProbedTable
from machine.simulator.receiver import Receiver
from machine.simulator.record import Record, record_of
from profiles.machine import Machine

BUSY_S = 2.0  # Marlin's HOST_KEEPALIVE interval
UNREAD_LINES = 20
CHATTER_S = 3600.0  # only the last hour of a longer wait is reported: a jump over years must not fill the memory
IDLE_S = 1.0  # interval of `wait` with Marlin's NO_TIMEOUTS
MACHINE_STATE = {True: "S_XYZ:5", False: "S_XYZ:3"}  # Marlin's M_RUNNING and M_IDLE


class SimulatedFirmware:
    """Simulated firmware; receive() delivers bytes, advance() lets time pass and returns the printer's output.

    kept_moves: number of moves to record, None: all. watch: gets each line's count before it begins; True: advance() returns
    first. table: the surface for its probe, None: no probe.
    """

    def __init__(
        self,
        machine: Machine,
        build: BuildOptions | None = None,
        busy_s: float = BUSY_S,
        kept_moves: int | None = None,
        table: ProbedTable | None = None,
    ) -> None:
        self._build = build or BuildOptions()
        self._said: list[str] = []
        self.board = Board(machine, self._build, self._said.append, kept_moves, table)
        self._rules = self.board.rules
        self.board.busy_every_s = self._busy_default_s = busy_s if self._build.busy and self._rules.has_build_options else 0.0
        self._receiver = Receiver(self._rules, dialect_of(machine).longest_line, self._build.rx_ring, self._build.checksums)
        self._room = (self._build.queue if self._rules.has_build_options else None) or self._rules.queue_lines
        self._reads_bytes = self._rules.urgent == "bytes" and (self._build.emergency_parser or self._build.realtime)
        self._busy_s = self._wait_s = inf
        self._queue: deque[tuple[str, str, str, str]] = deque()  # label of the answer; text; its name and rest
        self._wake_s: float | None = None
        self._work: Iterator[float] | None = None
        self._waits = False  # the program itself waits for the current command
        self._taken = self._watched = 0
        self.watch: Callable[[int], bool] | None = None
        self._reason = ""  # reason for a stop
        self.dead = False

    def receive(self, data: bytes) -> None:
        """Receive bytes on the line."""
        if self.dead and not self._rules.after_kill:
            return
        if self._reads_bytes:
            for order in self._receiver.urgent_orders(data):
                self._do_urgent(order)
            if self.dead:
                return
        lines = self._receiver.receive(data)
        if not self.dead and self._rules.urgent == "lines" and any(line.strip() == b"M112" for line in lines):
            self._stop_at_once()

    @property
    def has_ring(self) -> bool:
        """Whether bytes arrive in a ring that may overflow; over USB the host waits instead."""
        return self._build.rx_ring is not None

    @property
    def full(self) -> bool:
        """Whether reading is suspended (USB) until there is space."""
        return not self.has_ring and len(self._receiver) >= UNREAD_LINES

    def advance(self, until_s: float = inf) -> bytes:
        """Work until a virtual time; with inf until nothing is left to do, skipping all waits."""
        board, lines = self.board, self._receiver.lines
        while not self.dead:
            if lines:
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
        if not lines and len(self._queue) < self._room:
            self._receiver.idle()
        if until_s < inf:
            board.now_s = max(board.now_s, until_s)
        if self.dead:
            self._answer_dead()
        said = "".join([f"{line}\n" for line in self._said])
        self._said.clear()
        return said.encode("ascii", "replace")

    def next_s(self) -> float:
        """The virtual time of the next event without further bytes; inf for none."""
        if self.dead:
            return inf
        board = self.board
        due_s = min(board.report_s, board.position_s, board.nozzle.trip_s, board.bed.trip_s, board.idle_s)
        if self._wake_s is None:
            return board.now_s if self._queue or len(self._receiver) else min(due_s, self._wait_s)
        return min(self._wake_s, due_s, inf if board.waits_for_heat else self._busy_s)  # no busy while it reports temperatures

    def reset(self, banner: bool = True) -> None:
        """Restart the board: counter, queues, position and temperatures are lost."""
        board = self.board
        board.note("reset")
        board.off()
        board.forget()
        board.motion.forget()
        board.busy_every_s = self._busy_default_s
        self._receiver.forget()
        self._forget()
        self._receiver.last, self.dead = 0, False
        if banner:
            self._said += self._rules.banner

    @property
    def last_number(self) -> int:
        """Number of the last accepted line."""
        return self._receiver.last

    def record(self) -> Record:
        """The record so far."""
        return record_of(self.board, self._taken, self._receiver.lost_bytes)

    def kill(self, error: str) -> None:
        """Stop for good with the firmware's message, heaters off."""
        own = self._rules.heater_fault
        self.board.note(error, trouble=True)
        self._shut_down(() if own else (f"Error:{error}",), own)

    def _stop_at_once(self) -> None:
        """Execute M112."""
        report = ("echo:M112 Shutdown",) if self._rules.urgent == "bytes" else ()
        self.board.note("M112")
        self._shut_down(report, "Shutdown due to M112 command")

    def _shut_down(self, report: tuple[str, ...], reason: str) -> None:
        self.board.off()
        self._said += [*report, *self._rules.kill]
        self._reason, self.dead = reason, True
        if self._rules.after_kill:
            self._answer_waiting()
        else:
            self._receiver.forget()
        self._forget()

    def _answer_waiting(self) -> None:
        """Acknowledge the current command and refuse those behind it."""
        waiting = [text for _, text, _, _ in self._queue]
        if self._work is not None:
            self._said.append("ok")
            del waiting[0]
        for text in waiting:
            self._refuse(text)

    def _forget(self) -> None:
        self._queue.clear()
        self._wake_s = self._work = None
        self._busy_s = self._wait_s = inf
        self._watched = self._taken

    def _answer_dead(self) -> None:
        """Answer after a stop, as a firmware on a separate computer does: a refusal, and ok."""
        while len(self._receiver):
            if isinstance(taken := self._receiver.take(), tuple):
                self._refuse(taken[1])

    def _refuse(self, text: str) -> None:
        answer = self._rules.answers_killed.get(split_command(text)[0])
        self._said += [answer] if answer else [line.format(self._reason) for line in self._rules.after_kill]

    def _do_urgent(self, order: str) -> None:
        board = self.board
        if order in ("S000", "P000", "R000"):
            if self._build.realtime:
                self._said += [MACHINE_STATE[board.motion.planner.next_s() < inf], board.position()]
        elif self._build.emergency_parser:
            self._act_at_once(order)

    def _act_at_once(self, order: str) -> None:
        board = self.board
        if order == "M112":
            self._stop_at_once()
        elif order == "M410" and board.homes:  # Endstops::validate_homing_move: the end stop was not met
            board.note("Homing Failed", trouble=True)
            self._shut_down(("echo:Homing Failed",), "")
        elif (command := command_of(board, order)) is not None:
            command(board, Order(order, ""))
            if self._wake_s is not None and (order == "M410" or board.waits_for_heat or board.waits_for_person):
                self._wake_s = board.now_s

    def _fetch(self) -> None:
        """Move lines from the receive ring into the queue while it has space.

        Without an emergency parser Marlin looks for its orders here: a line is seen when it enters the queue.
        """
        receiver, queue, room = self._receiver, self._queue, self._room
        lines = receiver.lines
        while lines and len(queue) < room:
            taken = receiver.take()
            if isinstance(taken, str):
                self._said += receiver.ask_again(taken, self._build.resend_ok)
                continue
            if taken is not None:
                label, text = taken
                queue.append((label, text, *split_command(text)))
                if not self._reads_bytes and self._rules.urgent == "bytes" and text in URGENT:
                    self._act_at_once(text)

    def _run(self) -> None:
        """Begin or continue the oldest line of the queue."""
        board = self.board
        label, text, name, rest = self._queue[0]
        if self._work is None:
            if name in ("G0", "G1"):
                planner = board.motion.planner
                if not planner.free(board.now_s):
                    self._sleep(planner.next_s())
                    return
                answer = move(board, dict(read_words(rest)))
            else:
                answer = self._begin(text, name, rest)
                if self.dead:
                    return
            if answer is None or isinstance(answer, str):
                self._finish(label, answer)
                return
            self._work, self._waits = answer, name not in PATHS
        wake_s = next(self._work, None)
        if wake_s is None:
            self._work = None
            if self._waits:
                board.motion.planner.barrier(board.now_s)
            self._finish(label)
        else:
            self._sleep(wake_s)

    def _begin(self, text: str, name: str, rest: str) -> Work:
        if not text:
            return None
        if name == "M112":
            self._stop_at_once()
            return None
        command = command_of(self.board, name)
        if command is None:
            if not (self._build.realtime and name in ("S0", "P0", "R0")):
                self.board.refuse(text)
            return None
        answer = command(self.board, Order(name, rest))
        if self.board.number is not None:
            self._receiver.last, self.board.number = self.board.number, None
        return answer

    def _finish(self, label: str, answer: str | None = None) -> None:
        """Answer the oldest line of the queue; B still counts it, so it is one too low (TFT #2819)."""
        self._queue.popleft()
        self._taken += 1
        self._busy_s = inf
        if self._build.waits:
            self._wait_s = self.board.now_s + IDLE_S
        if answer is not None:
            self._said.append(answer)
        elif self._build.advanced_ok and self._rules.has_build_options:
            free = self.board.motion.planner.free(self.board.now_s)
            self._said.append(f"ok{label} P{free} B{self._room - 1 - len(self._queue)}")
        else:
            self._said.append("ok")

    def _sleep(self, wake_s: float) -> None:
        if self._busy_s == inf and self.board.busy_every_s > 0:
            self._busy_s = self.board.now_s + self.board.busy_every_s
        if self._wake_s is None:
            self._wake_s = wake_s

    def _pass(self, to_s: float) -> None:
        """Let the clock run, with due reports on the way."""
        board = self.board
        while not self.dead:
            sleeps, nozzle_s, bed_s = self._wake_s is not None, board.nozzle.trip_s, board.bed.trip_s
            busy_s = self._busy_s if sleeps and not board.waits_for_heat else inf
            trip_s = nozzle_s if nozzle_s < bed_s else bed_s
            wait_s = inf if sleeps or self._queue else self._wait_s
            due_s = min(busy_s, wait_s, board.report_s, board.position_s, trip_s, board.idle_s)
            if due_s > to_s or due_s == inf:
                break
            board.now_s = max(board.now_s, due_s, min(to_s - CHATTER_S, trip_s))
            self._report_due(due_s, busy_s, trip_s)
        if to_s < inf and not self.dead:
            board.now_s = max(board.now_s, to_s)

    def _report_due(self, due_s: float, busy_s: float, trip_s: float) -> None:
        """Report what is due now."""
        board = self.board
        if due_s == trip_s:
            heater, index = (board.nozzle, "0") if board.nozzle.trip_s == trip_s else (board.bed, "bed")
            heater.trip_s = inf
            self.kill(f"{heater.trip}, system stopped! Heater_ID: {index}")
        elif due_s == board.idle_s:
            board.idle()
        elif due_s == self._wait_s:
            self._said.append("wait")
            self._wait_s = board.now_s + IDLE_S
        elif due_s == busy_s:
            self._said.append(f"echo:busy: {'paused for user' if board.waits_for_person else 'processing'}")
            self._busy_s = board.now_s + board.busy_every_s
        elif due_s == board.report_s:
            self._said.append(f" {board.temperatures()}")
            board.report_s = board.now_s + board.report_every_s
        else:
            self._said.append(board.position())
            board.position_s = board.now_s + board.position_every_s
