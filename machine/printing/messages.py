"""Printer messages: the last things a printer has said that are no mere answers, for the person who watches a print."""

from collections import deque

from machine.link.protocol.events import Action, Echo, FirmwareFault, LineError, Start, Unknown, read_event, unknown_command

KEPT = 50
LONGEST_BYTES = 4096  # of a line that is not ended yet


class PrinterMessages:
    """The last things a printer has said that are no mere answers; hear() takes chunks of bytes in the thread of the port."""

    def __init__(self, most: int = KEPT) -> None:
        self.last: deque[str] = deque(maxlen=most)
        self._half, self._message = b"", ""
        self._newest, self._times = "", 0

    def hear(self, direction: str, data: bytes) -> None:
        """Take what was received ("<")."""
        if direction != "<":
            return
        *lines, self._half = (self._half + data).split(b"\n")
        self._half = self._half[-LONGEST_BYTES:]
        for line in lines:
            if line[:2] != b"ok" and (text := printer_message(line)):
                self._append(text)

    def _append(self, text: str) -> None:
        """What is said again takes no line of its own but a count."""
        again = text == self._newest and bool(self.last)
        self._newest, self._times = text, self._times + 1 if again else 1
        if again:
            self.last[-1] = f"{text} (x {self._times})"
        else:
            self.last.append(text)

    def add(self, text: str) -> None:
        """Take the stream's message of this moment; one that stays is added once."""
        if text and text != self._message:
            self._append(text)
        self._message = text


def printer_message(line: bytes) -> str:
    """What a line tells a person, "" for reports and answers."""
    event = read_event(line)
    if isinstance(event, Start):
        return "the printer has started"
    if isinstance(event, Action):
        return f"the printer asks: {event.name} {event.words}".rstrip()
    if unknown := unknown_command(event):
        return f"Unknown command: {unknown}"
    return event.text if isinstance(event, Echo | FirmwareFault | LineError | Unknown) else ""
