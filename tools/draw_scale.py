"""Draw how cost grows: `python tools/draw_scale.py` writes docs/scale.svg from the tables of docs/scale.md, and nothing else.

One panel a table and curve: core seconds over what a row begins with, on axes that are logarithmic where a table spans decades.
"""

import re
from dataclasses import dataclass
from html import escape
from math import log10
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE, PICTURE = DOCS / "scale.md", DOCS / "scale.svg"
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 330, 250, 52, 16, 34, 46
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
MOST_TICKS = 5


@dataclass(frozen=True)
class Panel:
    """A curve of a table. x, y: columns; logarithmic: both axes, which then end at powers of ten."""

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
COLUMNS = 3


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


def draw(text: str) -> str:
    """The picture of a page's tables."""
    columns = tables(text)
    rows = -(-len(PANELS) // COLUMNS)
    width, height = COLUMNS * WIDTH, rows * HEIGHT
    places = ((k % COLUMNS * WIDTH, k // COLUMNS * HEIGHT) for k in range(len(PANELS)))
    body = "\n".join(
        f'<g transform="translate({x},{y})">\n{panel_svg(panel, columns[panel.table])}\n</g>'
        for panel, (x, y) in zip(PANELS, places, strict=True)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="11">\n'
        f'<rect width="{width}" height="{height}" fill="white"/>\n{body}\n</svg>\n'
    )


def panel_svg(panel: Panel, columns: dict[str, list[float]]) -> str:
    """Axes with their ticks, the curve, and each of its points with its value."""
    x, y = Axis.of(columns[panel.x], panel.logarithmic), Axis.of(columns[panel.y], panel.logarithmic)
    wide, high = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
    parts = [f'<text x="{LEFT}" y="18" font-size="12" font-weight="bold">{escape(panel.title)}</text>']
    for tick in x.ticks:
        at = LEFT + wide * x.share(tick)
        parts.append(f'<path d="M{at:.1f} {TOP}V{TOP + high}" stroke="#ddd"/>')
        parts.append(f'<text x="{at:.1f}" y="{TOP + high + 15}" text-anchor="middle" fill="#555">{in_short(tick)}</text>')
    for tick in y.ticks:
        at = TOP + high * (1.0 - y.share(tick))
        parts.append(f'<path d="M{LEFT} {at:.1f}H{LEFT + wide}" stroke="#ddd"/>')
        parts.append(f'<text x="{LEFT - 5}" y="{at + 4:.1f}" text-anchor="end" fill="#555">{in_short(tick)}</text>')
    pairs = zip(columns[panel.x], columns[panel.y], strict=True)
    points = sorted((LEFT + wide * x.share(a), TOP + high * (1.0 - y.share(b)), b) for a, b in pairs)
    parts.append(
        f'<path d="M{"L".join(f"{a:.1f} {b:.1f}" for a, b, _ in points)}" fill="none" stroke="#2b6cb0" stroke-width="2"/>'
    )
    for a, b, value in points:
        parts.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="#2b6cb0"/>')
        parts.append(f'<text x="{a:.1f}" y="{b - 7:.1f}" text-anchor="middle" font-size="10">{in_short(value)}</text>')
    parts.append(f'<text x="{LEFT + wide / 2}" y="{HEIGHT - 12}" text-anchor="middle">{panel.x}</text>')
    parts.append(f'<text x="{LEFT + wide}" y="18" text-anchor="end" fill="#2b6cb0">{panel.y}</text>')
    return "\n".join(parts)


@dataclass(frozen=True)
class Axis:
    """What an axis shows, and its ticks. low, high: powers of ten where it is logarithmic."""

    low: float
    high: float
    ticks: tuple[float, ...]
    logarithmic: bool

    @classmethod
    def of(cls, values: list[float], logarithmic: bool) -> "Axis":
        """An axis that holds values, from 0 where it is not logarithmic."""
        if logarithmic:
            low = next(k for k in range(20, -20, -1) if 10.0**k <= min(values))
            high = next(k for k in range(-20, 20) if 10.0**k >= max(values))
            return cls(float(low), float(high), tuple(10.0**k for k in range(low, high + 1)), True)
        steps = (step * 10.0**k for k in range(-3, 9) for step in STEPS)
        step = next(step for step in steps if MOST_TICKS * step >= max(values))
        ticks = tuple(step * k for k in range(MOST_TICKS + 2) if step * (k - 1) < 1.05 * max(values))
        return cls(0.0, ticks[-1], ticks, False)

    def share(self, value: float) -> float:
        """Where on the axis a value is, 0 to 1."""
        return ((log10(value) if self.logarithmic else value) - self.low) / (self.high - self.low)


def in_short(value: float) -> str:
    """A number in few characters."""
    if value >= 1e6:
        return f"{value / 1e6:.3g}M"
    return f"{value / 1e3:.3g}k" if value >= 1e4 else f"{value:.4g}"


def main() -> None:
    """Write the picture."""
    PICTURE.write_text(draw(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"wrote {PICTURE.name}")


if __name__ == "__main__":
    main()
