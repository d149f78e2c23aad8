"""Feed: runs a print: the program's commands in order, and between them those of user, printer and journal."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from math import inf

from machine.firmware import dialect_of
from machine.gcode.commands import command_in
from machine.gcode.modes import ModalState, axes_of
from machine.gcode.words import PAUSE_REMARK, split_command
from machine.link.exchange import Exchange
from machine.link.journal import Checkpoint, Journal
from machine.link.line_history import Barriers, LineHistory, PlannerReports, SentLine, shifts
from machine.link.pause.park_moves import extrudes, least_extrusion_c, lift_move
from machine.link.pause.pause import Pause
from machine.link.pause.printed_bounds import PrintedBounds
from machine.link.pending_commands import Control, PendingCommands
from machine.link.print_state import PrintState, PrintStatus, ProgramPosition
from machine.link.protocol.events import Event, Kind
from machine.link.protocol.framing import command_of
from machine.link.protocol.states import State
from machine.link.resume import ResumePoint
from machine.link.status import position_differences
from machine.link.watchdog import PrinterReports
from profiles.errors import PrinterError
from profiles.profile import Profile

PROGRESS_S = 0.2  # users read no faster
ASK_S = 5.0  # between temperature queries to a printer that does not report by itself, or has fallen silent
REPORT_S = 2  # between reports of one that does
BOUNDARY_S = 15.0  # the longest that a pause waits for the end of a stroke
WORTH_S = 0.3  # a planner that empties in less is not queried next time; a simulated one at full speed takes none
WATCH_S, WATCH_MOST_S = 0.02, 5.0  # interval of queries for the number of moves waiting, and how long they may bring no news
NEAR = 0.1  # mm or deg: M114 reports hundredths, motor steps are smaller


class Feed:
    """A program in print: run() streams it over a greeted exchange, whose callbacks are handle_event() and handle_turn().

    limit: characters of a line that the firmware keeps; total: commands of the program, None: unknown.
    """

    def __init__(
        self,
        profile: Profile | None,
        limit: int,
        total: int | None,
        *,
        control: Control,
        journal: Journal | None,
        on_progress: Callable[[PrintStatus], None] | None,
        start_s: float,
    ) -> None:
        self.profile, self.limit, self._total = profile, limit, total
        self._journal, self._on_progress = journal, on_progress
        machine = profile.machine if profile is not None else None
        self.modal, self._position = ModalState(axes_of(machine)), ProgramPosition()
        self._planner, self._worth_following, self._reports_stand_still = PlannerReports(), False, False
        self.history = LineHistory(planner=self._planner)
        self._bounds = PrintedBounds(machine) if machine is not None else None
        self.pending = PendingCommands(self.modal.axes, limit, control)
        self.pending.babystep = "" if machine is None else dialect_of(machine).babystep
        # A bed that cannot be heated has room temperature.
        most_c = (inf, inf) if machine is None else (machine.nozzle_limit_c, machine.bed_limit_c or inf)
        self.reports = PrinterReports(start_s, most_c)
        self.exchange: Exchange
        self.state, self._trouble, self.started, self.finished = PrintState.PRINTING, "", False, False
        self.sent = self._skipped = 0
        self._program_pause = ""  # the program's text about the pause before its next command
        self._shifts_z = True
        self._barriers, self._reconnected = Barriers(self.modal.axes.letters, start_s), False
        self._pause: Pause | None = None  # the current one
        self._start_s = self._shown_s = self._asked_s = start_s
        self._warned = ""  # the warning shown last

    def run(self, lines: Iterable[str], resume_point: ResumePoint | None = None) -> None:
        """Feed the program from its beginning, or from the resume point of an interrupted print, to the final barrier."""
        exchange = self.exchange
        self._shifts_z = resume_point is None or resume_point.shifts_z
        can_shift = self._shifts_z and exchange.connection.greeting.capabilities.get("BABYSTEPPING", True)
        babystep = self.pending.babystep if can_shift else ""
        if resume_point is not None:
            resume_point.check_offset(babystep)
        self.pending.begin_offset(babystep, 0.0 if resume_point is None else resume_point.z_offset_mm)
        self.started, self.history = True, self._new_history(0 if resume_point is None else resume_point.line - 1)
        if exchange.connection.greeting.capabilities.get("AUTOREPORT_TEMP"):
            exchange.send(f"M155 S{REPORT_S}")
        for line, command in self._commands(lines):
            if resume_point is not None and line < resume_point.line:
                self._skip(command)
                continue
            if resume_point is not None:
                self._approach(resume_point)
                resume_point = None
            self._before(command)
            if self.reports.leaves_out(command):
                self._skip(command)
            else:
                self._send(line, command)
        self._finish()

    def _approach(self, resume_point: ResumePoint) -> None:
        """Send the commands before the first line of a resumed print, and check them by the printer's position."""
        self.set_state(PrintState.RESUMING)
        self.history = self._new_history(resume_point.line - 1)
        self.history.acknowledge(self.exchange.connection.window.acknowledged)
        self._record()
        # A printer that has not restarted may keep what the user set before the interruption.
        overrides = f"M220 S{self.pending.feed_percent:g}", f"M221 S{self.pending.flow_percent:g}"
        for command in (*overrides, *resume_point.before):
            self.exchange.send(command)
        self._verify_position("before the print continues")
        self.set_state(PrintState.PRINTING)

    def _skip(self, command: str) -> None:
        """Skip a command that an earlier run executed, or that the firmware does not know."""
        self._track(command)
        self._skipped += 1
        self._program_pause = ""

    def _track(self, command: str) -> bool:
        """Update modal state and print's outline; True when the command moves an axis."""
        return self.modal.take(command) if self._bounds is None else self._bounds.track(self.modal, command)[0]

    def _send(self, line: int, command: str) -> None:
        if self._journal is not None:
            shift = shifts(command, self.modal.axes.letters)
            if shift or self._journal.record_due(line):
                self.history.sent = line
                self._record(hurry=shift)
        number = self.exchange.send(command)
        moves = self._track(command)
        self.sent += 1
        self.history.send(SentLine(number, line, moves, self.modal.coordinates()))

    def _commands(self, lines: Iterable[str]) -> Iterator[tuple[int, str]]:
        for line, text in enumerate(lines, 1):
            command = command_of(text, line, self.limit)
            if ";" in text:
                self._barriers.layer_ended |= self._position.read_comment(text)
            if command:
                if command[0] in "Mm":
                    self._position.read_m73(command, self.exchange.medium.now_s() - self._start_s)
                    self.pending.note_override(command)
                yield line, command
            elif PAUSE_REMARK in text:
                self._program_pause = text.partition(PAUSE_REMARK)[2].strip()

    def _before(self, command: str) -> None:
        """Do what is due before the next command of the program."""
        if self.pending.lines:
            for own in self.pending.next_lines(self.modal):
                self._record()  # it holds the Z offset that this line may change
                self.exchange.send(own)
        if self._reconnected:
            self._reconnected = False
            self._verify_position("after the port came back")
        if self._journal is not None:
            history, now_s = self.history, self.exchange.medium.now_s()
            if self._barriers.due(command, self._prints, history.tracked):
                self._end_moves()
                self._record()
            if self._barriers.check_due(command, history.tracked, now_s):
                self._check_position()
        if self._program_pause:
            why, self._program_pause = self._program_pause, ""
            self._rest(f"the program pauses: {why}")
        since_s = self.pending.pause_s
        if since_s is not None and (not self._prints(command) or self.exchange.medium.now_s() - since_s > BOUNDARY_S):
            if self._is_cold():  # by an old report, perhaps
                self.exchange.send("M105")
                self.exchange.settle()
            if not self._is_cold():
                self._rest()

    def _is_cold(self) -> bool:
        """Whether the nozzle is being heated and too cold yet for a pause, which pulls filament."""
        now_c, least_c = self.reports.temperature.nozzle_c, least_extrusion_c(self.modal.nozzle_c, self.profile)
        return extrudes(self.modal, self.profile) and now_c is not None and now_c < least_c

    def _prints(self, command: str) -> bool:
        """Whether not to pause before a command: a stroke, or one of a pair that turns the table."""
        return split_command(command.upper())[0] == "MANUAL_STEPPER" or self.modal.names_filament(command)

    def _new_history(self, before: int = 0) -> LineHistory:
        connection = self.exchange.connection
        waiting = None if connection.window.numbered else connection.greeting.waiting_moves
        return LineHistory(before, waiting, self._planner)

    def _end_moves(self) -> None:
        """Wait until every move sent so far has ended."""
        begun_s, waiting = self.exchange.medium.now_s(), self.history.waiting
        self._follow_moves()
        self.exchange.drain()
        self._note_end()
        if waiting > 1 and not self._reports_stand_still:
            self._worth_following = self.exchange.medium.now_s() - begun_s >= WORTH_S

    def _note_end(self) -> None:
        """Note that every move has ended: the query answered last followed M400."""
        self.history.end_moves(self.exchange.connection.window.sent - 1)

    def _follow_moves(self) -> None:
        """Wait while more than one move is planned, as far as the printer reports it, and keep the journal up to date."""
        exchange, history = self.exchange, self.history
        waiting, news_s = inf, exchange.medium.now_s()
        while self._worth_following and history.tracked and self._journal is not None and history.waiting > 1:
            if history.waiting < waiting:
                waiting, news_s = history.waiting, exchange.medium.now_s()
                self._record()
            elif exchange.medium.now_s() - news_s > WATCH_MOST_S:
                self._worth_following, self._reports_stand_still = False, True
            else:
                exchange.wait(max(WATCH_S, (exchange.medium.now_s() - news_s) / 2))
            exchange.send("M114")  # its ok reports the planner, it waits for nothing and changes nothing
            exchange.settle()

    def _position_errors(self) -> list[str]:
        """Axes whose reported position differs from the program's, after all moves; [] if none is reported."""
        self._follow_moves()
        position = self.exchange.ask_position()
        self._note_end()
        return position_differences(self.modal, position, NEAR) if position is not None else []

    def _check_position(self) -> None:
        wrong = self._position_errors()
        self._trouble = f"the printer stands at {', '.join(wrong)}" if wrong else ""
        self._record()

    def _verify_position(self, when: str) -> None:
        """Compare the printer's position with the program's. Raises PrinterError when they differ."""
        if wrong := self._position_errors():
            raise PrinterError(f"{when} the printer stands at {', '.join(wrong)}: its position can no longer be trusted")

    def _rest(self, why: str = "") -> None:
        """Pause, then continue at the same place; why: shown meanwhile."""
        self.set_state(PrintState.PAUSING, why)
        self._record()
        position_known = not self._position_errors()
        self._pause = Pause(self.exchange, self.pending, self.reports, self.modal, self.profile)
        for state, words in self._pause.run(self._bounds, why):
            self.set_state(state, words)
            self._record()
        self.pending.end_pause()
        if position_known:
            self._verify_position("after the pause")
        self._pause = None
        self.set_state(PrintState.PRINTING)

    def _finish(self) -> None:
        """Wait for the end of the print: the answer to a query sent after M400."""
        exchange = self.exchange
        self.set_state(PrintState.FINISHING)
        if exchange.connection.greeting.capabilities.get("AUTOREPORT_TEMP"):
            exchange.send("M155 S0")
        for own in self.pending.next_lines(self.modal):
            exchange.send(own)
        self._end_moves()  # firmwares shift the tip at once: the last moves must be over before its offset is undone
        if undone := self.pending.undo_overrides():
            self.pending.sent_offset_mm = 0.0  # a cancel must not undo it again
            for own in undone:
                exchange.send(own)
            self._end_moves()
        self.finished = True
        self._record()
        self.show(exchange.medium.now_s())

    def handle_event(self, event: Event) -> None:
        """Handle an event of the printer."""
        now_s = self.exchange.medium.now_s()
        if event.kind is Kind.OK and event.line is not None:
            window = self.exchange.connection.window
            if window.line_number(event.line) == window.acknowledged:
                self.history.acknowledge(window.acknowledged, event.planner_free)
        command = self.reports.read(event, now_s)
        if command is not None:
            self.pending.accept(command, self.state, now_s)

    def handle_turn(self, now_s: float) -> None:
        """Handle a turn of the exchange."""
        self.history.acknowledge(self.exchange.connection.window.acknowledged)
        self.poll()
        self.reports.check_silence(now_s, self._cannot_report())
        if self._journal is not None and self.started:  # until then it holds the record of an interrupted print
            self._journal.update(self._checkpoint(), now_s)
        asked_s = max(self.reports.temperature_s, self._asked_s)
        if now_s - asked_s >= ASK_S and self.exchange.connection.send("M105", now_s):
            self._asked_s = now_s

    def _cannot_report(self) -> bool:
        """Whether the printer cannot report temperatures now: it is at a slow command or waits for the user, and does not report
        by itself."""
        connection = self.exchange.connection
        reports = connection.greeting.capabilities.get("AUTOREPORT_TEMP")
        return not reports and (bool(self.reports.waiting) or connection.window.at_slow_command)

    def poll(self) -> None:
        """Take the user's requests, and show the status regularly. Raises CancelledError, EmergencyError."""
        now_s, message = self.exchange.medium.now_s(), self.pending.message
        wanted = self.pending.pause_s is not None
        self.pending.poll(self.state, now_s)
        changed = self.pending.message != message or (self.pending.pause_s is not None) != wanted
        if now_s - self._shown_s >= PROGRESS_S or changed or self._warning() != self._warned:
            self.show(now_s)

    def set_state(self, state: PrintState, message: str = "") -> None:
        """Show a new state at once."""
        self.state, self.pending.message = state, message
        self.show(self.exchange.medium.now_s())

    @contextmanager
    def in_state(self, state: PrintState, message: str) -> Iterator[None]:
        """Use another state during a block; the position is checked before the print continues."""
        before, words = self.state, self.pending.message
        self._reconnected, self._trouble = True, message
        self.set_state(state)
        try:
            yield
        finally:
            self._trouble = ""
            self.set_state(before, words)

    def lift_move(self) -> tuple[str, float] | None:
        """Words and mm/min of a move away from the print; None when Z is unknown, or the tip is away already."""
        if self.profile is None or (self._pause is not None and self._pause.aside):
            return None
        return lift_move(self.modal, self.profile.machine)

    def record_lift(self, position: Mapping[str, float] | None) -> None:
        """Record that the tip was lifted off the print for good; position: reported by the printer."""
        if self._journal is not None:
            pose = tuple((position or {}).get(letter) for letter in self.modal.axes.letters)
            self._journal.write(replace(self._checkpoint(), state=PrintState.CANCELLED, pose=pose))

    def _checkpoint(self) -> Checkpoint:
        history, waits = self.history, self._pause.stands if self._pause is not None else None
        number = self.exchange.connection.window.wire_number(history.number)
        # while heating again or without a port the tip still waits
        state = PrintState.DONE if self.finished else PrintState.PAUSED if waits is not None else self.state
        z_offset_mm, shifts_z = round(self.pending.sent_offset_mm, 3), self._shifts_z
        lines = history.sent, history.acknowledged, history.executed, number
        return Checkpoint(*lines, waits or history.pose, state, z_offset_mm, shifts_z)

    def _record(self, hurry: bool = False) -> None:
        if self._journal is not None:
            self._journal.write(self._checkpoint(), hurry)

    def show(self, now_s: float) -> None:
        """Report the progress."""
        self._shown_s, self._warned = now_s, self._warning()
        if self._on_progress is None:
            return
        at, history, feed_percent = self._position, self.history, self.pending.feed_percent
        elapsed_s, done = now_s - self._start_s, self._skipped + history.commands
        pausing = (
            self.state is PrintState.PRINTING and self.pending.pause_s is not None
        )  # begins at the end of the current stroke
        self._on_progress(
            PrintStatus(
                sent=self.sent, acknowledged=done, total=self._total, elapsed_s=elapsed_s,
                left_s=None if self.state is PrintState.CANCELLING else at.left_s(elapsed_s, feed_percent),
                share=at.share(done, self._total),
                temperature=self.reports.temperature, heat_age_s=now_s - self.reports.temperature_s,
                part=at.part, parts=at.parts, layer=at.layer,
                state=PrintState.PAUSING if pausing else self.state,
                file_line=history.acknowledged,
                feed_percent=feed_percent, flow_percent=self.pending.flow_percent,
                z_offset_mm=self.pending.z_offset_mm,
                message=self.pending.message or self._trouble or self.reports.waiting or self._silence() or self._delay(pausing),
                warning=self._warned,
            )
        )  # fmt: skip

    def _delay(self, pausing: bool) -> str:
        """Message about the heat or the slow command that a requested pause waits for."""
        window = self.exchange.connection.window
        slow = next((window.command(line.number) for line in window.flight if line.slow_timeout_s), "") if pausing else ""
        if pausing and (self._is_cold() or (slow and command_in(slow).waits == "heat")):
            return "it pauses once it is hot"
        return f"it pauses after {slow}" if slow else ""

    def _warning(self) -> str:
        return self._journal.warning if self._journal is not None else ""

    def _silence(self) -> str:
        """The message while an answer is overdue; slow commands may take their time."""
        connection = self.exchange.connection
        overdue = connection.state is State.PROBING and not connection.window.at_slow_command
        return "no answer from the printer, it is asked again" if overdue else ""
