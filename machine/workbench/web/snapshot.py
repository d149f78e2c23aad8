"""Snapshot: the state of a session for its pages, as JSON: the bench, the slices and whether they can be printed."""

from collections.abc import Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from machine.dryrun.findings import Finding
from machine.planning.stops import Stop
from machine.program import Alternative
from machine.quantities import about, amount, duration, filament_g, newtons, percent, price_in_words
from machine.view.parts import front_record, page_colours
from machine.view.scene import machine_bodies
from machine.workbench.bench.bench import Bench, History, Step
from machine.workbench.bench.changes import Cuts
from machine.workbench.bench.model import Model
from machine.workbench.bench.page_words import page_words
from machine.workbench.bench.settings import settings_of
from machine.workbench.session.commands import Need, lacking
from machine.workbench.session.planes import pedestal_key
from machine.workbench.session.session import Session
from machine.workbench.work.models import Resting
from machine.workbench.work.plate import Plated
from mdp.joint import Joint
from mdp.overhang import PLATE_TOLERANCE_MM, threshold
from mdp.save import plane_values
from mdp.search.plan_file import ZONE_KINDS
from mdp.search.trial import Trial
from mdp.zone import AnyZone, Brushed, MeshVolume, Modifier, Zone
from profiles.machine import Table
from profiles.material import Material
from profiles.messages import advice, keys_in, option, settings_in
from profiles.places import OF_KIND
from profiles.profile import Profile

MOST_STEPS_LISTED = 30  # greatest number of listed steps that can be undone or redone
MOST_FINDINGS = 50  # in the list; the page of the print has all
MOST_FACES = 2_000_000  # limit for drawing
MODIFIER_MARGIN_MM = 3.0  # beyond the model's diagonal, to which the boxes of modifiers are shown
SAME_UP = 1e-6  # between the directions of two orientations that differ by a turn about z
# Text of a button, and its command.
SLICE_AGAIN = {"text": "Slice again", "command": {"do": "slice"}}
SUPPORT_ON = {"text": "Switch support on", "command": {"do": "set", "key": "process.support", "value": "auto"}}
NO_PURGE = {"text": "Print no purge line", "command": {"do": "set", "key": "machine.purge_mm", "value": "0"}}


def verdict_of(findings: Sequence[Finding], profile: Profile, hanging_mm2: float, *, out_of_date: bool) -> dict[str, Any]:
    """Whether slices with these findings and profile can be printed. hanging_mm2: area that needs support; out_of_date: the bench
    has changed since. `kind`: ready, problem or stale; `finding`: index of the finding that the text is about, -1: none;
    `remedy`: button that fixes it."""
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
        return verdict | {"text": f"Ready to print, but {amount(hanging_mm2, 0)} mm² would need support", "remedy": SUPPORT_ON}
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
    """Names and texts of an alternative's costs; dashes if it cannot be printed. The price is left out if unknown."""
    mm, support_mm3 = alternative.filament_mm or 0.0, alternative.support_mm3 or 0.0
    figures = {
        "time": about(alternative.time_s or 0.0),
        "plastic": f"{amount(filament_g(mm, material), 1)} g",
        "costs": price_in_words(mm, material),
        "support": f"{amount(support_mm3 / 1000.0)} cm³",
        "support marks": _mm2(alternative.risky_mm2),
        "seams between parts": f"{amount(alternative.seam_mm, 0)} mm",
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
    return f"{joint.part}", _mm2(joint.area_mm2), contact, plastic, f"{amount(joint.seam_mm, 0)} mm", f"{newtons(joint.load_n)} N"


def _mm2(area: float) -> str:
    return f"{amount(area, 1)} mm²"


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
            ("print time", duration(sliced.time_s)),
            (
                "filament",
                f"{amount(sliced.filament_mm / 1000.0)} m, {amount(filament_g(sliced.filament_mm, profile.material), 1)} g",
            ),
            *([("cost", costs)] if costs else []),
        ],
        "verdict": verdict_of(sliced.findings, profile, sliced.cost.risky_mm2, out_of_date=session.slicing.out_of_date),
        "joints": [_joint(joint) for joint in sliced.cost.joints],
        "findings": [asdict(each) | {"keys": ", ".join(keys_in(each.message))} for each in sliced.findings[:MOST_FINDINGS]],
        "more_findings": max(len(sliced.findings) - MOST_FINDINGS, 0),
        "errors": [error.message for error in sliced.errors[:MOST_FINDINGS]],
    }


def _gcode(session: Session) -> dict[str, Any] | None:
    """The G-code file that is open: its name, and whether it can be printed, in a sentence."""
    file = session.gcode
    if file is None:
        return None
    profile, note = file.known.profile, file.cost.message
    tried = f"; {note}, so it was tried for {profile.machine.name} as under Settings" if note else ""
    verdict = verdict_of(file.findings, profile, 0.0, out_of_date=False)["text"].removesuffix(" below")
    figures = f"{duration(file.time_s)}, {amount(file.filament_mm / 1000.0)} m of filament"
    return {"key": file.key, "name": file.cost.name, "told": f"{verdict}; {figures}{tried}"}


def snapshot(session: Session) -> dict[str, Any]:
    """Everything but the triangles; small enough to be sent as a whole at every change."""
    bench = session.bench
    return {
        "version": session.version,
        "problem": session.problem,
        "problems": session.problems,
        "answers": session.answers,
        "busy": session.busy,
        "note": session.note,
        "preparing": bool(session.readiness.progress),
        "unsliceable": session.unsliceable(),
        "lacking": {need: lacking(session, need) for need in Need if need != Need.NOTHING},
        "savable": _savable(session),
        **_steps(session.history),
        **_model_state(session),
        **_parts_state(session),
        **_marks_state(bench),
        **_plate_state(session),
        **slices_state(session),
        "gcode": _gcode(session),
        "given": asdict(bench.given),
        "material": bench.profile.material.name,
        "process": bench.profile.process.name,
        "machine": machine_bodies(bench.profile.machine, known=True),
        "benches": session.benches,
        "kept": session.keeping.released,
    }


def _steps(history: History) -> dict[str, Any]:
    """The steps that can be undone and redone."""
    undo, redo = (_words(steps) for steps in ((*history.before, history.now)[1:], history.undone))
    return {"undo": undo[0] if undo else "", "redo": redo[0] if redo else "", "steps": {"undo": undo, "redo": redo}}


def _model_state(session: Session) -> dict[str, Any]:
    """The model and its placement."""
    bench, standing = session.bench, session.standing.result
    return {
        "model": None if bench.model is None else _model(bench.model, session),
        "units": _units(session),
        "rotation": bench.rotation,
        "scale": bench.profile.process.scale,
        "standing": standing and {"size_mm": standing.size_mm, "problem": standing.problem},
        "overhang_mm2": standing and standing.overhang_mm2,
        "needing_mm2": session.trials.uncut.result,
        "pedestal_mm": bench.profile.search.pedestal_mm,
        "pedestal": pedestal_key(bench, standing),
        "limit": threshold(bench.profile.process.self_supporting_angle_deg),
        "platform_mm": PLATE_TOLERANCE_MM,
        "resting": _resting(session),
    }


def _parts_state(session: Session) -> dict[str, Any]:
    """The search, its front, and the planes on the bench."""
    bench, search = session.bench, session.finding.progress
    best = None if search is None else search.best
    planes = [] if best is None else [plane_values(plane) for plane in reversed(best.planes)]
    return {
        "search": None if search is None else {"text": search.text, "planes": planes},
        "front": [front_record(row) for row in bench.rows],
        "by_hand": session.by_hand.result and front_record(session.by_hand.result),
        "priced": bench.priced,
        "notes": [_note(note, bench) for note in bench.notes if bench.rows and advice("parts", bench.parts) not in note],
        "laid": _laid(session),
        "parts": bench.parts,
        "recommended": bench.recommended,
        "cuts": _cuts(bench.cuts or ()),
        "locked": [part in bench.locked for part in bench.cuts or ()],
        "invalid": [session.trials.invalid.get(part, "") for part in bench.cuts or ()],
        "trial": _trial(session),
        "refused": _refused(session),
        "colours": page_colours(max([bench.parts, len(planes) + 1, *(row.parts for row in bench.rows)])),
        "part_settings": [{"part": own.part, "keys": list(own.process)} for own in bench.profile.parts],
    }


def _plate_state(session: Session) -> dict[str, Any]:
    """All models on the plate, where they stand, and the pauses of their print."""
    bench, plated = session.bench, session.plated.result
    count = sum(each.copies for each in bench.plate)
    if count == 1:
        plated, told = Plated(), ""
    elif plated is None:
        told = f"Looking for places for all {count} on the plate …"
    else:
        told = (
            f"{plated.problem}. The models without a place are drawn in red."
            if plated.problem
            else f"All {count} stand on the plate."
        )
    return {
        "place_mm": bench.profile.process.place_mm,
        "copies": bench.copies,
        "copies_mm": plated and [[round(x, 3), round(y, 3)] for x, y in plated.copies_mm],
        "copies_told": told,
        "misplaced": plated is not None and plated.problem != "",
        "plate_told": _extent(bench.profile.machine.table),
        "beside": [_other(other) for other in bench.beside],
        "number": bench.number,
        "other_boxes": plated.other_boxes if plated else [],
        "others": plated and plated.others_key,
        "addable": session.addable,
        "stops": [_stop(stop) for stop in bench.stops],
    }


def _other(bench: Bench) -> dict[str, Any]:
    """Another model on the plate."""
    assert bench.model is not None
    return {"name": bench.model.name, "copies": bench.copies, "parts": bench.parts}


def _savable(session: Session) -> dict[str, tuple[str, str]]:
    """Each kind of file that can be saved: why it cannot be ("" if it can), and its description."""
    model, parts, cut, slices = (lacking(session, need) for need in (Need.MODEL, Need.PARTS, Need.CUT, Need.SLICES))
    latest, given = session.slicing.latest(), session.bench.given
    errors, compared = latest is not None and latest.sliced.errors, ", with the comparison" if session.comparing.rows() else ""
    entries = {
        "project": (model, "3MF with model, parts, marks and profiles, to open here or on another computer"),
        "plan": (parts, "orientation and cuts, to open here again"),
        "parts": (cut, "zip of an STL file for each part, a coloured 3MF and the plan"),
        "pictures": (cut, "zip of PNGs: the parts, the print order, every number of parts"),
        "gcode": (slices, "the dry run found errors: confirm before saving" if errors else "for the printer"),
        "page": (slices, f"one HTML file that opens anywhere{compared}"),
    }
    for kind in OF_KIND:
        name, count = Path(getattr(given, kind)).name, len(settings_of(given, kind))
        changes = f"{count} change{'s' * (count != 1)}"
        entries[kind] = ("" if count else f"no setting of {name} is changed", f"{name} with {changes}, to open here again")
    return entries


def _resting(session: Session) -> list[dict[str, Any]]:
    """The orientations in which the model rests, `present` where it does so now; its own first where it is none of them."""
    bench, standing, found = session.bench, session.standing.result, session.resting.result
    if not found:
        return []
    up = np.array(bench.rotation[2])
    rows = [asdict(rest) | {"present": bool(np.abs(rest.rotation[2] - up).max() < SAME_UP)} for rest in found]
    if standing is not None and not any(row["present"] for row in rows):
        now = Resting(bench.rotation, "as it lies now", standing.overhang_mm2, standing.size_mm[2])
        rows.insert(0, asdict(now) | {"present": True})
    return rows


def _words(steps: Sequence[Step]) -> list[str]:
    """The words of the last steps of a history, the latest first."""
    return [page_words(step.word) for step in steps[::-1][:MOST_STEPS_LISTED]]


def _stop(stop: Stop) -> dict[str, str]:
    where = f"at {stop.height_mm or 0.0:.12g} mm" if stop.layer is None else f"before layer {stop.layer}"
    return {"kind": "filament change" if stop.change else "pause", "where": f"part {stop.part}, {where}"}


def _extent(table: Table) -> str:
    """Sentence with the extent of the build plate."""
    x_mm, y_mm = (size / 2.0 for size in table.size_mm or (2.0 * table.radius_mm,) * 2)
    return f"The plate goes from −{x_mm:g} to {x_mm:g} mm along x, from −{y_mm:g} to {y_mm:g} mm along y."


def marks_key(bench: Bench) -> str:
    """Key of the faces that zones mark, by which the page requests them; "" if there are none."""
    kinds = [[zone for zone in getattr(bench.zones, kind) if not isinstance(zone, Zone)] for kind in ZONE_KINDS]
    if bench.model is None or not any(kinds):
        return ""
    return sha256(repr((bench.model.key, bench.rotation, kinds)).encode()).hexdigest()[:16]


def _marks_state(bench: Bench) -> dict[str, Any]:
    """The zones as the page shows them: a mesh by the box around it, brushed faces by their count alone."""
    zones = [
        {"kind": kind, "number": number, **_zone(zone)}
        for kind in ZONE_KINDS
        for number, zone in enumerate(getattr(bench.zones, kind), start=1)
    ]
    modifiers = [_modifier(modifier, bench.model) for modifier in bench.zones.modifiers]
    return {"zones": zones, "modifiers": modifiers, "marks": marks_key(bench)}


def _zone(zone: AnyZone) -> dict[str, Any]:
    if isinstance(zone, Brushed):
        return {"faces": sum(last + 1 - first for first, last in zone.ranges)}
    return asdict(zone.box if isinstance(zone, MeshVolume) else zone)


def _modifier(modifier: Modifier, model: Model | None) -> dict[str, Any]:
    """The box of a modifier (the bounding box of a mesh), limited to the model's surroundings, and its settings in words."""
    volume, given = modifier.volume, modifier.process.items()
    settings = ", ".join(option("set", f"process.{key}={value}") for key, value in given)
    if isinstance(volume, Zone):
        reach_mm = np.linalg.norm(model.size_mm) + MODIFIER_MARGIN_MM if model is not None else np.inf
        low, high = (np.clip(corner, -reach_mm, reach_mm).tolist() for corner in (volume.min_mm, volume.max_mm))
        return {"min_mm": low, "max_mm": high, "axes": volume.axes, "settings": settings}
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
        "remedies": [_remedy(settings) for note in model.notes if (settings := settings_in(note))],
        "plates": [{"number": number, "name": name, "taken": number == plate} for number, name in model.plates.items()],
        "has_settings": model.has_settings,
        "settings_note": note if key == model.key else "",
        "drawn": model.faces <= MOST_FACES,
    }


def _remedy(settings: Sequence[str]) -> dict[str, Any]:
    """The button that makes settings which a note proposes, as pairs of key and value."""
    words = " and ".join(page_words(advice("set", setting)) for setting in settings)
    return {"text": words[0].upper() + words[1:], "settings": [setting.split("=", 1) for setting in settings]}


def _trial(session: Session) -> dict[str, Any] | None:
    """The figures of the last trial, or why its planes cannot be cut."""
    if session.trials.trial is None or session.trials.trial[0].sought != session.bench.sought:
        return None
    _, cuts, trial = session.trials.trial
    figures = asdict(trial)
    rejected = {"refused": figures.pop("rejected"), "refused_part": figures.pop("rejected_part")}
    return {"cuts": _cuts(cuts), **figures, **rejected, "parts": [] if trial.rejected else _part_figures(session.bench, trial)}


def _part_figures(bench: Bench, trial: Trial) -> list[list[tuple[str, str]]]:
    """Names and texts of the figures of each part. The first part, which has no cut, has what the others leave."""
    others = [part for part in trial.parts if part is not None]
    volume_mm3 = 0.0 if bench.model is None else bench.model.volume_mm3 - sum(part.volume_mm3 for part in others)
    support_mm2 = (trial.support_area_mm2 or 0.0) - sum(part.support_mm2 for part in others)
    cut = [[("seam", f"{amount(part.rim_mm, 0)} mm"), ("cut edge", f"{part.edge_deg:.0f}°")] for part in others]
    whole = [(volume_mm3, support_mm2), *((part.volume_mm3, part.support_mm2) for part in others)]
    return [
        [("volume", f"{amount(volume / 1000.0)} cm³"), ("support", _mm2(support)), *own]
        for (volume, support), own in zip(whole, [[], *cut], strict=True)
    ]


def _refused(session: Session) -> dict[str, Any] | None:
    """The planes that were refused last, while their page shows the reason."""
    refused = session.trials.refused
    return asdict(refused) if refused is not None and refused.page in session.problems else None


def _note(note: str, bench: Bench) -> dict[str, Any]:
    """A note of the search. parts: the number of parts that it proposes, for a button in place of its last words; 0: none."""
    parts = next((row.parts for row in bench.rows if note.endswith(advice("parts", row.parts))), 0)
    return {"text": note.removesuffix(f": {advice('parts', parts)}"), "parts": parts}


def _laid(session: Session) -> dict[str, Any] | None:
    """Rotations before and after the last search, while its parts are current."""
    laid, bench = session.finding.laid, session.bench
    return {"before": laid[0], "after": laid[1]} if laid is not None and bench.rows and bench.rotation == laid[1] else None


def _units(session: Session) -> dict[str, Any] | None:
    """The possible units of a model, while its page is asked."""
    waits = session.unscaled
    return {"page": waits.page, "words": list(waits.units)} if waits is not None and waits.page in session.problems else None


def _cuts(cuts: Cuts) -> list[dict[str, Any]]:
    return [plane_values(part.plane) for part in cuts if part.plane is not None]
