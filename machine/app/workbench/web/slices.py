"""Slices: what a page is told of slices under way, of those that are there, and of their comparison with one piece."""

from dataclasses import asdict
from typing import Any

from machine.app.workbench.session.session import Session

MOST_FINDINGS = 50  # in the list; the page of the print has all


def slices_told(session: Session) -> dict[str, Any]:
    """The keys `slicing`, `sliced`, `comparing` and `compared` of the state."""
    return {
        "slicing": _under_way(session),
        "sliced": _sliced(session),
        "comparing": session.comparing.text,
        "compared": [
            {
                "name": each.name,
                "note": "; ".join(filter(None, (each.orientation, each.message))),
                "time_s": each.time_s,
                "filament_mm": each.filament_mm,
                "filament_g": each.filament_g,
                "support_mm3": each.support_mm3,
                "support_area_mm2": each.risky_mm2,
                "seam_mm": each.seam_mm,
                "findings": each.findings,
            }
            for each in session.comparing.rows()
        ],
    }


def _under_way(session: Session) -> dict[str, Any] | None:
    slicing = session.slicing.under_way
    if slicing is None:
        return None
    return {"text": slicing.text, "number": slicing.number, "shares": slicing.shares, "ready": sorted(slicing.walls)}


def _sliced(session: Session) -> dict[str, Any] | None:
    slices = session.slicing.latest()
    if slices is None:
        return None
    sliced = slices.sliced
    return {
        "key": sliced.key,
        "number": slices.number,
        "stale": session.slicing.out_of_date,
        "ready": sorted(slices.walls),
        "time_s": sliced.time_s,
        "filament_mm": sliced.filament_mm,
        "findings": [asdict(each) for each in sliced.findings[:MOST_FINDINGS]],
        "more_findings": max(len(sliced.findings) - MOST_FINDINGS, 0),
        "errors": [each.message for each in sliced.errors[:MOST_FINDINGS]],
    }
