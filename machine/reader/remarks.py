"""Remarks: the comments from which a text tells its parts, layers and kinds of line."""

import re

from machine.gcode.line_text import begins_layer, begun_part
from machine.gcode.part_totals import KEY, read_totals
from machine.reader.parsed import Unheld
from machine.reader.state import Reader


def remark(reader: Reader, text: str) -> None:
    """What a comment says, the sign taken off: PrusaSlicer's words, Cura's LAYER and our own PART, CONTENTS and UNSUPPORTED."""
    text = text.strip()
    if begins_layer(text):
        reader.layer += 1
        reader.layers += 1
        return
    if part := begun_part(text):
        reader.part, reader.layer = part[0], 0
        reader.parts.append(reader.part)
        reader.announced = max(reader.announced, part[1])
        return
    key, colon, value = text.partition(":")
    if not colon:
        return
    if key == "TYPE":
        reader.type = reader.types.setdefault(value, len(reader.types))
    elif key == "WIDTH":
        reader.width = _positive(value)
    elif key == "HEIGHT":
        reader.height = _positive(value)
    elif key == KEY:
        totals = read_totals(value, reader.number, reader.part)
        if totals is not None:
            reader.part_totals.append(totals)
    elif key == "UNSUPPORTED":
        area, _, rest = value.partition("@")
        layer, _, reason = rest.partition(" ")
        worst = int(layer) if re.fullmatch("[0-9]{1,6}", layer) else 0
        reader.unsupported.append(Unheld(reader.number, reader.part, _positive(area), worst, reason))


def _positive(text: str) -> float:
    """The number of a comment; 0 when it is none, for a comment must not stop a print."""
    return float(text) if re.fullmatch(r" *[0-9]{1,9}(?:\.[0-9]{1,12})? *", text) else 0.0
