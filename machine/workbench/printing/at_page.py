"""The user at a page during a print: state for pages, commands from them, and loading of a bench's slices."""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, fields, replace
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

LAST_WORD_S = 5.0  # a server that hangs is not waited for any longer
LINES_KEPT = 100  # number of the program's messages that are kept
BEGIN, LEAVE = "begin", "leave"  # LEAVE: a print on a server continues without this program
BEFORE_LIVE = {PrintState.CHECKING: "checking …", PrintState.PRINTING: "starting", PrintState.CANCELLING: "ending"}
IS_READY = "Is the table empty and clean, is the filament loaded, and are all hands out of the machine?"
IS_KEPT = "The server stores the file; nothing prints until someone starts it there."
HEATERS_OFF = "The heaters go off; the printed part stays on the table."
ANSWERS = (BEGIN, LEAVE, Command.CANCEL, Command.EMERGENCY_STOP)  # to the question whether to begin


@dataclass(frozen=True)
class JobState:
    """A print for pages. status: its newest moment with its state, received at told_s, seconds since 1970; live: whether more of
    the status than its state is known. resumes: journal of the print that it completes; key: of the slices; starts: False if a
    print server only stores the file; server: whether a print server prints it.

    question: asked before it begins; log, journal: files; webcam: URL of its picture; sentence: how it ended; checks: results of
    the checks, forced if they speak against the print; words: the printer's messages; said: the program's messages; figures: of
    the program; forcible: force overrides the refusal; stop_given: an emergency stop was executed.
    """

    status: PrintStatus = field(default_factory=lambda: PrintStatus(PrintState.CHECKING))
    live: bool = False
    told_s: float = 0.0
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
    forcible: bool = False
    stop_given: bool = False

    @property
    def state(self) -> PrintState:
        return self.status.state

    def changed(self, state: PrintState | None = None, **values: Any) -> "JobState":
        """A copy with other values; state: of its status."""
        changed = replace(self, **values)
        return changed if state is None else replace(changed, status=replace(changed.status, state=state))

    def json(self) -> dict[str, Any]:
        """The print and its status for a page, side by side. heat_s: time of the temperatures, seconds since 1970: the
        page shows their age."""
        values = {each.name: getattr(self, each.name) for each in fields(self) if each.name != "status"}
        checks = [{"text": check.text, "forced": check.forced} for check in self.checks]
        heat_s = self.told_s - self.status.heat_age_s
        return self.status.json() | values | {"checks": checks, "heat_s": heat_s, "how": self.how, "texts": self.texts()}

    @property
    def how(self) -> str:
        """How the print is, or how it has ended."""
        if self.state.is_over:
            return self.sentence
        if self.live:
            return self.status.in_words()
        if self.state is PrintState.UPLOADING:
            return self.status.message or "uploading"
        if self.state is PrintState.READY:
            return "ready to print" if self.starts else "ready to upload"
        return BEFORE_LIVE.get(self.state, f"{self.state}")

    def texts(self) -> dict[str, str]:
        """Texts of a page by the ids of its elements."""
        port = "the simulated printer" if self.port == "sim" else self.port
        state = ": ".join(filter(None, (self.state, self.status.warning)))
        ends = "The server ends it, as its own macros say." if self.server else HEATERS_OFF
        return {
            "run-title": f"{'the rest of ' * bool(self.resumes)}{self.name} on {port}",
            "run-news": f"{self.name}: {self.sentence if self.state.is_over else state}",  # a reader need not hear every per cent
            "ask-told": self.question or (IS_READY if self.starts else IS_KEPT),
            "begin": "Resume now" if self.resumes else "Print now" if self.starts else "Upload",
            "leave": "Not now",
            "pause": "Resume" if self.state.is_away else "Pause",
            "sure-told": f"Cancel this print? {ends}",
        }


def first_state(job: PrintJob) -> JobState:
    """The state of a print before its process has reported anything."""
    name = job.name or {Does.HAND: "manual control", Does.FOLLOW: "the current print"}.get(job.does, "")
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
    """The slices of a bench, loaded by a call. gcode: a file as `export` writes it; known: findings of its dry run."""

    name: str
    gcode: Path
    profile: Profile
    known: KnownFindings | None = None

    def __call__(self) -> LoadedProgram:
        """Load and dry-run the lines; known findings for the same lines and profile are reused. Raises PlanError if the file is
        gone."""
        try:
            text = self.gcode.read_bytes().decode()
        except FileNotFoundError:
            raise PlanError("these slices no longer exist: slice what is to be printed again") from None
        compilers.wait_for(compilers.DRY_RUN)
        lines = tuple(text.removesuffix("\n").split("\n"))
        findings = None if self.known is None else self.known.of(lines, self.profile)
        return LoadedProgram(self.name, Program(lines, dry_run(lines, self.profile, findings), None), self.profile)


class HandDoes(StrEnum):
    HEAT = "heat"
    COOL = "cool"
    HOME = "home"
    JOG = "jog"
    LET_GO = "let_go"


@dataclass(frozen=True)
class HandCommand:
    """axis, by_mm: of a jog; keep_heat: the heaters stay on after the session."""

    does: HandDoes
    axis: str = ""
    by_mm: float = 0.0
    keep_heat: bool = False


class StateReporter:
    """Sends the newest state to the server from its own thread, so that printing never waits for a reader.

    `tell()` is thread-safe; changes are merged while the server does not read, so nothing blocks.
    """

    def __init__(self, out: BinaryIO, state: JobState) -> None:
        self._out, self._state = out, state
        self._lock, self._changed, self._over = Lock(), Flag(), False
        self._thread = Thread(target=self._serve, name="reporter", daemon=True)
        self._thread.start()

    def tell(self, state: PrintState | None = None, **values: Any) -> None:
        """Change values of the job, or the state of its status."""
        with self._lock:
            self._state = self._state.changed(state, **values)
        self._changed.set()

    def close(self) -> None:
        """Send the final state."""
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
            except (OSError, ValueError):  # the server is gone: the print ends through its input, not its output
                return


class AtPage:
    """Implements `Person` at a page. One thread, which reads from the server, calls hear() and leave(), another one all else.

    cut_off: journal of the print to be resumed. agreed: the user has confirmed, so that something may move.
    """

    def __init__(self, reporter: StateReporter, cut_off: Path | None = None) -> None:
        self.stop = Flag()
        self.commands = Control(self.stop)
        self.agreed = False
        self.tell, self._cut_off = reporter.tell, cut_off
        self._checks: tuple[Notice, ...] = ()
        self._lines: deque[str] = deque(maxlen=LINES_KEPT)
        self._answers: SimpleQueue[bool] = SimpleQueue()
        self._cancels, self._halts = Flag(), Flag()
        self.by_hand: SimpleQueue[HandCommand] = SimpleQueue()  # commands for a printer under manual control
        self.interrupt: Callable[[Command | str], None] = lambda word: None  # called with the command that ends it at once

    def hear(self, word: Command | HandCommand | str, value: float = 100.0) -> None:
        """Handle a command: for a print, for manual control, BEGIN or LEAVE."""
        if isinstance(word, HandCommand):
            self.by_hand.put(word)
            return
        if isinstance(word, Command):
            self.commands.ask(word, value)
        if word in (Command.CANCEL, LEAVE):
            self._cancels.set()
        if word == LEAVE:
            self.stop.set()
        if word == Command.EMERGENCY_STOP:
            self._halts.set()
        if word in ANSWERS:
            self._answers.put(word == BEGIN)
        if word in (Command.CANCEL, Command.EMERGENCY_STOP):
            self.interrupt(word)

    def leave(self) -> None:
        """Handle the loss of the server: cancel the print, because no one can control it; one on a print server continues."""
        self.stop.set()
        self._answers.put(False)
        self.interrupt(LEAVE)

    def passed(self, sentence: str) -> None:
        self._add(Notice(marked_line(sentence)))

    def hear_notice(self, notice: Notice) -> None:
        """Add a notice of the program; an error that --force overrides is also a check."""
        if notice.forced:
            self._add(Notice(notice.text.rstrip(), forced=True))
        self._lines.extend(line for line in notice.text.split("\n") if line.strip())
        self.tell(said=tuple(self._lines))

    @contextmanager
    def progress(self) -> Iterator[Report]:
        """Report the progress of work before the print, only while it lasts."""
        try:
            yield lambda text, share=None: self.tell(said=(*self._lines, marked_line(text)))
        finally:
            self.tell(said=tuple(self._lines))

    def _add(self, check: Notice) -> None:
        self._checks = (*self._checks, check)
        self.tell(checks=self._checks)

    def ask(self, question: str, choices: tuple[str, ...] = ()) -> int | None:
        """Wait until the user confirms or declines. Raises JournalError for a question that requires a look at the printer."""
        if choices:
            raise JournalError(f"{question}; which one is asked at a terminal only: tiltprint resume {self._cut_off}")
        self.tell(state=PrintState.READY, question=question)
        self.agreed = self._answers.get()
        return 0 if self.agreed else None

    @contextmanager
    def show(self, scene: Scene) -> Iterator[Show]:
        """Show the print as its state. Statuses are reported even without changes, as for a paused print on a server."""
        journal = "" if scene.journal is None else str(scene.journal.path)
        self.tell(log="" if scene.log.trouble else str(scene.log.file), journal=journal)
        if scene.uploads:
            self.tell(state=PrintState.UPLOADING)
        state = PrintState.UPLOADING if scene.uploads else PrintState.PRINTING

        def show(status: PrintStatus | None) -> None:
            nonlocal state
            if status is not None and status.state.is_printing:  # other states of a server are not the end of the job
                state = status.state
            self._show(status, state, scene)

        with nullcontext() if scene.server else stopping(self.stop):
            yield show

    def _show(self, status: PrintStatus | None, state: PrintState, scene: Scene) -> None:
        if status is None:
            self.tell(status=PrintStatus(state), live=False, told_s=time())
            return
        moment = replace(status, state=state, message=plain_line(status.message))
        values: dict[str, Any] = {"status": moment, "live": not scene.uploads, "told_s": time()}
        if not scene.uploads:
            scene.messages.add(status.message)
            values["words"] = tuple(plain_line(word) for word in scene.messages.last)
        if status.warning:
            values["journal"] = ""
        self.tell(**values)

    def left(self) -> bool:
        """Whether a print on a server is left to it."""
        return self.stop.is_set()

    def releases(self) -> bool:
        """Whether manual control ends, with the heaters off."""
        return self.stop.is_set() or self._cancels.is_set()

    def cancels(self) -> bool:
        """Whether a print on a server that has not begun is abandoned; after an emergency stop it is not."""
        return (self._cancels.is_set() or self.stop.is_set()) and not self._halts.is_set()

    def has_stopped(self) -> bool:
        """Whether an emergency stop was requested and executed, to be called at the end."""
        waiting = iter(self.commands.take, None)
        return self._halts.is_set() and all(request.command != Command.EMERGENCY_STOP for request in waiting)
