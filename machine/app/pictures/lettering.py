"""Lettering: text on pictures, in the font that Pillow brings along, so that it is the same on every machine."""

import numpy as np
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from machine.app.pictures.raster import Image


def write_text(image: Image, text: str, left: float, baseline: float, height: float, grey: int) -> Image:
    """The image (h, w, 3) with a line of text. left, baseline: where it begins, height: of the font, all in pixels."""
    picture = Pillow.fromarray(image)
    ImageDraw.Draw(picture).text((left, baseline), text, (grey, grey, grey), ImageFont.load_default(height), anchor="ls")
    return np.asarray(picture)
