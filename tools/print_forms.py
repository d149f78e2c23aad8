"""Forms to try prints with: closed solids of twelve families, each made of a seed alone.

    python tools/print_forms.py FOLDER [--count 24]

Each is an STL on z = 0, 15 to 70 mm long. Lengths are drawn so that every family holds what prints easily and what hardly prints.
"""

import argparse
import random
from collections.abc import Callable
from itertools import pairwise
from math import cos, pi, sin
from pathlib import Path

import manifold3d as m3
import numpy as np
from numpy.typing import NDArray

Solid = m3.Manifold
ROUND = 48  # corners of a circle


def block(x: float, y: float, z: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Solid:
    """A box whose middle in x and y, and whose bottom, stand at a point."""
    return Solid.cube((x, y, z)).translate((at[0] - x / 2, at[1] - y / 2, at[2]))


def rod(radius: float, height: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0), top: float | None = None) -> Solid:
    """An upright cylinder or cone that stands on a point."""
    return Solid.cylinder(height, radius, radius if top is None else top, ROUND).translate(at)


def spots(dice: random.Random, count: int, x: float, y: float) -> list[tuple[float, float]]:
    """Places within a rectangle about the origin."""
    return [(dice.uniform(-x, x) / 2, dice.uniform(-y, y) / 2) for _ in range(count)]


def pockets(dice: random.Random) -> Solid:
    """A block with pockets and holes from above, from below and from a side."""
    x, y, z = dice.uniform(20, 60), dice.uniform(20, 60), dice.uniform(6, 25)
    solid = block(x, y, z)
    for px, py in spots(dice, dice.randint(2, 7), 0.8 * x, 0.8 * y):
        size, deep = dice.uniform(1.5, x / 3), dice.choice([dice.uniform(0.5, z - 1), 2 * z])
        low = dice.choice([z - deep, deep - 2 * z])
        square = block(size, dice.uniform(2, y / 2), 2 * z, (px, py, low))
        solid -= dice.choice([square, rod(size / 2, 2 * z, (px, py, low))])
    if dice.random() < 0.5:
        solid -= rod(dice.uniform(1, z / 2.5), 2 * x).rotate((0.0, 90.0, 0.0)).translate((-x, dice.uniform(-y, y) / 3, z / 2))
    return solid


def pins(dice: random.Random) -> Solid:
    """Pins and cones on a plate, some of them thinner than two lines."""
    x, y = dice.uniform(18, 50), dice.uniform(18, 50)
    solid = block(x, y, dice.uniform(1, 5))
    for px, py in spots(dice, dice.randint(3, 14), 0.85 * x, 0.85 * y):
        radius = dice.choice([0.3, 0.5, 0.8, 1.5, 3.0])
        solid += rod(radius, dice.uniform(3, 30), (px, py, 0.5), radius * dice.choice([0.0, 0.3, 1.0, 1.0, 1.6]))
    return solid


def ribs(dice: random.Random) -> Solid:
    """Ribs on a plate, some crossing, some leaning, some hollowed by a notch."""
    x, y, z = dice.uniform(20, 60), dice.uniform(20, 60), dice.uniform(6, 25)
    solid = block(x, y, dice.uniform(0.8, 3))
    for px, py in spots(dice, dice.randint(2, 8), 0.7 * x, 0.7 * y):
        rib = block(dice.choice([0.4, 0.6, 0.9, 1.3, 2.5]), dice.uniform(8, y), z)
        rib = rib.rotate((dice.choice([0, 0, 15, 30]), 0.0, dice.choice([0.0, 90.0, dice.uniform(0, 180)])))
        solid += rib.translate((px, py, 0.2))
    return solid - block(2 * x, dice.uniform(2, 8), z, (0, 0, dice.uniform(0.4, 0.8) * z))


def shells(dice: random.Random) -> Solid:
    """A thin-walled cup, dome, tube or box, perhaps with a window."""
    radius, height, wall = dice.uniform(8, 25), dice.uniform(15, 50), dice.choice([0.45, 0.8, 1.2, 2.0])
    kind = dice.choice(["cup", "dome", "tube", "box"])
    if kind == "dome":
        solid = Solid.sphere(radius, ROUND) - Solid.sphere(radius - wall, ROUND)
        solid = solid.trim_by_plane((0.0, 0.0, 1.0), dice.uniform(-0.5, 0.0) * radius)
    elif kind == "box":
        x, y = 2 * radius, dice.uniform(15, 50)
        solid = block(x, y, height) - block(x - 2 * wall, y - 2 * wall, height, (0.0, 0.0, wall))
    else:
        floor = dice.uniform(0.6, 2.0) if kind == "cup" else -1.0
        top = radius * dice.choice([0.6, 1.0, 1.0, 1.4])
        solid = rod(radius, height, top=top) - rod(radius - wall, height + 2, (0.0, 0.0, floor), top - wall)
    if dice.random() < 0.4:
        solid -= block(dice.uniform(4, radius), 100.0, dice.uniform(3, 0.6 * height), (0.0, 50.0, 0.3 * height))
    return solid


def text(dice: random.Random) -> Solid:
    """Letters of strokes on a plate, raised from it or sunk into it; the plate may stand upright."""
    letters, high, deep = dice.randint(2, 6), dice.uniform(6, 14), dice.uniform(0.4, 2.0)
    stroke, wide = dice.choice([0.5, 0.8, 1.2, 2.0]), 0.7 * high
    plate = block(letters * wide + 4, high + 4, 2.0 + deep)
    lettering = Solid()
    for k in range(letters):
        corners = [(dice.choice([0.0, 0.5, 1.0]), dice.choice([0.0, 0.5, 1.0])) for _ in range(dice.randint(3, 6))]
        places = [((k - letters / 2 + 0.15 + 0.6 * a) * wide, (b - 0.5) * high) for a, b in corners]
        for (x0, y0), (x1, y1) in pairwise(places):
            ends = [rod(stroke / 2, 2 * deep, (a, b, 2.0)) for a, b in ((x0, y0), (x1, y1))]
            lettering += Solid.batch_hull(ends)
    raised = dice.random() < 0.5
    solid = plate + lettering.translate((0.0, 0.0, deep)) if raised else plate - lettering
    return solid.rotate((90.0, 0.0, 0.0)) if dice.random() < 0.4 else solid


def threads(dice: random.Random) -> Solid:
    """A twisted bar as a screw, on a head or in a nut of its own shape."""
    radius, height, turns = dice.uniform(4, 12), dice.uniform(12, 40), dice.uniform(1, 6)
    corners = [
        (r * cos(angle), r * sin(angle))
        for angle, r in ((2 * pi * k / ROUND, radius * (1 + 0.12 * cos(2 * pi * k / ROUND))) for k in range(ROUND))
    ]
    if dice.random() < 0.4:
        corners = [(radius * cos(2 * pi * k / 5), radius * sin(2 * pi * k / 5)) for k in range(5)]
    screw = Solid.extrude(m3.CrossSection([corners]), height, int(height * 3), 360.0 * turns)
    if dice.random() < 0.3:
        return rod(1.7 * radius, 0.6 * height) - screw.translate((0.0, 0.0, -0.2 * height))
    return screw + rod(1.5 * radius, dice.uniform(2, 6)) if dice.random() < 0.7 else screw


def bridges(dice: random.Random) -> Solid:
    """Pillars with level or arched spans between them, one above the other."""
    length, deep, high = dice.uniform(15, 60), dice.uniform(4, 20), dice.uniform(8, 30)
    post = dice.uniform(2, 6)
    solid = block(length, deep, 1.5)
    for x in (-1, 1):
        solid += block(post, deep, high, (x * (length - post) / 2, 0.0, 0.0))
    for _ in range(dice.randint(1, 3)):
        solid += block(length, dice.uniform(2, deep), dice.uniform(0.6, 3), (0.0, 0.0, dice.uniform(0.3, 0.95) * high))
    if dice.random() < 0.5:
        arch = rod(length / 2 - post, 2 * deep).rotate((90.0, 0.0, 0.0)).translate((0.0, deep, 0.0))
        solid += block(length, deep, length / 2 + 2) - arch
    return solid


def voids(dice: random.Random) -> Solid:
    """A block or a ball with closed hollows."""
    x, y, z = dice.uniform(18, 45), dice.uniform(18, 45), dice.uniform(12, 40)
    solid = block(x, y, z) if dice.random() < 0.6 else rod(min(x, y) / 2, z)
    for _ in range(dice.randint(1, 5)):
        r = dice.uniform(1, min(x, y, z) / 4.5)
        hollow = Solid.sphere(r, ROUND) if dice.random() < 0.5 else block(2 * r, dice.uniform(1, 2) * r, 2 * r, (0, 0, -r))
        solid -= hollow.translate((dice.uniform(-x, x) / 4, dice.uniform(-y, y) / 4, dice.uniform(r + 0.8, z - r - 0.8)))
    return solid


def plates(dice: random.Random) -> Solid:
    """Thin plates: lying, standing, or leaning on a foot."""
    x, y, thick = dice.uniform(15, 60), dice.uniform(15, 60), dice.choice([0.3, 0.6, 1.0, 1.6, 2.4])
    lean = dice.choice([0.0, 90.0, 90.0, dice.uniform(20, 80)])
    solid = block(x, y, thick).rotate((lean, 0.0, 0.0))
    for px, py in spots(dice, dice.randint(0, 4), 0.7 * x, 0.7 * y):
        solid -= rod(dice.uniform(0.8, 4), 4 * thick, (px, py, -thick)).rotate((lean, 0.0, 0.0))
    low = solid.bounding_box()[2]
    middle = (solid.bounding_box()[1] + solid.bounding_box()[4]) / 2
    return solid.translate((0.0, -middle, -low)) + (block(x, 12.0, 2.0) if lean else Solid())


def stairs(dice: random.Random) -> Solid:
    """Steps upward, and downward as overhangs, of heights that no layer meets."""
    steps, deep = dice.randint(3, 9), dice.uniform(8, 30)
    run, rise = dice.uniform(2, 6), dice.choice([0.13, 0.37, 1.01, dice.uniform(0.3, 4)])
    solid = block(run, deep, max(2.0, rise))
    for k in range(1, steps):
        low = (k - dice.uniform(0.2, 1.0)) * rise if dice.random() < 0.3 else 0.0
        solid += block(run * 1.02, deep, (k + 1) * rise + 1.0 - low, (k * run, 0.0, low))
    return solid


def tables(dice: random.Random) -> Solid:
    """A top on legs, or a tee."""
    x, y, high = dice.uniform(18, 60), dice.uniform(12, 50), dice.uniform(8, 30)
    leg, thick = dice.uniform(1.2, 6), dice.uniform(1, 5)
    solid = block(x, y, thick, (0.0, 0.0, high))
    places = [(a * (x - leg) / 2, b * (y - leg) / 2) for a in (-1, 1) for b in (-1, 1)]
    for px, py in places if dice.random() < 0.7 else [(0.0, 0.0)]:
        shape = rod(leg / 2, high + thick / 2) if dice.random() < 0.5 else block(leg, leg, high + thick / 2)
        solid += shape.translate((px, py, 0.0))
    return solid


def booleans(dice: random.Random) -> Solid:
    """Boxes, cylinders, balls and cones, turned at random, joined and cut off each other."""

    def primitive() -> Solid:
        r = dice.uniform(3, 14)
        kinds: tuple[Callable[[], Solid], ...] = (
            lambda: Solid.cube((2 * r, dice.uniform(3, 28), dice.uniform(3, 28)), True),
            lambda: Solid.cylinder(dice.uniform(4, 30), r, r, ROUND, True),
            lambda: Solid.sphere(r, ROUND),
            lambda: Solid.cylinder(dice.uniform(4, 30), r, dice.uniform(0, 0.8) * r, ROUND, True),
        )
        turned = dice.choice(kinds)().rotate(tuple(dice.choice([0.0, 90.0, dice.uniform(0, 360)]) for _ in range(3)))
        return turned.translate(tuple(dice.uniform(-9, 9) for _ in range(3)))

    solid = primitive() + primitive()
    for _ in range(dice.randint(1, 6)):
        solid = dice.choice([Solid.__add__, Solid.__add__, Solid.__sub__])(solid, primitive())
    return solid


FAMILIES: dict[str, Callable[[random.Random], Solid]] = {
    make.__name__: make for make in (pockets, pins, ribs, shells, text, threads, bridges, voids, plates, stairs, tables, booleans)
}


def form_names(count: int) -> list[str]:
    """Names of a number of forms, the families in turn."""
    families = list(FAMILIES)
    return [f"{families[k % len(families)]}-{k // len(families):03}" for k in range(count)]


def form(name: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (n, 3) in mm and faces (m, 3) of a form by its name, standing on z = 0 about the z axis: its largest piece.

    The longest side is brought into 15 to 70 mm.
    """
    dice = random.Random(name)
    whole = FAMILIES[name.split("-")[0]](dice)
    solid = whole ^ max(whole.decompose(), key=Solid.volume)  # a piece comes without its hollows: they are pieces, too
    low, high = np.split(np.array(solid.bounding_box()), 2)
    longest = float((high - low).max())
    middle = (low + high) / 2
    solid = solid.translate((-middle[0], -middle[1], -low[2])).scale([min(max(longest, 15.0), 70.0) / longest] * 3)
    mesh = solid.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64)


def write_stl(path: Path, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
    """A binary STL."""
    rows = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["corners"] = np.asarray(vertices)[faces]
    path.write_bytes(bytes(80) + np.uint32(len(faces)).tobytes() + rows.tobytes())


def main() -> None:
    """Read the options, write the forms."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--count", type=int, default=24)
    given = options.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    for name in form_names(given.count):
        write_stl(given.folder / f"{name}.stl", *form(name))


if __name__ == "__main__":
    main()
