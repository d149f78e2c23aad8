"""Inquiry: what a printer tells about itself before it is greeted; the greeting sets its line numbers back.

Nothing is changed by it: its one numbered line has a number that no line of a print has, which a firmware that checks numbers
refuses with the last one it has taken.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from machine.link.events import Ok, Position, Temperature, read_event
from machine.link.framing import frame
from machine.link.medium import Medium, Wire
from machine.link.shutdown import Listener

LAST_LINE = re.compile(rb"Last Line: (\d{1,10})")
FAR_NUMBER = 999_999
TRIES, ANSWER_S = 3, 4.0  # a board that restarts when its port is opened spends two seconds in its boot loader
STILL_S = 300.0  # a printer that still works on its queue answers when that is empty


@dataclass(frozen=True)
class Found:
    """The number of the last line the printer has taken, where it says it stands, its temperatures; None: it does not tell."""

    last_number: int | None
    position: Position | None
    temperature: Temperature


@dataclass
class _Answers:
    """What is heard meanwhile."""

    number: int | None = None
    position: Position | None = None
    temperature: Temperature = field(default_factory=Temperature)

    def numbered(self, line: bytes) -> bool:
        """Whether the far number was answered, by a refusal or, where numbers are not checked, by what M105 is answered with."""
        event = read_event(line)
        if found := LAST_LINE.search(line):
            self.number = int(found[1])
        return found is not None or (isinstance(event, Ok) and event.temperature is not None)

    def placed(self, line: bytes) -> bool:
        """Take a position; whether the temperature that is asked for after it has come."""
        event = read_event(line)
        if isinstance(event, Position):
            self.position = event
        elif isinstance(event, Ok):
            self.position = event.position or self.position
            self.temperature = event.temperature or self.temperature
            return event.temperature is not None
        return False


def inquire(wire: Wire, medium: Medium, heed: Callable[[], None]) -> Found:
    """Ask; a printer that answers nothing is found without anything known. Raises PortError, and what heed(), called meanwhile,
    raises to end the asking.
    """
    answers, listener = _Answers(), Listener(wire, medium, heed)
    for _ in range(TRIES):
        wire.write(b"\n" + frame(FAR_NUMBER, "M105"))
        if listener.until(medium.now_s() + ANSWER_S, answers.numbered):
            break
    else:
        return Found(None, None, Temperature())
    listener.until(medium.now_s() + 0.5, lambda line: False)  # the rest of the refusal
    wire.write(b"M400\nM114\nM105\n")
    listener.until(medium.now_s() + STILL_S, answers.placed)
    return Found(answers.number, answers.position, answers.temperature)
