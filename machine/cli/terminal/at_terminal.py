"""The user at a terminal during a print: questions on stderr, and a live screen with keys, or plain status lines."""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import replace
from datetime import datetime, timedelta
from threading import Event as Flag

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from machine.cli.terminal.interrupts import calling, interrupting, stopping
from machine.cli.terminal.keys import Keyboard, can_type, is_terminal, typing
from machine.link.pending_commands import Control
from machine.link.print_state import AWAY, PrintState, PrintStatus
from machine.notices import PlainLines, plain_line, reporting, say, say_lines
from machine.printing.job import End, Scene, Show
from machine.quantities import duration
from profiles.errors import JournalError

MOST_WORDS = 4
WORD_LENGTH = 200  # longest message: a lost connection takes two lines to describe
COLOURS = dict.fromkeys((PrintState.PRINTING, PrintState.FINISHING), "green") | dict.fromkeys(
    (*AWAY, PrintState.RESUMING), "yellow"
)
KEYS = "p pause  r resume  c cancel  + - feed  [ ] flow  u d Z  ee emergency  ? more"
EXIT_CODES = {PrintState.DONE: 0, PrintState.DECLINED: 1, PrintState.CANCELLED: 130, PrintState.LEFT: 130}


def exit_code(end: End) -> int:
    """Exit code for the end of a job."""
    return EXIT_CODES[end.state]


class AtTerminal:
    """Implements `Person` at the terminal. yes: answer every question with yes; follow: also called with each status."""

    def __init__(self, yes: bool = False) -> None:
        self.stop = Flag()
        self.commands = Control(self.stop)
        self.follow: Callable[[PrintStatus], None] = lambda status: None
        self._yes, self._board = yes, Keyboard(self.commands)

    def passed(self, sentence: str) -> None:
        """Ignore a passed check."""

    def ask(self, question: str, choices: tuple[str, ...] = ()) -> int | None:
        """Ask on stderr. Raises JournalError if there is no terminal to ask at, or --yes cannot answer."""
        say_lines(question)
        listed = ", ".join(f"{number}: {choice}" for number, choice in enumerate(choices, 1))
        if choices and (self._yes or not sys.stdin.isatty()):
            raise JournalError(f"you must see at which height the tip stands ({listed}): resume at a terminal, without --yes")
        if choices:
            chosen = _answer(f"which? [{listed}; anything else: none] ")
            return int(chosen) - 1 if chosen in [str(number) for number in range(1, len(choices) + 1)] else None
        if self._yes:
            return 0
        if not sys.stdin.isatty():
            raise JournalError("resume asks before it continues: give --yes if there is no terminal")
        return 0 if _answer("continue? [y/N] ") in ("y", "yes") else None

    @contextmanager
    def show(self, scene: Scene) -> Iterator[Show]:
        """Show the screen. Ctrl-C cancels a print at a port, asks what to do with a server's print, and aborts an upload."""
        if scene.uploads:
            with reporting() as report:
                yield lambda status: None if status is None else report(status.message, status.share)
            return
        self._board = board = Keyboard(self.commands, scene.server)
        with ExitStack() as stack:
            stack.enter_context(calling(board.interrupt) if scene.server else stopping(self.stop))
            draw: Callable[[PrintStatus], None] | None = None

            def tell(status: PrintStatus | None) -> None:
                nonlocal draw
                if draw is None:
                    draw = stack.enter_context(_screen(scene, board) if is_terminal() else _status_lines())
                if status is not None:
                    status = replace(status, message=plain_line(status.message))
                    draw(status)
                    self.follow(status)

            yield tell

    def left(self) -> bool:
        """Whether the user has left by the key l, or by an interrupt without an answer."""
        return self._board.left()

    def cancels(self) -> bool:
        """Always False: a KeyboardInterrupt ends the print."""
        return False


def _answer(prompt: str) -> str:
    sys.stderr.write(prompt)
    sys.stderr.flush()
    with interrupting():
        return sys.stdin.readline().strip().lower()


@contextmanager
def _status_lines() -> Iterator[Callable[[PrintStatus], None]]:
    """Plain status lines: one every few seconds, and at once after a change."""
    lines, last, warned = PlainLines(), (PrintState.PRINTING, ""), ""

    def tell(status: PrintStatus) -> None:
        nonlocal last, warned
        if status.warning != warned:
            warned = status.warning
            say(status.warning)
        before, last = last, (status.state, status.message)
        lines.show(status_line(status), at_once=before != last)

    yield tell


@contextmanager
def _screen(scene: Scene, board: Keyboard) -> Iterator[Callable[[PrintStatus], None]]:
    """The live screen with keys; restores the terminal at the end. If the terminal is closed, only the drawing stops."""
    keys, gone = can_type(), False
    live = Live(console=Console(stderr=True, highlight=False), auto_refresh=False, transient=True)

    def tell(status: PrintStatus) -> None:
        nonlocal gone
        board.follow(status)
        scene.messages.add(status.message)
        if not gone:
            try:
                live.update(render(scene, status, board.hint, keys, datetime.now()), refresh=True)
            except OSError:
                gone = True

    with typing(board.press) if keys else nullcontext():
        live.start()
        try:
            yield tell
        finally:
            with suppress(OSError):
                live.stop()


def status_line(status: PrintStatus) -> str:
    """The status of a print in one line."""
    if status.state is PrintState.CANCELLING:
        return f"{status.state}" + (f"; {status.message}" if status.message else "")
    phrases = [f"{100 * status.share:.0f} %"] if status.share is not None else []
    if status.share is None and (status.total is not None or status.acknowledged):
        phrases.append(f"line {status.acknowledged}")
    if status.part is not None:
        phrases.append(f"part {status.part}" + (f" of {status.parts}" if status.parts else ""))
    if status.layer is not None:
        phrases.append(f"layer {status.layer}")
    nozzle, bed = status.temperature.nozzle_c, status.temperature.bed_c
    if nozzle is not None:
        old = f" as last known {status.heat_age_s:.0f} s ago" if _is_outdated(status) else ""
        phrases.append(f"nozzle {nozzle:.0f} °C" + (f", bed {bed:.0f} °C" if bed is not None else "") + old)
    if status.left_s is not None:
        phrases.append(f"{duration(status.left_s)} left")
    return f"{status.state}: " + ", ".join(phrases) + (f"; {status.message}" if status.message else "")


def render(scene: Scene, status: PrintStatus, hint: str, keys: bool, now: datetime) -> RenderableType:
    """Render the whole screen. hint: text in place of the list of keys; keys: whether keys can be pressed."""
    lines = [_head(scene.title, status), _position(scene, status), _heat(status), _bar(status), _times(status, now)]
    if status.warning:
        lines.append(Text(plain_line(status.warning), style="bold red"))
    lines += _words(tuple(scene.messages.last)[-MOST_WORDS:])
    if hint or keys:
        lines.append(Text(plain_line(hint or KEYS), style="bold yellow" if hint else "dim"))
    return Group(*lines)


def _head(title: str, status: PrintStatus) -> RenderableType:
    row = Table.grid(expand=True)
    row.add_column(no_wrap=True, overflow="ellipsis", ratio=1)
    row.add_column(justify="right", no_wrap=True)
    row.add_row(Text(plain_line(title), style="bold"), Text(status.state, style=f"bold {COLOURS.get(status.state, 'red')}"))
    return row


def _position(scene: Scene, status: PrintStatus) -> Text:
    phrases = []
    if status.part is not None:
        phrases.append(f"part {status.part}{_of(status.parts)}")
    if status.layer is not None:
        phrases.append(f"layer {status.layer}{_of(status.layers)}")
    turned = zip(("tilt", "turn"), list(status.at.items())[3:], strict=False)
    phrases += [f"{axis} {letter} {value:.1f} deg" for axis, (letter, value) in turned]
    return _phrases_line(phrases or [scene.beginning])


def _of(count: int | None) -> str:
    return f" of {count}" if count else ""


def _heat(status: PrintStatus) -> Text:
    heat = status.temperature
    old = [f"as last known {status.heat_age_s:.0f} s ago:"] if _is_outdated(status) and heat.words else []
    phrases = [
        f"{name} {now_c:.1f}" + (f" / {target_c:.0f}" if target_c is not None else "") + " °C"
        for name, now_c, target_c in (("nozzle", heat.nozzle_c, heat.nozzle_target_c), ("bed", heat.bed_c, heat.bed_target_c))
        if now_c is not None
    ]
    overrides = [f"feed {status.feed_percent:.0f} %", f"flow {status.flow_percent:.0f} %"]
    shifted = [f"Z offset {status.z_offset_mm:+g} mm"] if status.z_offset_mm else []
    return _phrases_line([*old, *phrases, *overrides, *shifted])


def _is_outdated(status: PrintStatus) -> bool:
    """Whether the age of the temperatures is to be shown."""
    return status.heat_is_old and status.heat_age_s >= 1.0


def _bar(status: PrintStatus) -> RenderableType:
    row = Table.grid(expand=True, padding=(0, 1))
    row.add_column(ratio=1)
    row.add_column(justify="right", no_wrap=True)
    share = status.share
    row.add_row(ProgressBar(total=1.0, completed=share or 0.0), Text("" if share is None else f"{100 * share:.0f} %"))
    return row


def _times(status: PrintStatus, now: datetime) -> Text:
    phrases = [f"{duration(status.elapsed_s)} so far"]
    if status.left_s is not None:
        end = now + timedelta(seconds=status.left_s)
        day = "" if end.date() == now.date() else f"{end:%a %d %b} "
        phrases += [f"{duration(status.left_s)} left", f"done at {day}{end:%H:%M}"]
    if status.total is not None or status.acknowledged:
        phrases.append(f"line {status.acknowledged}{_of(status.total)}")
    return _phrases_line(phrases)


def _words(words: tuple[str, ...]) -> list[Text]:
    short = (word if len(word) <= WORD_LENGTH else word[:WORD_LENGTH] + "..." for word in words)
    return [Text(f"  {plain_line(word)}", style="cyan") for word in short]


def _phrases_line(phrases: list[str]) -> Text:
    return Text("   ".join(phrases), no_wrap=True, overflow="ellipsis")
