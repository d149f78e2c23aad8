"""Report: the tables that the commands print on stdout."""

import sys

from machine.app.pipeline import Decomposed
from machine.dryrun.dryrun import DryRun, summary


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


def parts_table(found: Decomposed) -> str:
    """The parts in print order, and what they save."""
    decomposition = found.decomposition
    rows = [["part", "tilt deg", "turn deg", "base mm", "volume mm3", "risky mm2"]]
    for part in decomposition.parts:
        angles = [f"{part.pose.tilt_deg:.1f}", f"{part.pose.turn_deg:.1f}", f"{part.base.offset_mm:.1f}"]
        rows.append([str(part.index), *angles, f"{part.volume_mm3:.0f}", f"{part.risky_area_mm2:.1f}"])
    before, after = decomposition.risky_area_mm2, decomposition.residual_area_mm2
    return table(rows) + (
        f"risky area {before:.1f} mm2 printed straight up, {after:.1f} mm2 in {len(decomposition.parts)} parts: "
        f"{100 * decomposition.reduction:.1f} % less\n"
        f"{decomposition.candidates_evaluated} candidates in {decomposition.search_s:.1f} s\n"
    )


def run_table(run: DryRun) -> str:
    """What a dry run found."""
    values = summary(run)
    low, high = values["bounds_mm"] or ([0.0] * 3, [0.0] * 3)
    lines = [
        f"time {duration(values['time_s'])}, filament {values['filament_mm'] / 1000:.2f} m, "
        f"{values['extruded_mm3'] / 1000:.2f} cm3",
        f"{values['parts']} parts, {values['layers']} layers, {values['reorientations']} reorientations, "
        f"{values['retractions']} retractions, {values['travel_mm'] / 1000:.2f} m travel",
        "plastic from " + ", ".join(f"{a:.1f}" for a in low) + " to " + ", ".join(f"{b:.1f}" for b in high) + " mm (workpiece)",
        "axes " + ", ".join(f"{axis} {least:.1f}..{most:.1f}" for axis, (least, most) in values["axes"].items()),
    ]
    for finding in values["findings"]:
        where = f" (line {finding['line']})" if finding["line"] else ""
        lines.append(f"{finding['severity']}: {finding['message']}{where}")
    return "\n".join(lines) + "\n"


def show(text: str) -> None:
    """A result on stdout."""
    sys.stdout.write(text)
    sys.stdout.flush()
