"""Exchange: one conversation over an open wire; lines go out as the window allows, every event of the printer is handed on."""

from collections.abc import Callable
from math import inf

from machine.gcode.commands import command_in
from machine.link.medium import Medium, Wire
from machine.link.protocol.connection import GREETING_STATES, Connection
from machine.link.protocol.events import Event
from machine.link.protocol.states import State
from profiles.errors import PortError


class Exchange:
    """`on_event` gets every event after the connection has seen it, `on_turn` is called once a turn with the time, s.

    `on_lost` is called when the port is gone after the greeting: it finds the same printer again or raises. It returns the new
    wire, and whether what was on its way has been done; None: the printer is to be asked. The printer's own faults are raised as
    the connection reports them.
    """

    def __init__(
        self,
        wire: Wire,
        medium: Medium,
        connection: Connection,
        *,
        on_event: Callable[[Event], None],
        on_turn: Callable[[float], None],
        on_lost: Callable[[PortError], tuple[Wire, bool | None]],
    ) -> None:
        self.wire, self.medium, self.connection = wire, medium, connection
        self.greeted = False
        self._on_event, self._on_turn, self._on_lost = on_event, on_turn, on_lost
        self._position: dict[str, float] | None = None

    @property
    def waits(self) -> bool:
        """Whether the printer is at a command that is waited for when the print is ended: homing, above all."""
        window = self.connection.window
        return any(command_in(window.command(line.number)).must_end for line in window.flight)

    def greet(self) -> None:
        """Agree on line numbers and learn how the printer answers."""
        while self.connection.state in GREETING_STATES:
            self.pump()
        self.greeted = True

    def send(self, command: str) -> int:
        """Wait for room and send; returns the line's number, counted from the greeting on."""
        send, now_s = self.connection.send, self.medium.now_s
        while not (number := send(command, now_s())):
            self.pump()
        return number

    def settle(self) -> None:
        """Wait until every line sent is acknowledged."""
        window = self.connection.window
        while window.acknowledged < window.sent or self.connection.state is not State.OPEN:
            self.pump()

    def drain(self) -> None:
        """The barrier: wait until every move sent so far is over. A question asked after M400 has been answered then."""
        self.send("M400")
        self.send("M105")
        self.settle()

    def ask_position(self) -> dict[str, float] | None:
        """The position that the printer reports, letter -> mm or deg, all moves over; None when it does not report it."""
        self.send("M400")
        self.settle()
        self._position = None
        self.send("M114")
        self.send("M105")
        self.settle()
        return self._position

    def wait(self, seconds: float = inf, until: Callable[[], bool] = lambda: False) -> None:
        """Keep the conversation alive, without sending, for some time or until something has come true."""
        end_s = self.medium.now_s() + seconds
        while not until() and self.medium.now_s() < end_s:
            self.pump()

    def pump(self) -> None:
        """One turn: write, read, let time pass."""
        connection = self.connection
        try:
            if out := connection.take():
                self.wire.write(out)
            data = self.wire.read()
        except PortError as error:
            self._reconnect(error)
            return
        now_s = self.medium.now_s()
        if data:
            for event in connection.receive(data, now_s):
                if event.position is not None:
                    self._position = event.position
                self._on_event(event)
        connection.tick(now_s)
        if connection.fault is not None:
            raise connection.fault
        self._on_turn(now_s)

    def _reconnect(self, error: PortError) -> None:
        """Go on over a new wire: the printer is asked what has arrived; one that has restarted answers with its first number."""
        if not self.greeted:
            raise error
        self.wire, done = self._on_lost(error)
        self.connection.reconnect(self.medium.now_s(), done)
        self.wire.write(self.connection.take())  # one that takes nothing over a new wire either has not been found again
