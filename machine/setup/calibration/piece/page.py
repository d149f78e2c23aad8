"""Page: one HTML file on which the readings of a calibration piece are typed, drawn, and told as corrections."""

import json
from html import escape
from pathlib import Path

from machine.setup.calibration.piece.fit import BIAS_MM, READ_MM, USUAL, slope_of
from machine.setup.calibration.piece.pads import Piece
from machine.setup.calibration.piece.readings import HEIGHT_MM, MARK_MM
from mdp.directions.unit_vectors import frame_across
from mdp.pose import unit

TEMPLATE = Path(__file__).parent / "page.html"


def piece_page(piece: Piece, machine_name: str, file_name: str) -> bytes:
    """The page of a printed piece; machine_name and file_name are those of the command that saves the corrections.

    Its script solves the same least squares as `fit.correct`, with the slope at the profile's own numbers.
    """
    machine = piece.machine
    values = {
        "machine": machine_name,
        "file": file_name,
        "markMm": MARK_MM,
        "heightMm": HEIGHT_MM,
        "slope": slope_of(machine, piece).tolist(),
        "usual": USUAL.tolist(),
        "readMm": READ_MM.tolist(),
        "biasMm": BIAS_MM.tolist(),
        "turnMm": list(machine.turn.point_mm),
        "tiltMm": list(machine.tilt.point_mm),
        "acrossTilt": frame_across(unit(machine.tilt.axis)).tolist(),
        "zeroDeg": machine.tilt.zero_deg,
        "letters": [machine.turn.letter, machine.tilt.letter],
    }
    packed = json.dumps(values, allow_nan=False).replace("<", "\\u003c")
    text = TEMPLATE.read_text(encoding="utf-8")
    return text.replace("<!--TITLE-->", escape(f"{file_name} on {machine.name}")).replace("/*VALUES*/", packed).encode()
