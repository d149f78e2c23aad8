"""Print display: what a person sees of a running print: a screen with keys on a terminal, plain lines elsewhere."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager

from machine.cli.terminal.keys import Keyboard, can_type, typing
from machine.cli.terminal.printer_messages import PrinterMessages
from machine.cli.terminal.progress import is_terminal
from machine.cli.terminal.screen import Screen
from machine.dryrun.timeline import Timeline
from machine.link.progress import Progress
from machine.notices import PlainLines, say
from machine.quantities import duration

Follow = Callable[[Progress], None]


class PrintDisplay:
    """`with PrintDisplay(...) as display:` display(progress) shows it, from open() on: before, while a person is asked
    something, the terminal is theirs. Ends with the terminal as before.
    """

    def __init__(self, title: str, timeline: Timeline, board: Keyboard, messages: PrinterMessages) -> None:
        self._stack = ExitStack()
        self._follow: Follow | None = None
        self._shown: AbstractContextManager[Follow] = _shown(title, timeline, board, messages)

    def open(self) -> None:
        """Begin to show what comes."""
        self._follow = self._stack.enter_context(self._shown)

    def __call__(self, progress: Progress) -> None:
        if self._follow is not None:
            self._follow(progress)

    def __enter__(self) -> "PrintDisplay":
        self._stack.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()


@contextmanager
def _shown(title: str, timeline: Timeline, board: Keyboard, messages: PrinterMessages) -> Iterator[Follow]:
    if not is_terminal():
        yield _StatusLines()
        return
    with ExitStack() as stack:
        keys = can_type()
        if keys:
            stack.enter_context(typing(board.press))
        screen = stack.enter_context(Screen(title, timeline, messages, lambda: board.hint, keys))

        def follow(progress: Progress) -> None:
            board.follow(progress)
            screen.tell(progress)

        yield follow


class _StatusLines:
    """Plain lines: one every few seconds, and at once when something has changed."""

    def __init__(self) -> None:
        self._lines, self._last, self._warning = PlainLines(), ("printing", ""), ""

    def __call__(self, progress: Progress) -> None:
        if progress.warning != self._warning:
            self._warning = progress.warning
            say(progress.warning)
        before, self._last = self._last, (progress.state, progress.message)
        self._lines.show(status(progress), at_once=before != self._last)


def status(progress: Progress) -> str:
    """One line that tells where a print stands."""
    phrases = [f"{100 * progress.share:.0f} %"] if progress.share is not None else []
    if progress.share is None and (progress.total is not None or progress.acknowledged):
        phrases.append(f"line {progress.acknowledged}")
    if progress.part is not None:
        phrases.append(f"part {progress.part}" + (f" of {progress.parts}" if progress.parts else ""))
    if progress.layer is not None:
        phrases.append(f"layer {progress.layer}")
    nozzle, bed = progress.temperature.nozzle_c, progress.temperature.bed_c
    if nozzle is not None:
        old = f" as last known {progress.heat_age_s:.0f} s ago" if progress.heat_is_old else ""
        phrases.append(f"nozzle {nozzle:.0f} C" + (f", bed {bed:.0f} C" if bed is not None else "") + old)
    if progress.left_s is not None:
        phrases.append(f"{duration(progress.left_s)} left")
    return f"{progress.state}: " + ", ".join(phrases) + (f"; {progress.message}" if progress.message else "")
