"""PNG: pictures as files, and in the head of G-code, where printers and their web pages show them beside the file's name.

The form there is PrusaSlicer's, which Mainsail, Fluidd, RepRapFirmware and Prusa's printers read: base64 between comments.
"""

from base64 import b64encode
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from machine.gcode.lines import Lines
from machine.pipeline.output import write_bytes
from machine.pipeline.pictures.picture import parts_together
from mdp.decomposition import Decomposition
from profiles.profile import Profile

ROW = 78  # characters of base64 a line, as PrusaSlicer writes them


def png_bytes(image: NDArray[np.uint8]) -> bytes:
    """The PNG file of an image (h, w, 3), uint8."""
    file = BytesIO()
    Image.fromarray(image).save(file, "PNG")
    return file.getvalue()


def write_png(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an image (h, w, 3), uint8; the file appears complete or not at all. Raises OutputError."""
    write_bytes(path, png_bytes(image))


def with_thumbnails(lines: Lines, decomposition: Decomposition, profile: Profile) -> Lines:
    """The G-code with the pictures that machine.thumbnails_px asks for after its first comments."""
    head = next((k for k, line in enumerate(lines) if not line.startswith("; ")), len(lines))
    comments: list[str] = []
    for width, height in profile.machine.thumbnails_px:
        comments += thumbnail(png_bytes(parts_together(decomposition, profile, (width, height))), width, height)
    return lines[:head] + Lines.of(comments) + lines[head:]


def thumbnail(png: bytes, width: int, height: int) -> list[str]:
    """One picture's comment lines."""
    text = b64encode(png).decode("ascii")
    rows = [text[k : k + ROW] for k in range(0, len(text), ROW)]
    return [f"; thumbnail begin {width}x{height} {len(text)}", *(f"; {row}" for row in rows), "; thumbnail end"]
