"""A reader of pages by the description of their format in CONTRIBUTING.md, independent of the code that writes them."""

import base64
import json
import re
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

ELEMENT = re.compile(rb'<script type="application/octet-stream" id="tiltprint">([A-Za-z0-9+/=]*)</script>')
Arrays = dict[str, NDArray[Any]]


def opened(page: bytes) -> tuple[dict[str, Any], Arrays]:
    """Header and arrays of an HTML page."""
    (text,) = ELEMENT.findall(page)
    return unpacked(base64.b64decode(text, validate=True))


def unpacked(block: bytes) -> tuple[dict[str, Any], Arrays]:
    """Header and arrays of a packed block; arrays in mm, deg, seconds."""
    raw = zlib.decompress(block)
    assert raw[:8] == b"TILTVW01"
    (length,) = struct.unpack("<I", raw[8:12])
    assert (12 + length) % 8 == 0
    header = json.loads(raw[12 : 12 + length])
    return header, {name: _array(raw[12 + length :], form) for name, form in header["arrays"].items()}


def text_of(header: dict[str, Any], arrays: Arrays) -> list[str]:
    """The lines of the G-code."""
    packed_text, rows, end = header["text"], arrays["line"], np.rint(arrays["end"] * 1000).astype(int)
    pushed = np.rint(arrays["filament"] * 1e5).astype(int)

    def line(number: int, pattern: str) -> str:
        last, before = int((rows <= number).sum()) - 1, int((rows < number).sum()) - 1
        zero = ([0] + [zero for begin, zero in packed_text["zeros"] if begin <= number])[-1]

        def number_of(match: re.Match[str]) -> str:
            letter, hole = match[1], ord(match[2])
            if letter in "XYZ":
                value, digits = end[last, "XYZ".index(letter)], 3
            else:
                value, digits = pushed[last] - (zero if hole > 3 else pushed[before] if before >= 0 else 0), 5
            full = f"{value / 10**digits:.{digits}f}"
            short = full.rstrip("0").rstrip(".")
            return letter + (full, short, short.replace("0.", ".", 1))[(hole - 1) % 3]

        return re.sub("([A-Z])([\x01-\x06])", number_of, pattern)

    return [line(k + 1, packed_text["patterns"][int(pattern_index)]) for k, pattern_index in enumerate(arrays["text"])]


def _array(raw: bytes, form: dict[str, Any]) -> NDArray[Any]:
    assert form["offset"] % 8 == 0
    rows, *rest = form["shape"]
    columns = rest[0] if rest else 1
    if form["coding"] == "plain":
        kind = {"u8": "<u1", "u16": "<u2", "i32": "<i4", "f32": "<f4"}[form["type"]]
        values = np.frombuffer(raw, kind, rows * columns, form["offset"]).reshape(rows, columns).astype(float)
    else:
        values = np.zeros((rows, columns))
        for column in range(columns):
            start = form["offset"] + 4 * rows * column
            planes = [np.frombuffer(raw, "u1", rows, start + k * rows).astype(np.uint64) for k in range(4)]
            word = planes[0] | planes[1] << np.uint64(8) | planes[2] << np.uint64(16) | planes[3] << np.uint64(24)
            step = np.where(word & np.uint64(1), -(word // 2).astype(np.int64) - 1, (word // 2).astype(np.int64))
            values[:, column] = np.cumsum(step)
    return (values if rest else values[:, 0]) * form["scale"]


def turned_back(axis: dict[str, Any], value_deg: float, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """A point rotated by the inverse of T(value) or U(value) of the format in CONTRIBUTING.md, by Rodrigues' formula."""
    u, angle = np.array(axis["axis"]), np.radians(axis["sign"] * (value_deg - axis["zero_deg"]))
    across, along = np.cross(u, point), u * (u @ point)
    turned: NDArray[np.float64] = along + np.cos(angle) * (point - along) + np.sin(angle) * across
    return turned


def on_the_work(machine: dict[str, Any], row: NDArray[np.float64]) -> NDArray[np.float64]:
    """The workpiece point under the tip for a row X Y Z tilt turn."""
    a, c = (np.array(machine[axis]["point_mm"]) for axis in ("tilt", "turn"))
    tip = row[:3] - np.array(machine["tool_mm"])
    return turned_back(machine["turn"], row[4], turned_back(machine["tilt"], row[3], tip - a) + a - c)
