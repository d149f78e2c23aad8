"""PNG: an 8-bit RGB picture written with zlib alone (PNG specification, third edition, sections 5, 9 and 11)."""

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from machine.app.output import write_bytes

SIGNATURE = b"\x89PNG\r\n\x1a\n"
SUB = 1  # filter type: every byte minus the byte of the pixel to the left


def png_bytes(image: NDArray[np.uint8]) -> bytes:
    """The PNG file of an image (h, w, 3), uint8."""
    height, width, _ = image.shape
    rows = np.empty((height, 1 + 3 * width), dtype=np.uint8)
    rows[:, 0] = SUB
    rows[:, 1:4] = image[:, 0]
    rows[:, 4:] = (image[:, 1:] - image[:, :-1]).reshape(height, -1)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return SIGNATURE + _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + _chunk(b"IEND", b"")


def write_png(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an image (h, w, 3), uint8; the file appears complete or not at all. Raises OutputError."""
    write_bytes(path, png_bytes(image))


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
