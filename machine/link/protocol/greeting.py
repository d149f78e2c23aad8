"""The greeting: how line numbers are agreed on, what a printer answers to M115, and how often it has been greeted in vain."""

from machine.firmware import Firmware, identify
from machine.firmware.marlin import MARLIN
from machine.link.protocol.decoder import LineDecoder
from machine.link.protocol.events import Event, Kind
from machine.link.protocol.verdict import failed_greeting
from profiles.errors import PrinterError

# No newline before it: an empty line counts as a line where checksums are insisted on (OctoPrint's virtual printer: Missing
# checksum), and is answered with ok by Klipper and Smoothieware. What stands half written there costs one greeting.
GREETING = b"N0 M110 N0*125\n"
# The last attempt: a printer that answers it is there, at this rate, and takes no numbered lines. The newline ends a half line.
PLAIN_QUESTION = b"\nM115\n"
UNANSWERED_MOST = 3  # M110 in vain; then numbered lines are sent all the same, for the firmware may not know it


class Greeting:
    """The attempts to greet a printer, and its answers. identity: the FIRMWARE_NAME line; firmware: the one it names. heard: the
    last words of a printer that were no answer to a greeting. wanted: the line number that the printer has asked for since the
    last attempt, 0: none. keeps_numbers: it ignores M110. asked_plainly: PLAIN_QUESTION is under way.
    """

    def __init__(self, rx_bytes: int | None = None, baud: int | None = None) -> None:
        self.firmware: Firmware = MARLIN  # taken for one of unknown name
        self.identity = self.heard = ""
        self.capabilities: dict[str, bool] = {}
        self.wanted = self._wanted_before = 0
        self.keeps_numbers = self.asked_plainly = self._skipped = False
        self._rx_bytes, self._baud, self._tries = rx_bytes, baud, 0

    @property
    def rx_bytes(self) -> int:
        """Bytes that the receive buffer holds: the machine's own, else as usual with its firmware."""
        return self._rx_bytes or self.firmware.line.rx_bytes

    @property
    def emergency_parser(self) -> bool:
        """Whether an M112 is read from the raw bytes."""
        return self.capabilities.get("EMERGENCY_PARSER", False)

    @property
    def waiting_moves(self) -> int | None:
        """The number of moves that may wait behind the newest acknowledged one; None: any number, as of a firmware that has no
        name."""
        return None if identify(self.identity) is None else self.firmware.line.waiting_moves

    @property
    def keep_awake(self) -> str:
        """The command that keeps its motors on in a pause; of a firmware that has no name M84 might switch them off
        (Smoothieware's does)."""
        return "" if identify(self.identity) is None else self.firmware.line.keep_awake

    def learn(self, answer: Event) -> None:
        """Take note of a line of the answer to M115."""
        if answer.identity:
            self.identity, self.firmware = answer.identity, identify(answer.identity) or self.firmware
        if answer.kind is Kind.CAPABILITY:
            name, _, present = answer.text.partition(":")
            self.capabilities[name] = present == "1"

    def attempt(self, decoder: LineDecoder) -> int | PrinterError:
        """The next attempt to greet: the number of the first line, 0: after M110. Or why there is no sense in it.

        A firmware that ignores M110 goes on with a number of its own: it asks for it after two attempts, or one without M110.
        """
        wanted, self.wanted = self.wanted, 0
        self.keeps_numbers = wanted > 0 and (wanted == self._wanted_before or self._skipped)
        self._wanted_before = wanted
        if (error := failed_greeting(decoder, self._tries, self._baud, self.heard)) is not None:
            return error
        self._tries += 1
        if self.keeps_numbers:
            return wanted
        self._skipped = self._tries > UNANSWERED_MOST and not wanted
        return int(self._skipped)
