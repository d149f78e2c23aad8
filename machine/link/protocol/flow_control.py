"""Flow control: how many lines may be on their way at the same time."""

from machine.firmware.line import LineRules

CLEAN_LINES = 8  # acknowledgements awaited one by one before the window opens
# After each error four times as many: when a line is refused the printer throws away what it has of the next one, and the rest of
# that one may be run without check. A window of one line cannot be torn so, and costs a tenth of the speed.
CAUTION_MOST = 8192
PLACES_MOST = 16  # Marlin's BUFSIZE is 4 to 16; a greater number is a damaged answer


class FlowControl:
    """`numbered`: the answers name the line they belong to."""

    def __init__(self) -> None:
        self.numbered = False
        self._free = 0
        self._clean, self._caution = 0, CLEAN_LINES

    def lines(self, rules: LineRules, emergency_parser: bool) -> int:
        """Lines in flight. Without an emergency parser one place of the printer stays free, so that it sees an M112 at once."""
        if self._clean < self._caution:
            return 1
        if not self.numbered:
            return rules.places_plain
        if not self._free:
            return rules.places
        return self._free if emergency_parser else max(1, self._free - 1)

    def learn(self, rx_free: int | None) -> None:
        """A numbered answer has come, with or without the free places of the printer's queue."""
        self.numbered = True
        if rx_free is not None:
            self._free = max(self._free, min(rx_free + 1, PLACES_MOST))  # B counts the line itself as still there

    def acknowledge(self, lines: int) -> None:
        """So many lines were acknowledged."""
        self._clean += lines

    def slow_down(self) -> None:
        """An answer is missing: one by one for a while."""
        self._clean = 0

    def back_off(self) -> None:
        """A line was refused: one by one for longer than the last time."""
        self._clean = 0
        self._caution = min(4 * self._caution, CAUTION_MOST)
