"""Status: what a printer reports about itself before it is greeted; the greeting sets its line numbers back. And whether the line
that was on its way when the port was lost has been done, by where the printer stands.

Nothing is changed by it: its one numbered line has a number that no line of a print has, which a firmware that checks numbers
refuses with the last one it has taken. RepRapFirmware and Klipper cannot be asked by line number, but both report the place they
were sent to, to a thousandth, and the filament with it.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from machine.gcode.commands import command_in
from machine.gcode.modes import E_AXIS, ModalState
from machine.link.medium import Medium, Wire
from machine.link.protocol.events import Event, Kind, Temperature
from machine.link.protocol.framing import FAR_NUMBER, frame
from machine.link.shutdown import Orders

LAST_LINE = re.compile(r"Last Line: (\d{1,10})")
QUESTIONS = ("M400", "M114", "M105")
TRIES, ANSWER_S = 3, 4.0  # a board that restarts when its port is opened spends two seconds in its boot loader
STILL_S = 300.0  # a printer that still works on its queue answers when that is empty
SAME = 0.01  # mm or deg: what program and firmware round
DISTINCT = 0.004  # two places nearer to each other cannot be told apart by thousandths
SEVERAL = 3  # coordinates that are not 0 and agree: a printer that has restarted stands at 0 0 0


@dataclass
class PrinterStatus:
    """A printer's own report; None: not reported."""

    last_number: int | None = None  # of the last line that it has taken
    position: dict[str, float] | None = None
    temperature: Temperature = field(default_factory=Temperature)
    greeted: bool = False  # the firmware said its greeting meanwhile: it has just restarted
    fault: str = ""  # its own words for an error

    def _read(self, event: Event) -> None:
        """Any event; a board that restarts begins its line numbers anew."""
        if event.kind is Kind.FAULT:
            self.fault = event.text.removeprefix("!!").strip()
        if event.kind in (Kind.START, Kind.BANNER):
            self.greeted, self.last_number = True, None if self.last_number is None else 0

    def read_number(self, event: Event) -> bool:
        """Whether the far number was answered, by a refusal or, where numbers are not checked, by what M105 is answered with."""
        self._read(event)
        if last_line := LAST_LINE.search(event.text):
            self.last_number = int(last_line[1])
        elif event.kind is Kind.RESEND and event.line is not None:  # Repetier and OctoPrint's virtual printer name no last line
            self.last_number = event.line - 1
        return self.last_number is not None or (event.kind is Kind.OK and event.temperature is not None)

    def read_position(self, event: Event) -> bool:
        """Take a position; whether the temperature that is asked for after it has come."""
        self._read(event)
        self.position = event.position or self.position
        if event.kind is Kind.OK and event.temperature is not None:
            self.temperature = event.temperature
            return True
        return False


def query_status(wire: Wire, medium: Medium, on_turn: Callable[[], None]) -> PrinterStatus:
    """Ask a printer for its status; all of it is unknown where no answer comes.

    Raises PortError, and what on_turn(), called meanwhile, raises to end the asking.
    """
    status, orders = PrinterStatus(), Orders(wire, medium, on_turn)
    for _ in range(TRIES):
        wire.write(b"\n" + frame(FAR_NUMBER, "M105"))
        if orders.wait_for(status.read_number, medium.now_s() + ANSWER_S):
            break
    else:
        return PrinterStatus()
    orders.wait_for(lambda event: False, medium.now_s() + 0.5)  # the rest of the refusal
    for _ in range(TRIES):  # what was asked is lost when the board restarts meanwhile
        before, status.greeted = status.greeted, False
        orders.give(QUESTIONS, lambda event: status.read_position(event) or status.greeted, medium.now_s() + STILL_S)
        again, status.greeted = status.greeted, status.greeted or before
        if not again:
            break
        orders.wait_for(lambda event: False, medium.now_s() + ANSWER_S)
    return status


def line_was_done(command: str, before: Sequence[float | None], after: ModalState, status: PrinterStatus) -> bool | None:
    """True: done; False: it may be sent once more; None: nobody can say, or the printer has restarted.

    before: X Y Z tilt turn E before the command; after: what the firmware is to remember after it.
    """
    if status.position is None or len(before) <= E_AXIS:
        return None
    reported = status.position
    letters = [
        letter
        for letter, old, new in zip(after.axes.letters, before, after.at, strict=True)
        if letter in reported and old is not None and new is not None
    ]
    start, end = (dict(zip(after.axes.letters, values, strict=True)) for values in (before, after.at))
    if not _still_running(reported, (start, end), letters, status, after):
        return None
    for chosen in ([letter for letter in letters if letter != "E"], letters):  # some firmwares count filament in their own way
        if _greatest_difference(start, end, chosen) >= DISTINCT:
            return _reached_end(reported, start, end, chosen)
    row = command_in(command)
    absolute = not (after.modes.relative or after.modes.filament_relative)
    repeatable = row.repeatable or row.modal or (row.moves == "path" and absolute)
    return False if repeatable and _greatest_difference(reported, end, letters) <= SAME else None


def _still_running(
    reported: Mapping[str, float],
    ends: Sequence[Mapping[str, float | None]],
    letters: Sequence[str],
    status: PrinterStatus,
    after: ModalState,
) -> bool:
    """Whether the printer has not restarted since: it stands at one of the places, and still heats what is to be hot."""
    heat = status.temperature
    pairs = ((after.nozzle_c, heat.nozzle_target_c), (after.bed_c, heat.bed_target_c))
    if any(wanted > 0 and target is not None and target <= 0 for wanted, target in pairs):
        return False
    at = [letter for letter in letters if letter != "E"]
    stands = any(_greatest_difference(reported, end, at) <= SAME for end in ends)
    hot = any(wanted > 0 and target for wanted, target in pairs)
    return stands and (hot or sum(abs(reported[letter]) > SAME for letter in letters) >= SEVERAL)


def _reached_end(
    reported: Mapping[str, float], start: Mapping[str, float | None], end: Mapping[str, float | None], letters: Sequence[str]
) -> bool | None:
    """Whether the printer stands where the command leads to; None when at neither place."""
    from_start = _greatest_difference(reported, start, letters)
    from_end = _greatest_difference(reported, end, letters)
    return from_end < from_start if min(from_start, from_end) <= SAME else None


def _greatest_difference(a: Mapping[str, float | None], b: Mapping[str, float | None], letters: Sequence[str]) -> float:
    """The greatest difference of two places on some axes."""
    return max((abs((a[letter] or 0.0) - (b[letter] or 0.0)) for letter in letters), default=0.0)


def position_differences(modal: ModalState, reported: Mapping[str, float], near: float) -> list[str]:
    """Axes on which the printer's own position differs by more than `near` from what the program has led to, in words."""
    pairs = zip(modal.axes.letters[:E_AXIS], modal.at[:E_AXIS], strict=True)
    return [
        f"{letter} {reported[letter]:g} instead of {value:.3f}"
        for letter, value in pairs
        if value is not None and letter in reported and abs(reported[letter] - value) > near
    ]
