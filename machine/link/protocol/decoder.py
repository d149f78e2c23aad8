"""The line decoder: received bytes, cut anywhere, become events; bounded, with a count of what could not be read."""

from machine.link.protocol.events import Event, Kind, read_event

LONGEST_LINE = 4096  # a line without end is thrown away beyond this; Marlin's longest answer has 300 characters
TAIL_S = 0.25  # the second line of an error follows at once; 300 characters take this long at 9600 baud
READABLE = frozenset(b"\t\n\r") | frozenset(range(32, 127))
ENOUGH_BYTES = 8  # fewer may be the jerk of a cable being plugged in
RUBBISH_SHARE = 0.2  # a wrong baud rate makes most bytes unreadable, a noisy line a few in a hundred


class LineDecoder:
    """receive() bytes, flush() now and then; `last`: the newest words that are not of a printer."""

    def __init__(self) -> None:
        self._half, self._overflow = b"", False
        self._held, self._held_s = b"", 0.0
        self._bytes = self._unreadable = self._understood = 0
        self.last = ""

    @property
    def incomplete(self) -> bool:
        """Whether words are missing: nothing should be sent before they are known."""
        return bool(self._held)

    @property
    def rubbish(self) -> bool:
        """Whether what has come so far is what a wrong baud rate makes of words."""
        enough = self._bytes >= ENOUGH_BYTES and not self._understood
        return enough and self._unreadable >= RUBBISH_SHARE * self._bytes

    @property
    def foreign(self) -> str:
        """The last words of something that speaks readably, but not like a printer; "" when there are none."""
        return "" if self._understood or self.rubbish else self.last

    def receive(self, data: bytes, now_s: float) -> list[Event]:
        """The events of received bytes; a line may end with a newline, a carriage return or both."""
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
        """The rest of a half line will not come."""
        self._half, self._overflow = b"", False

    def flush(self, now_s: float) -> list[Event]:
        """The event of an error whose second line did not come in time."""
        if not self._held or now_s - self._held_s < TAIL_S:
            return []
        held, self._held = self._held, b""
        return [read_event(held)]

    def _read(self, line: bytes, now_s: float, events: list[Event]) -> None:
        """Marlin's older kin say `Error:0` and, in the next line, `: Extruder switched off. MAXTEMP triggered !`."""
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
