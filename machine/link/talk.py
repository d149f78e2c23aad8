"""Talk: one conversation over an open wire; lines go out as the window allows, and every event of the printer is handed on."""

from collections.abc import Callable
from math import inf
from typing import NamedTuple

from machine.link.events import Event, Ok, Position
from machine.link.framing import LINE_LIMIT
from machine.link.medium import Medium, Wire
from machine.link.protocol import Protocol, Timing
from machine.link.states import State
from profiles.errors import PortError

GREETING = (State.DRAIN, State.SYNC, State.HELLO)


class Mended(NamedTuple):
    """A new wire to a printer whose port was lost, and whether what was on its way has been done; None: it is to be asked."""

    wire: Wire
    done: bool | None


class Talk:
    """`heard` gets every event after the protocol has seen it, `turned` is called once a turn with the time, s.

    `lost` is asked what to do when the port is gone after the greeting: it finds the same printer again or raises. The
    printer's own faults are raised as the protocol tells them.
    """

    def __init__(
        self,
        wire: Wire,
        medium: Medium,
        timing: Timing,
        heard: Callable[[Event], None],
        turned: Callable[[float], None],
        lost: Callable[[PortError], Mended],
        limit: int = LINE_LIMIT,
        rx_bytes: int | None = None,
        baud: int | None = None,
    ) -> None:
        self.wire, self.medium = wire, medium
        self.protocol = Protocol(timing, medium.now_s(), limit, rx_bytes=rx_bytes, baud=baud)
        self.greeted = False
        self._heard, self._turned, self._lost = heard, turned, lost
        self._position: Position | None = None

    def greet(self) -> None:
        """Agree on line numbers and learn the printer's habits."""
        while self.protocol.state in GREETING:
            self.pump()
        self.greeted = True

    def send(self, command: str) -> int:
        """Wait for room and send; returns the line's number, counted from the greeting on."""
        room = self.protocol.room
        while not room(command):
            self.pump()
        return self.protocol.send(command, self.medium.now_s())

    def settle(self) -> None:
        """Wait until every line sent is acknowledged."""
        window = self.protocol.window
        while window.acknowledged < window.sent or self.protocol.state is not State.OPEN:
            self.pump()

    def drain(self) -> None:
        """The barrier: wait until every move sent so far is over. A question asked after M400 has been answered then."""
        self.send("M400")
        self.send("M105")
        self.settle()

    def ask_position(self) -> Position | None:
        """Where the printer says it stands, all moves over; None when it does not tell."""
        self.send("M400")
        self.settle()
        self._position = None
        self.send("M114")
        self.send("M105")
        self.settle()
        return self._position

    def rest(self, seconds: float = inf, until: Callable[[], bool] = lambda: False) -> None:
        """Keep the conversation alive, without sending, for some time or until something has come true."""
        end_s = self.medium.now_s() + seconds
        while not until() and self.medium.now_s() < end_s:
            self.pump()

    def pump(self) -> None:
        """One turn: write, read, let time pass."""
        protocol = self.protocol
        try:
            if out := protocol.take():
                self.wire.write(out)
            data = self.wire.read()
        except PortError as error:
            self._mend(error)
            return
        now_s = self.medium.now_s()
        if data:
            for event in protocol.receive(data, now_s):
                if isinstance(event, Position):
                    self._position = event
                elif isinstance(event, Ok) and event.position is not None:
                    self._position = event.position
                self._heard(event)
        protocol.tick(now_s)
        if protocol.fault is not None:
            raise protocol.fault
        self._turned(now_s)

    def _mend(self, error: PortError) -> None:
        """Go on over a new wire: the printer is asked what has arrived; one that has restarted answers with its first number."""
        if not self.greeted:
            raise error
        self.wire, done = self._lost(error)
        self.protocol.interrupted(self.medium.now_s(), done)
        self.wire.write(self.protocol.take())  # one that takes nothing over a new wire either has not been found again
