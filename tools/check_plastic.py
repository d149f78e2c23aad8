"""Hold the plastic of G-code files of ours against the room that there is for it, interface by interface and layer by layer.

    python -m tools.check_plastic FILE.gcode ... [--maps FOLDER] [--layers]

One row an interface (a part's first layer on earlier parts): its section, mm2; the share of it in contact; plastic over room of
all of it, %; square millimetres with more than 110 % and with less than 90 %, % of it; along which share of the outer walls
nothing lies under their middle, and how far inside their outer edge the plastic below ends at the median and at the 95th
percentile, mm. --maps: a picture of each interface, blue where there is too little plastic, white where it fits, red where there
is too much, grey where nothing is below. --layers: one row a part of what its layers get on each other, the worst one named.
"""

import argparse
from pathlib import Path

import numpy as np

from machine.dryrun.dryrun import dry_run
from machine.dryrun.interfaces import Interface, balance_of, interfaces
from machine.pipeline.embedded_profile import read_embedded_profile
from machine.pipeline.pictures import write_png
from profiles.profile import load
from tools.layer_balance import LEAST, MOST, balance_map, layer_balances, wall_edges

HEAD = (
    "file",
    "part",
    "mm2",
    "contact %",
    "plastic / room %",
    "over 110 %",
    "under 90 %",
    "walls over nothing %",
    "inside mm",
    "p95",
)
LAYERS = ("file", "part", "layers", "plastic / room %", "over 110 %", "under 90 %", "worst layer", "its plastic / room %")
FULL = 0.5  # this far from what fits, a colour is full
GREY, WHITE, RED, BLUE = (np.array(colour, float) for colour in ((170, 170, 170), (255, 255, 255), (200, 30, 30), (30, 60, 200)))


def row(name: str, face: Interface) -> str:
    """One interface's line of the table."""
    ratio = balance_map(face)
    told = np.isfinite(ratio)
    over, under = (float(bad.sum()) / max(int(told.sum()), 1) for bad in (ratio[told] > MOST, ratio[told] < LEAST))
    held, inside = wall_edges(face)
    sums = balance_of(face)
    cells = [
        name, face.part, f"{sums.area_mm2:.1f}", f"{100 * sums.contact:.1f}", f"{100 * sums.over_room:.0f}", f"{100 * over:.0f}",
        f"{100 * under:.0f}", f"{100 * (1.0 - held.mean()):.1f}", f"{np.median(inside):.2f}", f"{np.quantile(inside, 0.95):.2f}",
    ]  # fmt: skip
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def picture(face: Interface) -> np.ndarray:
    """(h, w, 3) uint8: a pixel a column, Y upward."""
    ratio = balance_map(face)
    image = np.full((*ratio.shape, 3), 255.0)
    image[face.section] = GREY
    told = np.isfinite(ratio)
    off = np.clip((ratio[told] - 1.0) / FULL, -1.0, 1.0)[:, None]
    image[told] = np.where(off > 0, WHITE + off * (RED - WHITE), WHITE - off * (BLUE - WHITE))
    image[face.section & face.touching & ~face.bead] *= 0.6
    return np.ascontiguousarray(image.transpose(1, 0, 2)[::-1]).astype(np.uint8)


def main() -> None:
    """Read the options, print the tables."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("files", type=Path, nargs="+")
    options.add_argument("--maps", type=Path)
    options.add_argument("--layers", action="store_true")
    given = options.parse_args()
    print("| " + " | ".join(LAYERS if given.layers else HEAD) + " |\n" + "|---" * len(LAYERS if given.layers else HEAD) + "|")
    for file in given.files:
        lines = tuple(file.read_text().split("\n"))
        profile, _ = read_embedded_profile(lines, load(), frozenset())
        run = dry_run(lines, profile, known=())
        if given.layers:
            for part in layer_balances(run.program, run.deposited, profile):
                worst = max(part.layers, key=lambda layer: abs(layer.over_room - 1.0))
                cells = [
                    file.stem, part.part, len(part.layers), f"{100 * part.over_room:.0f}", f"{100 * part.over:.1f}",
                    f"{100 * part.under:.1f}", worst.layer, f"{100 * worst.over_room:.0f}",
                ]  # fmt: skip
                print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)
            continue
        for face in interfaces(run.program, run.deposited, profile):
            print(row(file.stem, face), flush=True)
            if given.maps is not None:
                given.maps.mkdir(parents=True, exist_ok=True)
                write_png(given.maps / f"{file.stem}-{face.part}.png", picture(face))


if __name__ == "__main__":
    main()
