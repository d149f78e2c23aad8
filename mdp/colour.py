"""Colour: what a file paints a face with, and what a person means by it: a whole number 0xRRGGBB."""

import re

NO_COLOUR = -1
WRITTEN = re.compile(r"#([0-9a-fA-F]{6})(?:[0-9a-fA-F]{2})?")


def parse_colour(text: str) -> int | None:
    """The colour of #RRGGBB or #RRGGBBAA, whose alpha is not kept; None for anything else."""
    match = WRITTEN.fullmatch(text.strip())
    return None if match is None else int(match[1], 16)


def colour_text(colour: int) -> str:
    """A colour as #rrggbb."""
    return f"#{colour:06x}"
