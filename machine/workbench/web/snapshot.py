"""Snapshot: what a page is told of the session, as JSON."""

from dataclasses import asdict
from hashlib import sha256
from typing import Any

from machine.view.parts import front_record, page_colours
from machine.view.scene import machine_bodies
from machine.workbench.bench.bench import Bench
from machine.workbench.bench.model import Model
from machine.workbench.bench.page_words import in_page_words, page_words, with_page_words
from machine.workbench.bench.planes import Cuts
from machine.workbench.session.commands import Need, lacking
from machine.workbench.session.session import Session
from machine.workbench.web.slices import slices_state
from mdp.overhang import PLATFORM_TOLERANCE_MM, threshold
from mdp.save import plane_values
from mdp.search.plan_file import ZONE_KINDS
from mdp.zone import AnyZone, MeshVolume, Modifier, Zone

MOST_FACES = 2_000_000  # that a page draws
# The keys of the state that hold sentences.
SENTENCES = (
    *("problem", "problems", "answers", "busy", "stopped", "lacking", "notes", "standing", "resting", "copies_told"),
    *("search", "trial", "refused", "slicing", "sliced", "comparing", "compared"),
)


def snapshot(session: Session) -> dict[str, Any]:
    """Everything but the triangles, in the page's own words; small enough to be told whole whenever anything changes."""
    return with_page_words(_state(session), SENTENCES, session.names)


def _state(session: Session) -> dict[str, Any]:
    bench, history, search = session.bench, session.history, session.finding.search
    standing = session.standing.now
    resting = session.resting[1] if bench.model is not None and session.resting[0] == bench.model.key else ()
    best = None if search is None else search.searched.best
    planes = [] if best is None else [plane_values(plane) for plane in reversed(best.planes)]
    return {
        "version": session.version,
        "problem": session.problem,
        "problems": session.problems,
        "answers": session.answers,
        "busy": session.busy,
        "stopped": session.stopped,
        "preparing": session.readiness.preparing > 0,
        "lacking": {need: lacking(session, need) for need in Need if need != Need.NOTHING},
        "undo": history.now.word if history.before else "",
        "redo": history.undone[-1].word if history.undone else "",
        "model": None if bench.model is None else _model(bench.model, session),
        "rotation": bench.rotation,
        "scale": bench.profile.process.scale,
        "standing": standing and {"size_mm": standing.size_mm, "problem": standing.problem},
        "overhang_mm2": standing and standing.overhang_mm2,
        "pedestal_mm": bench.profile.search.pedestal_mm,
        "pedestal": session.standing.pedestal_key,
        "limit": threshold(bench.profile.process.self_supporting_angle_deg),
        "platform_mm": PLATFORM_TOLERANCE_MM,
        "resting": [asdict(rest) for rest in resting],
        "search": None if search is None else {"text": search.searched.text, "planes": planes},
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
        "benches": [asdict(bench) for bench in session.benches],
        "material": bench.profile.material.name,
        "process": bench.profile.process.name,
    }


def _copies_told(session: Session) -> str:
    """How many copies stand on the plate, or why they cannot."""
    standing, count = session.standing.now, session.bench.copies
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
    kinds = ((kind, enumerate(getattr(bench.zones, kind), start=1)) for kind in ZONE_KINDS)
    return [{"kind": kind, "number": number, **asdict(_shown(zone))} for kind, zones in kinds for number, zone in zones]


def _shown(zone: AnyZone) -> AnyZone:
    """A zone as the page shows it: a mesh by the box around it."""
    return zone.box if isinstance(zone, MeshVolume) else zone


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
        "notes": in_page_words(model.notes, session.names),
        "plates": [{"number": number, "name": name, "taken": number == plate} for number, name in model.plates.items()],
        "has_settings": model.has_settings,
        "settings_note": page_words(note, session.names) if key == model.key else "",
        "drawn": model.faces <= MOST_FACES,
    }


def _trial(session: Session) -> dict[str, Any] | None:
    """The figures of the planes that were tried last, or why they cannot be cut."""
    if session.trials.trial is None or session.trials.trial[0].sought != session.bench.sought:
        return None
    _, cuts, trial = session.trials.trial
    return {"cuts": _cuts(cuts), **asdict(trial)}


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
