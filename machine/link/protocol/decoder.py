"""Line decoder: turns received bytes, split anywhere, into events; bounded, with a count of unreadable bytes."""

from machine.link.protocol.events import Event, Kind, read_event

LONGEST_LINE = 4096  # an endless line is discarded beyond this; Marlin's longest answer has 300 characters
TAIL_S = 0.25  # the second line of an error follows at once; 300 characters take this long at 9600 baud
READABLE = frozenset(b"\t\n\r") | frozenset(range(32, 127))
ENOUGH_BYTES = 8  # fewer may be the noise of a cable being plugged in
GARBLED_SHARE = 0.2  # a wrong baud rate garbles most bytes, a noisy line a few in a hundred


class LineDecoder:
    """Decodes lines: receive() bytes, flush() regularly. `last`: the newest line that is not a printer's."""

    def __init__(self) -> None:
        self._half, self._overflow = b"", False
        self._held, self._held_s = b"", 0.0
        self._bytes = self._unreadable = self._understood = 0
        self.last = ""

    @property
    def incomplete(self) -> bool:
        """Whether a message is incomplete: nothing should be sent before its end is known."""
        return bool(self._held)

    @property
    def is_garbled(self) -> bool:
        """Whether the bytes so far are garbled as by a wrong baud rate."""
        enough = self._bytes >= ENOUGH_BYTES and not self._understood
        return enough and self._unreadable >= GARBLED_SHARE * self._bytes

    @property
    def foreign(self) -> str:
        """The last line of something readable that does not speak like a printer; "" for none."""
        return "" if self._understood or self.is_garbled else self.last

    def receive(self, data: bytes, now_s: float) -> list[Event]:
        """The events of received bytes; a line ends with a newline, a carriage return or both."""
        *lines, self._half = (self._half + data.replace(b"\r", b"\n")).split(b"\n")
        if not self._understood:
            self._bytes += len(data)
            self._unreadable += sum(byte not in READABLE for byte in data)
        if lines and self._overflow:
            self._overflow = False
            del lines[0]
        if len(self._half) > LONGEST_LINE or self._overflow:
            self._half, self._overflow = b"", True
        events: list[Event] = []
        for line in lines:
            if line and len(line) <= LONGEST_LINE:
                self._read(line, now_s, events)
        return events

    def discard_partial(self) -> None:
        """Discard an unfinished line whose end will not come."""
        self._half, self._overflow = b"", False

    def flush(self, now_s: float) -> list[Event]:
        """The event of an error whose second line did not come in time."""
        if not self._held or now_s - self._held_s < TAIL_S:
            return []
        held, self._held = self._held, b""
        return [read_event(held)]

    def _read(self, line: bytes, now_s: float, events: list[Event]) -> None:
        """Append a line's event; older Marlins send `Error:0` and, on the next line, `: Extruder switched off. MAXTEMP triggered
        !`."""
        if self._held:
            held, self._held = self._held, b""
            if line.lstrip().startswith(b":"):
                line = held.rstrip() + line.lstrip()
            else:
                events.append(read_event(held))
        if line.startswith(b"Error:") and line[6:].strip(b" -0123456789") == b"":
            self._held, self._held_s = line, now_s
            return
        event = read_event(line)
        if event.kind is Kind.UNKNOWN:
            self.last = event.text or self.last
        else:
            self._understood += 1
        events.append(event)
