"""Screen: where a running print stands, render on the terminal: part, layer, pose, heat, time left, the printer's words, keys."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from machine.app.terminal.plain import plain_line
from machine.dryrun.dryrun import DryRun
from machine.link.progress import Progress
from machine.link.protocol.events import Action, Echo, FirmwareFault, LineError, Start, Unknown, read_event, unknown_command
from machine.quantities import duration
from machine.reader.parsed import MoveKind

WORDS_KEPT = 4  # last words of the printer
WORD_LENGTH = 200  # characters of one: a lost connection takes two lines to tell
HALF_BYTES = 4096
COLOURS = {"printing": "green", "finishing": "green", "paused": "yellow", "pausing": "yellow", "resuming": "yellow"}
KEYS = "p pause  r resume  c cancel  + - feed  [ ] flow  e emergency stop  ? more"


class Course:
    """What a dry run knows about the way of a print: where the table stands at a line, what is left to do, layers of a part."""

    beginning = "starting"  # as long as there is no part

    def __init__(self, run: DryRun) -> None:
        program = run.program
        self.letters = run.letters
        self._line, self._ends = program.line, program.end
        self._done_s = np.concatenate([[0.0], np.cumsum(run.times_s)])
        self._waits = [(event.line, event.value) for event in program.events if event.code == "G4"]
        laying = program.kind == MoveKind.EXTRUDE  # the way to a part still counts to the layer before it
        self._layers = {part: len(np.unique(program.layer[laying & (program.part == part)])) for part in program.parts}

    def pose_deg(self, file_line: int) -> tuple[float, float] | None:
        """Tilt and turn after a line of the program; None before the first move."""
        row = self._rows(file_line) - 1
        return None if row < 0 else (float(self._ends[row, 3]), float(self._ends[row, 4]))

    def at(self, file_line: int) -> dict[str, float]:
        """Where the axes stand after a line of the program, by their letters, mm and deg; {} before the first move."""
        row = self._rows(file_line) - 1
        return {} if row < 0 else dict(zip(self.letters, self._ends[row].tolist(), strict=False))

    def remaining_s(self, file_line: int) -> float:
        """How long moves and dwells after a line of the program take; heating and homing are not counted."""
        waits_s = sum(wait_s for line, wait_s in self._waits if line > file_line)
        return float(self._done_s[-1] - self._done_s[self._rows(file_line)]) + waits_s

    def _rows(self, file_line: int) -> int:
        """How many moves are phrases up to a line."""
        return int(np.searchsorted(self._line, file_line, side="right"))

    def layers(self, part: int | None) -> int | None:
        """Layers of a part."""
        return None if part is None else self._layers.get(part)


class UnknownCourse(Course):
    """Of a program that is not here: nothing is known of it."""

    beginning = "a file that is not known here"

    def __init__(self) -> None:
        self.letters = ()

    def pose_deg(self, file_line: int) -> None:
        """None."""

    def at(self, file_line: int) -> dict[str, float]:
        """{}."""
        return {}

    def remaining_s(self, file_line: int) -> float:
        """0."""
        return 0.0

    def layers(self, part: int | None) -> None:
        """None."""


@dataclass(frozen=True)
class ScreenState:
    """What stands on the screen. title: what is printed where; hint: a question or an explanation in place of the keys."""

    title: str
    progress: Progress
    course: Course
    words: tuple[str, ...] = ()
    hint: str = ""
    keys: bool = True


class Words:
    """The last things a printer has said that are no mere answers; hear() takes chunks of bytes in the thread of the port."""

    def __init__(self, kept: int = WORDS_KEPT) -> None:
        self.last: deque[str] = deque(maxlen=kept)
        self._half, self._message = b"", ""
        self._newest, self._times = "", 0

    def hear(self, direction: str, data: bytes) -> None:
        """Take what was received ("<")."""
        if direction != "<":
            return
        *lines, self._half = (self._half + data).split(b"\n")
        self._half = self._half[-HALF_BYTES:]
        for line in lines:
            if line[:2] != b"ok" and (text := printer_message(line)):
                self._append(text)

    def _append(self, text: str) -> None:
        """What is said again takes no line of its own but a count."""
        again = text == self._newest and bool(self.last)
        self._newest, self._times = text, self._times + 1 if again else 1
        if again:
            self.last[-1] = f"{text} (x {self._times})"
        else:
            self.last.append(text)

    def add(self, text: str) -> None:
        """Take the stream's message of this moment; one that stays is added once."""
        if text and text != self._message:
            self._append(text)
        self._message = text


def printer_message(line: bytes) -> str:
    """What a line tells a person, "" for reports and answers."""
    event = read_event(line)
    if isinstance(event, Start):
        return "the printer has started"
    if isinstance(event, Action):
        return f"the printer asks: {event.name} {event.words}".rstrip()
    if unknown := unknown_command(event):
        return f"Unknown command: {unknown}"
    return event.text if isinstance(event, Echo | FirmwareFault | LineError | Unknown) else ""


def render(state: ScreenState, now: datetime) -> RenderableType:
    """The whole screen at a moment."""
    progress = state.progress
    lines = [
        _head(state),
        _place(state),
        _heat(progress),
        _bar(progress),
        _times(progress, now),
        *_words(state.words),
    ]
    if state.hint or state.keys:
        lines.append(Text(plain_line(state.hint or KEYS), style="bold yellow" if state.hint else "dim"))
    return Group(*lines)


def _head(state: ScreenState) -> RenderableType:
    row = Table.grid(expand=True)
    row.add_column(no_wrap=True, overflow="ellipsis", ratio=1)
    row.add_column(justify="right", no_wrap=True)
    shown = state.progress.state
    row.add_row(Text(plain_line(state.title), style="bold"), Text(shown, style=f"bold {COLOURS.get(shown, 'red')}"))
    return row


def _place(state: ScreenState) -> Text:
    progress, course = state.progress, state.course
    phrases = []
    if progress.part is not None:
        phrases.append(f"part {progress.part}{_of(progress.parts)}")
    if progress.layer is not None:
        phrases.append(f"layer {progress.layer}{_of(course.layers(progress.part))}")
    pose = course.pose_deg(progress.file_line)
    if pose is not None:
        phrases.append(f"tilt {course.letters[3]} {pose[0]:.1f} deg")
        phrases.append(f"turn {course.letters[4]} {pose[1]:.1f} deg")
    return _phrases_line(phrases or [course.beginning])


def _of(count: int | None) -> str:
    return f" of {count}" if count else ""


def _heat(progress: Progress) -> Text:
    heat = progress.temperature
    phrases = [
        f"{name} {now_c:.1f}" + (f" / {target_c:.0f}" if target_c is not None else "") + " deg C"
        for name, now_c, target_c in (
            ("nozzle", heat.nozzle_c, heat.nozzle_target_c),
            ("bed", heat.bed_c, heat.bed_target_c),
        )
        if now_c is not None
    ]
    overrides = [f"feed {progress.feed_percent:.0f} %", f"flow {progress.flow_percent:.0f} %"]
    return _phrases_line([*phrases, *overrides])


def _bar(progress: Progress) -> RenderableType:
    row = Table.grid(expand=True, padding=(0, 1))
    row.add_column(ratio=1)
    row.add_column(justify="right", no_wrap=True)
    share = progress.share
    row.add_row(ProgressBar(total=1.0, completed=share or 0.0), Text("" if share is None else f"{100 * share:.0f} %"))
    return row


def _times(progress: Progress, now: datetime) -> Text:
    phrases = [f"{duration(progress.elapsed_s)} so far"]
    if progress.left_s is not None:
        end = now + timedelta(seconds=progress.left_s)
        day = "" if end.date() == now.date() else f"{end:%a %d %b} "
        phrases += [f"{duration(progress.left_s)} left", f"done at {day}{end:%H:%M}"]
    if progress.total is not None or progress.acknowledged:
        phrases.append(f"line {progress.acknowledged}{_of(progress.total)}")
    return _phrases_line(phrases)


def _words(words: tuple[str, ...]) -> list[Text]:
    short = (word if len(word) <= WORD_LENGTH else word[:WORD_LENGTH] + "..." for word in words)
    return [Text(f"  {plain_line(word)}", style="cyan") for word in short]


def _phrases_line(phrases: list[str]) -> Text:
    return Text("   ".join(phrases), no_wrap=True, overflow="ellipsis")


class Screen:
    """`with Screen(...) as screen:` screen.tell(progress) redraws; the terminal is as before afterwards.

    A terminal that has gone away (a closed window) ends the drawing, not the print.
    """

    def __init__(self, title: str, course: Course, words: Words, hint: Callable[[], str], keys: bool) -> None:
        self._title, self._course, self._words, self._hint, self._keys = title, course, words, hint, keys
        self._live = Live(console=Console(stderr=True, highlight=False), auto_refresh=False, transient=True)
        self._gone = False

    def tell(self, progress: Progress) -> None:
        """Draw where the print stands."""
        if self._gone:
            return
        self._words.add(progress.message)
        state = ScreenState(self._title, progress, self._course, tuple(self._words.last), self._hint(), self._keys)
        try:
            self._live.update(render(state, datetime.now()), refresh=True)
        except OSError:
            self._gone = True

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            self._live.stop()
        except OSError:
            return
