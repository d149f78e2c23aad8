"""Snapshot: the state of a session as its pages get it, as JSON: the bench, the slices and whether they can be printed."""

from collections.abc import Sequence
from dataclasses import asdict
from hashlib import sha256
from typing import Any

from machine.dryrun.findings import Finding
from machine.program import Alternative
from machine.quantities import about, duration, filament_g, newtons, percent, price_in_words
from machine.view.parts import front_record, page_colours
from machine.view.scene import machine_bodies
from machine.workbench.bench.bench import Bench
from machine.workbench.bench.changes import Cuts
from machine.workbench.bench.model import Model
from machine.workbench.session.commands import Need, lacking
from machine.workbench.session.planes import pedestal_key
from machine.workbench.session.session import Session
from mdp.joint import Joint
from mdp.overhang import PLATE_TOLERANCE_MM, threshold
from mdp.save import plane_values
from mdp.search.plan_file import ZONE_KINDS
from mdp.zone import MeshVolume, Modifier, Zone
from profiles.material import Material
from profiles.messages import terminal_words
from profiles.profile import Profile

MOST_FINDINGS = 50  # in the list; the page of the print has all
MOST_FACES = 2_000_000  # that a page draws
# What a button says, and the command of the workbench that it gives.
SLICE_AGAIN = {"text": "Slice again", "command": {"do": "slice"}}
SUPPORT_ON = {"text": "Switch support on", "command": {"do": "set", "key": "process.support", "value": "auto"}}
NO_PURGE = {"text": "Print no purge line", "command": {"do": "set", "key": "machine.purge_mm", "value": "0"}}


def verdict_of(findings: Sequence[Finding], profile: Profile, hanging_mm2: float, *, out_of_date: bool) -> dict[str, Any]:
    """Whether slices with these findings, made with this profile, can be printed. hanging_mm2: of faces that need support;
    out_of_date: the bench was changed since.

    `kind`: ready, problem or stale; `finding`: place in the list of the one that the text is about, -1: none; `remedy`: the
    button that does something about it."""
    verdict: dict[str, Any] = {"kind": "ready", "finding": -1, "remedy": None}
    if out_of_date:
        text = "Out of date: the workbench was changed since it was sliced"
        return verdict | {"kind": "stale", "text": text, "remedy": SLICE_AGAIN}
    errors = [k for k, finding in enumerate(findings) if finding.severity == "error"]
    if errors:
        count = "1 problem" if len(errors) == 1 else f"{len(errors)} problems, the first"
        first = findings[errors[0]]
        remedy = NO_PURGE if first.code == "purge" and profile.machine.purge_mm > 0.0 else None
        return verdict | {"kind": "problem", "text": f"{count}: {first.message}", "finding": errors[0], "remedy": remedy}
    process = profile.process
    if process.support == "none" and not process.spiral_vase and hanging_mm2 > process.support_least_mm2:
        return verdict | {"text": f"Ready to print, but {hanging_mm2:.0f} mm² would need support", "remedy": SUPPORT_ON}
    warnings = f"; {len(findings)} warning{'s' * (len(findings) > 1)} below" if findings else ""
    return verdict | {"text": f"Ready to print{warnings}"}


def slices_state(session: Session) -> dict[str, Any]:
    """The keys `slicing`, `sliced`, `comparing` and `compared` of the state."""
    return {
        "slicing": _under_way(session),
        "sliced": _sliced(session),
        "comparing": session.comparing.progress or "",
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
        "support": f"{support_mm3 / 1000.0:.2f} cm³",
        "support marks": _mm2(alternative.risky_mm2),
        "seams between parts": f"{alternative.seam_mm:.0f} mm",
        "stair-stepping": _mm2(alternative.stairs_mm2),
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
    slicing = session.slicing.progress
    if slicing is None:
        return None
    return {"text": slicing.text, "number": session.slicing.number, "shares": slicing.shares, "ready": sorted(slicing.walls)}


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
        "verdict": verdict_of(sliced.findings, profile, sliced.cost.risky_mm2, out_of_date=session.slicing.out_of_date),
        "joints": [_joint(joint) for joint in sliced.cost.joints],
        "findings": [asdict(finding) for finding in sliced.findings[:MOST_FINDINGS]],
        "more_findings": max(len(sliced.findings) - MOST_FINDINGS, 0),
        "errors": [error.message for error in sliced.errors[:MOST_FINDINGS]],
    }


def snapshot(session: Session) -> dict[str, Any]:
    """Everything but the triangles; small enough to be told whole whenever anything changes."""
    bench, history, search = session.bench, session.history, session.finding.progress
    standing = session.standing.result
    best = None if search is None else search.best
    planes = [] if best is None else [plane_values(plane) for plane in reversed(best.planes)]
    return {
        "version": session.version,
        "problem": session.problem,
        "problems": session.problems,
        "answers": session.answers,
        "busy": session.busy,
        "stopped": session.stopped,
        "preparing": bool(session.readiness.progress),
        "lacking": {need: lacking(session, need) for need in Need if need != Need.NOTHING},
        "undo": terminal_words(history.now.word) if history.before else "",
        "redo": terminal_words(history.undone[-1].word) if history.undone else "",
        "model": None if bench.model is None else _model(bench.model, session),
        "rotation": bench.rotation,
        "scale": bench.profile.process.scale,
        "standing": standing and {"size_mm": standing.size_mm, "problem": standing.problem},
        "overhang_mm2": standing and standing.overhang_mm2,
        "pedestal_mm": bench.profile.search.pedestal_mm,
        "pedestal": pedestal_key(bench, standing),
        "limit": threshold(bench.profile.process.self_supporting_angle_deg),
        "platform_mm": PLATE_TOLERANCE_MM,
        "resting": [asdict(rest) for rest in session.resting.result or ()],
        "search": None if search is None else {"text": search.text, "planes": planes},
        **slices_state(session),
        "front": [front_record(row) for row in bench.rows],
        "parts": bench.parts,
        "recommended": bench.recommended,
        "cuts": _cuts(bench.cuts or ()),
        "locked": [part in bench.locked for part in bench.cuts or ()],
        "trial": _trial(session),
        "zones": _zones(bench),
        "modifiers": [_modifier(modifier) for modifier in bench.zones.modifiers],
        "marks": marks_key(bench),
        "refused": _refused(session),
        "units": _units(session),
        "colours": page_colours(max([bench.parts, len(planes) + 1, *(row.parts for row in bench.rows)])),
        "notes": session.finding.notes if bench.rows else (),
        "laid": _laid(session),
        "given": asdict(bench.given),
        "part_settings": [{"part": own.part, "keys": list(own.process)} for own in bench.profile.parts],
        "priced": bench.priced,
        "stops": [asdict(stop) for stop in bench.stops],
        "copies": bench.copies,
        "copies_mm": standing and [[round(x, 3), round(y, 3)] for x, y in standing.copies_mm],
        "copies_told": _copies_told(session),
        "place_mm": bench.profile.process.place_mm,
        "machine": machine_bodies(bench.profile.machine, known=True),
        "benches": session.benches,
        "material": bench.profile.material.name,
        "process": bench.profile.process.name,
    }


def _copies_told(session: Session) -> str:
    """How many copies stand on the plate, or why they cannot."""
    standing, count = session.standing.result, session.bench.copies
    if standing is None or count == 1:
        return ""
    return standing.copies_problem or f"All {count} stand on the plate."


def marks_key(bench: Bench) -> str:
    """What tells the faces that zones name from others: the page asks for them by it; "": they name none."""
    kinds = [[zone for zone in getattr(bench.zones, kind) if not isinstance(zone, Zone)] for kind in ZONE_KINDS]
    if bench.model is None or not any(kinds):
        return ""
    return sha256(repr((bench.model.key, bench.rotation, kinds)).encode()).hexdigest()[:16]


def _zones(bench: Bench) -> list[dict[str, Any]]:
    """The zones as the page shows them: a mesh by the box around it."""
    return [
        {"kind": kind, "number": number, **asdict(zone.box if isinstance(zone, MeshVolume) else zone)}
        for kind in ZONE_KINDS
        for number, zone in enumerate(getattr(bench.zones, kind), start=1)
    ]


def _modifier(modifier: Modifier) -> dict[str, Any]:
    """The box of a modifier, that around one that is a mesh, and its settings in words."""
    volume, settings = modifier.volume, ", ".join(f"{key} = {value}" for key, value in modifier.process.items())
    if isinstance(volume, Zone):
        return {"min_mm": volume.min_mm, "max_mm": volume.max_mm, "axes": volume.axes, "settings": settings}
    low, high = volume.mesh.bounds_mm.tolist()
    return {"min_mm": low, "max_mm": high, "axes": None, "settings": f"{volume.file.name}: {settings}"}


def _model(model: Model, session: Session) -> dict[str, Any]:
    plate = model.plate or next(iter(model.plates), None)
    key, note = session.settings_note
    return {
        "key": model.key,
        "name": model.name,
        "faces": model.faces,
        "size_mm": model.size_mm,
        "volume_mm3": model.volume_mm3,
        "notes": model.notes,
        "plates": [{"number": number, "name": name, "taken": number == plate} for number, name in model.plates.items()],
        "has_settings": model.has_settings,
        "settings_note": note if key == model.key else "",
        "drawn": model.faces <= MOST_FACES,
    }


def _trial(session: Session) -> dict[str, Any] | None:
    """The figures of the planes that were tried last, or why they cannot be cut."""
    if session.trials.trial is None or session.trials.trial[0].sought != session.bench.sought:
        return None
    _, cuts, trial = session.trials.trial
    figures = asdict(trial)
    rejected = {"refused": figures.pop("rejected"), "refused_part": figures.pop("rejected_part")}
    return {"cuts": _cuts(cuts), **figures, **rejected}


def _refused(session: Session) -> dict[str, Any] | None:
    """The planes that were refused last, as long as the page that wanted them is told why."""
    refused = session.trials.refused
    return asdict(refused) if refused is not None and refused.page in session.problems else None


def _laid(session: Session) -> dict[str, Any] | None:
    """How the last search has found the model turned and how it has turned it, as long as its parts lie there."""
    laid, bench = session.finding.laid, session.bench
    return {"before": laid[0], "after": laid[1]} if laid is not None and bench.rows and bench.rotation == laid[1] else None


def _units(session: Session) -> dict[str, Any] | None:
    """The units of which one is that of a model, as long as the page that wanted it is asked."""
    waits = session.unscaled
    return {"page": waits.page, "words": list(waits.units)} if waits is not None and waits.page in session.problems else None


def _cuts(cuts: Cuts) -> list[dict[str, Any]]:
    return [plane_values(part.plane) for part in cuts if part.plane is not None]
