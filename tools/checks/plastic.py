"""Plastic at joints compared with the space for it: `python tools/checks/plastic.py FILE.gcode ... [--maps FOLDER]`.

One row per interface (a part's first layer on earlier parts) of tiltprint's G-code files: its section, mm²; the fraction of it in
contact; plastic over space of the whole, %; square millimetres with more than 110 % and with less than 90 %, % of it; the
fraction of the outer walls without anything below their centre line, and how far inside their outer edge the plastic below ends
at the median and at the 95th percentile, mm. `--maps`: a picture of each interface, blue for too little plastic, white for the
right amount, red for too much, grey with nothing below.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from machine.dryrun.interfaces import Interface, Lattice, Mask, balance_of, interfaces
from machine.pipeline.pictures import write_png
from mdp.mesh import Floats
from tools.checks.harness import files, options_of, played, table

LEAST, MOST = 0.9, 1.1  # acceptable plastic over space of a square millimetre
WINDOW_MM = 1.0
LEAST_MM2 = 0.5  # of a window: with less space in it, as at the tip of a corner, a fragment of one bead would decide
SAMPLE_MM, FAR_MM, AROUND_MM = 0.1, 1.5, 0.05  # between samples along outer walls, and across them
FULL = 0.5  # a colour is full at this deviation
GREY, WHITE, RED, BLUE = (np.array(colour, float) for colour in ((170, 170, 170), (255, 255, 255), (200, 30, 30), (30, 60, 200)))
HEAD = ("file", "part", "mm2", "contact %", "plastic / room %", "over %", "under %", "walls over nothing %", "inside mm", "p95")


def main() -> None:
    """Read the options, print the table."""
    parser = options_of(__doc__)
    parser.add_argument("--maps", type=Path)
    given = parser.parse_args()
    table(HEAD, files(given.models), lambda file: rows(file, given.maps))


def rows(file: Path, maps: Path | None) -> Iterator[Sequence[object]]:
    """The cells of a file's interfaces."""
    run, profile = played(file)
    for face in interfaces(run.program, run.deposited, profile):
        ratio = balance_map(face)
        ratios = ratio[np.isfinite(ratio)]
        over, under = (float(bad.sum()) / max(len(ratios), 1) for bad in (ratios > MOST, ratios < LEAST))
        held, inside = wall_edges(face)
        sums = balance_of(face)
        shares = (sums.over_room, over, under)
        cells = [face.part, f"{sums.area_mm2:.1f}", f"{100 * sums.contact:.1f}", *(f"{100 * share:.0f}" for share in shares)]
        yield [*cells, f"{100 * (1.0 - held.mean()):.1f}", f"{np.median(inside):.2f}", f"{np.quantile(inside, 0.95):.2f}"]
        if maps is not None:
            maps.mkdir(parents=True, exist_ok=True)
            write_png(maps / f"{file.stem}-{face.part}.png", picture(face))


def picture(face: Interface) -> np.ndarray:
    """(h, w, 3) uint8: a pixel per column, Y upward."""
    ratio = balance_map(face)
    image = np.full((*ratio.shape, 3), 255.0)
    image[face.section] = GREY
    known = np.isfinite(ratio)
    off = np.clip((ratio[known] - 1.0) / FULL, -1.0, 1.0)[:, None]
    image[known] = np.where(off > 0, WHITE + off * (RED - WHITE), WHITE - off * (BLUE - WHITE))
    image[face.section & face.touching & ~face.bead] *= 0.6
    return np.ascontiguousarray(image.transpose(1, 0, 2)[::-1]).astype(np.uint8)


def wall_edges(face: Interface) -> tuple[Mask, Floats]:
    """At places SAMPLE_MM apart along an interface's outer walls: (n,) whether an earlier part reaches them near their centre
    line, and (n,) how far inside their outer edge it ends, mm; inf beyond FAR_MM."""
    walls, side = face.walls, face.walls.end[:, :2] - face.walls.begin[:, :2]
    length = np.hypot(*side.T)
    counts = np.ceil(length / SAMPLE_MM).astype(np.int64)
    which = np.repeat(np.arange(len(length)), counts)
    share = (np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[which]
    middle = walls.begin[which, :2] + share[:, None] * side[which]
    across = np.column_stack([-side[:, 1], side[:, 0]])[which] / length[which, None]
    steps = np.arange(-FAR_MM, AROUND_MM, 0.5 * face.lattice.cell)
    held, ends = [], []
    for outward in (across, -across):
        edge = middle + walls.half[which, None] * outward
        outer = ~_at(face.section, edge + 2.0 * AROUND_MM * outward, face.lattice)
        way = edge[outer, None] + steps[:, None] * outward[outer, None]
        there = _at(face.touching, way, face.lattice)
        last = len(steps) - 1 - there[:, ::-1].argmax(axis=1)
        beside = middle[outer, None] + np.array([-2.0 * AROUND_MM, 0.0, 2.0 * AROUND_MM])[:, None] * outward[outer, None]
        held.append(_at(face.touching, beside, face.lattice).any(axis=1))
        ends.append(np.where(there.any(axis=1), np.maximum(-steps[last], 0.0), np.inf))
    return np.concatenate(held), np.concatenate(ends)


def _at(mask: Mask, points: Floats, lattice: Lattice) -> Mask:
    """Whether the columns of (..., 2) points are marked."""
    i, j = np.moveaxis(((points - lattice.origin) / lattice.cell).astype(np.int64), -1, 0)
    found: Mask = mask[i.clip(0, lattice.shape[0] - 1), j.clip(0, lattice.shape[1] - 1)]
    return found


def balance_map(face: Interface) -> Floats:
    """(nx, ny) plastic over space in the square millimetre around each column of an interface; nan outside."""
    return over_room(face.plastic, np.where(face.touching & face.section, face.room, np.nan), face.lattice)


def window_sums(values: Floats, lattice: Lattice) -> Floats:
    """For each column the sum over the square of WINDOW_MM around it."""
    reach = max(1, round(0.5 * (WINDOW_MM / lattice.cell - 1.0)))
    padded = np.pad(values, ((reach + 1, reach), (reach + 1, reach)))
    sums = padded.cumsum(axis=0).cumsum(axis=1)
    wide = 2 * reach + 1
    whole: Floats = sums[wide:, wide:] - sums[:-wide, wide:] - sums[wide:, :-wide] + sums[:-wide, :-wide]
    return whole


def over_room(plastic: Floats, room: Floats, lattice: Lattice) -> Floats:
    """Plastic over space in the square millimetre around each column with space, mm³ both; nan if there is too little.

    room: mm³ of each column, nan without space.
    """
    there = np.isfinite(room)
    covered = window_sums(there * lattice.column_mm2, lattice)
    mm3 = window_sums(np.where(there, room, 0.0), lattice)
    enough = there & (covered >= LEAST_MM2 * WINDOW_MM**2) & (mm3 > 1e-9)
    return np.where(enough, window_sums(np.where(there, plastic, 0.0), lattice) / np.where(enough, mm3, 1.0), np.nan)


if __name__ == "__main__":
    main()
