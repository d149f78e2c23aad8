"""At page: a job as pages of the workbench see it, the loading of a bench's slices, and the user who attends it there."""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from pathlib import Path
from queue import SimpleQueue
from threading import Event as Flag
from threading import Lock, Thread
from time import time
from typing import Any, BinaryIO

from machine.cli.terminal.interrupts import stopping
from machine.dryrun.dryrun import dry_run
from machine.dryrun.findings import KnownFindings
from machine.link.pending_commands import Command, Control
from machine.link.print_state import PrintState, PrintStatus
from machine.notices import Notice, Report, marked_line, plain_line
from machine.pipeline import compilers
from machine.pipeline.programs import LoadedProgram
from machine.printing.destination import Server
from machine.printing.job import Does, PrintJob, Scene, Show
from machine.program import Program
from mdp.kernels.workers import frame
from profiles.errors import JournalError, PlanError
from profiles.profile import Profile

LAST_WORD_S = 5.0  # a server that stands still is not waited for any longer
LINES_KEPT = 100  # of what the program says
BEGIN, LEAVE = "begin", "leave"  # LEAVE: a print on a server goes on without this program
ANSWERS = (BEGIN, LEAVE, Command.CANCEL, Command.EMERGENCY_STOP)  # to the question whether to begin


@dataclass(frozen=True)
class JobState:
    """A print as pages see it. resumes: the journal of the print whose rest it is; key: of the slices; starts: False where a
    print server only gets the file; server: whether a print server prints it.

    question: what a person is asked before it begins; log, journal: files; webcam: where its picture is; sentence: how it ended;
    checks: what was found before, forced where it speaks against the print; words: what the printer has said; said: what the
    program has; figures: of the program; progress: the newest moment, told_s: when it was, seconds since 1970; forcible: force
    goes past why it was refused; stop_given: an emergency stop was heard.
    """

    state: PrintState = PrintState.CHECKING
    name: str = ""
    machine: str = ""
    port: str = ""
    resumes: str = ""
    key: str = ""
    starts: bool = True
    server: bool = False
    question: str = ""
    log: str = ""
    journal: str = ""
    webcam: str = ""
    sentence: str = ""
    checks: tuple[Notice, ...] = ()
    words: tuple[str, ...] = ()
    said: tuple[str, ...] = ()
    figures: dict[str, Any] | None = None
    progress: PrintStatus | None = None
    told_s: float = 0.0
    forcible: bool = False
    stop_given: bool = False

    def json(self) -> dict[str, Any]:
        """The state for a page. over: whether nothing of it goes on; heat_s: since when the temperatures are known, seconds since
        1970, for the page goes on counting when nothing more comes."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        checks = [{"text": check.text, "forced": check.forced} for check in self.checks]
        moment = self.progress
        if moment is not None and self.state.is_over:  # an upload that has ended says nothing of a print
            moment = None if moment.state is PrintState.UPLOADING else replace(moment, state=self.state)
        progress = moment and moment.json() | {"heat_s": self.told_s - moment.heat_age_s}
        return values | {"checks": checks, "progress": progress, "over": self.state.is_over}


def first_state(job: PrintJob) -> JobState:
    """The state of a print before its process has reported anything."""
    name = job.name or {Does.HAND: "by hand", Does.FOLLOW: "what it prints"}.get(job.does, "")
    return JobState(
        name=name if job.cut_off is None else job.cut_off.stem,
        machine=job.profile.machine.name if job.does is Does.PRINT and job.profile is not None else "",
        port=job.destination.name,
        resumes=str(job.cut_off or ""),
        key=job.key,
        starts=job.starts,
        server=isinstance(job.destination, Server),
    )


@dataclass(frozen=True, eq=False)
class Slices:
    """A bench's slices, called to load them. gcode: a file as `export` writes it; known: what a dry run has found of it."""

    name: str
    gcode: Path
    profile: Profile
    known: KnownFindings | None = None

    def __call__(self) -> LoadedProgram:
        """These very lines, dry-run; what the dry run of the very same has found for the very same profile is not looked for
        again. Raises PlanError where they are not there any more."""
        try:
            text = self.gcode.read_bytes().decode()
        except FileNotFoundError:
            raise PlanError("these slices are not there any more: slice what is to be printed again") from None
        compilers.wait_for(compilers.DRY_RUN)
        lines = tuple(text.removesuffix("\n").split("\n"))
        findings = None if self.known is None else self.known.of(lines, self.profile)
        return LoadedProgram(self.name, Program(lines, dry_run(lines, self.profile, findings), None), self.profile)


class HandDoes(StrEnum):
    """Actions of a person at a printer in hand."""

    HEAT = "heat"
    COOL = "cool"
    HOME = "home"
    JOG = "jog"
    LET_GO = "let_go"


@dataclass(frozen=True)
class HandCommand:
    """axis, by_mm: of a jog; keep_heat: of letting go, the heaters stay as they are."""

    does: HandDoes
    axis: str = ""
    by_mm: float = 0.0
    keep_heat: bool = False


class StateReporter:
    """Tells the server the newest state, from a thread of its own: who prints never waits for who listens.

    tell() from any thread; what comes while the server does not read is put together, so nothing is ever held back.
    """

    def __init__(self, out: BinaryIO, state: JobState) -> None:
        self._out, self._state = out, state
        self._lock, self._changed, self._over = Lock(), Flag(), False
        self._thread = Thread(target=self._serve, name="reporter", daemon=True)
        self._thread.start()

    def tell(self, **values: Any) -> None:
        """Change parts of the state."""
        with self._lock:
            self._state = replace(self._state, **values)
        self._changed.set()

    def close(self) -> None:
        """Say the last word."""
        self._over = True
        self._changed.set()
        self._thread.join(LAST_WORD_S)

    def _serve(self) -> None:
        over = False
        while not over:
            self._changed.wait()
            self._changed.clear()
            over = self._over
            try:
                self._out.write(frame(self._state))
                self._out.flush()
            except (OSError, ValueError):  # the server is gone: the print ends by what it hears, not by what it says
                return


class AtPage:
    """The `Person` at a page. hear() and leave() come from the thread that listens to the server, all else from the other.

    cut_off: the journal of the print whose rest it is. agreed: to what was found: from then on something may move.
    """

    def __init__(self, reporter: StateReporter, cut_off: Path | None = None) -> None:
        self.stop = Flag()
        self.commands = Control(self.stop)
        self.agreed = False
        self.tell, self._cut_off = reporter.tell, cut_off
        self._checks: tuple[Notice, ...] = ()
        self._lines: deque[str] = deque(maxlen=LINES_KEPT)
        self._answers: SimpleQueue[bool] = SimpleQueue()
        self._gives_up, self._halts = Flag(), Flag()
        self.by_hand: SimpleQueue[HandCommand] = SimpleQueue()  # what is to be done at a printer that is in hand
        self.interrupt: Callable[[Command | str], None] = lambda word: None  # called with what ends it at once

    def hear(self, word: Command | HandCommand | str, value: float = 100.0) -> None:
        """Take a command of the person: for a print, by hand, BEGIN or LEAVE."""
        if isinstance(word, HandCommand):
            self.by_hand.put(word)
            return
        if isinstance(word, Command):
            self.commands.ask(word, value)
        if word in (Command.CANCEL, LEAVE):
            self._gives_up.set()
        if word == LEAVE:
            self.stop.set()
        if word == Command.EMERGENCY_STOP:
            self._halts.set()
        if word in ANSWERS:
            self._answers.put(word == BEGIN)
        if word in (Command.CANCEL, Command.EMERGENCY_STOP):
            self.interrupt(word)

    def leave(self) -> None:
        """The server is gone, and nobody can command any more: the print ends as if it had been cancelled, but one on a print
        server goes on there."""
        self.stop.set()
        self._answers.put(False)
        self.interrupt(LEAVE)

    def passed(self, sentence: str) -> None:
        """Add a passed check."""
        self._add(Notice(marked_line(sentence)))

    def hear_notice(self, notice: Notice) -> None:
        """Add a notice of the program; an error that --force goes past is a check, too."""
        if notice.forced:
            self._add(Notice(notice.text.rstrip(), forced=True))
        self._lines.extend(line for line in notice.text.split("\n") if line.strip())
        self.tell(said=tuple(self._lines))

    @contextmanager
    def progress(self) -> Iterator[Report]:
        """The progress of work before the print, told only while it lasts."""
        try:
            yield lambda text, share=None: self.tell(said=(*self._lines, marked_line(text)))
        finally:
            self.tell(said=tuple(self._lines))

    def _add(self, check: Notice) -> None:
        self._checks = (*self._checks, check)
        self.tell(checks=self._checks)

    def ask(self, question: str, choices: tuple[str, ...] = ()) -> int | None:
        """Wait for the person's word to begin. Raises JournalError where one must look at the printer."""
        if choices:
            raise JournalError(f"{question}; which one is asked at a terminal only: tiltprint resume {self._cut_off}")
        self.tell(state=PrintState.READY, question=question)
        self.agreed = self._answers.get()
        return 0 if self.agreed else None

    @contextmanager
    def show(self, scene: Scene) -> Iterator[Show]:
        """The print as its state. A print of which nothing changes, as a paused one on a server, is heard of all the same."""
        journal = "" if scene.journal is None else str(scene.journal.path)
        self.tell(log="" if scene.log.trouble else str(scene.log.file), journal=journal)
        if scene.uploads:
            self.tell(state=PrintState.UPLOADING)
        with nullcontext() if scene.server else stopping(self.stop):
            yield lambda status: self._show(status, scene)

    def _show(self, status: PrintStatus | None, scene: Scene) -> None:
        if status is None:
            self.tell(state=PrintState.PRINTING, progress=None, told_s=time())
            return
        values: dict[str, Any] = {"progress": replace(status, message=plain_line(status.message)), "told_s": time()}
        if status.state.is_printing:  # what a server tells besides is not the end of the job yet
            values["state"] = status.state
        if not scene.uploads:
            scene.messages.add(status.message)
            values["words"] = tuple(plain_line(word) for word in scene.messages.last)
        if status.warning:
            values["journal"] = ""
        self.tell(**values)

    def left(self) -> bool:
        """Whether a print on a server is left."""
        return self.stop.is_set()

    def lets_go(self) -> bool:
        """Whether a printer in hand is let go of, its heaters off."""
        return self.stop.is_set() or self._gives_up.is_set()

    def gives_up(self) -> bool:
        """Whether there is to be no print on a server, as long as none has begun; an emergency stop is given to the printer."""
        return (self._gives_up.is_set() or self.stop.is_set()) and not self._halts.is_set()

    def has_stopped(self) -> bool:
        """Whether the print has been stopped at once, at its end: the order was heard and is not waiting any more."""
        waiting = iter(self.commands.take, None)
        return self._halts.is_set() and all(request.command != Command.EMERGENCY_STOP for request in waiting)
