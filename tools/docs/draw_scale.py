"""Draw the growth of cost: `python tools/docs/draw_scale.py` writes docs/scale.svg from the tables of docs/scale.md.

A panel per curve: core seconds or memory over the first column of a table. The picture's description contains the tables, so that
a test can check whether it is current. Needs the extra `train` for matplotlib.
"""

import re
from typing import NamedTuple

from tools.docs.harness import DOCS

PAGE, PICTURE = DOCS / "scale.md", DOCS / "scale.svg"


class Panel(NamedTuple):
    """A curve of a table: x and y are columns; logarithmic: both axes."""

    title: str
    table: str
    x: str
    y: str
    logarithmic: bool = False


PANELS = (
    Panel("decompose, by faces", "faces", "faces", "core s", True),
    Panel("decompose, by faces", "faces", "faces", "memory MB", True),
    Panel("export by a plan, by parts", "parts", "parts", "core s"),
    Panel("export in one part, by layers", "layer mm", "layers", "core s"),
    Panel("export in one part, by lines", "layer mm", "lines", "core s"),
    Panel("export in one part, by lines", "layer mm", "lines", "memory MB"),
)


def tables(text: str) -> dict[str, dict[str, list[float]]]:
    """The page's tables of numbers by the name of their first column: column -> values."""
    found: dict[str, dict[str, list[float]]] = {}
    for block in re.findall(r"(?:^\|.*\|\n)+", text, re.MULTILINE):
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in block.splitlines()]
        head, body = rows[0], rows[2:]
        try:
            values = [[float(cell) for cell in row] for row in body]
        except ValueError:  # a table of words
            continue
        found[head[0]] = {name: [row[k] for row in values] for k, name in enumerate(head)}
    return found


def main() -> None:
    """Write the picture of the page's tables."""
    import matplotlib
    from matplotlib.figure import Figure

    text = PAGE.read_text(encoding="utf-8")
    matplotlib.rcParams |= {"svg.hashsalt": "scale", "svg.fonttype": "none"}  # deterministic bytes
    columns, figure = tables(text), Figure(figsize=(10.0, 5.6), layout="constrained")
    for panel, axes in zip(PANELS, figure.subplots(2, 3).flat, strict=True):
        values = columns[panel.table]
        x, y = zip(*sorted(zip(values[panel.x], values[panel.y], strict=True)), strict=True)
        axes.plot(x, y, "o-", color="#2b6cb0")
        axes.set(title=panel.title, xlabel=panel.x, ylabel=panel.y)
        room = {"xlim": (0.0, 1.05 * max(x)), "ylim": (0.0, 1.1 * max(y))}
        axes.set(**{"xscale": "log", "yscale": "log"} if panel.logarithmic else room)
        axes.grid(color="#dddddd")
    figure.savefig(PICTURE, metadata={"Date": None, "Description": described(text)})


def described(text: str) -> str:
    """The tables shown in the picture, as its description contains them."""
    shown = tables(text)
    return str({panel.table: shown[panel.table] for panel in PANELS})


if __name__ == "__main__":
    main()
