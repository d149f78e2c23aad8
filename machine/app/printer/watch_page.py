"""Watch page: the page of a running print, served on this computer where it is asked for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from machine.app.pipeline.programs import LoadedProgram
from machine.app.terminal.progress import say
from machine.link.progress import Progress
from machine.view.live import serve
from machine.view.page import print_page

Follow = Callable[[Progress], None]


@dataclass(frozen=True)
class Watchers:
    """Those who watch a print: follow(progress) tells them where it stands, end(state) how it ended."""

    follow: Follow | None = None
    end: Callable[[str], None] = lambda state: None


@contextmanager
def serve_watch_page(job: LoadedProgram, port: int | None) -> Iterator[Watchers]:
    """Serve the page of a print on a port of this computer, 0: on any free one; None: serve nothing."""
    if port is None:
        yield Watchers()
        return
    with serve(print_page(job.name, job.program, job.profile, live=True), port) as watched:
        say(f"watch the print at {watched.address}")
        yield Watchers(watched.follow, watched.end)
