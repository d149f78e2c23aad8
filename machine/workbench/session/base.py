"""Session base: what all work of a session stands on: the history, the processes, the pages that wait for changes, and values
that follow from the bench."""

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
LONGEST_SENTENCE = 2000  # letters: a page may ask for a name as long as it likes
LONGEST_ASK = 80  # letters of the name of a command
MOST_ANSWERS = 20  # named commands whose outcome is kept and sent to the pages
MOST_PROBLEMS = 20  # pages for which the last refusal is kept
Value = TypeVar("Value")
asking: ContextVar[str] = ContextVar("asking", default="")  # the page that is obeyed, or worked for; "": it has no name


def hear_from(page: object) -> None:
    """All that the running task does from now on, and begins, is for the page of this name, if it is one."""
    asking.set(page if isinstance(page, str) and len(page) <= LONGEST_ASK else "")


class Observable:
    """All from the event loop. listeners: called with every change, before whoever waits for it; closed: no more come."""

    def __init__(self) -> None:
        self.version, self.closed = 0, False
        self.listeners: list[Callable[[], None]] = []
        self._changed = asyncio.Event()

    def notify(self) -> None:
        """Let the pages know that something has changed."""
        self.version += 1
        self._changed.set()
        self._changed = asyncio.Event()
        for listen in self.listeners:
            listen()

    async def changed(self, seen: int) -> None:
        """Return when there is something newer than the version that was seen."""
        while self.version == seen:
            await self._changed.wait()


async def in_loop(loop: asyncio.AbstractEventLoop, work: Coroutine[Any, Any, Value]) -> Value:
    """The result of a coroutine that runs in another event loop; to cancel the waiting cancels it there."""
    return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(work, loop))


class SessionBase(Observable):
    """All from the event loop; the pages wait for `changed`. Whatever changes the bench does so in its `turn`: one command is
    executed at a time, and nothing else changes the bench meanwhile.

    problems: what could not be done last, by the page that wanted it, "" for all pages; answers: to the last commands that a page
    gave a name, by that: why they were refused, "" for those that are done; busy: what the pages wait for; note: what the
    last command has changed beside what it was for; quick, long, hand: its tasks in the pools; received: the files of its pages;
    followers: called after every change of the bench.
    """

    def __init__(self, bench: Bench, pools: WorkerPools) -> None:
        super().__init__()
        self.history = History(Step("", bench))
        self.problems: dict[str, str] = {}
        self.answers: dict[str, str] = {}
        self.busy = self.note = ""
        self.quick, self.long, self.hand = TaskQueue(pools.quick), TaskQueue(pools.long), TaskQueue(pools.hand)
        self.followers: list[Callable[[], None]] = []
        self.turn = asyncio.Lock()  # first come, first served
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

    def command(self, act: Callable[[], Coroutine[Any, Any, None] | None], ask: object = None) -> None:
        """Have a command done when those before it are; act: gives the work that it still is. ask: its name."""

        async def in_turn() -> None:
            async with self.turn:
                work = act()
                if work is not None:
                    await work

        self.start(in_turn(), ask)

    def refuse(self, error: Exception) -> str:
        """Tell the page that wanted it what could not be done, a bug with the log that it got; the sentence."""
        sentence = f"{error}" if isinstance(error, UserError) else bug_in_words(error, sys.argv)
        if len(shown := terminal_words(sentence)) > LONGEST_SENTENCE:
            sentence = f"{shown[:LONGEST_SENTENCE]} ..."
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
        """Take a further step, which can be undone. lost: what it has removed, beside what its step says itself."""
        self.advance(self.history.do(word, bench), lost)

    def advance(self, history: History, lost: str = "") -> None:
        """Go on with another history; a step forth tells what it has removed."""
        forth = history.before[-1:] == (self.history.now,)
        self.problems.clear()  # they told of what lay there before
        self.note = ""
        for sentence in (lost, history.now.lost if forth else ""):
            self.add_note(sentence)
        self.become(history)

    def add_problem(self, sentence: str) -> None:
        """Tell a sentence beside what is told already."""
        self._tell_problem("; ".join(filter(None, (self.problems.get(asking.get(), ""), sentence))))

    def add_note(self, sentence: str) -> None:
        """Tell all pages what has changed, beside what they are told already."""
        self.note = "; ".join(filter(None, (self.note, sentence)))

    def _tell_problem(self, sentence: str) -> None:
        page = asking.get()
        self.problems.pop(page, None)  # the newest is the last
        self.problems = dict([*self.problems.items(), (page, sentence)][-MOST_PROBLEMS:])

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


class Derived(Generic[Value]):
    """A value that follows from the bench, worked out by a task beside the pages.

    key: what of a bench decides it, None: there is nothing to work out. task: works it out for a bench, and may tell() how far it
    is. by_itself: as soon as the key changes, else when it is begun. interrupts: a change of the key cancels the task at once,
    else it may end and is begun anew then; in both cases its answer is dropped. accept: changes the bench by the answer.

    progress: what the task has told last, None: none is under way; bench: of the task under way; done: the last answer, of
    one that is begun whatever the bench is now.
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
        self.number = 0  # of the task under way, or the last one
        self._session, self._key_of, self._work, self._accept = session, key, task, accept
        self._by_itself, self._interrupts = by_itself, interrupts
        self._begun: object = None  # key of the task under way, or the last one
        self._of: object = None  # key of the last answer
        self._error: Exception | None = None
        self._task: asyncio.Task[None] | None = None
        self._changed = asyncio.Event()
        session.followers.append(self.follow)

    @property
    def result(self) -> Value | None:
        """The answer for the bench as it is now."""
        return self.done if self._of is not None and self._of == self._key_of(self._session.bench) else None

    @property
    def stale(self) -> bool:
        """Whether the task under way works for a bench that is another one now."""
        return self._begun != self._key_of(self._session.bench)

    def begin(self, progress: Any = None) -> None:
        """Begin to work it out, if no task is under way."""
        if self._task is None:
            self.number += 1
            self.progress, self._error = progress, None
            self.bench = self._session.bench
            self._begun = self._key_of(self.bench)
            self._task = self._session.start(self._run())

    def tell(self, progress: Any) -> None:
        """Have the pages know how far the task under way is."""
        self.progress = progress
        self._session.notify()

    def teller(self) -> Callable[[Any], None]:
        """tell() for the task under way, which is not heard any more when that is stopped."""
        number = self.number
        return lambda progress: self.tell(progress) if self._task is not None and self.number == number else None

    def stop(self) -> None:
        """Cancel the task under way."""
        if self._task is not None:
            self._task.cancel()
            self._task = self.progress = self._begun = None

    def interrupted(self) -> None:
        """Called after a change of the bench has cancelled the task."""

    def follow(self) -> None:
        """Heed a change of the bench."""
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
        """Hold nothing of a bench that is another one now: models are large."""
        self.bench = self._session.bench
        if key != self._begun:
            self._begun = None
        if key != self._of:
            self._of = None
            self.done = None if self._by_itself else self.done

    async def rests(self, wait_s: float) -> bool:
        """Wait, but not beyond a change of the bench; whether the task is still for the bench as it is."""
        with suppress(TimeoutError):
            async with asyncio.timeout(wait_s):
                await self._changed.wait()
        return not self.stale

    async def wait(self) -> None:
        """Return when no task is under way any more."""
        while self._task is not None and not self._task.done():  # a task that was cancelled stays where its session is closed
            await asyncio.wait((self._task,))

    async def get(self) -> Value:
        """The answer for the bench as it is now, worked out once for all that ask. Raises what the task raises."""
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
