"""Encoding of a header and named arrays as one compressed block that a browser reads without a library.

Zigzag differences of neighbours, sorted by byte significance and deflated, shrink paths to a sixth of their raw size.
"""

import json
import struct
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAGIC = b"TILTVW01"
ALIGNED = 8
LENGTH = struct.Struct("<I")
LEVEL = 6
MOST = 2**32 - 1
TYPES = {"u8": "<u1", "u16": "<u2", "i32": "<i4", "f32": "<f4"}


@dataclass(frozen=True, eq=False)
class Column:
    """An array to store: values, (n,) or (n, k), in the page's unit; stored as integer multiples of scale unless f32."""

    values: NDArray[Any]
    type: str
    scale: float = 1.0
    delta: bool = False


def pack(header: Mapping[str, Any], columns: Mapping[str, Column]) -> bytes:
    """The compressed block; the header receives the positions of the arrays as `arrays`."""
    arrays: dict[str, Any] = {}
    blocks: list[bytes] = []
    offset = 0
    for name, column in columns.items():
        block = _delta(column) if column.delta else _plain(column)
        arrays[name] = {
            "type": column.type, "shape": list(column.values.shape), "offset": offset,
            "coding": "delta" if column.delta else "plain", "scale": column.scale,
        }  # fmt: skip
        blocks.append(block + bytes(-len(block) % ALIGNED))
        offset += len(blocks[-1])
    return _press({**header, "arrays": arrays}, blocks)


def with_header(block: bytes, change: Callable[[dict[str, Any]], Mapping[str, Any]]) -> bytes:
    """Replace the header of a packed block by change(header)."""
    raw = zlib.decompress(block)
    begin = len(MAGIC) + LENGTH.size
    end = begin + LENGTH.unpack_from(raw, len(MAGIC))[0]
    return _press(change(json.loads(raw[begin:end])), (memoryview(raw)[end:],))


def _press(header: Mapping[str, Any], arrays: Iterable[bytes | memoryview]) -> bytes:
    text = json.dumps(header, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode(errors="replace")
    text += b" " * (-(len(MAGIC) + LENGTH.size + len(text)) % ALIGNED)
    press = zlib.compressobj(LEVEL)
    pressed = [press.compress(block) for block in (MAGIC + LENGTH.pack(len(text)) + text, *arrays)]
    return b"".join([*pressed, press.flush()])


def whole(column: Column) -> NDArray[np.int64]:
    """The values as integer multiples of the scale, as stored."""
    multiples: NDArray[np.int64] = np.rint(np.asarray(column.values, dtype=np.float64) / column.scale).astype(np.int64)
    return multiples


def _plain(column: Column) -> bytes:
    if column.type == "f32":
        return np.asarray(column.values, dtype=TYPES["f32"]).tobytes()
    limits = np.iinfo(TYPES[column.type])
    return np.clip(whole(column), limits.min, limits.max).astype(TYPES[column.type]).tobytes()


def _delta(column: Column) -> bytes:
    """Zigzag differences of each column, clipped to 32 bits, as four byte planes, the lowest byte first."""
    multiples = whole(column)
    blocks = []
    for multiple in multiples.reshape(len(multiples), prod(multiples.shape[1:])).T:
        steps = np.diff(multiple, prepend=0)
        words = np.minimum((steps << 1) ^ (steps >> 63), MOST).astype("<u4")
        blocks.append(np.ascontiguousarray(words.view(np.uint8).reshape(-1, 4).T).tobytes())
    return b"".join(blocks)
