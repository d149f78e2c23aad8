"""Status query before the greeting, which resets the line numbers; and the fate of the line in flight when a port was lost.

The query changes nothing: its numbered line has a number beyond those of a print, which a firmware that checks numbers refuses
with the last one it accepted. RepRapFirmware and Klipper do not report line numbers, but positions and filament to a thousandth.
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
QUESTIONS = ("M115", "M400", "M114", "M105")
TRIES, ANSWER_S = 3, 4.0  # a board that restarts when its port is opened spends two seconds in its boot loader
STILL_S = 300.0  # a printer that is still executing its queue answers when that is empty
SAME = 0.01  # mm or deg: rounding of program and firmware
DISTINCT = 0.004  # closer positions cannot be distinguished by thousandths
SEVERAL = 3  # matching coordinates other than 0: a restarted printer reports 0 0 0


@dataclass
class PrinterStatus:
    """A printer's own report; None: not reported."""

    last_number: int | None = None  # number of the last accepted line
    position: dict[str, float] | None = None
    temperature: Temperature = field(default_factory=Temperature)
    greeted: bool = False  # the firmware sent its start-up message: it has just restarted
    fault: str = ""  # its message about an error
    capabilities: dict[str, bool] = field(default_factory=dict)  # by name, as far as the firmware lists them

    def _read(self, event: Event) -> None:
        """Note an event; a board that restarts begins its line numbers again."""
        if event.kind is Kind.FAULT:
            self.fault = event.text.removeprefix("!!").strip()
        if event.kind is Kind.CAPABILITY:
            name, _, present = event.text.partition(":")
            self.capabilities[name] = present == "1"
        if event.kind in (Kind.START, Kind.BANNER):
            self.greeted, self.last_number = True, None if self.last_number is None else 0

    def read_number(self, event: Event) -> bool:
        """Whether the question was answered: by a refusal or, where numbers are not checked, by the answer to M105."""
        self._read(event)
        if last_line := LAST_LINE.search(event.text):
            self.last_number = int(last_line[1])
        elif event.kind is Kind.RESEND and event.line is not None:  # Repetier and OctoPrint's virtual printer name no last line
            self.last_number = event.line - 1
        return self.last_number is not None or (event.kind is Kind.OK and event.temperature is not None)

    def read_position(self, event: Event) -> bool:
        """Note a position; whether the temperature requested after it has come."""
        self._read(event)
        self.position = event.position or self.position
        if event.kind is Kind.OK and event.temperature is not None:
            self.temperature = event.temperature
            return True
        return False


def query_status(wire: Wire, medium: Medium, on_turn: Callable[[], None]) -> PrinterStatus:
    """Query a printer's status; everything is unknown when no answer comes.

    Raises PortError, and whatever on_turn(), called meanwhile, raises to end the query.
    """
    status, orders = PrinterStatus(), Orders(wire, medium, on_turn)
    for _ in range(TRIES):
        wire.write(b"\n" + frame(FAR_NUMBER, "M105"))
        if orders.wait_for(status.read_number, medium.now_s() + ANSWER_S):
            break
    else:
        return PrinterStatus()
    orders.wait_for(lambda event: False, medium.now_s() + 0.5)  # the rest of the refusal
    for _ in range(TRIES):  # a query is lost when the board restarts meanwhile
        before, status.greeted = status.greeted, False
        orders.give(QUESTIONS, lambda event: status.read_position(event) or status.greeted, medium.now_s() + STILL_S)
        again, status.greeted = status.greeted, status.greeted or before
        if not again:
            break
        orders.wait_for(lambda event: False, medium.now_s() + ANSWER_S)
    return status


def line_was_done(command: str, before: Sequence[float | None], after: ModalState, status: PrinterStatus) -> bool | None:
    """Whether a line was executed; False: it may be sent again; None: unknown, or the printer has restarted.

    before: X Y Z tilt turn E before the command; after: the firmware's state after it.
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
    for chosen in ([letter for letter in letters if letter != "E"], letters):  # some firmwares count filament differently
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
    """Whether the printer has not restarted: it is at one of the ends, and still heats as the program requires."""
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
    """Whether the printer is at the end of the command; None when at neither end."""
    from_start = _greatest_difference(reported, start, letters)
    from_end = _greatest_difference(reported, end, letters)
    return from_end < from_start if min(from_start, from_end) <= SAME else None


def _greatest_difference(a: Mapping[str, float | None], b: Mapping[str, float | None], letters: Sequence[str]) -> float:
    """Greatest difference of two positions on some axes."""
    return max((abs((a[letter] or 0.0) - (b[letter] or 0.0)) for letter in letters), default=0.0)


def position_differences(modal: ModalState, reported: Mapping[str, float], near: float) -> list[str]:
    """Axes, in words, whose reported position differs by more than `near` from the program's."""
    pairs = zip(modal.axes.letters[:E_AXIS], modal.at[:E_AXIS], strict=True)
    return [
        f"{letter} {reported[letter]:g} instead of {value:.3f}"
        for letter, value in pairs
        if value is not None and letter in reported and abs(reported[letter] - value) > near
    ]
