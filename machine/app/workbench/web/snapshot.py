"""Snapshot: what a page is told of the session, as JSON; the model's triangles as bytes of their own."""

from dataclasses import asdict
from functools import lru_cache
from hashlib import sha256
from typing import Any

import numpy as np

from machine.app.workbench.bench.bench import Bench, Model, overhang_mm2
from machine.app.workbench.bench.fit import standing
from machine.app.workbench.bench.marks import named_faces
from machine.app.workbench.bench.planes import Cuts
from machine.app.workbench.session.session import Session
from machine.app.workbench.web.slices import slices_told
from machine.view.front import front_record
from machine.view.parts import page_colours
from machine.view.scene import machine_bodies
from mdp.mesh import Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM, threshold
from mdp.plane import Plane
from mdp.plans.plan_file import ZONE_KINDS
from mdp.zone import Zone

MOST_FACES = 2_000_000  # that a page draws


def snapshot(session: Session) -> dict[str, Any]:
    """Everything but the triangles; small enough to be told whole whenever anything changes."""
    bench, history, search = session.bench, session.history, session.finding.search
    lifted = session.pedestal.now
    resting = session.resting[1] if session.resting is not None and session.resting[0] is bench.model else ()
    best = None if search is None else search.searched.best
    planes = [] if best is None else [_plane(plane) for plane in reversed(best.planes)]
    return {
        "version": session.version,
        "problem": session.problem,
        "answers": session.answers,
        "busy": session.busy,
        "preparing": session.readiness.preparing > 0,
        "undo": history.now.word if history.before else "",
        "redo": history.undone[-1].word if history.undone else "",
        "model": None if bench.model is None else _model(bench.model),
        "rotation": bench.rotation,
        "scale": bench.profile.process.scale,
        "standing": None
        if (stands := standing(bench)) is None
        else asdict(stands) | ({"problem": lifted.problem} if lifted else {}),
        "pedestal_mm": bench.profile.search.pedestal_mm,
        "pedestal": session.pedestal.key,
        "limit": threshold(bench.profile.process.self_supporting_angle_deg),
        "platform_mm": PLATFORM_TOLERANCE_MM,
        "overhang_mm2": lifted.overhang_mm2 if lifted else _overhang_mm2(bench),
        "resting": [
            {"rotation": each.rotation, "words": each.words, "overhang_mm2": each.overhang_mm2, "height_mm": each.height_mm}
            for each in resting
        ],
        "search": None if search is None else {"text": search.searched.text, "planes": planes},
        **slices_told(session),
        "front": [front_record(row) for row in bench.rows],
        "parts": bench.parts,
        "recommended": bench.recommended,
        "cuts": _cuts(bench.cuts or ()),
        "locked": [part in bench.locked for part in bench.cuts or ()],
        "trial": _trial(session),
        "zones": _zones(bench),
        "marks": marks_key(bench),
        "refused": asdict(session.trying.refused) if session.problem and session.trying.refused else None,
        "colours": page_colours(max([bench.parts, len(planes) + 1, *(row.parts for row in bench.rows)])),
        "notes": session.finding.notes if bench.rows else (),
        "given": asdict(bench.given),
        "part_settings": [{"part": each.part, "keys": list(each.process)} for each in bench.profile.parts],
        "priced": bench.priced,
        "stops": [asdict(stop) for stop in bench.stops],
        "copies": bench.copies,
        "machine": machine_bodies(bench.profile.machine, known=True),
        "benches": [asdict(each) for each in session.benches],
        "material": bench.profile.material.name,
        "process": bench.profile.process.name,
    }


def marks_key(bench: Bench) -> str:
    """What tells the faces that zones name from others: the page asks for them by it; "": they name none."""
    kinds = [[zone for zone in getattr(bench.zones, kind) if not isinstance(zone, Zone)] for kind in ZONE_KINDS]
    if bench.model is None or not any(kinds):
        return ""
    return sha256(repr((bench.model.key, bench.rotation, kinds)).encode()).hexdigest()[:16]


def marks(bench: Bench) -> bytes:
    """(m,) of each face of the model in which kinds of zones that are no boxes it is: a bit each, in their order."""
    bits = np.packbits(named_faces(bench), axis=0, bitorder="little")[0]
    return bytes(bits)


def _zones(bench: Bench) -> list[dict[str, Any]]:
    return [
        {"kind": kind, "number": number, **asdict(zone)}
        for kind in ZONE_KINDS
        for number, zone in enumerate(getattr(bench.zones, kind), start=1)
    ]


def triangles(mesh: Mesh) -> bytes:
    """Two counts as uint32, then vertices (n, 3) float32 in mm and faces (m, 3) uint32, all little-endian."""
    vertices, faces = mesh.vertices.astype("<f4"), mesh.faces.astype("<u4")
    return np.array([len(vertices), len(faces)], "<u4").tobytes() + vertices.tobytes() + faces.tobytes()


def _model(model: Model) -> dict[str, Any]:
    low, high = model.mesh.bounds_mm
    return {
        "key": model.key,
        "name": model.name,
        "faces": len(model.mesh.faces),
        "size_mm": (high - low).tolist(),
        "volume_mm3": model.mesh.volume_mm3,
        "notes": model.notes,
        "drawn": len(model.mesh.faces) <= MOST_FACES,
    }


def _trial(session: Session) -> dict[str, Any] | None:
    """The figures of the planes that were tried last, or why they cannot be cut."""
    if session.trying.trial is None or session.trying.trial[0].sought != session.bench.sought:
        return None
    _, cuts, trial = session.trying.trial
    return {"cuts": _cuts(cuts), **asdict(trial)}


def _cuts(cuts: Cuts) -> list[dict[str, Any]]:
    return [_plane(part.plane) for part in cuts if part.plane is not None]


def _plane(plane: Plane) -> dict[str, Any]:
    return {"normal": plane.normal.tolist(), "offset_mm": plane.offset_mm}


@lru_cache(maxsize=4)
def _overhang_mm2(bench: Bench) -> float:
    return overhang_mm2(bench)
