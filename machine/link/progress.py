"""How far a print is by its lines, and what the program's own comments and M73 say."""

from dataclasses import dataclass

from machine.gcode.line_text import begins_layer, begun_part, read_line
from machine.gcode.words import read_words, split_command


@dataclass
class ProgramPosition:
    """Where in the program the sender stands, gathered line by line."""

    part: int | None = None
    parts: int | None = None
    layer: int | None = None
    percent: float | None = None
    minutes_left: float | None = None
    reported_at_s: float = 0.0

    def read_comment(self, line: str) -> bool:
        """Take note of what a line says behind its `;`; whether a layer begins there."""
        comment = read_line(line).comment.strip() if ";" in line else ""
        if not comment:
            return False
        if begins := begins_layer(comment):
            self.layer = 1 if self.layer is None else self.layer + 1
        elif part := begun_part(comment):
            self.part, self.layer, self.parts = part[0], None, part[1] or self.parts
        return begins

    def read_m73(self, command: str, now_s: float) -> None:
        """Take note of the P (per cent done) and R (minutes left) of an M73; nothing of another command."""
        name, rest = split_command(command.upper())
        if name != "M73":
            return
        words = dict(read_words(rest))
        self.percent = words.get("P", self.percent)
        if "R" in words:
            self.minutes_left, self.reported_at_s = words["R"], now_s

    def left_s(self, elapsed_s: float, feed_percent: float) -> float | None:
        """Time left by M73's last word, less what has passed since; None when it has said nothing."""
        if self.minutes_left is None:
            return None
        return max(0.0, 60.0 * self.minutes_left * 100.0 / feed_percent - (elapsed_s - self.reported_at_s))

    def share(self, acknowledged: int, total: int | None) -> float | None:
        """Done so far, 0 to 1: by M73, else by lines."""
        if self.percent is not None:
            return min(1.0, self.percent / 100.0)
        return acknowledged / total if total else None
