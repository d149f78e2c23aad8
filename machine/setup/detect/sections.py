"""Sections: configurations of [name] and key = value, as Klipper and LinuxCNC write them."""

import configparser
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite

from machine.setup.detect.found import ConfigText, Reading
from profiles.errors import ProfileError

MOST_INCLUDED = 100  # files; more is one that includes itself
NOTHING = re.compile(r"(?!)")
CONTINUED = re.compile(r"\\[ \t]*\n")  # a line goes on in the next one (LinuxCNC, docs/src/config/ini-config.adoc, 5c41560)


@dataclass(frozen=True)
class Sections:
    """A configuration by section and key. name: its file, for messages; missing: included files that are not there."""

    name: str
    of: dict[str, dict[str, str]]
    missing: list[str] = field(default_factory=list)

    def __getitem__(self, title: str) -> Mapping[str, str]:
        """The settings of a section; empty for one that is not there."""
        return self.of.get(title, {})

    def number(self, title: str, key: str) -> float | None:
        """A number; None where it is not there. Raises ProfileError."""
        text = self[title].get(key)
        if text is None:
            return None
        try:
            value = float(text)
        except ValueError:
            raise ProfileError(f"{self.name}, [{title}]: {key} is {text[:40]!r}, which is no number") from None
        if not isfinite(value):
            raise ProfileError(f"{self.name}, [{title}]: {key} is {text[:40]!r}: a finite number is expected")
        return value

    def reading(self, title: str, key: str) -> Reading | None:
        """A number with its source; None where it is not there. Raises ProfileError."""
        value = self.number(title, key)
        return None if value is None else Reading(value, f"[{title}] {key}")


def read_sections(config: ConfigText, include: re.Pattern[str] = NOTHING, indents: bool = True) -> Sections:
    """The sections of a text, later ones over earlier ones; keys in lower case; comments begin with #, or with ; after a blank.

    include: matches a line that names other files by its first group: they are read in its place. indents: a line that begins
    with a blank continues the value before it. Raises ProfileError.
    """
    parser, missing = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";", "#")), list[str]()
    for name, lines in _pieces(config, include, missing, [0]):
        try:
            parser.read_string("\n".join(lines if indents else map(str.strip, lines)), name)
        except configparser.MissingSectionHeaderError as error:
            raise ProfileError(f"{name}: {error.line.strip()[:60]!r} stands in no section") from None
        except configparser.ParsingError as error:
            _, line = error.errors[0]
            raise ProfileError(f"{name}: {line[:60]} is neither a section nor a setting: is the file cut off?") from None
    return Sections(config.name, {title: dict(parser.items(title)) for title in parser.sections()}, missing)


def _pieces(
    config: ConfigText, include: re.Pattern[str], missing: list[str], count: list[int]
) -> Iterator[tuple[str, list[str]]]:
    """File names and lines in the order in which they are read. count: of files so far."""
    count[0] += 1
    if count[0] > MOST_INCLUDED:
        raise ProfileError(f"{config.name}: more than {MOST_INCLUDED} files are included: does one include itself?")
    lines: list[str] = []
    for line in CONTINUED.sub(" ", config.text).split("\n"):
        if (named := include.match(line)) is None:
            lines.append(line.partition("#")[0])
            continue
        yield config.name, lines
        lines = []
        pattern = named[1].strip()
        others = config.beside(pattern)
        if not others and "*" not in pattern:
            missing.append(pattern)
        for other in others:
            yield from _pieces(other, include, missing, count)
    yield config.name, lines
