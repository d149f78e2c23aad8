"""Exchange: the conversation with a printer over an open wire; sends as the window allows and passes on every event."""

from collections.abc import Callable
from math import inf

from machine.gcode.commands import command_in
from machine.link.medium import Medium, Wire
from machine.link.protocol.connection import GREETING_STATES, Connection
from machine.link.protocol.events import Event
from machine.link.protocol.states import State
from profiles.errors import PortError


class Exchange:
    """Runs a connection over a wire. on_event gets each event after the connection; on_turn is called once per turn with the
    time, s.

    on_lost is called when the port is lost after the greeting. It returns the new wire to the same printer, and whether the lines
    in flight were executed (None: ask the printer); or it raises. The printer's faults are raised as the connection reports them.
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
        """Whether the printer runs a command that the end of the print must wait for, above all homing."""
        window = self.connection.window
        return any(command_in(window.command(line.number)).must_end for line in window.flight)

    def greet(self) -> None:
        """Agree on line numbers and learn how the printer answers."""
        while self.connection.state in GREETING_STATES:
            self.pump()
        self.greeted = True

    def send(self, command: str) -> int:
        """Wait for space and send; returns the line's number, counted from the greeting."""
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
        """Wait until every move sent so far has ended: a query sent after M400 is answered then."""
        self.send("M400")
        self.send("M105")
        self.settle()

    def ask_position(self) -> dict[str, float] | None:
        """The position that the printer reports after all moves, letter -> mm or deg; None when it reports none."""
        self.send("M400")
        self.settle()
        self._position = None
        self.send("M114")
        self.send("M105")
        self.settle()
        return self._position

    def wait(self, seconds: float = inf, until: Callable[[], bool] = lambda: False) -> None:
        """Keep the conversation alive without sending, for a time or until a condition holds."""
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
        """Continue over a new wire: the printer is asked which lines arrived; a restarted one answers with its first number."""
        if not self.greeted:
            raise error
        self.wire, done = self._on_lost(error)
        self.connection.reconnect(self.medium.now_s(), done)
        self.wire.write(self.connection.take())  # a printer that accepts nothing over a new wire counts as lost
