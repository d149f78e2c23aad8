"""Safe shutdown: stop the moves, switch the heaters off, lift the tip; the emergency stop; and the guard around a print."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from types import TracebackType
from typing import Self

from machine.firmware.dialect import HOMING_S
from machine.link.exchange import Exchange
from machine.link.medium import Medium, Wire
from machine.link.protocol.decoder import LineDecoder
from machine.link.protocol.events import Event, Kind, Temperature
from machine.link.protocol.framing import FAR_NUMBER, frame, number_lines
from profiles.errors import PortError, PrinterError, add_words

# M108 ends a wait for heat and M410 a move if the firmware reads them out of turn. Nothing homes or turns the table: the head may
# be inside the part.
HEATERS_OFF = ("M104 S0", "M140 S0", "M107", "M105")
ORDERS = ("M108", "M410", *HEATERS_OFF)
# Marlin takes a homing move stopped by M410 for one that missed its end stop, and halts (Endstops::validate_homing_move, kill
# "Homing Failed"): the orders follow after homing.
HOMING_ORDERS = ("M108", *HEATERS_OFF)
AGAIN_S = 2.0  # noise may swallow an order; without proof they are repeated at this interval
OLD_REPORTS_S = 1.0  # a report from before the orders proves nothing; the wait is limited for printers that never fall silent
SETTLE_S = 20.0  # lines that the printer has already accepted are executed first
FAULT_S = 2.0  # time limit for a printer that has just failed to report its heaters
LIFT_S = 10.0  # a lift of some millimetres at any Z axis' speed
STOP_AGAIN_S, STOP_MOST_S = 0.5, 2.0
UNCONFIRMED = "did not confirm M112: cut the power"


@dataclass
class Orders:
    """Commands outside of a conversation, without line numbers, so that they are understood whatever was lost.

    A firmware that requires checksums refuses them ("Missing checksum": OctoPrint's virtual printer with forceChecksum,
    Repetier). A line with a number too far ahead then makes it report its own, and the commands are sent again with both.
    on_turn: called meanwhile, may raise to stop listening; insists: the firmware requires numbers and checksums; decoder: reads
    the answers.
    """

    wire: Wire
    medium: Medium
    on_turn: Callable[[], None] = lambda: None
    insists: bool = False
    decoder: LineDecoder = field(default_factory=LineDecoder)
    _waiting: tuple[str, ...] = ()  # sent as soon as the number is known

    def give(self, commands: Sequence[str], is_wanted: Callable[[Event], bool], end_s: float) -> bool:
        """Write commands and listen for a wanted event; False when none came by end_s."""
        if self.insists:
            self._ask_number(commands)
        else:
            self.wire.write(as_lines(commands))
        return self.wait_for(lambda event: self._heed(event, commands) or is_wanted(event), end_s)

    def wait_for(self, is_wanted: Callable[[Event], bool], end_s: float) -> bool:
        """Listen for a wanted event; False when none came by end_s."""
        while self.medium.now_s() < end_s:
            self.on_turn()
            data, now_s = self.wire.read(), self.medium.now_s()
            events = [*self.decoder.receive(data, now_s), *self.decoder.flush(now_s)]
            wanted = [is_wanted(event) for event in events]  # evaluate all of them: a halt may directly follow an ok
            if any(wanted):
                return True
        return False

    def _heed(self, event: Event, commands: Sequence[str]) -> bool:
        """React to a refusal and to the number that follows; False, for neither is the wanted event."""
        if event.lacks_checksum and not self.insists:
            self.insists = True
            self._ask_number(commands)
        elif event.kind is Kind.RESEND and event.line is not None and self._waiting:
            self.wire.write(number_lines(event.line, self._waiting))
            self._waiting = ()
        return False

    def _ask_number(self, commands: Sequence[str]) -> None:
        """Make the firmware report its number. A single command is sent for this itself: a firmware that requires a checksum but
        accepts any number executes it."""
        self._waiting = tuple(commands)
        question = commands[0] if len(commands) == 1 else "M105"
        self.wire.write(frame(FAR_NUMBER, question))  # the refused line has ended an unfinished one


def as_lines(commands: Sequence[str]) -> bytes:
    """Commands as lines without numbers; the newline before them ends an unfinished line."""
    return "".join(["\n", *(f"{command}\n" for command in commands)]).encode("ascii")


class Heaters(Enum):
    """State of the heaters at the end of a print."""

    OFF = "the printer reports its heaters off"
    HALTED = "the printer has halted and switched its heaters off by itself"
    UNPROVED = "its heaters may still be on, look at the printer"


def heaters_off(
    wire: Wire, medium: Medium, timeout_s: float = SETTLE_S, homing: bool = False, on_turn: Callable[[], None] = lambda: None
) -> Heaters:
    """Stop the printer and switch the heaters off; returns what its answers prove.

    homing: wait up to HOMING_S for a command that must not or cannot be stopped. on_turn: called meanwhile, may raise. Raises
    PortError when the port is lost.
    """
    wire.discard()
    orders, halted, start_s = Orders(wire, medium, on_turn), False, medium.now_s()
    while (data := wire.read()) and (now_s := medium.now_s()) - start_s < OLD_REPORTS_S:
        halted = any(event.is_halt for event in orders.decoder.receive(data, now_s)) or halted
    orders.decoder.discard_partial()  # nor does the rest of an old report
    commands = HOMING_ORDERS if homing else ORDERS
    off = answered = False

    def ends(event: Event) -> bool:
        """Whether the state of the heaters is proved."""
        nonlocal halted, off, answered
        answered = answered or event.kind is Kind.OK
        halted = halted or event.is_halt
        off = off or (event.temperature is not None and shows_off(event.temperature))
        return off or halted

    def ends_homing(event: Event) -> bool:
        """Whether homing has ended, which an `ok` shows, unless it belongs to a Resend: G28 is answered when it is done."""
        return ends(event) or (answered and not orders.insists)

    if homing and not halted and orders.give(commands, ends_homing, start_s + HOMING_S):
        commands = ORDERS
    start_s = medium.now_s()
    while not off and (now_s := medium.now_s()) < start_s + timeout_s:
        if orders.give(commands, ends, min(now_s + AGAIN_S, start_s + timeout_s)) or halted:
            break
    return Heaters.OFF if off else Heaters.HALTED if halted else Heaters.UNPROVED


def shows_off(report: Temperature) -> bool:
    """Whether a report proves that nozzle and bed are off; a printer without a bed reports none."""
    return report.nozzle_target_c == 0 and report.bed_target_c in (0, None)


class HeaterGuard:
    """`with guard:` around everything that is sent to a printer: however the block ends, the heaters go off.

    That includes KeyboardInterrupt, SystemExit and errors during the shutdown itself. The error's message contains what the
    printer has confirmed. Only release() leaves heaters on. is_needed: whether anything was sent that may heat. on_turn: called
    while listening, may raise. heaters: their final state; None: not switched off yet.
    """

    def __init__(self, exchange: Exchange, is_needed: Callable[[], bool], on_turn: Callable[[], None]) -> None:
        self.heaters: Heaters | None = None
        self._exchange, self._is_needed, self._on_turn = exchange, is_needed, on_turn
        self._began = self._released = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.leave(error)

    def leave(self, error: BaseException | None) -> None:
        """End the block, with or without an error."""
        if self._released or self.heaters is not None or not self._is_needed():
            return
        try:
            if not self._began:
                self.switch_off(FAULT_S if isinstance(error, PrinterError) else SETTLE_S)
        finally:
            if self.heaters is None:  # interrupted: the orders were given, the proof is not awaited
                self.heaters = Heaters.UNPROVED
                with suppress(PortError):
                    self._exchange.wire.write(as_lines(HOMING_ORDERS if self._exchange.waits else ORDERS))
            if error is not None:
                add_words(error, self.heaters.value)

    def release(self) -> None:
        """Leave the heaters as they are: the program has ended by itself, or the user wants them on."""
        self._released = True

    def switch_off(self, timeout_s: float = SETTLE_S, waits: bool = True) -> Heaters:
        """Switch off the heaters of the exchange's printer by heaters_off(). waits: for the end of homing."""
        self._began, exchange = True, self._exchange
        try:
            heaters = heaters_off(exchange.wire, exchange.medium, timeout_s, waits and exchange.waits, self._on_turn)
        except PortError:
            heaters = Heaters.UNPROVED
        self.heaters = Heaters.HALTED if heaters is Heaters.UNPROVED and exchange.connection.halted else heaters
        return self.heaters

    def stop(self) -> str:
        """Make an emergency stop; returns the result in words."""
        halted = emergency_stop(self._exchange.wire, self._exchange.medium)
        self.heaters = Heaters.HALTED if halted else Heaters.UNPROVED
        return f"emergency stop: the printer {f'has halted; {self.revival}' if halted else UNCONFIRMED}"

    @property
    def revival(self) -> str:
        """Advice for a halted printer."""
        return f"{self._exchange.connection.greeting.firmware.line.revival} before the next print"


def lift_tip(wire: Wire, medium: Medium, words: str, feed_mm_min: float, on_turn: Callable[[], None]) -> dict[str, float] | None:
    """Move away from the print and return the position that the printer then reports; words: of a relative G1.

    on_turn: called meanwhile, may raise. Raises PortError.
    """
    position: dict[str, float] | None = None

    def reports_done(event: Event) -> bool:
        nonlocal position
        position = event.position or position
        return event.kind is Kind.OK and event.temperature is not None

    step = ("M83", "G91", f"G1 {words} F{feed_mm_min:.0f}", "G90", "M400", "M114", "M105")
    arrived = Orders(wire, medium, on_turn).give(step, reports_done, medium.now_s() + LIFT_S)
    return position if arrived else None


def reset_overrides(wire: Wire, medium: Medium, commands: Sequence[str], on_turn: Callable[[], None]) -> bool:
    """Send the commands that take the user's overrides back; True when the printer has answered them. Raises PortError."""
    return Orders(wire, medium, on_turn).give(
        (*commands, "M105"),
        lambda event: event.kind is Kind.OK and event.temperature is not None,
        medium.now_s() + FAULT_S,
    )


def emergency_stop(wire: Wire, medium: Medium) -> bool:
    """Send M112 before everything that waits to be sent, and repeat it; True when the printer reports that it has halted.

    Another error may have been under way and confirms nothing. M112 has no number: an emergency parser finds it in the raw bytes,
    any other firmware reads it as a line.
    """
    try:
        wire.discard()
        start_s, orders = medium.now_s(), Orders(wire, medium)
        if orders.give(("M112",), _is_halt, start_s + STOP_AGAIN_S):
            return True
        # A Klipper that had shut down before answers M112 with a bare ok, and any other command with its message.
        return orders.give(("M112", "M107"), _is_halt, start_s + STOP_MOST_S)
    except PortError:
        return False


def _is_halt(event: Event) -> bool:
    return event.is_halt
