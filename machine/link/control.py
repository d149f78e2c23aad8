"""Control: what a person asks of a running print, handed from any thread to the one that owns the port."""

from collections import deque
from dataclasses import dataclass
from enum import Enum, auto


class Wish(Enum):
    """What may be asked for."""

    PAUSE = auto()
    RESUME = auto()
    CANCEL = auto()
    EMERGENCY_STOP = auto()
    FEED = auto()  # value: per cent of the programmed feed rates
    FLOW = auto()  # value: per cent of the programmed filament
    LINE = auto()  # text: a command of the person's own


@dataclass(frozen=True)
class Request:
    """One wish with its value or text."""

    wish: Wish
    value: float = 100.0
    text: str = ""


class Control:
    """Requests in the order they were made. ask() from any thread, take() from the stream's."""

    def __init__(self) -> None:
        self._waiting: deque[Request] = deque()

    def ask(self, wish: Wish, value: float = 100.0, text: str = "") -> None:
        """Add a request."""
        self._waiting.append(Request(wish, value, text))

    def take(self) -> Request | None:
        """The oldest request, None when there is none."""
        return self._waiting.popleft() if self._waiting else None
