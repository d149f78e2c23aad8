"""Status: what a printer reports about itself before it is greeted; the greeting sets its line numbers back.

Nothing is changed by it: its one numbered line has a number that no line of a print has, which a firmware that checks numbers
refuses with the last one it has taken.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from machine.link.medium import Medium, Wire
from machine.link.protocol.events import (
    Banner,
    Event,
    FirmwareFault,
    Ok,
    Position,
    Resend,
    Start,
    Temperature,
    position_in,
    read_event,
)
from machine.link.protocol.framing import FAR_NUMBER, frame
from machine.link.shutdown import Orders

LAST_LINE = re.compile(rb"Last Line: (\d{1,10})")
QUESTIONS = ("M400", "M114", "M105")
TRIES, ANSWER_S = 3, 4.0  # a board that restarts when its port is opened spends two seconds in its boot loader
STILL_S = 300.0  # a printer that still works on its queue answers when that is empty


@dataclass
class PrinterStatus:
    """The number of the last line the printer has taken, where it says it stands, its temperatures; None: not reported.

    greeted: the firmware said its greeting meanwhile: it has just restarted. fault: its own words for an error, "" for none.
    """

    last_number: int | None = None
    position: Position | None = None
    temperature: Temperature = field(default_factory=Temperature)
    greeted: bool = False
    fault: str = ""

    def _read(self, line: bytes) -> Event:
        """Any line; a board that restarts begins its line numbers anew."""
        event = read_event(line)
        if isinstance(event, FirmwareFault):
            self.fault = event.text.removeprefix("!!").strip()
        if isinstance(event, Start | Banner):
            self.greeted, self.last_number = True, None if self.last_number is None else 0
        return event

    def read_number(self, line: bytes) -> bool:
        """Whether the far number was answered, by a refusal or, where numbers are not checked, by what M105 is answered with."""
        event = self._read(line)
        if last_line := LAST_LINE.search(line):
            self.last_number = int(last_line[1])
        elif isinstance(event, Resend):  # Repetier and OctoPrint's virtual printer do not name the last line
            self.last_number = event.line - 1
        return self.last_number is not None or (isinstance(event, Ok) and event.temperature is not None)

    def read_position(self, line: bytes) -> bool:
        """Take a position; whether the temperature that is asked for after it has come."""
        event = self._read(line)
        self.position = position_in(event) or self.position
        if isinstance(event, Ok) and event.temperature is not None:
            self.temperature = event.temperature
            return True
        return False


def query_status(wire: Wire, medium: Medium, on_turn: Callable[[], None]) -> PrinterStatus:
    """Ask; a printer that answers nothing gives a status without anything known.

    Raises PortError, and what on_turn(), called meanwhile, raises to end the asking.
    """
    status, orders = PrinterStatus(), Orders(wire, medium, on_turn)
    for _ in range(TRIES):
        wire.write(b"\n" + frame(FAR_NUMBER, "M105"))
        if orders.wait_for(status.read_number, medium.now_s() + ANSWER_S):
            break
    else:
        return PrinterStatus()
    orders.wait_for(lambda line: False, medium.now_s() + 0.5)  # the rest of the refusal
    for _ in range(TRIES):  # what was asked is lost when the board restarts meanwhile
        before, status.greeted = status.greeted, False
        orders.give(QUESTIONS, lambda line: status.read_position(line) or status.greeted, medium.now_s() + STILL_S)
        again, status.greeted = status.greeted, status.greeted or before
        if not again:
            break
        orders.wait_for(lambda line: False, medium.now_s() + ANSWER_S)
    return status
