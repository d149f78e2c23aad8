"""Drawing: a layer as SVG, with beads as wide as printed and coloured by kind, travels and seams."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from mdp.mesh import Floats
from profiles.errors import SliceError
from slicer.paths import Kind, Path, SlicedPart

COLOURS = {
    Kind.OUTER_WALL: "#e8a33d",
    Kind.INNER_WALL: "#f4d160",
    Kind.OVERHANG: "#2746c7",
    Kind.GAP: "#d9d9d9",
    Kind.INFILL: "#b3372b",
    Kind.SKIN: "#9a5bb5",
    Kind.TOP_SKIN: "#f07a6a",
    Kind.BRIDGE: "#4f8fe0",
    Kind.IRONING: "#ffb3a7",
    Kind.SKIRT: "#3f7f5f",
    Kind.SUPPORT: "#4caf50",
    Kind.SUPPORT_INTERFACE: "#1b7f3b",
    Kind.PURGE: "#8c8c8c",
}
WALLS = (Kind.OUTER_WALL, Kind.OVERHANG)
TRAVEL_COLOUR, RETRACTED_COLOUR, SEAM_COLOUR = "#3c8d93", "#c2185b", "#000000"
MARGIN_MM = 2.0  # around the paths, more than half of any bead
LINE_MM = 0.06  # thickness of travels
SCALE = 10  # pixels per millimetre, for viewers without zoom
LEGEND_MM = 3.0  # height of a row of the legend


def layer_svg(sliced: SlicedPart, number: int) -> str:
    """SVG of a part's layer, counted from 1, in the part frame: x to the right, y up, 1 unit = 1 mm.

    Each bead is a polyline as wide as the bead in the group of its kind (id: the kind's name), with round ends; travels are thin
    lines, dashed without and solid with a retraction; a dot marks the start of every outer wall. Raises SliceError for a layer
    that does not exist.
    """
    if not 1 <= number <= len(sliced.layers):
        raise SliceError(f"part {sliced.index} has no layer {number}: its layers are 1 to {len(sliced.layers)}")
    layer = sliced.layers[number - 1]
    paths = layer.paths
    points = np.concatenate([path.points for path in paths])
    low, high = points.min(axis=0) - MARGIN_MM, points.max(axis=0) + MARGIN_MM
    kinds = [kind for kind in Kind if any(path.kind is kind for path in paths)]
    title = f"part {sliced.index}, layer {number}, z {layer.z_mm:.3f} mm, height {layer.height_mm:.3f} mm"
    lines = [*_frame(title, low, high, kinds)]
    lines.append('<g transform="scale(1 -1)" fill="none" stroke-linecap="round" stroke-linejoin="round">')
    for kind in kinds:
        lines.append(f'<g id="{kind.value}" stroke="{COLOURS[kind]}">')
        of_kind = [path for path in paths if path.kind is kind]
        lines += [f'<polyline stroke-width="{path.width_mm:.4f}" points="{_points(path.points)}"/>' for path in of_kind]
        lines.append("</g>")
    lines += [*_travels(paths), *_seams(paths), "</g>", "</svg>"]
    return "\n".join(lines) + "\n"


def _frame(title: str, low: Floats, high: Floats, kinds: Sequence[Kind]) -> Iterator[str]:
    """The head of the SVG, its background, and below the layer the legend of its kinds."""
    width, height = high - low
    width, height = max(width, 10.0 * LEGEND_MM), height + LEGEND_MM * (len(kinds) + 1)
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{SCALE * width:.0f}" height="{SCALE * height:.0f}" '
        f'viewBox="{low[0]:.3f} {-high[1]:.3f} {width:.3f} {height:.3f}">'
    )
    yield f"<title>{title}</title>"
    yield f'<rect x="{low[0]:.3f}" y="{-high[1]:.3f}" width="{width:.3f}" height="{height:.3f}" fill="#ffffff"/>'
    for row, kind in enumerate(kinds):
        y = -low[1] + LEGEND_MM * (row + 0.5)
        yield (
            f'<rect x="{low[0] + 1:.3f}" y="{y - 1:.3f}" width="4" height="2" fill="{COLOURS[kind]}"/>'
            f'<text x="{low[0] + 6:.3f}" y="{y + 0.8:.3f}" font-size="2.2" font-family="sans-serif">{kind.value}</text>'
        )


def _travels(paths: Sequence[Path]) -> Iterator[str]:
    yield f'<g id="travels" stroke-width="{LINE_MM}">'
    for before, path in pairwise(paths):
        points = np.vstack([before.points[-1:], path.approach.reshape(-1, 2), path.points[:1]])
        if float(np.hypot(*np.diff(points, axis=0).T).sum()) > LINE_MM:
            colour, dashes = (RETRACTED_COLOUR, "") if path.retract else (TRAVEL_COLOUR, ' stroke-dasharray="0.3 0.2"')
            yield f'<polyline stroke="{colour}"{dashes} points="{_points(points)}"/>'
    yield "</g>"


def _seams(paths: Sequence[Path]) -> Iterator[str]:
    """Dots at the starts of outer walls; consecutive strokes of one wall have no travel between them."""
    yield f'<g id="seams" fill="{SEAM_COLOUR}">'
    end = np.full(2, np.nan)
    for path in paths:
        if path.kind in WALLS and not (path.points[0] == end).all():
            yield f'<circle cx="{path.points[0, 0]:.3f}" cy="{path.points[0, 1]:.3f}" r="{0.3 * path.width_mm:.3f}"/>'
        end = path.points[-1]
    yield "</g>"


def _points(points: Floats) -> str:
    return " ".join(f"{x:.3f},{y:.3f}" for x, y in points.tolist())
