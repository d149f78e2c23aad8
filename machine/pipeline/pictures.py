"""Pictures of decompositions and calibrations, as images, PNG files and thumbnails in G-code.

They show the model beside its parts, the print order as a sheet of frames, a frame for each number of parts, or the residuals of
a calibration. Thumbnails have PrusaSlicer's format, base64 in comments, which Mainsail, Fluidd, RepRapFirmware and Prusa's
printers display.
"""

from base64 import b64encode
from collections.abc import Sequence
from io import BytesIO
from math import ceil, sqrt
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from machine.gcode.lines import Lines
from machine.pipeline.output import write_bytes
from machine.pipeline.raster import Image, draw, seen_from
from machine.quantities import amount, minutes
from machine.view.parts import part_colours, residual_faces
from mdp.cost.cost import needing_upright
from mdp.cut import cut, mesh_of, solid_of
from mdp.decomposition import Decomposition, FrontRow, Part
from mdp.mesh import Floats, Mesh
from mdp.overhang import Mask, risky_above, risky_upright
from mdp.pose import UP, Pose, unit
from profiles.machine import Machine
from profiles.messages import three_digits
from profiles.profile import Profile

if TYPE_CHECKING:  # only calibration loads it
    from machine.setup.calibration.fit import Calibration

PLAIN = (214.0, 217.0, 222.0)
PRINTED = (196.0, 202.0, 210.0)
FLOOR = (236.0, 238.0, 241.0)
NOZZLE = (128.0, 131.0, 138.0)
SPREAD = 0.13  # gap between exploded parts as a fraction of the model's size
SEGMENTS = 96
SMALL_PX, SMALL_COLOURS = (136, 102), 32
FINER = 3  # times as many pixels of a small picture are drawn for each that is kept


def parts_picture(decomposition: Decomposition, profile: Profile, size: tuple[int, int] = (1600, 800)) -> Image:
    """The upright model and its exploded parts, with faces that need support in red.

    Returns (h, w, 3), uint8; size is width and height in pixels.
    """
    model, parts = decomposition.mesh, decomposition.parts
    risky = needing_upright(model, profile)
    floor, view, half = floor_of(model), best_view(model, risky), (size[0] // 2, size[1])
    plain = draw([floor, model], [FLOOR, PLAIN], reds=[None, risky], axes=view, size=half)
    apart = parts_apart(parts)
    reds = [residual_faces(part, profile) for part in parts]
    exploded = draw([floor, *apart], [FLOOR, *part_colours(len(parts))], reds=[None, *reds], axes=view, size=half)
    return np.concatenate([plain, exploded], axis=1)


def parts_apart(parts: Sequence[Part]) -> list[Mesh]:
    """Meshes of the parts, each moved away from the part below it."""
    low, high = (pick([part.mesh.bounds_mm[side] for part in parts], axis=0) for side, pick in enumerate((np.min, np.max)))
    gap = SPREAD * min(1.0, 5.0 / len(parts)) * float(np.linalg.norm(high - low))
    return [part.mesh.transform(np.eye(3), shift) for part, shift in zip(parts, _shifts(parts, gap), strict=True)]


def parts_together(decomposition: Decomposition, profile: Profile, size: tuple[int, int]) -> Image:
    """The coloured parts in place. Returns (h, w, 3), uint8; size is width and height in pixels."""
    risky = needing_upright(decomposition.mesh, profile)
    parts = [part.mesh for part in decomposition.parts]
    return draw(parts, list(part_colours(len(parts))), axes=best_view(decomposition.mesh, risky), size=size)


def small_picture(meshes: Sequence[Mesh], colours: Sequence[tuple[float, ...]]) -> bytes:
    """A small PNG of meshes in their places, on a transparent background, for a list of models."""
    width, height = SMALL_PX
    fine = draw(meshes, colours, size=(FINER * width, FINER * height)).reshape(height, FINER, width, FINER, 3)
    covered = (fine != 255).any(axis=4, keepdims=True)
    share = covered.mean(axis=(1, 3))
    colour = (fine * covered).mean(axis=(1, 3)) / np.maximum(share, 1e-9)
    pixels = np.concatenate([colour, 255 * share], axis=2).round().astype(np.uint8)
    file = BytesIO()
    Pillow.fromarray(pixels).quantize(SMALL_COLOURS, Pillow.Quantize.FASTOCTREE).save(file, "PNG", optimize=True)
    return file.getvalue()


def contact_sheet(decomposition: Decomposition, machine: Machine, frame_pixels: int = 480) -> Image:
    """A numbered frame per part in print order: the table in the part's pose, the part in colour under the nozzle.

    Returns (h, w, 3), uint8: the model's name, below it rows of square frames of frame_pixels.
    """
    parts, model = decomposition.parts, decomposition.mesh
    view = _along_the_tilt_axis(parts, machine)
    floor, nozzle = floor_of(model), _nozzle(machine)
    span = 1.1 * float(np.linalg.norm(model.bounds_mm[1] - model.bounds_mm[0]))
    frames = []
    for part, colour in zip(parts, part_colours(len(parts)), strict=True):
        printed = [earlier.mesh.transform(part.rotation) for earlier in parts[: part.index]]
        meshes = [floor.transform(part.rotation), *printed, nozzle.transform(np.eye(3), _last_point(printed[-1]))]
        paints = [FLOOR, *([PRINTED] * (part.index - 1)), colour, NOZZLE]
        frame = draw(meshes, paints, axes=view, size=(frame_pixels, frame_pixels), span_mm=span)
        frames.append(_label(frame, part, machine))
    return add_title(tile(frames), decomposition.name, frame_pixels)


def _shifts(parts: Sequence[Part], gap_mm: float) -> list[Floats]:
    """Displacement of each part: along its direction from the part below it, which is displaced itself."""
    shifts: list[Floats] = [np.zeros(3)]
    for position, part in enumerate(parts[1:], start=1):
        foot = part.mesh.vertices[part.base.heights_mm(part.mesh.vertices) < 1e-3].mean(axis=0)
        below = min(range(position), key=lambda k: float(np.abs(parts[k].mesh.vertices - foot).sum(axis=1).min()))
        shifts.append(shifts[below] + gap_mm * part.direction)
    return shifts


def best_view(model: Mesh, risky: NDArray[np.bool_]) -> Floats:
    """Camera axes for the side, slightly from above, that shows most of the model's outline and risky faces."""
    azimuths = np.arange(-180.0, 180.0, 10.0)
    toward = np.stack([np.cos(np.radians(azimuths)), np.sin(np.radians(azimuths)), np.zeros(len(azimuths))])
    facing = model.normals @ toward
    outline = 0.5 * model.areas_mm2 @ np.abs(facing)
    red = (model.areas_mm2 * risky) @ np.maximum(facing, 0.0)
    score = outline / outline.max() + 0.3 * red / max(red.max(), 1e-9) - 1e-4 * np.abs(azimuths + 60.0)
    return seen_from(float(azimuths[int(np.argmax(score))]), 9.0)


def _along_the_tilt_axis(parts: tuple[Part, ...], machine: Machine) -> Floats:
    """Camera axes nearly along the tilt axis, from the side to which most tilted tables show their upper faces."""
    axis = unit(machine.tilt.axis)
    across = np.cross(UP, axis)
    shown = sum(float(np.sign(np.round(part.rotation @ UP @ across, 6))) for part in parts)
    aside = 35.0 if shown > 0 else -35.0
    return seen_from(float(np.degrees(np.arctan2(axis[1], axis[0]))) + aside, 14.0)


def floor_of(model: Mesh) -> Mesh:
    """A disc as wide as the model, which suggests the build plate."""
    reach = float(np.hypot(*model.vertices[:, :2].T).max())
    return _revolve([(0.0, -0.03 * reach), (reach, -0.03 * reach), (reach, -0.01), (0.0, -0.01)])


def _nozzle(machine: Machine) -> Mesh:
    """The lowest 5 mm of the head's silhouette and a stub above them, tip at the origin."""
    low = [(radius, height) for radius, height in machine.head.silhouette_mm if height <= 5.0]
    outline = low or [(1.0, 0.0)]
    radius, height = outline[-1]
    return _revolve([(0.0, outline[0][1]), *outline, (radius, height + 4.0), (0.0, height + 4.0)])


def _last_point(mesh: Mesh) -> Floats:
    """The highest point of a part in its pose, 0.3 mm above the surface."""
    above: Floats = mesh.vertices[int(np.argmax(mesh.vertices[:, 2]))] + np.array([0.0, 0.0, 0.3])
    return above


def _revolve(outline: list[tuple[float, float]]) -> Mesh:
    """Surface of revolution about z of an outline (radius, z) from axis to axis, counter-clockwise."""
    turns = np.linspace(0.0, 2.0 * np.pi, SEGMENTS, endpoint=False)
    rings = np.array([[(r * np.cos(t), r * np.sin(t), z) for t in turns] for r, z in outline])
    k = np.arange(SEGMENTS)
    faces = []
    for ring in range(len(outline) - 1):
        a, b = ring * SEGMENTS + k, ring * SEGMENTS + (k + 1) % SEGMENTS
        c, d = b + SEGMENTS, a + SEGMENTS
        faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    return Mesh(rings.reshape(-1, 3), np.concatenate(faces))


def tile(frames: list[Image]) -> Image:
    """Frames in rows, padded with white."""
    rows = max(1, round(sqrt(len(frames) / 1.6)))
    columns = ceil(len(frames) / rows)
    blank = np.full_like(frames[0], 255)
    filled = frames + [blank] * (rows * columns - len(frames))
    return np.concatenate([np.concatenate(filled[row * columns : (row + 1) * columns], axis=1) for row in range(rows)], axis=0)


def add_title(sheet: Image, name: str, frame_pixels: int) -> Image:
    """The sheet below a line with the model's name."""
    height = frame_pixels // 12
    title = np.full((height, *sheet.shape[1:]), 255, dtype=np.uint8)
    written = write_text(title, name, (frame_pixels / 32, 0.8 * height), 0.7 * height, 90)
    return np.concatenate([written, sheet], axis=0)


def write_text(image: Image, text: str, at: tuple[float, float], height: float, grey: int) -> Image:
    """The image (h, w, 3) with a line of text in Pillow's own font, which is the same on every machine.

    at: start of the baseline, height: of the font, in pixels.
    """
    picture = Pillow.fromarray(image)
    ImageDraw.Draw(picture).text(at, text, (grey, grey, grey), ImageFont.load_default(height), anchor="ls")
    return np.asarray(picture)


def _label(frame: Image, part: Part, machine: Machine) -> Image:
    """The frame with the part's number at the top left and its tilt and turn at the bottom left."""
    pixels, pose = len(frame), part.pose
    left = pixels / 32
    labelled = write_text(frame, str(part.index), (left, pixels / 10), pixels / 12, 90)
    axes = (("tilt", machine.tilt.letter, pose.tilt_deg), ("turn", machine.turn.letter, pose.turn_deg)) if machine.tilts else ()
    for row, (word, letter, value) in enumerate(axes):
        text = f"{word} {letter} {three_digits(value, 1)}°"
        labelled = write_text(labelled, text, (left, pixels * (0.93 + 0.04 * row)), pixels / 28, 120)
    return labelled


BORDER = (0, 114, 178)


def front_picture(decomposition: Decomposition, profile: Profile, frame_pixels: int = 480) -> Image:
    """A frame for each row of the front: coloured parts with faces that need support in red, and figures below.

    Returns (h, w, 3), uint8: the model's name, below it rows of square frames of frame_pixels.
    """
    model = decomposition.mesh
    view = best_view(model, risky_upright(model, profile.process.self_supporting_angle_deg, profile.search.count_platform_faces))
    frames = [_frame(row, model, profile, view, frame_pixels) for row in decomposition.front]
    return add_title(tile(frames), decomposition.name, frame_pixels)


def _frame(row: FrontRow, model: Mesh, profile: Profile, view: Floats, pixels: int) -> Image:
    parts, reds = _cut(row, model, profile)
    span = 1.25 * float(np.linalg.norm(model.bounds_mm[1] - model.bounds_mm[0]))
    colours = [FLOOR, *part_colours(len(parts))]
    frame = draw([floor_of(model), *parts], colours, reds=[None, *reds], axes=view, size=(pixels, pixels), span_mm=span)
    left, height = pixels / 32, pixels / 24
    frame = write_text(frame, "one piece" if row.parts == 1 else f"{row.parts} parts", (left, pixels / 12), pixels / 16, 90)
    figures = f"{amount(row.support_area_mm2, 0)} mm² on support, {amount(row.seam_mm, 0)} mm of seams"
    frame = write_text(frame, figures, (left, 0.93 * pixels), height, 110)
    if row.time_s is not None and row.filament_mm is not None:
        takes = f"{minutes(row.time_s)}, {amount(row.filament_mm / 1000, 1)} m"
        frame = write_text(frame, takes, (left, 0.98 * pixels), height, 110)
    return _with_border(frame, max(2, pixels // 120)) if row.chosen else frame


def _cut(row: FrontRow, model: Mesh, profile: Profile) -> tuple[list[Mesh], list[Mask]]:
    """The parts in print order, and their faces that need support."""
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


ROW = 78  # characters of base64 per line, as PrusaSlicer writes them


def png_bytes(image: NDArray[np.uint8]) -> bytes:
    """The PNG file of an image (h, w, 3), uint8."""
    file = BytesIO()
    Pillow.fromarray(image).save(file, "PNG")
    return file.getvalue()


def write_png(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an image (h, w, 3), uint8, as a PNG file, completely or not at all. Raises OutputError."""
    write_bytes(path, png_bytes(image))


def with_thumbnails(lines: Lines, decomposition: Decomposition, profile: Profile) -> Lines:
    """The G-code with the pictures of machine.thumbnails_px after its first comments."""
    head = next((k for k, line in enumerate(lines) if not line.startswith("; ")), len(lines))
    comments: list[str] = []
    for width, height in profile.machine.thumbnails_px:
        comments += thumbnail(png_bytes(parts_together(decomposition, profile, (width, height))), width, height)
    return lines[:head] + Lines.of(comments) + lines[head:]


def thumbnail(png: bytes, width: int, height: int) -> list[str]:
    """Comment lines of a picture."""
    text = b64encode(png).decode("ascii")
    rows = [text[k : k + ROW] for k in range(0, len(text), ROW)]
    return [f"; thumbnail begin {width}x{height} {len(text)}", *(f"; {row}" for row in rows), "; thumbnail end"]


WIDTH, HEIGHT, EDGE = 1600, 800, 70
INK, PALE = (70, 74, 80), (214, 217, 222)
RINGS = 4


def residual_picture(calibration: "Calibration", poses: Sequence[Pose], machine: Machine) -> Image:
    """Residuals of a calibration: x and y in the workpiece frame, and a bar per pose, coloured by tilt; (h, w, 3), uint8."""
    picture = Pillow.new("RGB", (WIDTH, HEIGHT), "white")
    pen = ImageDraw.Draw(picture)
    tilts = sorted({round(pose.tilt_deg, 1) for pose in poses})
    palette = [tuple(round(value) for value in colour) for colour in part_colours(len(tilts))]
    colours = [palette[tilts.index(round(pose.tilt_deg, 1))] for pose in poses]
    most = _round_up(max(calibration.residuals_mm))
    _dots(pen, calibration, colours, most)
    _bars(pen, calibration, colours, most)
    for k, (tilt, colour) in enumerate(zip(tilts, palette, strict=True)):
        left = WIDTH // 2 + 20 + k * 110
        pen.rectangle((left, HEIGHT - 38, left + 16, HEIGHT - 22), fill=colour)
        _write(pen, f"{machine.tilt.letter} {tilt:g}", (left + 22, HEIGHT - 23), 20)
    title = f"{machine.name}: {calibration.rms_mm:.3f} mm off on average at {len(poses)} poses"
    _write(pen, title, (EDGE, 44), 28)
    return np.asarray(picture)


def _round_up(value_mm: float) -> float:
    """End of a scale: the next multiple of 0.02 mm."""
    return max(0.02, 0.02 * ceil(value_mm / 0.02))


def _dots(pen: ImageDraw.ImageDraw, calibration: "Calibration", colours: Sequence[tuple[int, ...]], most_mm: float) -> None:
    size = HEIGHT - 3 * EDGE
    x0, y0, scale = EDGE + size / 2, HEIGHT - EDGE - size / 2, size / 2 / most_mm
    for ring in range(1, RINGS + 1):
        radius = size / 2 * ring / RINGS
        pen.ellipse((x0 - radius, y0 - radius, x0 + radius, y0 + radius), outline=PALE, width=2)
        _write(pen, f"{most_mm * ring / RINGS:.3f}", (x0 + 4, y0 - radius - 3), 16)
    for (x, y, _), colour in zip(calibration.errors_mm, colours, strict=True):
        pen.ellipse((x0 + x * scale - 7, y0 - y * scale - 7, x0 + x * scale + 7, y0 - y * scale + 7), fill=colour, outline=INK)
    _write(pen, "x and y off, mm, on the table", (EDGE, HEIGHT - 23), 20)


def _bars(pen: ImageDraw.ImageDraw, calibration: "Calibration", colours: Sequence[tuple[int, ...]], most_mm: float) -> None:
    left, right, top, floor = WIDTH // 2 + 20, WIDTH - EDGE, 2 * EDGE, HEIGHT - EDGE
    for ring in range(RINGS + 1):
        y = floor - (floor - top) * ring / RINGS
        pen.line((left, y, right, y), fill=PALE, width=2)
        _write(pen, f"{most_mm * ring / RINGS:.3f}", (right + 6, y + 6), 16)
    step = (right - left) / len(colours)
    for k, (off, colour) in enumerate(zip(calibration.residuals_mm, colours, strict=True)):
        x = left + k * step
        pen.rectangle((x + 0.15 * step, floor - (floor - top) * off / most_mm, x + 0.85 * step, floor), fill=colour, outline=INK)
    _write(pen, "mm off, a bar a pose, as measured", (left, top - 20), 20)


def _write(pen: ImageDraw.ImageDraw, text: str, at: tuple[float, float], height: int) -> None:
    pen.text(at, text, INK, ImageFont.load_default(height), anchor="ls")
