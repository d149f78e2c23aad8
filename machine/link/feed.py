"""Feed: one print under way; the program's commands in order, and between them what person, printer and journal want."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import inf
from threading import Event as Flag

from machine.link.control import Control
from machine.link.doubt import was_done
from machine.link.events import Event, Ok, Position
from machine.link.framing import command_of
from machine.link.inquiry import Found
from machine.link.job import Begin, Job
from machine.link.journal import FINISHED, LEFT, Journal, Moment
from machine.link.modal import Modal, axes_of
from machine.link.park import Laid, lift_words, standing_mm
from machine.link.progress import Place, Progress
from machine.link.reports import Reports
from machine.link.retreat import retreat, unlike
from machine.link.states import State
from machine.link.talk import Talk
from machine.link.trail import Step, Trail
from machine.link.watchdog import Watchdog
from machine.link.wishes import Wishes
from profiles.errors import RemoteProtocolError

PROGRESS_S = 0.2  # a person reads no faster
ASK_S = 5.0  # between temperature questions to a printer that does not report by itself, or has fallen silent
REPORT_S = 2  # between reports of one that does
BOUNDARY_S = 15.0  # a pause waits so long for the end of a stroke
CHECK_S = 30.0  # between looks at the position where a layer ends
CHECK_MUTE_S = 10.0  # the same for a printer that does not tell what it has executed
NEAR = 0.1  # mm or deg: M114 tells hundredths, motor steps are smaller


class Feed:
    """run() a program over a greeted talk; heard() and turned() are the talk's callbacks."""

    def __init__(
        self,
        job: Job,
        control: Control | None,
        journal: Journal | None,
        on_progress: Callable[[Progress], None] | None,
        stop: Flag | None,
        began_s: float,
    ) -> None:
        self._job, self._journal, self._on_progress = job, journal, on_progress
        machine = job.profile.machine if job.profile is not None else None
        self.modal, self.trail, self._place = Modal(axes_of(machine)), Trail(), Place()
        self._laid = Laid(machine) if machine is not None else None
        self._wishes = Wishes(self.modal.axes, job.limit, control, stop)
        # A bed that cannot be heated is as warm as its room.
        watchdog = Watchdog((machine.nozzle_limit_c, machine.bed_limit_c or inf)) if machine is not None else Watchdog()
        self.reports = Reports(watchdog, began_s)
        self.talk: Talk
        self.begin: Begin | None = None  # of a resumed print
        self.state, self._trouble, self.begun, self.finished = "printing", "", False, False
        self.sent = self._absorbed = 0
        self._layer_ended = self._verify = self._away = False
        self._began_s = self._shown_s = self._asked_s = self._checked_s = began_s

    @property
    def acknowledged(self) -> int:
        """Commands of the program that the printer has taken."""
        return self.trail.commands

    def run(self, lines: Iterable[str]) -> None:
        """Feed the program from its beginning, or where the job says, to the barrier at its end."""
        talk = self.talk
        begin, self.begun = self.begin, True
        if talk.protocol.capabilities.get("AUTOREPORT_TEMP"):
            talk.send(f"M155 S{REPORT_S}")
        for line, command in self._commands(lines):
            if begin is not None and line < begin.line:
                self._absorb(command)
                continue
            if begin is not None:
                self._approach(begin)
                begin = None
            self._between(command)
            self._send(line, command)
        self._finish()

    def _approach(self, begin: Begin) -> None:
        """What stands before the first line of a resumed print, proved by the printer's own position."""
        self.turn_to("resuming")
        self.trail = Trail(begin.line - 1)
        self.trail.acknowledge(self.talk.protocol.window.acknowledged)
        self._mark()
        for command in begin.before:
            self.talk.send(command)
        self._prove("before the print goes on")
        self.turn_to("printing")

    def _absorb(self, command: str) -> None:
        """A command that was done by an earlier run."""
        self._follow(command)
        self._absorbed += 1

    def _follow(self, command: str) -> bool:
        """Keep modal state and the print's outline in step; True when the command moves something."""
        return self.modal.take(command) if self._laid is None else self._laid.follow(self.modal, command)[0]

    def _send(self, line: int, command: str) -> None:
        if self._journal is not None and self._journal.behind(line):
            self.trail.sent = line
            self._mark()
        number = self.talk.send(command)
        moves = self._follow(command)
        self.sent += 1
        self.trail.send(Step(number, line, moves, self.modal.place()))

    def _commands(self, lines: Iterable[str]) -> Iterator[tuple[int, str]]:
        for line, text in enumerate(lines, 1):
            command = command_of(text, line, self._job.limit)
            if command:
                if command.startswith("M73"):
                    self._place.told(command, self.talk.medium.now_s() - self._began_s)
                elif command.startswith(("M220", "M221")):
                    self._wishes.told(command)
                yield line, command
            elif text.startswith(";"):
                self._place.comment(text)
                self._layer_ended = self._layer_ended or text.startswith(";LAYER_CHANGE")

    def _between(self, command: str) -> None:
        """What is due before the next command of the program."""
        if self._wishes.lines:
            self._send_own()
        if self._verify:
            self._verify = False
            self._prove("after the port came back")
        if self._journal is not None and (self._layer_ended or not self.talk.protocol.advanced) and self._due(command):
            self._check()
        since_s = self._wishes.pause_s
        if since_s is not None and (not _pushes(command) or self.talk.medium.now_s() - since_s > BOUNDARY_S):
            self._pause()

    def _send_own(self) -> None:
        """Commands of the person's own."""
        while self._wishes.lines:
            command = self._wishes.lines.popleft()
            self.talk.send(command)
            if command[0] in "Mm":  # a person's temperature or fan holds beyond a pause
                self.modal.take(command)

    def _due(self, command: str) -> bool:
        """Whether the position is to be looked at now: at a layer's end, or in a travel where the printer tells little."""
        ended, self._layer_ended = self._layer_ended, False
        since_s = self.talk.medium.now_s() - self._checked_s
        if self.talk.protocol.advanced:
            return ended and since_s >= CHECK_S
        return (ended or command.startswith("G0")) and since_s >= CHECK_MUTE_S

    def _check(self) -> None:
        self._checked_s = self.talk.medium.now_s()
        told = self.talk.ask_position()
        self.trail.barrier()
        wrong = unlike(self.modal, told.axes, NEAR) if told is not None else []
        self._trouble = f"the printer stands at {', '.join(wrong)}" if wrong else ""
        self._mark()

    def _prove(self, when: str) -> None:
        """Compare the printer's own position with the program's; raises RemoteProtocolError when they differ."""
        told = self.talk.ask_position()
        self.trail.barrier()
        if told is not None and (wrong := unlike(self.modal, told.axes, NEAR)):
            raise RemoteProtocolError(f"{when} the printer stands at {', '.join(wrong)}: its position can no longer be trusted")

    def _pause(self) -> None:
        """Leave the print, wait for the wish to go on, and come back to the same place."""
        self.turn_to("pausing")
        self._mark()
        told = self.talk.ask_position()
        self.trail.barrier()
        agreed = told is None or not unlike(self.modal, told.axes, NEAR)
        way = retreat(self.modal, self._job.profile, self._laid)
        self._away = way.park is not None
        for command in way.away:
            self.talk.send(command)
        self.talk.drain()
        if way.park is not None:
            self.trail.pose = (*way.park.stand_mm, *self.modal.at[3:])
        self.turn_to("paused")
        self._mark()
        wishes = self._wishes
        while not wishes.resume:
            self.talk.rest(until=lambda: wishes.resume or bool(wishes.lines))
            self._send_own()
        self.turn_to("resuming")
        self._mark()
        for command in way.back:
            self.talk.send(command)
        wishes.resumed()
        if agreed:
            self._prove("after the pause")
        self._away = False
        self.turn_to("printing")

    def _finish(self) -> None:
        """The barrier: the print is done when a question asked after M400 is answered."""
        talk = self.talk
        self.turn_to("finishing")
        if talk.protocol.capabilities.get("AUTOREPORT_TEMP"):
            talk.send("M155 S0")
        for command in self._wishes.undone():
            talk.send(command)
        talk.drain()
        self.trail.barrier()
        self.finished = True
        self._mark()
        self.show(talk.medium.now_s())

    def heard(self, event: Event) -> None:
        """An event of the printer."""
        now_s = self.talk.medium.now_s()
        if isinstance(event, Ok) and event.line is not None:
            window = self.talk.protocol.window
            if window.line(event.line) == window.acknowledged:
                self.trail.acknowledge(window.acknowledged, event.planner_free)
        request = self.reports.hear(event, now_s)
        if request is not None:
            self._wishes.grant(request, self.state, now_s)

    def turned(self, now_s: float) -> None:
        """Once a turn of the talk."""
        self.trail.acknowledge(self.talk.protocol.window.acknowledged)
        self.heed()
        self.reports.wait(now_s, self._mute())
        if self._journal is not None:
            self._journal.note(self._moment(), now_s)
        if now_s - max(self.reports.heard_s, self._asked_s) >= ASK_S and self.talk.protocol.room("M105"):
            self._asked_s = now_s
            self.talk.protocol.send("M105", now_s)

    def _mute(self) -> bool:
        """Whether the printer tells no temperatures now: it is at a slow command, and does not report by itself."""
        protocol = self.talk.protocol
        return not protocol.capabilities.get("AUTOREPORT_TEMP") and any(line.budget_s for line in protocol.window.flight)

    def heed(self) -> None:
        """See what a person wants, and show where the print stands now and then. Raises CancelledError, EmergencyError."""
        now_s, message = self.talk.medium.now_s(), self._wishes.message
        self._wishes.heed(self.state, now_s)
        if now_s - self._shown_s >= PROGRESS_S or self._wishes.message != message:
            self.show(now_s)

    def turn_to(self, state: str) -> None:
        """Show a new state at once."""
        self.state, self._wishes.message = state, ""
        self.show(self.talk.medium.now_s())

    @contextmanager
    def apart(self, state: str, message: str) -> Iterator[None]:
        """Another state for as long as something takes; the position is proved before the print goes on."""
        before, self._verify, self._trouble = self.state, True, message
        self.turn_to(state)
        try:
            yield
        finally:
            self._trouble = ""
            self.turn_to(before)

    def was_done(self, found: Found) -> bool | None:
        """Whether the one line of the program on its way has been done, by where the printer stands; None: nobody can say."""
        window, step = self.talk.protocol.window, self.trail.unanswered
        waiting = [line.number for line in window.flight if not line.asks_temperature]
        if step is None or waiting != [step.number]:
            return None
        return was_done(window.command(step.number), self.trail.pose, self.modal, found)

    def lift(self) -> tuple[str, float] | None:
        """Words and mm/min of a step that takes the tip away from the print; None where Z is not known, or it is away already."""
        if self._job.profile is None or self._away:
            return None
        machine, following = self._job.profile.machine, self.modal.follows
        standing = standing_mm(machine, self.modal.place(), following)
        if standing is None:
            return None
        at, pose = standing
        far = min(machine.lift_mm, machine.z.limits_mm[1] - float(at[2]))
        return (lift_words(machine, pose, far, following), 60.0 * machine.z.speed_mm_s) if far > 0 else None

    def left(self, told: Position | None) -> None:
        """The tip was lifted off the print for good; told: where the printer says it stands now."""
        places = dict(told.axes) if told is not None else {}
        if self._journal is not None:
            pose = tuple(places.get(letter) for letter in self.modal.axes.letters)
            self._journal.mark(replace(self._moment(), state=LEFT, pose=pose))

    def _moment(self) -> Moment:
        trail = self.trail
        number = self.talk.protocol.window.wire(trail.number)
        return Moment(
            trail.sent, trail.acknowledged, trail.executed, number, trail.pose, FINISHED if self.finished else self.state
        )

    def _mark(self) -> None:
        if self._journal is not None:
            self._journal.mark(self._moment())

    def show(self, now_s: float) -> None:
        """Tell the progress."""
        self._shown_s = now_s
        if self._on_progress is None:
            return
        elapsed_s, place, done = now_s - self._began_s, self._place, self._absorbed + self.trail.commands
        self._on_progress(
            Progress(
                sent=self.sent, acknowledged=done, total=self._job.total, elapsed_s=elapsed_s,
                left_s=self._left_s(elapsed_s), share=place.share(done, self._job.total),
                temperature=self.reports.temperature, part=place.part, parts=place.parts, layer=place.layer, state=self.state,
                file_line=self.trail.acknowledged, feed_percent=self._wishes.feed_percent, flow_percent=self._wishes.flow_percent,
                message=self._wishes.message or self._trouble or self._silence(),
            )
        )  # fmt: skip

    def _left_s(self, elapsed_s: float) -> float | None:
        schedule, trail, feed = self._job.schedule, self.trail, self._wishes.feed_percent
        if schedule is None:
            return self._place.left_s(elapsed_s, feed)
        return schedule.left_s(trail.before, trail.acknowledged, elapsed_s, feed)

    def _silence(self) -> str:
        """Said while an answer is overdue; a slow command may take its time."""
        protocol = self.talk.protocol
        slow = any(line.budget_s for line in protocol.window.flight)
        return "no answer from the printer, it is asked again" if protocol.state is State.PROBING and not slow else ""


def _pushes(command: str) -> bool:
    """Whether a command is a stroke, or one of a pair that turns the table: no place to pause before."""
    return command.startswith("MANUAL_STEPPER") or (command[0] == "G" and command[1:2] in "123" and " E" in command)
