"""Layers: which rows of a program belong to one layer, by its comments or else by the heights of its strokes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.gcode.reader.parsed import Indices32, MoveKind, ParsedProgram
from machine.view.encoding import Column
from mdp.mesh import Floats

SAME_MM = 0.02  # strokes whose heights differ less lie in one layer
FEWEST = 4  # strokes that a helix takes to rise by a layer, at least: what goes up and down more quickly is no helix


@dataclass(frozen=True, eq=False)
class Layers:
    """number: (n,) for the rows of a program, 0 before the first. first, rows: (l,) where layers begin and how long they are.

    by: "comments", or "heights" in a text without layer comments.
    """

    number: NDArray[np.int64]
    first: NDArray[np.int64]
    rows: NDArray[np.int64]
    by: str


def layers_of(program: ParsedProgram, layer_height_mm: float) -> Layers:
    """The layers of a program. layer_height_mm: by how much a helix rises until it is a new layer."""
    commented = program.layers > 0
    number = program.layer.astype(np.int64) if commented else _by_heights(program, layer_height_mm)
    changes = np.ones(len(number), dtype=np.bool_)
    changes[1:] = (np.diff(number) != 0) | (np.diff(program.part) != 0)
    begins = np.flatnonzero(changes)
    rows = np.diff(np.append(begins, len(number)))
    layer = number[begins] > 0
    return Layers(number, begins[layer], rows[layer], "comments" if commented else "heights")


def _by_heights(program: ParsedProgram, layer_height_mm: float) -> NDArray[np.int64]:
    """(n,) numbers of layers: a level stroke at another height begins one, and so does a rise of a layer's height in a helix.

    Beads laid while the table turns have no height of their own: they are one layer, or continue the one before.
    """
    number = np.zeros(len(program.line), dtype=np.int64)
    number[np.flatnonzero((program.kind == MoveKind.ROTATE) & (program.e_mm > 0.0))[:1]] = 1
    strokes = np.flatnonzero(program.kind == MoveKind.EXTRUDE)
    if not len(strokes):
        return np.cumsum(number)
    before, z = program.start[strokes, 2], program.end[strokes, 2]
    level = np.abs(z - before) < SAME_MM / 10.0
    steps = np.ones(len(strokes), dtype=np.bool_)
    steps[1:] = level[1:] & (np.abs(np.diff(z)) > SAME_MM) | np.any(np.diff(program.end[strokes, 3:], axis=0) != 0.0, axis=1)
    run = np.cumsum(steps) - 1
    risen = np.ceil((z - before[steps][run]) / layer_height_mm - 1e-6)
    rises = np.diff(risen) != 0
    if rises.sum() * FEWEST < len(strokes):
        steps[1:] |= rises
    number[strokes[steps]] = 1
    return np.cumsum(number)


def sums_of_parts(program: ParsedProgram, layers: Layers, ends_s: Floats) -> list[dict[str, Any]]:
    """Layers, time and filament of each part; without ;PART: comments all is part 0. ends_s: (n,) when each row ends."""
    seconds, sums = np.diff(ends_s, prepend=0.0), []
    for index in program.parts or (0,):
        rows = np.flatnonzero(program.part == index)
        sums.append(
            {
                "index": index,
                "layers": int((program.part[layers.first] == index).sum()),
                "time_s": float(seconds[rows].sum()),
                "filament_mm": float(program.e_mm[rows].sum()),
            }
        )
    return sums


def columns(
    program: ParsedProgram, layers: Layers, ends_s: Floats, height_mm: Floats, shown: NDArray[np.int64]
) -> dict[str, Column]:
    """The table of layers. ends_s, height_mm: (n,) of all rows; first and rows are commented in places of the shown rows."""
    first, last = layers.first, layers.first + layers.rows
    part = program.part[first]
    seconds = np.concatenate([[0.0], ends_s])
    height = np.append(np.where(program.kind == MoveKind.EXTRUDE, program.end[:, 2], -np.inf), -np.inf)
    top = np.maximum.reduceat(height, np.stack([first, last], axis=1).ravel())[::2] if len(first) else np.zeros(0)
    top = np.where(np.isfinite(top), top, program.end[last - 1, 2])
    begin = np.searchsorted(shown, first)
    return {
        "layer_part": Column(part, "i32"),
        "layer_number": Column(layers.number[first], "i32"),
        "layer_first": Column(begin, "i32"),
        "layer_rows": Column(np.searchsorted(shown, last) - begin, "i32"),
        "layer_z": Column(top - _ground(part, top, height_mm, layers), "f32"),
        "layer_time": Column(seconds[last] - seconds[first], "f32"),
    }


def _ground(part: Indices32, top: Floats, height_mm: Floats, layers: Layers) -> Floats:
    """(l,) machine Z at which the part of each layer begins: its first layer's beads less their height."""
    parts, places, back = np.unique(part, return_index=True, return_inverse=True)
    thick = np.array(
        [height_mm[a : a + n].max(initial=0.0) for a, n in zip(layers.first[places], layers.rows[places], strict=True)]
    )
    ground: Floats = (top[places] - thick)[back] if len(parts) else np.zeros(0)
    return ground
