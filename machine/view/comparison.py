"""Comparison: what one way to print a model costs, to be held against other ways."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from machine.view.parts import page_colours
from mdp.decomposition import Decomposition, FrontRow


@dataclass(frozen=True)
class Alternative:
    """One way to print a model. risky_mm2: hanging faces that need support; unsupported_mm2: those that can get none; seam_mm:
    length of the seams between parts; interface_mm3: plastic that one piece would not have, by the part that stands
    there; findings: how many its dry run has; message: why it cannot be printed so, or ""."""

    name: str
    orientation: str
    parts: int
    time_s: float | None
    filament_mm: float | None
    filament_g: float | None
    support_mm3: float | None
    risky_mm2: float
    message: str = ""
    unsupported_mm2: float | None = None
    seam_mm: float = 0.0
    interface_mm3: Mapping[int, float] = field(default_factory=dict)
    findings: int = 0


def front_record(row: FrontRow) -> dict[str, Any]:
    """A row of a front as pages know it. planes: in print order, from part 2 on; why: of the chosen row, else ""."""
    return {
        "parts": row.parts,
        "support_area_mm2": row.support_area_mm2,
        "seam_mm": row.seam_mm,
        "cost_mm2": row.cost_mm2,
        "time_s": row.time_s,
        "filament_mm": row.filament_mm,
        "chosen": row.chosen,
        "why": row.reason,
        "planes": [{"normal": plane.normal.tolist(), "offset_mm": plane.offset_mm} for plane in reversed(row.planes)],
    }


def front_records(decomposition: Decomposition) -> list[dict[str, Any]]:
    """The rows of a front with the colours of their parts, and the command that takes each."""
    return [
        {
            **front_record(row),
            "colours": page_colours(row.parts),
            "command": f"tiltprint decompose {shlex.quote(decomposition.name)} --parts {row.parts}",
        }
        for row in decomposition.front
    ]
