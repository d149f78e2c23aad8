"""PNG: pictures as files."""

from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from machine.app.output import write_bytes


def png_bytes(image: NDArray[np.uint8]) -> bytes:
    """The PNG file of an image (h, w, 3), uint8."""
    file = BytesIO()
    Image.fromarray(image).save(file, "PNG")
    return file.getvalue()


def write_png(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an image (h, w, 3), uint8; the file appears complete or not at all. Raises OutputError."""
    write_bytes(path, png_bytes(image))
