"""Screen: where a running print stands, drawn on the terminal: part, layer, pose, heat, time left, the printer's words, keys."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from machine.cli.terminal.printer_messages import PrinterMessages
from machine.dryrun.timeline import Timeline
from machine.link.progress import Progress
from machine.notices import plain_line
from machine.quantities import duration

WORD_LENGTH = 200  # characters of one: a lost connection takes two lines to tell
COLOURS = {"printing": "green", "finishing": "green", "paused": "yellow", "pausing": "yellow", "resuming": "yellow"}
KEYS = "p pause  r resume  c cancel  + - feed  [ ] flow  e emergency stop  ? more"


@dataclass(frozen=True)
class ScreenState:
    """What stands on the screen. title: what is printed where; hint: a question or an explanation in place of the keys."""

    title: str
    progress: Progress
    timeline: Timeline
    words: tuple[str, ...] = ()
    hint: str = ""
    keys: bool = True


def render(state: ScreenState, now: datetime) -> RenderableType:
    """The whole screen at a moment."""
    progress = state.progress
    lines = [_head(state), _position(state), _heat(progress), _bar(progress), _times(progress, now)]
    if progress.warning:
        lines.append(Text(plain_line(progress.warning), style="bold red"))
    lines += _words(state.words)
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


def _position(state: ScreenState) -> Text:
    progress, timeline = state.progress, state.timeline
    phrases = []
    if progress.part is not None:
        phrases.append(f"part {progress.part}{_of(progress.parts)}")
    if progress.layer is not None:
        phrases.append(f"layer {progress.layer}{_of(timeline.layers(progress.part))}")
    at = timeline.at(progress.file_line)
    turned = zip(("tilt", "turn"), timeline.letters[3:], strict=False)
    phrases += [f"{axis} {letter} {at[letter]:.1f} deg" for axis, letter in turned if letter in at]
    return _phrases_line(phrases or [timeline.beginning])


def _of(count: int | None) -> str:
    return f" of {count}" if count else ""


def _heat(progress: Progress) -> Text:
    heat = progress.temperature
    old = [f"as last known {progress.heat_age_s:.0f} s ago:"] if progress.heat_is_old and heat.words else []
    phrases = [
        f"{name} {now_c:.1f}" + (f" / {target_c:.0f}" if target_c is not None else "") + " deg C"
        for name, now_c, target_c in (("nozzle", heat.nozzle_c, heat.nozzle_target_c), ("bed", heat.bed_c, heat.bed_target_c))
        if now_c is not None
    ]
    overrides = [f"feed {progress.feed_percent:.0f} %", f"flow {progress.flow_percent:.0f} %"]
    return _phrases_line([*old, *phrases, *overrides])


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

    def __init__(self, title: str, timeline: Timeline, messages: PrinterMessages, hint: Callable[[], str], keys: bool) -> None:
        self._title, self._timeline, self._messages, self._hint, self._keys = title, timeline, messages, hint, keys
        self._live = Live(console=Console(stderr=True, highlight=False), auto_refresh=False, transient=True)
        self._gone = False

    def tell(self, progress: Progress) -> None:
        """Draw where the print stands."""
        if self._gone:
            return
        self._messages.add(progress.message)
        state = ScreenState(self._title, progress, self._timeline, tuple(self._messages.last), self._hint(), self._keys)
        try:
            self._live.update(render(state, datetime.now()), refresh=True)
        except OSError:
            self._gone = True

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(self, *error: object) -> None:
        try:
            self._live.stop()
        except OSError:
            return
