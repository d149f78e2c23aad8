"""Messages: sentences for the user in which keys and options are marked, so that each front end names them in its own way.

A message is a str. A mark in it holds a name, a value, and the words of the terminal: `terminal_words` puts these in its place,
and the workbench shows the label of the key, or the field that does what the option does. The delimiters of a mark are
noncharacters, which Unicode keeps for the inside of programs: no proper text has them. A UserError keeps the marks where an
f-string puts it into another message; its str() is for the terminal.
"""

import re
from collections.abc import Callable
from math import floor, log10

_BEGIN, _BETWEEN, _END = "\ufdd0", "\ufdd1", "\ufdd2"
_INSIDE = f"([^{_BEGIN}-{_END}]*)"
_MARK = re.compile(f"{_BEGIN}{_INSIDE}{_BETWEEN}{_INSIDE}{_BETWEEN}{_INSIDE}{_END}")
_LEFT_OVER = re.compile(f"[{_BEGIN}-{_END}]")


def key_name(key: str, shown: str = "") -> str:
    """A key of the profile, as "process.walls". shown: what a terminal shows of it, as "walls"; else all of it."""
    return _mark(key, "", shown or key)


def option(name: str, value: object = None) -> str:
    """An option as a noun: "--parts 4", on the page "the number of parts 4"."""
    return _mark(f"--{name}", "" if value is None else f"{value}", _written(name, value))


def advice(name: str, value: object, verb: str = "") -> str:
    """An option that the user may give: "--parts 4", on the page "choose 4 parts". verb: before it."""
    return _mark(f"advice --{name}", f"{value}", f"{verb} {_written(name, value)}" if verb else _written(name, value))


def phrase(name: str, terminal: str, value: object = "") -> str:
    """A phrase that the terminal and the page word differently. terminal: the words of the terminal. The page writes its own
    phrase of this name with the value in it, or nothing if it has none. value: as the page writes it."""
    return _mark(name, f"{value}", terminal)


def three_digits(value: float, decimals: int = 2) -> str:
    """Format a measure with at most three significant digits and at most this many decimals: 9.45, 20.7, 125, 1230."""
    rounded = float(f"{value:.3g}")
    places = min(decimals, max(2 - floor(log10(abs(rounded))), 0)) if rounded else decimals
    shown = value if abs(rounded) < 1000.0 else rounded  # rounded once: 5.749 is 5.7, but 5.75 would be 5.8
    return f"{round(shown, places) + 0.0:.{places}f}"  # a negative zero becomes 0


def is_phrase(name: str, message: str) -> bool:
    """Whether a message is a phrase of this name."""
    return message.startswith(f"{_BEGIN}{name}{_BETWEEN}")


def settings_in(message: str) -> list[str]:
    """The settings KEY=VALUE that a message names as options."""
    return [value for name, value, _ in _MARK.findall(message) if name.endswith("--set")]


def keys_in(message: str) -> list[str]:
    """The keys of the profile that a message names."""
    return [name for name, value, _ in _MARK.findall(message) if "." in name and not value]


def terminal_words(message: str) -> str:
    """The message as a terminal shows it."""
    return rendered(message, lambda name, value, terminal: terminal)


def rendered(message: str, words: Callable[[str, str, str], str]) -> str:
    """The message with its marks replaced. words: the replacement of a mark, from its name, value and terminal phrase.

    >>> rendered(f"{option('parts', 0)}: 1 is the least", lambda name, value, terminal: f"{name}={value}")
    '--parts=0: 1 is the least'
    """
    return _escaped(_MARK.sub(lambda mark: words(*mark.groups()), message))


def check_text(text: str) -> None:
    """Refuse text from outside that could be taken for a mark, or that no UTF-8 file can hold. Raises ValueError."""
    if _LEFT_OVER.search(text):
        raise ValueError("the characters U+FDD0 to U+FDD2 are not allowed")
    text.encode()


def _escaped(text: str) -> str:
    """The text with delimiters that are not of a mark, as in a file's name, as backslash escapes."""
    return _LEFT_OVER.sub(lambda delimiter: f"\\u{ord(delimiter[0]):04x}", text)


def _written(name: str, value: object) -> str:
    return f"--{name}" if value is None else f"--{name} {value}"


def _mark(name: str, value: str, terminal: str) -> str:
    """A mark; a mark inside it, as of a message that is a value, becomes the words of the terminal."""
    fields = map(terminal_words, (name, value, terminal))
    return f"{_BEGIN}{_BETWEEN.join(fields)}{_END}"
