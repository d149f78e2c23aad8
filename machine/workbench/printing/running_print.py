"""Running print: the server's view of a print: its process, its newest state, and its end if the process dies."""

import asyncio
import sys
from collections.abc import Callable
from time import time
from typing import Annotated

from pydantic import Field

from machine.crash import bug_in_words
from machine.link.pending_commands import FEED_PERCENT, FLOW_PERCENT, MOST_OFFSET_MM, Command
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
EMERGENCY_S = 5.0  # for the print's own process, which tries for 2.5 s to stop the printer, before the server does it
LEAVE_S = 5.0  # for a declined print to release its port
FeedPercent = Annotated[int, Field(ge=FEED_PERCENT[0], le=FEED_PERCENT[1])]
FlowPercent = Annotated[int, Field(ge=FLOW_PERCENT[0], le=FLOW_PERCENT[1])]
Babystep = Annotated[float, Field(ge=-MOST_OFFSET_MM, le=MOST_OFFSET_MM, allow_inf_nan=False)]
HandWord = Annotated[HandDoes, Field(strict=False)]  # a string in JSON
DIED = "the process that printed has ended before the print was done"


class RunningPrint:
    """A print, used from one event loop. run() is called once. number: identifies it among the prints of a workbench; holder: the
    page that controls it, "" for none."""

    def __init__(self, number: int, job: PrintJob, holder: str, changed: Callable[[], None]) -> None:
        self.number, self.holder, self.state, self.job = number, holder, first_state(job), job
        self._changed = changed
        self._process: Interpreter | None = None
        self._late: asyncio.Task[None] | None = None
        self._begun = job.does is Does.FOLLOW  # by another program
        self._emergency = self._given_up = self._cancelled = False
        self._ended = False  # by this program, on purpose

    @property
    def over(self) -> bool:
        return self.state.state.is_over

    @property
    def asking(self) -> bool:
        """Whether nothing has moved yet, nor will: after the order to begin only the process knows its progress."""
        return not self._begun and self.state.state in (PrintState.CHECKING, PrintState.READY)

    async def run(self) -> None:
        """Print in a separate process until the end."""
        process = Interpreter(MAIN)
        await asyncio.to_thread(process.say, self.job)  # a long job is read once the process has loaded its modules
        self._process = process  # later commands can now reach it
        if self._given_up or self._emergency:
            self._kill()
        ended = lost = False
        async for state in heard(process.hear()):
            ended = state.state.is_over
            lost = ended and self._has_lost_an_order(state)
            self._take(state.changed(PrintState.CANCELLING) if lost else state)
        if lost:
            await self._order_anew()
        elif not ended:
            await self._end_without_process()

    def say(self, value: object) -> None:
        """Send a value to the process; it may be lost if the process has ended."""
        if self._process is not None:
            self._process.say(value)

    def begin(self) -> None:
        """Confirm the print; repeated calls, as after a double click, have no effect. Raises PrinterError unless it is ready."""
        if self._begun and not self.over:
            return
        if self.state.state is not PrintState.READY or not self.asking or self._given_up:
            raise PrinterError("this print cannot begin now: it is not ready, or over")
        self._begun = True
        self.say((BEGIN,))

    async def fail(self, error: Exception) -> None:
        """Handle an internal error: end the process, which no one reads, and make the printer safe."""
        self._kill()
        if not self.asking:
            self.state = self.state.changed(PrintState.CANCELLING)  # an end that it has reported is not trusted
        await self._end_without_process()
        self._take(self.state.changed(sentence=f"{bug_in_words(error, sys.argv)}; {self.state.sentence}"))

    def cancel(self) -> None:
        """End the print, heaters off; at once before it has begun, unless its process must delete the journal of a resumption."""
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
        """Leave a print to its print server. Raises PrinterError for other prints."""
        if not self.state.server:
            raise PrinterError("only a print on a print server continues by itself: this one ends with the workbench")
        self.say((LEAVE,))

    def pause(self) -> None:
        self.say((Command.PAUSE,))

    def resume(self) -> None:
        self.say((Command.RESUME,))

    def feed(self, *, percent: FeedPercent) -> None:
        """Set the speed, percent of the programmed one."""
        self.say((Command.FEED, float(percent)))

    def flow(self, *, percent: FlowPercent) -> None:
        """Set the flow, percent of the programmed one."""
        self.say((Command.FLOW, float(percent)))

    def babystep(self, *, by_mm: Babystep) -> None:
        """Raise the tip along the tool by a distance, mm, or lower it (below 0). The tool is machine Z on tilting tables, too."""
        self.say((Command.BABYSTEP, by_mm))

    def by_hand(self, *, does: HandWord, axis: str = "", by_mm: float = 0.0, keep_heat: bool = False) -> None:
        """Send a command of manual control. Raises PrinterError if the printer is not under manual control."""
        if self.state.state is not PrintState.IN_HAND:
            raise PrinterError("the printer is not under manual control now")
        self.say((HandCommand(does, axis[:1], by_mm, keep_heat),))

    def end(self) -> None:
        """End it with the workbench: cancel it, or leave it to its print server."""
        if self.state.server and not self.asking:
            self.leave()
        else:
            self.cancel()

    def stop_at_once(self) -> None:
        """Execute the emergency stop through the print's own process, or without it if it fails or still uploads."""
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
        """Whether a server's print was left before its last command was executed."""
        stop_lost = self._emergency and not ended.stop_given
        return ended.server and self._begun and (stop_lost or (self._cancelled and _goes_on(ended)))

    def _order_late(self) -> None:
        """Execute a stop or cancel that comes just after the print was left."""
        if _goes_on(self.state):
            self._take(self.state.changed(PrintState.CANCELLING))
            self._late = asyncio.get_running_loop().create_task(self._order_anew())

    async def _order_anew(self) -> None:
        """Execute the stop or cancel on a new connection."""
        at = self.job.destination
        assert isinstance(at, Server)
        if self._emergency:
            self._end(End(PrintState.FAILED, await asyncio.to_thread(rescue, at, True)))
            return
        name, away_s = self.state.name, time() - self.state.told_s + self.state.status.heat_age_s
        file = name if self.job.does is Does.FOLLOW else server_name(name)
        try:
            cancelled = await asyncio.to_thread(cancel_on_server, at, file, away_s)
        except UserError as error:
            self._end(End(PrintState.LEFT, f"{name} was not cancelled: {error}"))
            return
        nothing = f"there was nothing to cancel: {at.name} no longer prints"
        sentence = f"the print was cancelled on {at.name}" if cancelled else nothing
        self._end(End(PrintState.CANCELLED, sentence))

    async def _end_without_process(self) -> None:
        """Handle the death of the process: make the printer safe if it was used. A print on a print server continues."""
        at, moved = self.job.destination, not self.asking
        if not moved:
            self._take(self.state.changed(journal=""))
        if self._given_up and not self._emergency:
            self._end(NOT_BEGUN)
        elif isinstance(at, Simulated):
            stopped = "emergency stop: the simulated printer has ended"
            self._end(End(PrintState.FAILED, stopped if self._ended else f"{DIED}; the simulated printer has ended with it"))
        elif moved or self._emergency:
            self._take(self.state.changed(PrintState.CANCELLING))
            sentence = await asyncio.to_thread(rescue, at, self._emergency)
            self._end(End(PrintState.FAILED, f"{DIED}; {sentence}" if moved and not self._ended else sentence))
        else:
            self._end(End(PrintState.FAILED, f"{DIED}; nothing had moved yet"))

    def _end(self, end: End) -> None:
        self._take(self.state.changed(end.state, sentence=end.sentence))

    def _take(self, state: JobState) -> None:
        """The newest state. What is over stays as it has ended."""
        self.state = state if follows(self.state.state, state.state) else state.changed(self.state.state)
        self._changed()


def _goes_on(ended: JobState) -> bool:
    """Whether the print was left to its server, which continues it."""
    return ended.server and ended.state is PrintState.LEFT
