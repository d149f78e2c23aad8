"""Thumbnail: pictures of the print in the G-code's head, which printers and their web pages show beside the file's name.

The form is PrusaSlicer's, which Mainsail, Fluidd, RepRapFirmware and Prusa's printers read: a PNG in base64 between comments.
"""

from base64 import b64encode
from collections.abc import Sequence

from machine.app.pictures.picture import parts_together
from machine.app.pictures.png import png_bytes
from mdp.decomposition import Decomposition
from profiles.profile import Profile

ROW = 78  # characters of base64 a line, as PrusaSlicer writes them


def with_thumbnails(lines: Sequence[str], decomposition: Decomposition, profile: Profile) -> tuple[str, ...]:
    """The G-code with the pictures that machine.thumbnails_px asks for after its first comments."""
    head = next((k for k, line in enumerate(lines) if not line.startswith("; ")), len(lines))
    comments: list[str] = []
    for width, height in profile.machine.thumbnails_px:
        comments += thumbnail(png_bytes(parts_together(decomposition, profile, (width, height))), width, height)
    return (*lines[:head], *comments, *lines[head:])


def thumbnail(png: bytes, width: int, height: int) -> list[str]:
    """One picture's comment lines."""
    text = b64encode(png).decode("ascii")
    rows = [text[k : k + ROW] for k in range(0, len(text), ROW)]
    return [f"; thumbnail begin {width}x{height} {len(text)}", *(f"; {row}" for row in rows), "; thumbnail end"]
