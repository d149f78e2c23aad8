"""Greeting: agreement on line numbers, the answers to M115, and the count of attempts."""

from machine.firmware import Firmware, identify
from machine.firmware.marlin import MARLIN
from machine.link.protocol.decoder import LineDecoder
from machine.link.protocol.events import Event, Kind
from machine.link.protocol.verdict import failed_greeting
from profiles.errors import PrinterError

# No newline before it: an empty line counts as a line where checksums are required (OctoPrint's virtual printer: Missing
# checksum), and is answered with ok by Klipper and Smoothieware. An unfinished line costs one greeting.
GREETING = b"N0 M110 N0*125\n"
# The last attempt: a printer that answers it is there, at this rate, and accepts no numbered lines. The newline ends an
# unfinished line.
PLAIN_QUESTION = b"\nM115\n"
UNANSWERED_MOST = 3  # M110; after that numbered lines are sent all the same, for the firmware may not know it


class Greeting:
    """Attempts to greet a printer, and its answers.

    identity: the FIRMWARE_NAME line; firmware: the one it names. heard: its last line that did not answer a greeting. wanted:
    line number that the printer has requested since the last attempt, 0: none. keeps_numbers: it ignores M110. asked_plainly:
    PLAIN_QUESTION was sent.
    """

    def __init__(self, rx_bytes: int | None = None, baud: int | None = None) -> None:
        self.firmware: Firmware = MARLIN  # also for unknown names
        self.identity = self.heard = ""
        self.capabilities: dict[str, bool] = {}
        self.wanted = self._wanted_before = 0
        self.keeps_numbers = self.asked_plainly = self._skipped = False
        self._rx_bytes, self._baud, self._tries = rx_bytes, baud, 0

    @property
    def rx_bytes(self) -> int:
        """Size of the receive buffer: the machine's, else usual for its firmware."""
        return self._rx_bytes or self.firmware.line.rx_bytes

    @property
    def emergency_parser(self) -> bool:
        """Whether the firmware finds an M112 in the raw bytes."""
        return self.capabilities.get("EMERGENCY_PARSER", False)

    @property
    def waiting_moves(self) -> int | None:
        """Number of moves that may wait after the newest acknowledged one; None: unknown, as for an unknown firmware."""
        return None if identify(self.identity) is None else self.firmware.line.waiting_moves

    @property
    def keep_awake(self) -> str:
        """Command that keeps the motors on in a pause; "" for an unknown firmware, whose M84 might switch them off as
        Smoothieware's does."""
        return "" if identify(self.identity) is None else self.firmware.line.keep_awake

    def learn(self, answer: Event) -> None:
        """Note a line of the answer to M115."""
        if answer.identity:
            self.identity, self.firmware = answer.identity, identify(answer.identity) or self.firmware
        if answer.kind is Kind.CAPABILITY:
            name, _, present = answer.text.partition(":")
            self.capabilities[name] = present == "1"

    def attempt(self, decoder: LineDecoder) -> int | PrinterError:
        """Next attempt to greet: number of the first line, 0: after M110; or the error that makes a further attempt pointless.

        A firmware that ignores M110 continues its own numbers: it requests one after two attempts, or after one without M110.
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
