"""Scene: the spatial content of the page: surfaces of the parts, bodies and axes of the machine, positions of the findings."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import DryRun
from machine.dryrun.findings import Finding
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from machine.kinematics.table import workpiece_path
from machine.view.encoding import Column
from machine.view.parts import residual_faces, risky_before, risky_before_mm2
from mdp.decomposition import Decomposition, Part
from mdp.joint import Joint
from mdp.mesh import Floats
from mdp.pose import unit
from mdp.save import joint_values, plane_values
from profiles.axes import RotaryAxis
from profiles.machine import Machine
from profiles.messages import keys_in
from profiles.profile import Profile, with_labels

RESIDUAL, UPRIGHT = 1, 2  # bits of face_marks
FOOT_MM = 1e-3
MACHINES_OWN = frozenset({"axis-limit", "axis-speed", "collision", "contact", "off-plate", "uncalibrated"})


def surfaces(decomposition: Decomposition | None, profile: Profile) -> dict[str, Column]:
    """Vertices, faces and marks of all parts in print order; empty arrays for a G-code file."""
    parts = decomposition.parts if decomposition is not None else ()
    first = np.cumsum([0, *(len(part.mesh.vertices) for part in parts)])
    vertices = [part.mesh.vertices for part in parts]
    faces = [part.mesh.faces.astype(np.int64) + begin for part, begin in zip(parts, first, strict=False)]
    marks = [_marks(part, profile) for part in parts]
    return {
        "vertices": Column(np.concatenate([np.zeros((0, 3)), *vertices]), "i32", 0.001, delta=True),
        "faces": Column(np.concatenate([np.zeros((0, 3), dtype=np.int64), *faces]), "i32", delta=True),
        "face_marks": Column(np.concatenate([np.zeros(0), *marks]), "u8"),
    }


def _marks(part: Part, profile: Profile) -> NDArray[np.int64]:
    upright = risky_before(part, profile.process.self_supporting_angle_deg, profile.search.count_platform_faces)
    marks: NDArray[np.int64] = RESIDUAL * residual_faces(part, profile) + UPRIGHT * upright
    return marks


def solids(decomposition: Decomposition, profile: Profile, joints: Sequence[Joint]) -> list[dict[str, Any]]:
    """Header records of the parts: pose, base plane, joint and position in the surfaces."""
    angle, counted = profile.process.self_supporting_angle_deg, profile.search.count_platform_faces
    by_part = {joint["part"]: joint for joint in joint_values(joints)}
    records, vertex, face = [], 0, 0
    for part in decomposition.parts:
        ends = vertex + len(part.mesh.vertices), face + len(part.mesh.faces)
        centre, radius = _foot(part)
        base = plane_values(part.base) | {"centre_mm": centre.tolist(), "radius_mm": radius}
        records.append(
            {
                "index": part.index,
                "tilt_deg": part.pose.tilt_deg,
                "turn_deg": part.pose.turn_deg,
                "direction": part.direction.tolist(),
                "base": base,
                "volume_mm3": part.volume_mm3,
                "risky_before_mm2": risky_before_mm2(part, angle, counted),
                "risky_after_mm2": part.risky_area_mm2,
                "joint": by_part.get(part.index),
                "mesh": {"vertices": [vertex, ends[0]], "faces": [face, ends[1]]},
            }
        )
        vertex, face = ends
    return records


def _foot(part: Part) -> tuple[Floats, float]:
    """Centre and radius of a disc in the base plane that covers the part's contact face, or else the projection of the part."""
    heights = part.base.heights_mm(part.mesh.vertices)
    low = heights <= max(float(heights.min()), 0.0) + FOOT_MM
    flat = part.mesh.vertices[low] - heights[low, None] * part.base.normal
    centre: Floats = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    return centre, float(np.linalg.norm(flat - centre, axis=1).max())


def machine_bodies(machine: Machine, known: bool) -> dict[str, Any]:
    """The machine's axes and bodies, for the page to move."""
    return {
        "name": machine.name,
        "known": known,
        "shape": machine.shape,
        **{
            letter: {"limits_mm": list(axis.limits_mm)} for letter, axis in (("x", machine.x), ("y", machine.y), ("z", machine.z))
        },
        "tilt": _axis(machine.tilt),
        "turn": _axis(machine.turn),
        "tool_mm": list(machine.tool_mm),
        "table": machine.table.model_dump(mode="json"),
        "cradle": [box.model_dump(mode="json") for box in machine.cradle],
        "head": machine.head.model_dump(mode="json"),
    }


def _axis(axis: RotaryAxis) -> dict[str, Any]:
    kept = {"letter", "axis", "point_mm", "sign", "zero_deg", "limits_deg"}
    return axis.model_dump(mode="json", include=kept) | {"axis": unit(axis.axis).tolist()}


def relevant_findings(run: DryRun, known: bool) -> list[Finding]:
    """The findings in their order, without those that depend on the machine if that is not known."""
    return [finding for finding in run.findings if known or finding.code not in MACHINES_OWN]


def finding_records(run: DryRun, machine: Machine, known: bool, shown: NDArray[np.int64]) -> list[dict[str, Any]]:
    """The relevant findings for the page; row: the row that shows it, -1 for a finding about the whole print."""
    program = run.program
    records = []
    for finding in relevant_findings(run, known):
        row = _row(program, finding)
        shown_row = min(int(np.searchsorted(shown, row)), len(shown) - 1) if row < len(program.line) else -1
        points: dict[str, Any] = {"workpiece_mm": None, "machine_mm": None}
        if shown_row >= 0:
            at = program.end[row : row + 1]
            points = {"workpiece_mm": workpiece_path(machine, at)[0].tolist(), "machine_mm": at[0, :3].tolist()}
        records.append(
            {
                "severity": finding.severity, "code": finding.code, "message": with_labels(finding.message),
                "keys": ", ".join(keys_in(finding.message)),
                "line": finding.line, "part": finding.part, "layer": finding.layer, "row": shown_row,
            } | points
        )  # fmt: skip
    return records


def _row(program: ParsedProgram, finding: Finding) -> int:
    """Row of the finding's line, or of its layer's first stroke if the line is not in that; n for one about the whole print."""
    if finding.line <= 0:
        return len(program.line)
    row = int(np.searchsorted(program.line, finding.line))
    there = (program.part == finding.part) & (program.layer == finding.layer)
    if finding.layer > 0 and there.any() and not there[row : row + 1].any():
        strokes = np.flatnonzero(there & (program.kind == MoveKind.EXTRUDE))
        return int(strokes[0]) if len(strokes) else int(np.argmax(there))
    return row
