"""Dryrun: a G-code text played through the machine's kinematics, without a machine."""

from collections.abc import Iterable, Sequence
from concurrent.futures import Future
from dataclasses import asdict, dataclass
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.dryrun import clearance, extrusion, heat, layering, motion, own_comments, placement, sequence
from machine.dryrun.balance import interfaces
from machine.dryrun.balance.interfaces import InterfaceBalance
from machine.dryrun.findings import Finding
from machine.dryrun.replay import Contacts, replay
from machine.dryrun.strokes import Beads, beads_of
from machine.gcode.lines import Lines
from machine.kinematics.table import workpiece_path
from machine.planning.limits import axis_limits
from machine.reader.parse import parse_gcode
from machine.reader.parsed import MoveKind, ParsedProgram, pieces
from mdp.kernels.threads import ahead
from mdp.mesh import Floats
from profiles.errors import GcodeError
from profiles.machine import Machine
from profiles.profile import Profile
from slicer.paths import Kind

MOST_MM = 10_000.0  # five times what the largest printers reach


@dataclass(frozen=True, eq=False)
class DryRun:
    """What a G-code text does on a machine.

    times_s: (n,) seconds of each row of program; waits: line and seconds of what G4 tells and of heating in the midst of the
    print (what comes before it, and homing, are not counted).
    segments_mm: (m, 2, 3) deposited segments, workpiece frame; segment_row: (m,) their rows in program, which hold line,
    part, layer, type, width and height; segment_mm3: (m,) their volumes. contacts: what lay under each row; None where
    it was known before what there is to find. interfaces: where parts stand on others; none where contacts are not known.
    """

    program: ParsedProgram
    times_s: Floats
    waits: tuple[tuple[int, float], ...]
    segments_mm: Floats
    segment_row: NDArray[np.int64]
    segment_mm3: Floats
    contacts: Contacts | None
    findings: tuple[Finding, ...]
    letters: tuple[str, ...]
    interfaces: tuple[InterfaceBalance, ...] = ()

    @property
    def dwell_s(self) -> float:
        """Seconds of all waits."""
        return sum(seconds for _, seconds in self.waits)

    @property
    def time_s(self) -> float:
        """Seconds of all moves and dwells."""
        return float(self.times_s.sum()) + self.dwell_s

    @property
    def segment_type(self) -> list[str]:
        """The ;TYPE: name of each segment."""
        return [self.program.types[k] for k in self.program.type[self.segment_row]]

    @property
    def errors(self) -> tuple[Finding, ...]:
        """The findings that a print is refused for."""
        return tuple(finding for finding in self.findings if finding.severity == "error")


def dry_run(lines: Iterable[str], profile: Profile, known: Sequence[Finding] | None = None) -> DryRun:
    """Read G-code lines and play them: times, deposited plastic, findings. Raises GcodeError for what is not G-code.

    known: the findings of an earlier dry run of these very lines with this very profile, which are not looked for again.
    """
    machine, text = profile.machine, Lines.of(lines)
    program = parse_gcode(text, machine)
    _refuse_far_places(program)
    rows = np.flatnonzero(program.kind == MoveKind.EXTRUDE)
    segments = _segments(program, rows, machine)
    area = pi * profile.material.diameter_mm**2 / 4.0
    contacts = None
    balances: tuple[InterfaceBalance, ...] = ()
    if known is None:
        deposited = beads_of(program, segments, rows, profile)
        replayed = ahead(replay, program, deposited, profile)  # half of all work, on a core of its own
        balances = tuple(map(InterfaceBalance.of, interfaces.interfaces(program, deposited, profile)))
        known = _findings(text, program, Laid(deposited, replayed, balances), profile)
        contacts = replayed.result()
    times_s = motion.times_s(program, machine)
    dwells = [(event.line, event.value) for event in program.events if event.code == "G4"]
    return DryRun(
        program=program,
        times_s=times_s,
        waits=(*dwells, *heat.waits(program, times_s, machine)),
        segments_mm=segments,
        segment_row=rows,
        segment_mm3=program.e_mm[rows] * area,
        contacts=contacts,
        findings=tuple(known),
        letters=tuple(axis_limits(machine)),
        interfaces=balances,
    )


class Laid(NamedTuple):
    """What is deposited, what lies under it, as soon as that is replayed, and how its interfaces are filled."""

    deposited: Beads
    replayed: Future[Contacts]
    interfaces: tuple[InterfaceBalance, ...]


def _segments(program: ParsedProgram, rows: NDArray[np.int64], machine: Machine) -> Floats:
    """(m, 2, 3) ends of rows in the workpiece frame; some at a time, for what it takes to turn them is ten times as much."""
    segments = np.empty((len(rows), 2, 3))
    for some in pieces(len(rows)):
        for side, places in enumerate((program.start, program.end)):
            segments[some, side] = workpiece_path(machine, places[rows[some]])
    return segments


def _findings(text: Sequence[str], program: ParsedProgram, laid: Laid, profile: Profile) -> list[Finding]:
    """What speaks against a program, the worst first."""
    deposited, replayed, balances = laid
    segments, rows = deposited.segments_mm, deposited.rows
    moving = [*motion.findings(program, profile.machine), *clearance.findings(program, segments, rows, profile.machine)]
    of_program = [
        *extrusion.findings(program, deposited, profile),
        *interfaces.findings(program, balances, profile),
        *sequence.findings(program, profile),
        *own_comments.findings(text, program, profile),
        *placement.off_plate(program, segments, rows, profile),
        *placement.purged_into(program, deposited),
        *heat.findings(program, profile, own_comments.has_material(text, profile)),
    ]
    contacts = replayed.result()
    touching = [*placement.findings(program, deposited, contacts), *layering.findings(program, deposited, contacts)]
    findings = [*moving, *touching, *of_program]
    return sorted(dict.fromkeys(findings), key=lambda finding: (finding.severity, finding.line))


def _refuse_far_places(program: ParsedProgram) -> None:
    """What is tried along a move takes as long as the move: one of a damaged number would be tried for days."""
    far = np.abs(program.end[:, :3])
    rows = np.flatnonzero((far > MOST_MM).any(axis=1))
    if len(rows):
        row, axis = rows[0], int(far[rows[0]].argmax())
        place = f"{'XYZ'[axis]} comes to {program.end[row, axis]:g} mm"
        raise GcodeError(f"line {program.line[row]}: {place}: no printer reaches beyond {MOST_MM:g}")


def retractions(program: ParsedProgram) -> int:
    """How often filament is pulled back; pulled in several moves that follow each other counts once."""
    pulled = program.e_mm[np.abs(program.e_mm) > 1e-9] < 0
    return int((pulled & ~np.concatenate([[False], pulled[:-1]])).sum()) if len(pulled) else 0


def summary(run: DryRun) -> dict[str, Any]:
    """The figures of `simulate --json` and `export --json`."""
    program = run.program
    travels = (program.kind == MoveKind.TRAVEL) & (program.e_mm >= 0)  # a wipe, which pulls back, is none
    points = run.segments_mm[~program.rows_of_types(Kind.PURGE.value)[run.segment_row]].reshape(-1, 3)
    return {
        "time_s": run.time_s,
        "filament_mm": float(np.max(program.filament_mm, initial=0.0)),
        "extruded_mm3": float(run.segment_mm3.sum()),
        "travel_mm": float(program.way_mm[travels].sum()),
        "layers": program.layers,
        "parts": len(program.parts),
        "reorientations": int((program.kind == MoveKind.ROTATE).sum()),
        "retractions": retractions(program),
        "bounds_mm": [points.min(axis=0).tolist(), points.max(axis=0).tolist()] if len(points) else [],
        "axes": {
            letter: [float(program.end[:, k].min()), float(program.end[:, k].max())] if len(program.end) else []
            for k, letter in enumerate(run.letters)
        },
        "interfaces": [
            {
                "part": face.part,
                "area_mm2": face.area_mm2,
                "contact_share": face.contact,
                "plastic_over_room": face.over_room,
            }
            for face in run.interfaces
        ],
        "findings": [asdict(finding) for finding in run.findings],
    }
