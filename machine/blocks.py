"""Blocks: the profile's own G-code with its {placeholders} filled in."""

import re
from collections.abc import Mapping

from profiles.errors import ProfileError

PLACEHOLDER = re.compile(r"\{(\w+)\}")
FRAME = 12  # "N1234567 " and "*123": what the stream adds to a command


def filled(block: str, name: str, values: Mapping[str, object], longest: int) -> list[str]:
    """The block's lines with {placeholders} replaced, empty lines left out.

    Raises ProfileError for an unknown placeholder and for a command too long for the firmware.
    """
    lines = []
    for line in block.splitlines():
        text = PLACEHOLDER.sub(lambda found: _value(found[1], name, values), line).strip()
        command = text.partition(";")[0].strip()
        if len(command) + FRAME > longest:
            raise ProfileError(
                f"{name}: the line {command[:40]!r}... has {len(command)} characters, "
                f"at most {longest - FRAME} are allowed (the firmware's {longest} less line number and checksum)"
            )
        if text:
            lines.append(text)
    return lines


def _value(word: str, name: str, values: Mapping[str, object]) -> str:
    if word not in values:
        raise ProfileError(f"{name}: placeholder {{{word}}} is not known: allowed are {', '.join(sorted(values))}")
    value = values[word]
    if isinstance(value, float):
        return f"{value:.4f}".rstrip("0").rstrip(".") if abs(value) >= 5e-5 else "0"
    return str(value)
