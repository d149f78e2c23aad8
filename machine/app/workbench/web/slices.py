"""Slices: what a page is told of slices under way, of those that are there, and of their comparison with one piece."""

from dataclasses import asdict
from typing import Any

from machine.app.workbench.session.session import Session
from machine.app.workbench.session.verdict import verdict_of
from machine.quantities import filament_g, price_in_words
from mdp.save import joint_values

MOST_FINDINGS = 50  # in the list; the page of the print has all


def slices_state(session: Session) -> dict[str, Any]:
    """The keys `slicing`, `sliced`, `comparing` and `compared` of the state."""
    return {
        "slicing": _under_way(session),
        "sliced": _sliced(session),
        "comparing": session.comparing.text,
        "compared": [
            {
                "name": alternative.name,
                "note": "; ".join(filter(None, (alternative.orientation, alternative.message))),
                "time_s": alternative.time_s,
                "filament_mm": alternative.filament_mm,
                "filament_g": alternative.filament_g,
                "costs": price_in_words(alternative.filament_mm or 0.0, session.bench.profile.material),
                "support_mm3": alternative.support_mm3,
                "support_area_mm2": alternative.risky_mm2,
                "seam_mm": alternative.seam_mm,
                "stairs_mm2": alternative.stairs_mm2,
                "findings": alternative.findings,
            }
            for alternative in session.comparing.rows()
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
    sliced, profile = slices.sliced, slices.bench.profile
    return {
        "key": sliced.key,
        "number": slices.number,
        "stale": session.slicing.out_of_date,
        "ready": sorted(slices.walls),
        "time_s": sliced.time_s,
        "filament_mm": sliced.filament_mm,
        "filament_g": filament_g(sliced.filament_mm, profile.material),
        "costs": price_in_words(sliced.filament_mm, profile.material),
        "verdict": asdict(verdict_of(sliced.findings, profile, sliced.cost.risky_mm2, out_of_date=session.slicing.out_of_date)),
        "joints": joint_values(sliced.cost.joints),
        "findings": [asdict(finding) for finding in sliced.findings[:MOST_FINDINGS]],
        "more_findings": max(len(sliced.findings) - MOST_FINDINGS, 0),
        "errors": [error.message for error in sliced.errors[:MOST_FINDINGS]],
    }
