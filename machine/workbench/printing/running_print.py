"""Running print: the server's end of a print: its process, its newest state, and what is done when the process dies."""

import asyncio
import sys
from collections.abc import Callable
from time import time

from machine.crash import bug_in_words
from machine.link.pending_commands import Command
from machine.pipeline.requests import SIMULATED
from machine.printing.rescue import cancel_on_server, rescue
from machine.printing.servers.gcode_upload import server_name
from machine.workbench.printing.at_page import BEGIN, LEAVE
from machine.workbench.printing.order import FollowOrder, HandOrder, Order, PrintOrder, ResumeOrder, State, first_state
from machine.workbench.work.heard import heard
from mdp.kernels.workers import Interpreter
from profiles.errors import PrinterError, UserError

MAIN = "from machine.workbench.printing.process import main; main()"
EMERGENCY_S = 5.0  # so long the print's own process has to stop the printer: it tries for 2.5 s; then it is done without it
LEAVE_S = 5.0  # so long a print that is not to go on has to let go of its port
DIED = "the process that printed has ended before the print was done"


class RunningPrint:
    """run() once, all else from the event loop too. number: its name among the prints of a workbench; holder: the page that
    commands it, "" for none."""

    def __init__(self, number: int, order: Order, holder: str, changed: Callable[[], None]) -> None:
        self.number, self.holder, self.state = number, holder, first_state(order)
        self._order, self._changed = order, changed
        self._process: Interpreter | None = None
        self._late: asyncio.Task[None] | None = None
        self._begun = isinstance(order, FollowOrder)  # by somebody else
        self._emergency = self._given_up = self._cancelled = False
        self._ended = False  # by this program, on purpose

    @property
    def names(self) -> tuple[str, ...]:
        """What people have named themselves: the model, the machine, the port, and their files."""
        told = tuple(str(self.state[key]) for key in ("name", "machine", "port", "resumes", "journal", "log"))
        profile = self._order.profile if isinstance(self._order, PrintOrder | HandOrder) else None
        further = (profile.machine.name, profile.material.name, profile.process.name) if profile else ()
        return (*told, *further, server_name(told[0]))

    @property
    def over(self) -> bool:
        """Whether nothing of it goes on."""
        return bool(self.state["phase"] == "over")

    @property
    def asking(self) -> bool:
        """Whether nothing has moved yet, and nothing will: once it is told to begin, its process alone knows how far it is."""
        return not self._begun and self.state["phase"] in ("checking", "ready")

    async def run(self) -> None:
        """Have it printed by a process of its own, to the end."""
        process = Interpreter(MAIN)
        await asyncio.to_thread(process.say, self._order)  # a long one is read when the process has loaded what it needs
        self._process = process  # and follows what it does from now on
        if self._given_up or self._emergency:
            self._kill()
        ended = lost = False
        async for state in heard(process.hear()):
            ended = state["phase"] == "over"
            lost = ended and self._has_lost_an_order(state)
            self._become(**state | ({"phase": "leaving"} if lost else {}))
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
        if self.state["phase"] != "ready" or not self.asking or self._given_up:
            raise PrinterError("this print cannot begin now: it is not ready, or over")
        self._begun = True
        self.say((BEGIN,))

    async def fail(self, error: Exception) -> None:
        """A fault of this program: nobody hears the print's process any more, so it ends, and the printer is made safe."""
        self._kill()
        await self._end_without_process()
        self._become(sentence=f"{bug_in_words(error, sys.argv)}; {self.state['sentence']}")

    def cancel(self) -> None:
        """End it, heaters off; before it has begun at once. What has opened a journal to go on with takes it away itself."""
        if self.over:
            self._cancelled = True
            self._order_late()
            return
        asking = self.asking
        self._given_up = self._given_up or asking
        if asking and not isinstance(self._order, ResumeOrder):
            self._kill()
            return
        self.say((Command.CANCEL,))
        self._cancelled = not asking
        if asking:
            asyncio.get_running_loop().call_later(LEAVE_S, self._kill)

    def leave(self) -> None:
        """Let a print server go on with it by itself."""
        self.say((LEAVE,))

    def end(self) -> None:
        """End it because the workbench ends: as a cancel does, but what a print server prints goes on there."""
        if self.state["server"] and not self.asking:
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
        if self.asking or self.state["phase"] == "uploading":
            self._ended = True
            self._kill()
        else:
            self.say((Command.EMERGENCY_STOP,))
            asyncio.get_running_loop().call_later(EMERGENCY_S, self._kill)

    def _kill(self) -> None:
        if self._process is not None:
            self._process.end()

    def _has_lost_an_order(self, ended: State) -> bool:
        """Whether the following of a print on a server has ended before it took what it was told last."""
        stop_lost = self._emergency and not ended["stop_given"]
        return bool(ended["server"] and self._begun and (stop_lost or (self._cancelled and _goes_on(ended))))

    def _order_late(self) -> None:
        """The same for what comes when the print has just been left."""
        if _goes_on(self.state):
            self._become(phase="leaving")
            self._late = asyncio.get_running_loop().create_task(self._order_anew())

    async def _order_anew(self) -> None:
        """Give the stop or the cancel on a connection of its own."""
        port = self._order.printing.port
        if self._emergency:
            outcome = await asyncio.to_thread(rescue, port, 0, True)
            self._become(phase="over", end="failed", sentence=outcome)
            return
        name, away_s = self.state["name"], time() - self.state["progress"]["heat_s"]
        file = name if isinstance(self._order, FollowOrder) else server_name(name)
        try:
            cancelled = await asyncio.to_thread(cancel_on_server, port, file, away_s)
        except UserError as error:
            self._become(phase="over", end="left", sentence=f"{name} was not cancelled: {error}")
            return
        sentence = "the print was stopped" if cancelled else f"there was nothing to cancel: {port} prints nothing any more"
        self._become(phase="over", end="stopped", sentence=sentence)

    async def _end_without_process(self) -> None:
        """The process has died. What it printed on is told to be safe; nothing has been sent to a printer it only asked; a print
        server goes on by itself."""
        printing, moved = self._order.printing, not self.asking
        if not moved:
            self._become(journal="")
        if self._given_up and not self._emergency:
            self._become(phase="over", end="left", sentence="nothing was printed")
        elif printing.port == SIMULATED:
            self._become(phase="over", end="failed", sentence=f"{DIED}; the simulated printer has ended with it")
        elif moved or self._emergency:
            self._become(phase="leaving")
            sentence = await asyncio.to_thread(rescue, printing.port, printing.baud, self._emergency)
            outcome = f"{DIED}; {sentence}" if moved and not self._ended else sentence
            self._become(phase="over", end="failed", sentence=outcome)
        else:
            self._become(phase="over", end="failed", sentence=f"{DIED}; nothing had moved yet")

    def _become(self, **values: object) -> None:
        self.state = {**self.state, **values}
        self._changed()


def _goes_on(ended: State) -> bool:
    """Whether a print was left that its server goes on with."""
    return bool(ended["server"] and ended["end"] == "left" and ended["progress"])
