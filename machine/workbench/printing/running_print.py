"""Running print: the server's end of a print: its process, its newest state, and what is done when the process dies."""

import asyncio
import sys
from collections.abc import Callable
from dataclasses import replace
from time import time
from typing import Annotated

from pydantic import Field

from machine.crash import bug_in_words
from machine.link.pending_commands import FEED_PERCENT, FLOW_PERCENT, Command
from machine.link.print_state import PrintState, follows
from machine.printing.destination import Server, Simulated
from machine.printing.job import NOT_BEGUN, Does, End, PrintJob
from machine.printing.rescue import cancel_on_server, rescue
from machine.printing.servers.server import server_name
from machine.workbench.printing.at_page import BEGIN, LEAVE, HandCommand, HandDoes, JobState, first_state
from machine.workbench.work.worker_pool import heard
from mdp.kernels.workers import Interpreter
from profiles.errors import PrinterError, UserError

MAIN = "from machine.workbench.printing.process import main; main()"
EMERGENCY_S = 5.0  # so long the print's own process has to stop the printer: it tries for 2.5 s; then it is done without it
LEAVE_S = 5.0  # so long a print that is not to go on has to let go of its port
FeedPercent = Annotated[int, Field(ge=FEED_PERCENT[0], le=FEED_PERCENT[1])]
FlowPercent = Annotated[int, Field(ge=FLOW_PERCENT[0], le=FLOW_PERCENT[1])]
HandWord = Annotated[HandDoes, Field(strict=False)]  # a text in JSON
DIED = "the process that printed has ended before the print was done"


class RunningPrint:
    """run() once, all else from the event loop too. number: its name among the prints of a workbench; holder: the page that
    commands it, "" for none."""

    def __init__(self, number: int, job: PrintJob, holder: str, changed: Callable[[], None]) -> None:
        self.number, self.holder, self.state, self.job = number, holder, first_state(job), job
        self._changed = changed
        self._process: Interpreter | None = None
        self._late: asyncio.Task[None] | None = None
        self._begun = job.does is Does.FOLLOW  # by somebody else
        self._emergency = self._given_up = self._cancelled = False
        self._ended = False  # by this program, on purpose

    @property
    def over(self) -> bool:
        """Whether nothing of it goes on."""
        return self.state.state.is_over

    @property
    def asking(self) -> bool:
        """Whether nothing has moved yet, and nothing will: once it is told to begin, its process alone knows how far it is."""
        return not self._begun and self.state.state in (PrintState.CHECKING, PrintState.READY)

    async def run(self) -> None:
        """Have it printed by a process of its own, to the end."""
        process = Interpreter(MAIN)
        await asyncio.to_thread(process.say, self.job)  # a long one is read when the process has loaded what it needs
        self._process = process  # and follows what it does from now on
        if self._given_up or self._emergency:
            self._kill()
        ended = lost = False
        async for state in heard(process.hear()):
            ended = state.state.is_over
            lost = ended and self._has_lost_an_order(state)
            self._take(replace(state, state=PrintState.CANCELLING) if lost else state)
        if lost:
            await self._order_anew()
        elif not ended:
            await self._end_without_process()

    def say(self, value: object) -> None:
        """Something to the process; what it does not hear any more is not missed."""
        if self._process is not None:
            self._process.say(value)

    def begin(self) -> None:
        """A person agrees to what was found; said twice, as by a double click, it is one word. Raises PrinterError as long as
        that is not known."""
        if self._begun and not self.over:
            return
        if self.state.state is not PrintState.READY or not self.asking or self._given_up:
            raise PrinterError("this print cannot begin now: it is not ready, or over")
        self._begun = True
        self.say((BEGIN,))

    async def fail(self, error: Exception) -> None:
        """A fault of this program: nobody hears the print's process any more, so it ends, and the printer is made safe."""
        self._kill()
        if not self.asking:
            self.state = replace(self.state, state=PrintState.CANCELLING)  # an end that it has told is not believed
        await self._end_without_process()
        self._take(replace(self.state, sentence=f"{bug_in_words(error, sys.argv)}; {self.state.sentence}"))

    def cancel(self) -> None:
        """End it, heaters off; before it has begun at once. What has opened a journal to go on with takes it away itself."""
        if self.over:
            self._cancelled = True
            self._order_late()
            return
        asking = self.asking
        self._given_up = self._given_up or asking
        if asking and self.job.does is not Does.RESUME:
            self._kill()
            return
        self.say((Command.CANCEL,))
        self._cancelled = not asking
        if asking:
            asyncio.get_running_loop().call_later(LEAVE_S, self._kill)

    def leave(self) -> None:
        """Let a print server go on with it by itself. Raises PrinterError for a print that is on none."""
        if not self.state.server:
            raise PrinterError("only a print on a print server goes on by itself: this one ends with the workbench")
        self.say((LEAVE,))

    def pause(self) -> None:
        """Pause it."""
        self.say((Command.PAUSE,))

    def resume(self) -> None:
        """Go on after a pause."""
        self.say((Command.RESUME,))

    def feed(self, *, percent: FeedPercent) -> None:
        """Set the speed, in per cent of the programmed one."""
        self.say((Command.FEED, float(percent)))

    def flow(self, *, percent: FlowPercent) -> None:
        """Set the flow, in per cent of the programmed one."""
        self.say((Command.FLOW, float(percent)))

    def by_hand(self, *, does: HandWord, axis: str = "", by_mm: float = 0.0, keep_heat: bool = False) -> None:
        """Have a printer in hand do something. Raises PrinterError for one that is not in hand."""
        if self.state.state is not PrintState.IN_HAND:
            raise PrinterError("this cannot be done by hand now")
        self.say((HandCommand(does, axis[:1], by_mm, keep_heat),))

    def end(self) -> None:
        """End it because the workbench ends: as a cancel does, but what a print server prints goes on there."""
        if self.state.server and not self.asking:
            self.leave()
        else:
            self.cancel()

    def stop_at_once(self) -> None:
        """The emergency stop, by the print's own process; where that does not do it, or still uploads, without that."""
        if self.over:
            self._emergency = _goes_on(self.state)
            self._order_late()
            return
        self._emergency = True
        if self.asking or self.state.state is PrintState.UPLOADING:
            self._ended = True
            self._kill()
        else:
            self.say((Command.EMERGENCY_STOP,))
            asyncio.get_running_loop().call_later(EMERGENCY_S, self._kill)

    def _kill(self) -> None:
        if self._process is not None:
            self._process.end()

    def _has_lost_an_order(self, ended: JobState) -> bool:
        """Whether the following of a print on a server has ended before it took what it was told last."""
        stop_lost = self._emergency and not ended.stop_given
        return ended.server and self._begun and (stop_lost or (self._cancelled and _goes_on(ended)))

    def _order_late(self) -> None:
        """Give a stop or a cancel that comes when the print has just been left."""
        if _goes_on(self.state):
            self._take(replace(self.state, state=PrintState.CANCELLING))
            self._late = asyncio.get_running_loop().create_task(self._order_anew())

    async def _order_anew(self) -> None:
        """Give the stop or the cancel on a connection of its own."""
        at = self.job.destination
        assert isinstance(at, Server)
        if self._emergency:
            self._end(End(PrintState.FAILED, await asyncio.to_thread(rescue, at, True)))
            return
        name, status = self.state.name, self.state.progress
        away_s = time() - self.state.told_s + (0.0 if status is None else status.heat_age_s)
        file = name if self.job.does is Does.FOLLOW else server_name(name)
        try:
            cancelled = await asyncio.to_thread(cancel_on_server, at, file, away_s)
        except UserError as error:
            self._end(End(PrintState.LEFT, f"{name} was not cancelled: {error}"))
            return
        sentence = "the print was stopped" if cancelled else f"there was nothing to cancel: {at.name} prints nothing any more"
        self._end(End(PrintState.CANCELLED, sentence))

    async def _end_without_process(self) -> None:
        """The process has died. What it printed on is told to be safe; nothing has been sent to a printer it only asked; a print
        server goes on by itself."""
        at, moved = self.job.destination, not self.asking
        if not moved:
            self._take(replace(self.state, journal=""))
        if self._given_up and not self._emergency:
            self._end(NOT_BEGUN)
        elif isinstance(at, Simulated):
            stopped = "emergency stop: the simulated printer has ended"
            self._end(End(PrintState.FAILED, stopped if self._ended else f"{DIED}; the simulated printer has ended with it"))
        elif moved or self._emergency:
            self._take(replace(self.state, state=PrintState.CANCELLING))
            sentence = await asyncio.to_thread(rescue, at, self._emergency)
            self._end(End(PrintState.FAILED, f"{DIED}; {sentence}" if moved and not self._ended else sentence))
        else:
            self._end(End(PrintState.FAILED, f"{DIED}; nothing had moved yet"))

    def _end(self, end: End) -> None:
        self._take(replace(self.state, state=end.state, sentence=end.sentence))

    def _take(self, state: JobState) -> None:
        """The newest state. What is over stays as it has ended."""
        self.state = state if follows(self.state.state, state.state) else replace(state, state=self.state.state)
        self._changed()


def _goes_on(ended: JobState) -> bool:
    """Whether a print was left that its server goes on with."""
    return ended.server and ended.state is PrintState.LEFT
