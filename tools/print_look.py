"""Look at a print: an own height map of every part's layers, which shares no code with slicer, reader or dry run.

    python tools/print_look.py FILE.gcode ...

A part's pose stands still while it is printed, so its layers lie level in machine axes. Every part is examined there by itself,
and what it stands on is not known: the first layer of later parts is taken as it is. One row a file: strokes that have no plastic
anywhere across their width within the layer below, the longest stretch of them that is neither bridge nor overhang and lies more
than a line beside plastic (sparse infill below is told apart), missing layers, plastic against the room of its beads, and places
that hold twice what they have room for. It reports; the dry run judges.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from math import ceil, pi
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tools.read_beads import PLATE_FOLLOWED, Beads, read_beads

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
SUPPORT = ("Support material", "Support material interface")
SPARSE = ("Internal infill",)
ASIDE = ("Skirt/Brim", "Ironing")  # lie beside the print or in plastic that is there
HANGING = ("Bridge infill", "Overhang perimeter")  # told by the slicer itself
CELL_MM, MOST_CELLS = 0.15, 900
ROUNDING_MM = 0.02  # of the heights of layers in the file
LONGEST_MM = 10.0  # a stretch that PLA bridges
TWICE, TWICE_SHARE, TWICE_MM2 = 1.6, 0.25, 4.0
WRONG_VOLUME, LEAST_MM3 = 0.1, 1.0


class Worst(NamedTuple):
    """The greatest of some values, and where it is."""

    value: float = 0.0
    at: str = ""


NONE = Worst()


@dataclass(frozen=True)
class Look:
    """What is seen of a print, or of one of its parts.

    unsupported_mm: strokes without plastic below, told_mm: those of them that the slicer calls bridge or overhang; air_mm: the
    longest stretch that it does not, more than a line from plastic, sparse_mm: the same over sparse infill; volume: most that a
    layer's plastic is above its beads' rectangles of width and height, or below those with half-round sides, as a share; twice:
    greatest share of a layer that holds plastic twice; missing: layers above a gap.
    """

    strokes_mm: float = 0.0
    unsupported_mm: float = 0.0
    told_mm: float = 0.0
    air_mm: Worst = NONE
    sparse_mm: Worst = NONE
    volume: Worst = NONE
    twice: Worst = NONE
    missing: tuple[str, ...] = ()

    def merged_with(self, look: "Look") -> "Look":
        """Both together."""
        pairs = ((getattr(self, name), getattr(look, name)) for name in NAMES)
        return Look(*(max(a, b) if isinstance(a, Worst) else a + b for a, b in pairs))

    @property
    def figures(self) -> dict[str, str]:
        """All of it in short, for a table."""
        values = {name: getattr(self, name) for name in NAMES}
        worst = {name: f"{value.value:.3g} ({value.at})" for name, value in values.items() if isinstance(value, Worst)}
        return {
            name: worst.get(name, f"{value:.3g}" if isinstance(value, float) else str(len(value)))
            for name, value in values.items()
        }

    @property
    def suspect(self) -> list[str]:
        """Why a person should look at the print, nothing where it seems right."""
        reasons = [f"a gap below {spot}" for spot in self.missing[:3]]
        if self.air_mm.value > LONGEST_MM:
            reasons.append(f"{self.air_mm.value:.1f} mm in the air that no bridge is, {self.air_mm.at}")
        if self.volume.value > WRONG_VOLUME:
            reasons.append(f"{self.volume.value:.0%} too much or too little plastic in {self.volume.at}")
        if self.twice.value > TWICE_SHARE:
            reasons.append(f"{self.twice.value:.0%} of {self.twice.at} hold plastic twice")
        return reasons


NAMES = tuple(field.name for field in fields(Look))


def look_at(lines: Sequence[str]) -> Look:
    """What is seen of all parts of a program whose layers lie level in machine axes."""
    beads = read_beads(lines)
    whole = Look()
    for part in np.unique(beads.part):
        if beads.settings.get("machine.coordinates") == PLATE_FOLLOWED and abs(beads.tilt_deg[int(part)]) > 0.01:
            continue  # its layers do not lie level in the file
        whole = whole.merged_with(_PartLook(beads, int(part)).look())
    return whole


@dataclass(frozen=True, eq=False)
class _Steps:
    """Strokes in short steps. row: (s,) of the beads; cells: (s, k) across each step; length_mm: (s,), mm3: (s,)."""

    row: Ints
    cells: Ints
    length_mm: Floats
    mm3: Floats


class _PartLook:
    """One part on its raster."""

    def __init__(self, beads: Beads, part: int) -> None:
        rows = np.flatnonzero(beads.part == part)
        self._beads, self._part = beads, part
        ends = np.concatenate([beads.begin[rows, :2], beads.end[rows, :2]])
        widest = float(_width_mm(beads, rows).max())
        low, high = ends.min(axis=0) - widest, ends.max(axis=0) + widest
        self._cell_mm = max(CELL_MM, float((high - low).max()) / MOST_CELLS)
        self._low = low
        self._shape = tuple(int(n) for n in np.ceil((high - low) / self._cell_mm) + 1)
        # Heights of the plastic so far, those of support raised by its gap.
        self._top_mm = np.full(self._shape, 0.0 if part == 1 else -np.inf).ravel()
        self._support, self._aside = beads.is_kind(SUPPORT), beads.is_kind((*SUPPORT, *ASIDE))
        self._sparse, self._hangs = beads.is_kind(SPARSE), beads.is_kind(HANGING)
        self._gap_mm = beads.number("process.support_gap_mm", 0.2)
        self._width_mm, density = beads.number("process.line_width_mm", 0.45), beads.number("process.infill_density", 0.2)
        self._reach = min(
            200, ceil(self._width_mm / max(density, 0.02) / self._cell_mm)
        )  # cells half way to the next infill line
        self._layers = self._in_layers(rows)

    def _in_layers(self, rows: Ints) -> list[Ints]:
        """Rows layer by layer, what is told as a new layer at the same height counted to the one before."""
        layers: list[Ints] = []
        tops_mm: list[float] = []
        for layer in np.unique(self._beads.layer[rows]):
            own = rows[self._beads.layer[rows] == layer]
            tops_mm.append(float(self._beads.end[own, 2].max()))
            if layers and abs(tops_mm[-1] - tops_mm[-2]) < ROUNDING_MM:
                layers[-1] = np.concatenate([layers[-1], own])
            else:
                layers.append(own)
        return layers

    def look(self) -> Look:
        """What is seen of all layers."""
        whole, before, below_mm = Look(), np.empty(0, np.int64), 0.0
        for rows in self._layers:
            name = f"part {self._part} layer {self._beads.layer[rows[0]]}"
            z_mm, height_mm = float(self._beads.end[rows, 2].max()), float(np.median(self._beads.height_mm[rows]))
            steps = self._steps(rows)
            if len(before) or self._part == 1:  # what it lies on is known
                gap = z_mm - height_mm > below_mm + self._stand_off_mm(rows, before, height_mm) + ROUNDING_MM
                whole = whole.merged_with(Look(missing=(name,) if gap else ()))
                whole = whole.merged_with(self._hanging(steps, before)).merged_with(self._volume(rows, name))
            whole = whole.merged_with(self._twice(steps, name))
            tops_mm = self._beads.end[steps.row, 2] + np.where(self._support[steps.row], self._gap_mm, 0.0)
            np.maximum.at(self._top_mm, steps.cells.ravel(), np.repeat(tops_mm, steps.cells.shape[1]))
            before, below_mm = rows, z_mm
        return whole

    def _stand_off_mm(self, rows: Ints, before: Ints, height_mm: float) -> float:
        """What support alone keeps away from the part above or below it, in whole layers."""
        alone = self._support[rows].all() or (len(before) > 0 and self._support[before].all())
        return ceil(self._gap_mm / height_mm - ROUNDING_MM) * height_mm if alone else 0.0

    def _steps(self, rows: Ints) -> _Steps:
        """Strokes laid on the raster."""
        beads, length_mm = self._beads, self._beads.length_mm[rows]
        count = np.maximum(1, np.ceil(length_mm / (0.7 * self._cell_mm)).astype(np.int64))
        of = np.repeat(np.arange(len(rows)), count)
        nth = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
        way = beads.end[rows, :2] - beads.begin[rows, :2]
        places = beads.begin[rows, :2][of] + ((nth + 0.5) / count[of])[:, None] * way[of]
        width_mm = _width_mm(beads, rows)
        aside = np.stack([-way[:, 1], way[:, 0]], axis=1) * (width_mm / np.maximum(np.hypot(*way.T), 1e-9))[:, None]
        across = max(3, ceil(float(width_mm.max()) / (0.8 * self._cell_mm)))
        shares = (np.arange(across) + 0.5) / across - 0.5
        points = places[:, None, :] + shares[None, :, None] * aside[of][:, None, :]
        index = np.clip(((points - self._low) / self._cell_mm).astype(np.int64), 0, np.array(self._shape) - 1)
        cells = index[..., 0] * self._shape[1] + index[..., 1]
        return _Steps(rows[of], cells, (length_mm / count)[of], (beads.mm3[rows] / count)[of])

    def _hanging(self, steps: _Steps, before: Ints) -> Look:
        """Strokes without plastic in the layer below, and the longest stretches of them."""
        beads, row, length_mm = self._beads, steps.row, steps.length_mm
        own = ~self._aside[row]
        # A little less than the layer below: what ends right under it is not in it.
        depth_mm = 0.9 * float(np.median(beads.height_mm[before])) if len(before) else ROUNDING_MM
        floor_mm = beads.end[row, 2] - beads.height_mm[row] - depth_mm
        air = own & (self._top_mm[steps.cells] < floor_mm[:, None]).all(axis=1)
        untold = air & ~self._hangs[row]
        look = Look(float(length_mm[own].sum()), float(length_mm[air].sum()), float(length_mm[air & self._hangs[row]].sum()))
        if not untold.any() or beads.settings.get("process.support") == "none":  # then what hangs is meant to
            return look
        middles, ways, lines = steps.cells[:, steps.cells.shape[1] // 2], beads.way[row], beads.line[row]
        away = untold & ~self._beside(self._top_mm >= float(np.median(floor_mm)))[middles]
        spanning = untold & self._infill_below(before)[middles]
        over_air, over_infill = (_longest(marked, ways, length_mm, lines) for marked in (away & ~spanning, spanning))
        return replace(look, air_mm=over_air, sparse_mm=over_infill)

    def _beside(self, plastic: Mask) -> Mask:
        """The cells over plastic or no farther than a line beside it: there a line is held by the next one."""
        reach = ceil(1.5 * self._width_mm / self._cell_mm)
        return _spread(plastic.reshape(self._shape), reach).ravel()

    def _infill_below(self, before: Ints) -> Mask:
        """The cells among the lines of sparse infill of the layer before."""
        marked, lines, reach = np.zeros(self._shape, np.bool_), before[self._sparse[before]], self._reach
        if len(lines):
            marked.ravel()[self._steps(lines).cells.ravel()] = True
            marked = ~_spread(~_spread(np.pad(marked, reach), reach), reach)[reach:-reach, reach:-reach]
        return marked.ravel()

    def _volume(self, rows: Ints, name: str) -> Look:
        """A layer's plastic against the room of its beads."""
        rows = rows[~self._aside[rows]]
        length_mm, width_mm, height_mm = (a[rows] for a in (self._beads.length_mm, self._beads.width_mm, self._beads.height_mm))
        most_mm3 = float((length_mm * width_mm * height_mm).sum())
        least_mm3 = most_mm3 - float((length_mm * (1.0 - pi / 4.0) * height_mm**2).sum())
        if least_mm3 < LEAST_MM3:
            return Look()
        mm3 = float(self._beads.mm3[rows].sum())
        return Look(volume=Worst(max(mm3 / most_mm3 - 1.0, 1.0 - mm3 / least_mm3, 0.0), name))

    def _twice(self, steps: _Steps, name: str) -> Look:
        """How much of a layer holds plastic twice."""
        own = ~self._aside[steps.row]
        if not own.any():
            return Look()
        height_mm = steps.mm3[own] / self._cell_mm**2 / self._beads.height_mm[steps.row[own]] / steps.cells.shape[1]
        held = np.bincount(steps.cells[own].ravel(), np.repeat(height_mm, steps.cells.shape[1]), self._top_mm.size)
        held = _mean3(held.reshape(self._shape))
        covered, twice = int((held > 0.5).sum()), int((held > TWICE).sum())
        return Look(twice=Worst(twice / covered, name) if twice * self._cell_mm**2 > TWICE_MM2 else NONE)


def _width_mm(beads: Beads, rows: Ints) -> Floats:
    """How wide the plastic of strokes is: a rectangle with half-round sides of their volume, their height as told."""
    height = beads.height_mm[rows]
    return np.clip(beads.mm3[rows] / np.maximum(beads.length_mm[rows], 1e-3) / height + height * (1.0 - pi / 4.0), 0.1, 4.0)


def _longest(marked: Mask, way: Ints, step_mm: Floats, line: Ints) -> Worst:
    """Length of the longest stretch of marked samples of one way, and the line where it begins."""
    if not marked.any():
        return NONE
    firsts = np.flatnonzero(np.concatenate([[True], (marked[1:] != marked[:-1]) | (way[1:] != way[:-1])]))
    lengths = np.add.reduceat(np.where(marked, step_mm, 0.0), firsts)
    best = int(lengths.argmax())
    return Worst(float(lengths[best]), f"line {line[firsts[best]]}")


def _spread(marked: Mask, reach: int) -> Mask:
    """Cells that have a marked one within reach along both axes."""
    for _ in range(2):
        counts = np.cumsum(np.pad(marked, ((reach + 1, reach), (0, 0))).astype(np.int32), axis=0)
        marked = (counts[2 * reach + 1 :] > counts[: -2 * reach - 1]).T
    return marked


def _mean3(values: Floats) -> Floats:
    """The mean of every cell and its eight neighbours."""
    wide = np.pad(values, 1)
    rows = wide[:-2] + wide[1:-1] + wide[2:]
    return (rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]) / 9.0


def rows_of(files: Sequence[Path]) -> Iterator[str]:
    """One row of the table a file."""
    for file in files:
        look = look_at(file.read_text().split("\n"))
        yield f"| {file.name} | {' | '.join(look.figures.values())} | {'; '.join(look.suspect) or 'nothing'} |"


def main() -> None:
    """Read the options, print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("files", nargs="+", type=Path)
    print(f"| file | {' | '.join(NAMES)} | suspect |\n" + "|---" * (len(NAMES) + 2) + "|")
    for row in rows_of(options.parse_args().files):
        print(row, flush=True)


if __name__ == "__main__":
    main()
