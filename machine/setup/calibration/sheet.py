"""Sheet: a small TOML or CSV file for the readings of a calibration."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import Any

from machine.setup.calibration.fit import Touch
from machine.setup.calibration.program import TouchPlan
from machine.setup.files import check_row, number, quoted, read_document, rows_of
from mdp.pose import Pose
from profiles.errors import ProfileError, reason
from profiles.machine import Machine
from profiles.messages import option

COLUMNS = ("tilt_deg", "turn_deg", "x_mm", "y_mm", "z_mm", "on")
KEYS = ("machine", "mark_height_mm", "mark_angle_deg", "touch")
WHERE = ("mark", "plate")


@dataclass(frozen=True)
class Sheet:
    """The touches filled in, the mark's height, and its direction from the centre if known."""

    touches: tuple[Touch, ...]
    mark_height_mm: float
    mark_angle_deg: float | None = None
    machine: str | None = None


def sheet_text(name: str, machine: Machine, touches: TouchPlan) -> str:
    """An empty sheet for the touches of a calibration program; name: of the machine's profile."""
    lines = [
        f"# Calibration of {machine.name}: what the machine shows while the tip touches the mark, instead of each nan.",
        "# A touch that is left at nan is not used.",
        f"machine = {quoted(name)}",
        "# Height of the mark over the plate's surface, measured with a caliper.",
        f"mark_height_mm = {touches.mark_mm[2]:g}",
        "# Where the mark is seen from the middle, counted from the workpiece's +X towards +Y: turn.zero_deg is then found too.",
        "# mark_angle_deg = 0.0",
    ]
    for pose, (x, y, z) in zip(touches.poses, touches.expected_mm, strict=True):
        lines += [
            "",
            f"# {machine.tilt.letter}{pose.tilt_deg:g} {machine.turn.letter}{pose.turn_deg:g}: near {x:.1f} {y:.1f} {z:.1f}",
            "[[touch]]",
            f"tilt_deg = {pose.tilt_deg!r}",
            f"turn_deg = {pose.turn_deg!r}",
            "xyz_mm = [nan, nan, nan]",
        ]
    return "\n".join(lines) + "\n"


def read_sheet(path: Path, mark_height_mm: float | None = None) -> Sheet:
    """The sheet in a .toml or .csv file (columns tilt_deg, turn_deg, x_mm, y_mm, z_mm and optionally on: mark or plate).

    mark_height_mm overrides the file. Raises ProfileError naming the file and the touch, or a missing height of the mark.
    """
    document = _csv(path) if path.suffix.lower() == ".csv" else read_document(path, KEYS, "a calibration")
    touches = [_touch(path, f"touch {index}", row) for index, row in enumerate(rows_of(path, document, "touch"), start=1)]
    height = document.get("mark_height_mm") if mark_height_mm is None else mark_height_mm
    if height is None and not all(touch is None or touch.on_plate for touch in touches):
        raise ProfileError(f"{path}: the height of the mark is missing: {option('mark-height')} gives it in mm above the plate")
    angle, name = document.get("mark_angle_deg"), document.get("machine")
    return Sheet(
        tuple(touch for touch in touches if touch is not None),
        number(path, "mark_height_mm", height or 0.0),
        None if angle is None else number(path, "mark_angle_deg", angle),
        None if name is None else str(name),
    )


def _touch(path: Path, label: str, row: Mapping[str, Any]) -> Touch | None:
    """A touch; None if it is not filled in."""
    check_row(path, label, row, ("tilt_deg", "turn_deg", "xyz_mm", "on"))
    where = row.get("on", "mark")
    if where not in WHERE:
        raise ProfileError(f"{path}: {label}: on is {where!r}: it must be one of {', '.join(WHERE)}")
    at = row.get("xyz_mm")
    if not isinstance(at, list) or len(at) != 3 or not all(isinstance(x, int | float) for x in at):
        raise ProfileError(f"{path}: {label}: xyz_mm is {at!r}: it must be a list of three numbers")
    if any(isnan(x) for x in at):
        return None
    tilt, turn = (number(path, f"{label}: {key}", row.get(key)) for key in ("tilt_deg", "turn_deg"))
    x, y, z = (number(path, f"{label}: xyz_mm", value) for value in at)
    return Touch(Pose(tilt, turn), (x, y, z), where == "plate")


def _csv(path: Path) -> dict[str, Any]:
    """A CSV file as a document; an empty cell is a number not filled in."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise ProfileError(f"sheet {path} cannot be read: {reason(error)}") from None
    except (UnicodeDecodeError, csv.Error):
        raise ProfileError(f"sheet {path} is not a text file: CSV in UTF-8 is expected") from None
    missing = [name for name in COLUMNS[:5] if not rows or name not in rows[0]]
    if missing:
        raise ProfileError(f"{path}: the columns {', '.join(missing)} are missing: the first line must name {', '.join(COLUMNS)}")
    return {"touch": [_csv_row(path, index, row) for index, row in enumerate(rows, start=1)]}


def _csv_row(path: Path, index: int, row: Mapping[str, str | None]) -> dict[str, Any]:
    cells = {}
    for name in COLUMNS[:5]:
        text = (row[name] or "").strip()
        try:
            cells[name] = float(text) if text else float("nan")
        except ValueError:
            raise ProfileError(f"{path}: touch {index}: {name} is {text!r}: it must be a number") from None
    at = [cells[name] for name in COLUMNS[2:5]]
    return {"tilt_deg": cells["tilt_deg"], "turn_deg": cells["turn_deg"], "xyz_mm": at, "on": (row.get("on") or "mark").strip()}
