"""Slices: what a page is told of slices under way, of those that are there, and of their comparison with one piece."""

from dataclasses import asdict
from typing import Any

from machine.program import Alternative
from machine.quantities import about, duration, filament_g, newtons, percent, price_in_words
from machine.workbench.session.session import Session
from machine.workbench.session.verdict import verdict_of
from mdp.joint import Joint
from profiles.material import Material

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
                "figures": _figures(alternative, session.bench.profile.material),
            }
            for alternative in session.comparing.rows()
        ],
    }


def _figures(alternative: Alternative, material: Material) -> list[tuple[str, str]]:
    """Names and texts of what an alternative costs; dashes where it cannot be printed. Without a price none is told."""
    mm, support_mm3 = alternative.filament_mm or 0.0, alternative.support_mm3 or 0.0
    figures = {
        "time": about(alternative.time_s or 0.0),
        "plastic": f"{filament_g(mm, material):.1f} g",
        "costs": price_in_words(mm, material),
        "of it support": f"{support_mm3 / 1000.0:.2f} cm³",
        "scars of support": _mm2(alternative.risky_mm2),
        "seams between parts": f"{alternative.seam_mm:.0f} mm",
        "stairs": _mm2(alternative.stairs_mm2),
        "findings": f"{alternative.findings}",
    }
    return [(name, text if alternative.time_s is not None else "–") for name, text in figures.items() if text]


def _joint(joint: Joint) -> tuple[str, ...]:
    """Part, area, contact, plastic, seam and load of a joint, as texts."""
    contact, plastic = (
        "–" if share is None else f"{percent(share, digits)} %"
        for share, digits in ((joint.contact_share, 1), (joint.plastic_over_room, 0))
    )
    return f"{joint.part}", _mm2(joint.area_mm2), contact, plastic, f"{joint.seam_mm:.0f} mm", f"{newtons(joint.load_n)} N"


def _mm2(area: float) -> str:
    return f"{max(area, 0.0):.1f} mm²"


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
    costs = price_in_words(sliced.filament_mm, profile.material)
    return {
        "key": sliced.key,
        "number": slices.number,
        "stale": session.slicing.out_of_date,
        "ready": sorted(slices.walls),
        "told": [
            ("takes", duration(sliced.time_s)),
            ("filament", f"{sliced.filament_mm / 1000.0:.2f} m, {filament_g(sliced.filament_mm, profile.material):.1f} g"),
            *([("costs", costs)] if costs else []),
        ],
        "verdict": asdict(verdict_of(sliced.findings, profile, sliced.cost.risky_mm2, out_of_date=session.slicing.out_of_date)),
        "joints": [_joint(joint) for joint in sliced.cost.joints],
        "findings": [asdict(finding) for finding in sliced.findings[:MOST_FINDINGS]],
        "more_findings": max(len(sliced.findings) - MOST_FINDINGS, 0),
        "errors": [error.message for error in sliced.errors[:MOST_FINDINGS]],
    }
