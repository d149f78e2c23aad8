"""Session base: the history, the processes, the notification of pages, and values derived from the bench."""

import asyncio
import sys
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from itertools import count
from pathlib import Path
from typing import Any, Generic, TypeVar

from machine.crash import bug_in_words
from machine.workbench.bench.bench import Bench, History, Step
from machine.workbench.work.folders import Received
from machine.workbench.work.worker_pool import CLOSED, TaskQueue, WorkerPools
from profiles.errors import UserError
from profiles.messages import terminal_words

WAITING = "waiting until the work of other benches is done"
LONGEST_SENTENCE = 2000  # characters, because a page may send a name of any length
LONGEST_ASK = 80  # characters of a command's name
MOST_ANSWERS = 20  # named commands whose results are stored and sent to the pages
MOST_PROBLEMS = 20  # pages whose last error is stored
Value = TypeVar("Value")
asking: ContextVar[str] = ContextVar("asking", default="")  # page whose command is executed; "": it has no name


def hear_from(page: object) -> None:
    """Set the client page of the current task and the tasks that it starts; other values than a short string mean none."""
    asking.set(page if isinstance(page, str) and len(page) <= LONGEST_ASK else "")


class Observable:
    """Notifies pages of changes; used from one event loop. listeners: called first; closed: there will be no more changes."""

    def __init__(self) -> None:
        self.version, self.closed = 0, False
        self.listeners: list[Callable[[], None]] = []
        self._changed = asyncio.Event()
        self._tasks: set[asyncio.Task[None]] = set()

    def launch(self, work: Coroutine[Any, Any, None]) -> "asyncio.Task[None]":
        """Start work in the background."""
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def notify(self) -> None:
        self.version += 1
        self._changed.set()
        self._changed = asyncio.Event()
        for listen in self.listeners:
            listen()

    async def changed(self, seen: int) -> None:
        """Wait until there is a newer version than `seen`."""
        while self.version == seen:
            await self._changed.wait()


async def in_loop(loop: asyncio.AbstractEventLoop, work: Coroutine[Any, Any, Value]) -> Value:
    """Run a coroutine in another event loop and return its result; cancelling the wait cancels the coroutine."""
    return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(work, loop))


class SessionBase(Observable):
    """All from the event loop; the pages wait for `changed`. Whatever changes the bench does so in its `turn`: one command is
    executed at a time, and nothing else changes the bench meanwhile.

    problems: what could not be done last, by the page that wanted it, "" for all pages; answers: to the last commands that a page
    gave a name, by that: why they were refused, "" for those that are done; busy: what the pages wait for; note: what the last
    command has changed beside what it was for; quick, long, hand: its tasks in the pools; aside: tasks that no one waits for;
    received: the files of its pages; followers: called after every change of the bench.
    """

    def __init__(self, bench: Bench, pools: WorkerPools) -> None:
        super().__init__()
        self.history = History(Step("", bench))
        self.problems: dict[str, str] = {}
        self.answers: dict[str, str] = {}
        self.busy = self.note = ""
        self.quick, self.long, self.hand = TaskQueue(pools.quick), TaskQueue(pools.long), TaskQueue(pools.hand)
        self.aside = TaskQueue(pools.quick)
        self.followers: list[Callable[[], None]] = []
        self.turn = asyncio.Lock()  # fair: first come, first served
        self.received = Received()
        self._files = count(1)

    @property
    def bench(self) -> Bench:
        return self.history.now.bench

    @property
    def problem(self) -> str:
        """The newest error of any page, or ""."""
        return next(reversed(self.problems.values()), "")

    def new_file(self) -> Path:
        """A path for a task's output, deleted with the session at the latest."""
        return self.received.path / f"made-{next(self._files)}"

    def start(self, work: Coroutine[Any, Any, None], ask: object = None) -> "asyncio.Task[None]":
        """Start work in the background; its error becomes the sentence that pages show. ask: name of its command."""

        async def attempt() -> None:
            refusal = ""
            try:
                await work
            except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench continues
                refusal = self.refuse(error)
            finally:
                self.answer(ask, refusal)

        task = self.launch(attempt())
        task.add_done_callback(lambda _: work.close())  # if it was cancelled before it began
        return task

    def command(self, act: Callable[[], Coroutine[Any, Any, None] | None], ask: object = None) -> None:
        """Execute a command after the previous ones; act: returns its remaining work. ask: its name."""

        async def in_turn() -> None:
            async with self.turn:
                work = act()
                if work is not None:
                    await work

        self.start(in_turn(), ask)

    def refuse(self, error: Exception) -> str:
        """Report an error to the page that caused it, a bug with its log; returns the sentence."""
        sentence = f"{error}" if isinstance(error, UserError) else bug_in_words(error, sys.argv)
        if len(shown := terminal_words(sentence)) > LONGEST_SENTENCE:
            sentence = f"{shown[:LONGEST_SENTENCE]} ..."
        self._tell_problem(sentence)
        self.notify()
        return sentence

    def forget_problem(self) -> None:
        """Clear the error of the current page, and that for all pages."""
        for page in (asking.get(), ""):
            self.problems.pop(page, None)

    def answer(self, ask: object, refusal: str = "") -> None:
        """Store the result of a named command for its page."""
        if isinstance(ask, str) and len(ask) <= LONGEST_ASK:
            self.answers = dict([*self.answers.items(), (ask, refusal)][-MOST_ANSWERS:])
        self.notify()

    def do(self, word: str, bench: Bench, lost: str = "") -> None:
        """Take a further step, which can be undone. lost: what it has removed or made invalid, beside what its step says."""
        self.advance(self.history.do(word, bench), lost)

    def advance(self, history: History, lost: str = "") -> None:
        """Replace the history; a step forward reports what it has removed."""
        forth = history.before[-1:] == (self.history.now,)
        self.problems.clear()  # they were about the previous bench
        self.note = ""
        for sentence in (lost, history.now.lost if forth else ""):
            self.add_note(sentence)
        self.become(history)

    def add_problem(self, sentence: str) -> None:
        """Add a sentence to the current page's errors."""
        self._tell_problem("; ".join(filter(None, (self.problems.get(asking.get(), ""), sentence))))

    def add_note(self, sentence: str) -> None:
        """Add a sentence about a change to the note on all pages."""
        self.note = "; ".join(filter(None, (self.note, sentence)))

    def _tell_problem(self, sentence: str) -> None:
        page = asking.get()
        self.problems.pop(page, None)  # moves the newest to the end
        self.problems = dict([*self.problems.items(), (page, sentence)][-MOST_PROBLEMS:])

    def become(self, history: History) -> None:
        """Replace the history and notify followers and pages."""
        self.history = history
        for follow in self.followers:
            follow()
        self.notify()

    @contextmanager
    def waiting(self, words: str) -> Iterator[None]:
        """Show the pages what they wait for until the block ends."""
        self.busy = words
        self.notify()
        try:
            yield
        finally:
            self.busy = ""
            self.notify()


class Derived(Generic[Value]):
    """A value derived from the bench, computed by a background task.

    key: what of a bench determines it, None: there is nothing to compute. task: computes it for a bench, and may `tell()` its
    progress. by_itself: begin as soon as the key changes, otherwise on demand. interrupts: a change of the key cancels the task
    at once; otherwise it finishes and begins again. In both cases its result is dropped. accept: changes the bench by the result.

    progress: last progress of the task, None: it is not running; bench: that of the running task; done: the last result, which an
    on-demand value keeps when the bench changes.
    """

    def __init__(
        self,
        session: SessionBase,
        key: Callable[[Bench], object],
        task: Callable[[Bench], Coroutine[Any, Any, Value]],
        *,
        by_itself: bool = True,
        interrupts: bool = False,
        accept: Callable[[Value], None] | None = None,
    ) -> None:
        self.progress: Any = None
        self.bench = session.bench
        self.done: Value | None = None
        self.number = 0  # number of the running task, or the last one
        self._session, self._key_of, self._work, self._accept = session, key, task, accept
        self._by_itself, self._interrupts = by_itself, interrupts
        self._begun: object = None  # key of the running task, or the last one
        self._of: object = None  # key of the last result
        self._error: Exception | None = None
        self._task: asyncio.Task[None] | None = None
        self._changed = asyncio.Event()
        session.followers.append(self.follow)

    @property
    def result(self) -> Value | None:
        return self.done if self._of is not None and self._of == self._key_of(self._session.bench) else None

    @property
    def stale(self) -> bool:
        """Whether the running task computes the value for an outdated bench."""
        return self._begun != self._key_of(self._session.bench)

    def begin(self, progress: Any = None) -> None:
        """Begin the task unless it is running."""
        if self._task is None:
            self.number += 1
            self.progress, self._error = progress, None
            self.bench = self._session.bench
            self._begun = self._key_of(self.bench)
            self._task = self._session.start(self._run())

    def tell(self, progress: Any) -> None:
        """Set the progress of the running task, and notify the pages."""
        self.progress = progress
        self._session.notify()

    def teller(self) -> Callable[[Any], None]:
        """Return a `tell()` for the running task, which has no effect once that is stopped."""
        number = self.number
        return lambda progress: self.tell(progress) if self._task is not None and self.number == number else None

    def stop(self) -> None:
        """Cancel the running task."""
        if self._task is not None:
            self._task.cancel()
            self._task = self.progress = self._begun = None

    def interrupted(self) -> None:
        """Hook, called after a change of the bench has cancelled the task."""

    def follow(self) -> None:
        """Handle a change of the bench."""
        key = self._key_of(self._session.bench)
        if self._task is not None and key != self._begun:
            self._changed.set()
            if self._interrupts:
                self.stop()
                self.interrupted()
        if self._task is None:
            self._forget(key)
            if self._by_itself and key is not None and key != self._begun:
                self.begin()

    def _forget(self, key: object) -> None:
        """Drop outdated benches and results, because models are large."""
        self.bench = self._session.bench
        if key != self._begun:
            self._begun = None
        if key != self._of:
            self._of = None
            self.done = None if self._by_itself else self.done

    async def rests(self, wait_s: float) -> bool:
        """Wait, but not beyond a change of the bench; returns whether the task's bench is still current."""
        with suppress(TimeoutError):
            async with asyncio.timeout(wait_s):
                await self._changed.wait()
        return not self.stale

    async def wait(self) -> None:
        """Wait until the task is not running."""
        while self._task is not None and not self._task.done():  # a cancelled task remains when its session is closed
            await asyncio.wait((self._task,))

    async def get(self) -> Value:
        """The result for the current bench, computed once for all callers. Raises the task's error."""
        while (result := self.result) is None:
            if self._session.closed:
                raise UserError(CLOSED)
            self.begin()
            await self.wait()
            if self._error is not None:
                raise self._error
        return result

    async def _run(self) -> None:
        task = asyncio.current_task()
        self._changed.clear()
        if not self._interrupts:  # the bench may have changed since
            self.bench = self._session.bench
            self._begun = self._key_of(self.bench)
            if self._begun is None:
                self._end()
                return
        try:
            answer = await self._work(self.bench)
            if self._accept is None:
                self._take(answer)
            else:
                async with self._session.turn:
                    self._take(answer)
        except Exception as error:
            if self._task is task:
                self._error = error
                self._end()
            raise

    def _take(self, answer: Value) -> None:
        stale = self.stale
        if stale:
            self._begun = None
        else:
            self.done, self._of = answer, self._begun
        self._end()
        if self._accept is not None and not stale:
            self._accept(answer)

    def _end(self) -> None:
        self._task = self.progress = None
        if not self._session.closed:
            self.follow()
