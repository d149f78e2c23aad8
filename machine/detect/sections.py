"""Sections: configurations of [name] and key = value, as Klipper and LinuxCNC write them."""

import configparser
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite

from machine.detect.found import ConfigText
from profiles.errors import ProfileError

Sections = dict[str, dict[str, str]]
MOST_INCLUDED = 100  # files; more is one that names itself
NOTHING = re.compile(r"(?!)")
CONTINUED = re.compile(r"\\[ \t]*\r?\n")  # a line goes on in the next one (LinuxCNC, docs/src/config/ini-config.adoc, 5c41560)


@dataclass
class Included:
    """Files that a configuration has brought in. missing: names of those that are not there."""

    count: int = 0
    missing: list[str] = field(default_factory=list)


def read_sections(
    config: ConfigText, include: re.Pattern[str] = NOTHING, included: Included | None = None, indents: bool = True
) -> Sections:
    """The sections of a text, later ones over earlier ones; keys in small letters, comments from # on or from a ; behind a blank.

    include: a line that names other files by its first group: they are read in its place. indents: a line that begins with a
    blank goes on with the value before. Raises ProfileError.
    """
    parser = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";", "#"))
    for name, lines in _pieces(config, include, included or Included()):
        try:
            parser.read_string("\n".join(lines if indents else map(str.strip, lines)), name)
        except configparser.MissingSectionHeaderError as error:
            raise ProfileError(f"{name}: {error.line.strip()[:60]!r} stands in no section") from None
        except configparser.ParsingError as error:
            _, line = error.errors[0]
            raise ProfileError(f"{name}: {line[:60]} is neither a section nor a setting: is the file cut off?") from None
    return {title: dict(parser.items(title)) for title in parser.sections()}


def _pieces(config: ConfigText, include: re.Pattern[str], included: Included) -> Iterator[tuple[str, list[str]]]:
    """Names and lines in the order in which they count."""
    included.count += 1
    if included.count > MOST_INCLUDED:
        raise ProfileError(f"{config.name}: more than {MOST_INCLUDED} files are included: does one name itself?")
    lines: list[str] = []
    for line in CONTINUED.sub(" ", config.text).splitlines():
        if (named := include.match(line)) is None:
            lines.append(line.partition("#")[0])
            continue
        yield config.name, lines
        lines = []
        pattern = named[1].strip()
        others = config.beside(pattern)
        if not others and "*" not in pattern:
            included.missing.append(pattern)
        for other in others:
            yield from _pieces(other, include, included)
    yield config.name, lines


def number(section: Mapping[str, str], key: str, name: str) -> float | None:
    """The number of a key, None where it is not there. name: of section and file, for the message. Raises ProfileError."""
    text = section.get(key)
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        raise ProfileError(f"{name}: {key} is {text[:40]!r}, which is no number") from None
    if not isfinite(value):
        raise ProfileError(f"{name}: {key} is {text[:40]!r}: a finite number is expected")
    return value
