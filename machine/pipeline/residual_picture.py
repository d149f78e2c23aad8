"""Residual picture: how far each pose's measured ball is from where the found machine has it, as dots and as bars."""

from collections.abc import Sequence
from math import ceil

import numpy as np
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from machine.pipeline.raster import Image
from machine.setup.calibration.fit import Calibration
from machine.view.parts import part_colours
from mdp.pose import Pose
from profiles.machine import Machine

WIDTH, HEIGHT, EDGE = 1600, 800, 70
INK, PALE = (70, 74, 80), (214, 217, 222)
RINGS = 4


def residual_picture(calibration: Calibration, poses: Sequence[Pose], machine: Machine) -> Image:
    """Left x and y of the residuals in the workpiece frame, right a bar a pose, a colour a tilt; (h, w, 3), uint8."""
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
    """A scale's end: the next hundredth of a mm in steps that divide well."""
    return max(0.02, 0.02 * ceil(value_mm / 0.02))


def _dots(pen: ImageDraw.ImageDraw, calibration: Calibration, colours: Sequence[tuple[int, ...]], most_mm: float) -> None:
    size = HEIGHT - 3 * EDGE
    x0, y0, scale = EDGE + size / 2, HEIGHT - EDGE - size / 2, size / 2 / most_mm
    for ring in range(1, RINGS + 1):
        radius = size / 2 * ring / RINGS
        pen.ellipse((x0 - radius, y0 - radius, x0 + radius, y0 + radius), outline=PALE, width=2)
        _write(pen, f"{most_mm * ring / RINGS:.3f}", (x0 + 4, y0 - radius - 3), 16)
    for (x, y, _), colour in zip(calibration.errors_mm, colours, strict=True):
        pen.ellipse((x0 + x * scale - 7, y0 - y * scale - 7, x0 + x * scale + 7, y0 - y * scale + 7), fill=colour, outline=INK)
    _write(pen, "x and y off, mm, on the table", (EDGE, HEIGHT - 23), 20)


def _bars(pen: ImageDraw.ImageDraw, calibration: Calibration, colours: Sequence[tuple[int, ...]], most_mm: float) -> None:
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
