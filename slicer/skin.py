"""Skin: solid fill by lines at alternating +-45 degrees."""

from slicer.bead import Bead, length_mm, spacing_mm
from slicer.hatch import filled
from slicer.paths import Kind
from slicer.polygons import Polygons, grown

JOIN = 3.0  # spacings: neighbouring line ends nearer than this are joined
RANK = 2
LEAST_FLOW, MOST_FLOW = 0.85, 1.15


def skin(area: Polygons, kind: Kind, angle_deg: float, width_mm: float, height_mm: float, overlap: float) -> list[Bead]:
    """Beads that fill an area completely; `overlap` is the reach into the walls around, share of a line width.

    The lines of each connected piece are spread evenly and its flow makes the plastic equal to area times height, so
    that neither the joints at the line ends nor the overlap over-fill it.
    """
    spacing = spacing_mm(width_mm, height_mm)
    beads: list[Bead] = []
    for island in area.decompose():
        inner = grown(island, -(0.5 * spacing - overlap * width_mm))
        fence = grown(island, -0.1 * width_mm)
        lines = [line for line in filled(inner, fence, angle_deg, spacing, JOIN * spacing) if length_mm(line) > 0.5 * width_mm]
        total = sum(length_mm(line) for line in lines)
        if total > 0:
            flow = min(max(island.area() / (total * spacing), LEAST_FLOW), MOST_FLOW)
            beads += [Bead(kind, line, width_mm, RANK, flow) for line in lines]
    return beads


def angle_of_layer_deg(infill_angle_deg: float, layer: int) -> float:
    """Direction of the skin lines of a layer: neighbours cross at right angles."""
    return infill_angle_deg + 90.0 * (layer % 2)
