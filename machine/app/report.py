"""Report: the tables that the commands print on stdout."""

import sys
from textwrap import wrap

import numpy as np
from numpy.typing import NDArray

from machine.app.pipeline import Decomposed
from machine.dryrun.agreement import Agreement
from machine.dryrun.dryrun import DryRun, summary
from mdp.decomposition import ORDER_TOLERANCE_MM, Decomposition, Part
from mdp.orientation import best_orientation, in_words
from mdp.overhang import risky_upright

WIDEST = 100  # characters of a line
KEPT = "\u00a0"  # a space at which no line ends


def duration(seconds: float) -> str:
    """Seconds as 1h 6m 15s."""
    whole = round(seconds)
    hours, minutes, rest = whole // 3600, whole // 60 % 60, whole % 60
    return f"{hours}h {minutes}m {rest}s" if hours else f"{minutes}m {rest}s" if minutes else f"{rest}s"


def table(rows: list[list[str]]) -> str:
    """Rows as right-aligned columns, the first column left-aligned."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines) + "\n"


def parts_table(found: Decomposed, angle_deg: float = 45.0, count_platform_faces: bool = False) -> str:
    """The parts in print order, what would be risky of their faces straight up and what is, and what the whole saves.

    angle_deg and count_platform_faces as the search had them.
    """
    decomposition = found.decomposition
    rows = [["part", "tilt deg", "turn deg", "base mm", "volume mm3", "share", "risky before", "after mm2"]]
    for part in decomposition.parts:
        angles = [f"{part.pose.tilt_deg:.1f}", f"{part.pose.turn_deg:.1f}", f"{part.base.offset_mm:.1f}"]
        share = f"{100 * part.volume_mm3 / decomposition.volume_mm3:.1f} %"
        areas = [_number(risky_before_mm2(part, angle_deg, count_platform_faces)), _number(part.risky_area_mm2)]
        rows.append([str(part.index), *angles, f"{part.volume_mm3:.0f}", share, *areas])
    told = f"{decomposition.candidates_evaluated} candidates in {decomposition.search_s:.1f} s\n"
    return table(rows) + "\n" + _compared(decomposition, angle_deg, count_platform_faces) + told


def risky_before(part: Part, angle_deg: float, count_platform_faces: bool) -> NDArray[np.bool_]:
    """(m,) what is risky of a part's own faces, the cut below it left out, when the model is printed straight up."""
    down = risky_upright(part.mesh, angle_deg, count_platform_faces)
    cut = np.all(np.abs(part.base.heights_mm(part.mesh.vertices))[part.mesh.faces] <= ORDER_TOLERANCE_MM, axis=1)
    return down & ~cut if part.index > 1 else down


def risky_before_mm2(part: Part, angle_deg: float, count_platform_faces: bool) -> float:
    """The area of those faces."""
    return float(part.mesh.areas_mm2[risky_before(part, angle_deg, count_platform_faces)].sum())


def _compared(decomposition: Decomposition, angle_deg: float, count_platform_faces: bool) -> str:
    """Straight up, in the best single orientation, in parts: risky area and how much less that is."""
    best = best_orientation(decomposition.mesh, angle_deg)
    single = best.risky_mm2 + (best.base_mm2 if count_platform_faces else 0.0)
    told = [
        ("straight up", decomposition.risky_area_mm2, ""),
        ("best single orientation", single, f"  {in_words(best)}"),
        (f"in {_count(len(decomposition.parts), 'parts')}", decomposition.residual_area_mm2, ""),
    ]
    rows = [["risky area", "mm2", "less"]]
    for name, area, _ in told:
        less = 1.0 - area / decomposition.risky_area_mm2 if decomposition.risky_area_mm2 > 0 else 0.0
        rows.append([name, _number(area), f"{round(100 * less, 1) + 0.0:.1f} %"])
    rows[1][2] = ""
    head, *lines = table(rows).splitlines()
    return "\n".join([head, *(line + note for line, (_, _, note) in zip(lines, told, strict=True))]) + "\n"


def _number(area_mm2: float) -> str:
    return f"{max(area_mm2, 0.0):.1f}"


def run_table(run: DryRun) -> str:
    """What a dry run found."""
    values = summary(run)
    lines = [
        f"time {duration(values['time_s'])}, filament {values['filament_mm'] / 1000:.2f} m, "
        f"{values['extruded_mm3'] / 1000:.2f} cm3",
        ", ".join(_count(values[key], key) for key in ("parts", "layers", "reorientations", "retractions"))
        + f", {values['travel_mm'] / 1000:.2f} m travel",
    ]
    if values["bounds_mm"]:
        low, high = (", ".join(f"{value:.1f}" for value in corner) for corner in values["bounds_mm"])
        lines.append(f"plastic from {low} to {high} mm (workpiece)")
    moved = [f"{axis} {reach[0]:.1f}..{reach[1]:.1f}" for axis, reach in values["axes"].items() if reach]
    lines.append("axes " + ", ".join(moved) if moved else "nothing moves")
    for finding in values["findings"]:
        where = f" (line{KEPT}{finding['line']})" if finding["line"] else ""
        lines += _wrapped(finding["severity"], finding["message"] + where)
    return "\n".join(lines) + "\n"


def _wrapped(severity: str, message: str) -> list[str]:
    """A finding in lines that can be read, the words after the severity below each other; keys of a profile stay whole."""
    indent = " " * len(f"{severity}: ")
    lines = wrap(message, WIDEST, initial_indent=f"{severity}: ", subsequent_indent=indent, break_long_words=False)
    return [line.replace(KEPT, " ") for line in lines]


def agreement_line(found: Agreement) -> str:
    """How the plastic agrees with the model."""
    told = (
        f"the beads fill {100 * found.filled:.1f} % of the model; of their length {100 * found.outside:.2f} % lie outside it "
        f"by more than half a line ({found.farthest_mm:.2f} mm at the worst), {100 * found.unsupported:.2f} % hang in air "
        f"and {100 * found.reported:.2f} % are marked overhang or bridge and do"
    )
    return "\n".join(wrap(told, WIDEST, subsequent_indent="  ")) + "\n"


def _count(number: int, things: str) -> str:
    return f"{number} {things if number != 1 else things.removesuffix('s')}"


def show(text: str) -> None:
    """A result on stdout."""
    sys.stdout.write(text)
    sys.stdout.flush()
