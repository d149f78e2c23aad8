"""Session base: what all work of a session stands on: the history, the processes, and the pages that wait for changes."""

import asyncio
import sys
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import count
from pathlib import Path
from typing import Any

from machine.crash import bug_in_words
from machine.workbench.bench.bench import Bench, History, Step
from machine.workbench.work.observable import Observable
from machine.workbench.work.received import Received
from machine.workbench.work.worker_pool import TaskQueue, WorkerPools
from profiles.errors import UserError

WAITING = "waiting until the work of other benches is done"
LONGEST_SENTENCE = 2000  # letters: a page may ask for a name as long as it likes
LONGEST_ASK = 80  # letters of the name of a command
MOST_ANSWERS = 20  # named commands whose outcome is kept and sent to the pages
MOST_PROBLEMS = 20  # pages for which the last refusal is kept
asking: ContextVar[str] = ContextVar("asking", default="")  # the page that is obeyed, or worked for; "": it has no name


def hear_from(page: object) -> None:
    """All that the running task does from now on, and begins, is for the page of this name, if it is one."""
    asking.set(page if isinstance(page, str) and len(page) <= LONGEST_ASK else "")


class SessionBase(Observable):
    """All from the event loop; the pages wait for `changed`.

    problems: what could not be done last, by the page that wanted it, "" for all pages; answers: to the last commands that a page
    gave a name, by that: why they were refused, "" for those that are done; busy: what the pages wait for; stopped: what became
    of work that was stopped last; quick, long, hand: its tasks in the pools; received: the files of its pages; followers: called
    after every change of the bench.
    """

    def __init__(self, bench: Bench, pools: WorkerPools) -> None:
        super().__init__()
        self.history = History(Step("", bench))
        self.problems: dict[str, str] = {}
        self.answers: dict[str, str] = {}
        self.busy = self.stopped = ""
        self.quick, self.long, self.hand = TaskQueue(pools.quick), TaskQueue(pools.long), TaskQueue(pools.hand)
        self.followers: list[Callable[[], None]] = []
        self.received = Received()
        self._files = count(1)
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def bench(self) -> Bench:
        """What lies on the workbench now."""
        return self.history.now.bench

    @property
    def problem(self) -> str:
        """What could not be done last, whoever wanted it; "": all could."""
        return next(reversed(self.problems.values()), "")

    def new_file(self) -> Path:
        """A place for what a task makes, which goes with the session at the latest."""
        return self.received.path / f"made-{next(self._files)}"

    def start(self, work: Coroutine[Any, Any, None], ask: object = None) -> "asyncio.Task[None]":
        """Have work done beside the pages; what it is refused becomes the sentence that they show. ask: name of its command."""

        async def attempt() -> None:
            refusal = ""
            try:
                await work
            except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench goes on
                refusal = self.refuse(error)
            finally:
                self.answer(ask, refusal)

        task = asyncio.create_task(attempt())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        task.add_done_callback(lambda _: work.close())  # of one that was cancelled before it began
        return task

    def refuse(self, error: Exception) -> str:
        """Tell the page that wanted it what could not be done, a bug with the log that it got; the sentence."""
        sentence = str(error) if isinstance(error, UserError) else bug_in_words(error, sys.argv)
        if len(sentence) > LONGEST_SENTENCE:
            sentence = f"{sentence[:LONGEST_SENTENCE]} ..."
        self._tell_problem(sentence)
        self.notify()
        return sentence

    def forget_problem(self) -> None:
        """Tell the page whose command is obeyed no more what could not be done, nor what all are told."""
        for page in (asking.get(), ""):
            self.problems.pop(page, None)

    def answer(self, ask: object, refusal: str = "") -> None:
        """Tell the pages what became of a command, the one that gave it by the name that it gave it, if it did."""
        if isinstance(ask, str) and len(ask) <= LONGEST_ASK:
            self.answers = dict([*self.answers.items(), (ask, refusal)][-MOST_ANSWERS:])
        self.notify()

    def do(self, word: str, bench: Bench, lost: str = "") -> None:
        """Take a further step, which can be undone. lost: what it has taken away, beside what its step says itself."""
        self.advance(self.history.do(word, bench), lost)

    def advance(self, history: History, lost: str = "") -> None:
        """Go on with another history; a step forth tells what it has taken away."""
        forth = history.before[-1:] == (self.history.now,)
        self.problems.clear()  # they told of what lay there before
        self.stopped = ""
        for sentence in (lost, history.now.lost if forth else ""):
            self.add_problem(sentence)
        self.become(history)

    def add_problem(self, sentence: str) -> None:
        """Tell a sentence beside what is told already."""
        if sentence:
            self._tell_problem("; ".join(filter(None, (self.problems.get(asking.get(), ""), sentence))))

    def _tell_problem(self, sentence: str) -> None:
        page = asking.get()
        self.problems.pop(page, None)  # the newest is the last
        self.problems = dict([*self.problems.items(), (page, sentence)][-MOST_PROBLEMS:])

    def amend(self, bench: Bench, better: Bench) -> None:
        """What lies on the bench, if it is still this, known better; no step of its own."""
        if self.bench is bench:
            self.history = self.history.amended(better)

    def become(self, history: History) -> None:
        """Go on with another history."""
        self.history = history
        for follow in self.followers:
            follow()
        self.notify()

    @contextmanager
    def waiting(self, words: str) -> Iterator[None]:
        """While it is open, the pages show what they wait for."""
        self.busy = words
        self.notify()
        try:
            yield
        finally:
            self.busy = ""
            self.notify()
