"""Front picture: how every number of parts that a search found would cut the model, one frame each, the one taken in a border."""

import numpy as np

from machine.pipeline.pictures.picture import FLOOR, add_title, best_view, floor_of, tile, write_text
from machine.pipeline.pictures.raster import Image, View, draw
from machine.quantities import minutes
from machine.view.parts import part_colours
from mdp.cut import cut, mesh_of, solid_of
from mdp.decomposition import Decomposition, FrontRow
from mdp.mesh import Mesh
from mdp.overhang import Mask, risky_above, risky_upright
from profiles.profile import Profile

BORDER = (0, 114, 178)


def front_picture(decomposition: Decomposition, profile: Profile, frame_pixels: int = 480) -> Image:
    """A frame for every row of the front: its parts in colour with what needs support red, its figures below.

    Returns (h, w, 3), uint8: the model's name, below it frames of frame_pixels squared in rows.
    """
    model = decomposition.mesh
    view = best_view(model, risky_upright(model, profile.process.self_supporting_angle_deg, profile.search.count_platform_faces))
    frames = [_frame(row, model, profile, view, frame_pixels) for row in decomposition.front]
    return add_title(tile(frames), decomposition.name, frame_pixels)


def _frame(row: FrontRow, model: Mesh, profile: Profile, view: View, pixels: int) -> Image:
    parts, reds = _cut(row, model, profile)
    span = 1.25 * float(np.linalg.norm(model.bounds_mm[1] - model.bounds_mm[0]))
    colours = [FLOOR, *part_colours(len(parts))]
    frame = draw([floor_of(model), *parts], colours, reds=[None, *reds], view=view, size=(pixels, pixels), span_mm=span)
    left, height = pixels / 32, pixels / 24
    frame = write_text(frame, "one piece" if row.parts == 1 else f"{row.parts} parts", (left, pixels / 12), pixels / 16, 90)
    figures = f"{max(row.support_area_mm2, 0.0):.0f} mm2 on support, {row.seam_mm:.0f} mm of seams"
    frame = write_text(frame, figures, (left, 0.93 * pixels), height, 110)
    if row.time_s is not None and row.filament_mm is not None:
        takes = f"{minutes(row.time_s)}, {row.filament_mm / 1000:.1f} m"
        frame = write_text(frame, takes, (left, 0.98 * pixels), height, 110)
    return _with_border(frame, max(2, pixels // 120)) if row.chosen else frame


def _cut(row: FrontRow, model: Mesh, profile: Profile) -> tuple[list[Mesh], list[Mask]]:
    """The parts in print order and which of their faces need support."""
    angle_deg, rest = profile.process.self_supporting_angle_deg, solid_of(model)
    parts, reds = list[Mesh](), list[Mask]()
    for plane in row.planes:
        upper, rest = cut(rest, plane)
        parts.insert(0, mesh_of(upper))
        reds.insert(0, risky_above(parts[0], plane, angle_deg))
    parts.insert(0, mesh_of(rest))
    return parts, [risky_upright(parts[0], angle_deg, profile.search.count_platform_faces), *reds]


def _with_border(frame: Image, width: int) -> Image:
    bordered = frame.copy()
    for edge in (np.s_[:width], np.s_[-width:], np.s_[:, :width], np.s_[:, -width:]):
        bordered[edge] = BORDER
    return bordered
