"""Picture: a decomposition as images: the model and its parts side by side, and the print as a sheet of frames."""

from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

from machine.app.png import write_png
from machine.app.raster import Image, View, draw, seen_from
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Floats, Mesh
from mdp.overhang import risky_above, risky_upright
from mdp.pose import UP, unit
from profiles.machine import Machine
from profiles.profile import Profile

__all__ = ["View", "contact_sheet", "draw", "part_colours", "parts_picture", "parts_together", "seen_from", "write_png"]

# Okabe and Ito's colours for all kinds of colour vision, without vermilion, which is too near to the red of risky faces.
PALETTE = np.array([[86, 180, 233], [230, 159, 0], [0, 158, 115], [204, 121, 167], [240, 228, 66], [0, 114, 178]], dtype=float)
PLAIN = (214.0, 217.0, 222.0)
PRINTED = (196.0, 202.0, 210.0)
FLOOR = (236.0, 238.0, 241.0)
NOZZLE = (128.0, 131.0, 138.0)
SPREAD = 0.13  # gap between exploded parts as a share of the model's size
SEGMENTS = 96
# A font of 3 x 5: rows of each letter, top to bottom; letters of rotary axes only.
FONT = {
    letter: rows.split()
    for letter, rows in {
        "0": "111 101 101 101 111", "1": "010 110 010 010 111", "2": "111 001 111 100 111", "3": "111 001 111 001 111",
        "4": "101 101 111 001 001", "5": "111 100 111 001 111", "6": "111 100 111 101 111", "7": "111 001 001 010 010",
        "8": "111 101 111 101 111", "9": "111 101 111 001 111", "-": "000 000 111 000 000", ".": "000 000 000 000 010",
        "A": "010 101 111 101 101", "B": "110 101 110 101 110", "C": "111 100 100 100 111", "I": "111 010 010 010 111",
        "J": "001 001 001 101 111", "K": "101 101 110 101 101", "U": "101 101 101 101 111", "V": "101 101 101 101 010",
        "W": "101 101 111 111 101", " ": "000 000 000 000 000",
    }.items()
}  # fmt: skip


def parts_picture(decomposition: Decomposition, profile: Profile, size: tuple[int, int] = (1600, 800)) -> Image:
    """The model straight up with its risky faces red beside its parts, moved apart, with what stays risky red.

    Returns (h, w, 3), uint8; size is width and height in pixels.
    """
    angle = profile.process.self_supporting_angle_deg
    model, parts = decomposition.mesh, decomposition.parts
    risky = risky_upright(model, angle, profile.search.count_platform_faces)
    floor, view, half = _floor(model), _best_view(model, risky), (size[0] // 2, size[1])
    plain = draw([floor, model], [FLOOR, PLAIN], [None, risky], view, half)
    gap = SPREAD * min(1.0, 5.0 / len(parts)) * float(np.linalg.norm(model.bounds_mm[1] - model.bounds_mm[0]))
    apart = [part.mesh.moved(np.eye(3), shift) for part, shift in zip(parts, _shifts(parts, gap), strict=True)]
    reds = [residual(part, profile) for part in parts]
    exploded = draw([floor, *apart], [FLOOR, *part_colours(len(parts))], [None, *reds], view, half)
    return np.concatenate([plain, exploded], axis=1)


def parts_together(decomposition: Decomposition, profile: Profile, size: tuple[int, int]) -> Image:
    """The parts in colour where they belong. Returns (h, w, 3), uint8; size is width and height in pixels."""
    angle = profile.process.self_supporting_angle_deg
    risky = risky_upright(decomposition.mesh, angle, profile.search.count_platform_faces)
    parts = [part.mesh for part in decomposition.parts]
    return draw(parts, list(part_colours(len(parts))), None, _best_view(decomposition.mesh, risky), size)


def contact_sheet(decomposition: Decomposition, machine: Machine, frame_pixels: int = 480) -> Image:
    """One numbered frame a part in print order: the table tilted as for that part, the part in colour under the nozzle.

    Returns (h, w, 3), uint8, frames of frame_pixels squared in rows.
    """
    parts, model = decomposition.parts, decomposition.mesh
    view = _along_the_tilt_axis(parts, machine)
    floor, nozzle = _floor(model), _nozzle(machine)
    span = 1.1 * float(np.linalg.norm(model.bounds_mm[1] - model.bounds_mm[0]))
    frames = []
    for part, colour in zip(parts, part_colours(len(parts)), strict=True):
        printed = [earlier.mesh.moved(part.rotation) for earlier in parts[: part.index]]
        meshes = [floor.moved(part.rotation), *printed, nozzle.moved(np.eye(3), _last_point(printed[-1]))]
        paints = [FLOOR, *([PRINTED] * (part.index - 1)), colour, NOZZLE]
        frame = draw(meshes, paints, None, view, (frame_pixels, frame_pixels), span)
        frames.append(_labelled(frame, part, machine))
    return _tiled(frames)


def part_colours(count: int) -> Floats:
    """(count, 3) colours of parts 1, 2, ...; from the seventh on the palette returns paler."""
    places = np.arange(count)
    paler = np.minimum(places // len(PALETTE), 2)[:, None] * 0.38
    colours: Floats = PALETTE[places % len(PALETTE)] * (1.0 - paler) + 255.0 * paler
    return colours


def residual(part: Part, profile: Profile) -> NDArray[np.bool_]:
    """(m,) faces of a part that need support although it is printed in its own direction."""
    angle, counted = profile.process.self_supporting_angle_deg, profile.search.count_platform_faces
    return risky_upright(part.mesh, angle, counted) if part.index == 1 else risky_above(part.mesh, part.base, angle)


def _shifts(parts: tuple[Part, ...], gap_mm: float) -> list[Floats]:
    """Where each part is moved: along its direction away from the part it stands on, which has moved itself."""
    shifts: list[Floats] = [np.zeros(3)]
    for position, part in enumerate(parts[1:], start=1):
        foot = part.mesh.vertices[part.base.heights_mm(part.mesh.vertices) < 1e-3].mean(axis=0)
        below = min(range(position), key=lambda k: float(np.abs(parts[k].mesh.vertices - foot).sum(axis=1).min()))
        shifts.append(shifts[below] + gap_mm * part.direction)
    return shifts


def _best_view(model: Mesh, risky: NDArray[np.bool_]) -> View:
    """The side that shows most of the model's outline and of its risky faces, a little from above."""
    azimuths = np.arange(-180.0, 180.0, 10.0)
    toward = np.stack([np.cos(np.radians(azimuths)), np.sin(np.radians(azimuths)), np.zeros(len(azimuths))])
    facing = model.normals @ toward
    outline = 0.5 * model.areas_mm2 @ np.abs(facing)
    red = (model.areas_mm2 * risky) @ np.maximum(facing, 0.0)
    score = outline / outline.max() + 0.3 * red / max(red.max(), 1e-9) - 1e-4 * np.abs(azimuths + 60.0)
    return seen_from(float(azimuths[int(np.argmax(score))]), 9.0)


def _along_the_tilt_axis(parts: tuple[Part, ...], machine: Machine) -> View:
    """Nearly along the tilt axis, from the side to which most of the tilted tables show their upper faces."""
    axis = unit(machine.tilt.axis)
    across = np.cross(UP, axis)
    shown = sum(float(np.sign(np.round(part.rotation @ UP @ across, 6))) for part in parts)
    aside = 35.0 if shown > 0 else -35.0
    return seen_from(float(np.degrees(np.arctan2(axis[1], axis[0]))) + aside, 14.0)


def _floor(model: Mesh) -> Mesh:
    """A disc that suggests the platform: as wide as the model reaches."""
    reach = float(np.hypot(*model.vertices[:, :2].T).max())
    return _revolved([(0.0, -0.03 * reach), (reach, -0.03 * reach), (reach, -0.01), (0.0, -0.01)])


def _nozzle(machine: Machine) -> Mesh:
    """The lowest 5 mm of the head's silhouette and a stub above them, tip at the origin."""
    low = [(radius, height) for radius, height in machine.head.silhouette_mm if height <= 5.0]
    outline = low or [(1.0, 0.0)]
    radius, height = outline[-1]
    return _revolved([(0.0, outline[0][1]), *outline, (radius, height + 4.0), (0.0, height + 4.0)])


def _last_point(mesh: Mesh) -> Floats:
    """The highest place of a part in the pose it is printed at, a hair above it."""
    above: Floats = mesh.vertices[int(np.argmax(mesh.vertices[:, 2]))] + np.array([0.0, 0.0, 0.3])
    return above


def _revolved(outline: list[tuple[float, float]]) -> Mesh:
    """The closed surface of an outline (radius, z) from axis to axis, counter-clockwise, turned about z."""
    turns = np.linspace(0.0, 2.0 * np.pi, SEGMENTS, endpoint=False)
    rings = np.array([[(r * np.cos(t), r * np.sin(t), z) for t in turns] for r, z in outline])
    k = np.arange(SEGMENTS)
    faces = []
    for ring in range(len(outline) - 1):
        a, b = ring * SEGMENTS + k, ring * SEGMENTS + (k + 1) % SEGMENTS
        c, d = b + SEGMENTS, a + SEGMENTS
        faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    return Mesh(rings.reshape(-1, 3), np.concatenate(faces))


def _tiled(frames: list[Image]) -> Image:
    """Frames in rows, white where none is left."""
    rows = max(1, round(sqrt(len(frames) / 1.6)))
    columns = ceil(len(frames) / rows)
    blank = np.full_like(frames[0], 255)
    filled = frames + [blank] * (rows * columns - len(frames))
    return np.concatenate([np.concatenate(filled[row * columns : (row + 1) * columns], axis=1) for row in range(rows)], axis=0)


def _labelled(image: Image, part: Part, machine: Machine) -> Image:
    """The image with the part's number in its upper left corner, and where the table stands in the lower left one."""
    pose, size = part.pose, max(image.shape[0] // 96, 1)
    out, small = image.copy(), max(3 * size // 5, 1)
    _write(out, str(part.index), 3 * size, size, 90)
    axes = ((machine.tilt.letter, pose.tilt_deg), (machine.turn.letter, pose.turn_deg)) if machine.tilts else ()
    for row, (letter, value) in enumerate(axes):
        _write(out, f"{letter} {round(value, 1) + 0.0:.1f}", len(image) - 3 * size - (13 - 8 * row) * small, small, 120)
    return out


def _write(image: Image, text: str, top: int, size: int, grey: int) -> None:
    """Letters of the font, size pixels a dot, along the image's left margin."""
    rows = np.array([[int(dot) for letter in text for dot in FONT[letter][row] + "0"] for row in range(5)])
    marks = np.kron(rows, np.ones((size, size), dtype=np.uint8)).astype(bool)
    left = 3 * max(len(image) // 96, 1)
    place = image[top : top + marks.shape[0], left : left + marks.shape[1]]
    place[marks[:, : place.shape[1]]] = grey
