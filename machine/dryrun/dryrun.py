"""Dry run of a G-code text: plays it through the machine's kinematics."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.dryrun import clearance, extrusion, heat, interfaces, layering, motion, own_comments, placement, sequence
from machine.dryrun.findings import Finding, errors_of
from machine.dryrun.interfaces import InterfaceBalance, balance_of
from machine.dryrun.replay import Contacts, replay
from machine.dryrun.strokes import Beads, beads_of
from machine.gcode.lines import Lines
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from machine.planning.limits import axis_limits
from mdp.kernels.threads import ahead
from mdp.mesh import Floats
from profiles.errors import GcodeError
from profiles.messages import terminal_words
from profiles.profile import Profile
from slicer.paths import Kind

MOST_MM = 10_000.0  # five times the reach of the largest printers


@dataclass(frozen=True, eq=False)
class DryRun:
    """Result of a dry run: the program, its times, plastic and findings.

    times_s: (n,) seconds of each row of program; waits: line and seconds of each G4 and of heating during the print (heating
    before it and homing are not counted). deposited: its plastic. contacts: what was below each row; None if the findings were
    known in advance. interfaces: where parts stand on others; empty without contacts.
    """

    program: ParsedProgram
    times_s: Floats
    waits: tuple[tuple[int, float], ...]
    deposited: Beads
    contacts: Contacts | None
    findings: tuple[Finding, ...]
    letters: tuple[str, ...]
    filament_mm2: float
    interfaces: tuple[InterfaceBalance, ...] = ()

    @property
    def dwell_s(self) -> float:
        """Seconds of all waits."""
        return sum(seconds for _, seconds in self.waits)

    @property
    def time_s(self) -> float:
        """Seconds of all moves and waits."""
        return float(self.times_s.sum()) + self.dwell_s

    @property
    def segment_row(self) -> NDArray[np.int64]:
        """(m,) rows of the segments in program, which hold line, part, layer and type."""
        return self.deposited.rows

    @property
    def segment_mm3(self) -> Floats:
        """(m,) volumes of the segments."""
        return self.program.e_mm[self.deposited.rows] * self.filament_mm2

    @property
    def errors(self) -> tuple[Finding, ...]:
        """The findings because of which a print is refused."""
        return errors_of(self.findings)


def dry_run(lines: Iterable[str], profile: Profile, known: Sequence[Finding] | None = None) -> DryRun:
    """Read G-code lines and play them: times, deposited plastic, findings. Raises GcodeError for text that is not G-code.

    known: the findings of an earlier dry run of the same lines with the same profile, which are then reused.
    """
    machine, text = profile.machine, Lines.of(lines)
    program = parse_gcode(text, machine)
    _refuse_far_places(program)
    deposited = beads_of(program, np.flatnonzero(program.kind == MoveKind.EXTRUDE), profile)
    contacts = None
    balances: tuple[InterfaceBalance, ...] = ()
    if known is None:
        touching = ahead(_touching, program, deposited, profile)  # half of all work, on a separate core
        balances = tuple(map(balance_of, interfaces.interfaces(program, deposited, profile)))
        moving, of_program = _findings(text, program, deposited, balances, profile)
        times_s = motion.times_s(program, machine)
        contacts, touches = touching.result()
        problems = dict.fromkeys([*moving, *touches, *of_program])
        known = sorted(problems, key=lambda finding: (finding.severity, finding.line))
    else:
        times_s = motion.times_s(program, machine)
    dwells = [(event.line, event.value) for event in program.events if event.code == "G4"]
    return DryRun(
        program=program,
        times_s=times_s,
        waits=(*dwells, *heat.waits(program, times_s, machine)),
        deposited=deposited,
        contacts=contacts,
        findings=tuple(known),
        letters=tuple(axis_limits(machine)),
        filament_mm2=pi * profile.material.diameter_mm**2 / 4.0,
        interfaces=balances,
    )


def _touching(program: ParsedProgram, deposited: Beads, profile: Profile) -> tuple[Contacts, list[Finding]]:
    """The contacts of each row, and the findings about them."""
    contacts = replay(program, deposited, profile)
    return contacts, [*placement.findings(program, deposited, contacts), *layering.findings(program, deposited, contacts)]


def _findings(
    text: Sequence[str], program: ParsedProgram, deposited: Beads, balances: Sequence[InterfaceBalance], profile: Profile
) -> tuple[list[Finding], list[Finding]]:
    """The findings about the moves of a program, and about the rest of it."""
    moving = [*motion.findings(program, profile.machine), *clearance.findings(program, deposited, profile.machine)]
    of_program = [
        *extrusion.findings(program, deposited, profile),
        *interfaces.findings(program, balances, profile),
        *sequence.findings(program, profile),
        *own_comments.findings(text, program, profile),
        *placement.off_plate(program, deposited, profile),
        *placement.purged_into(program, deposited),
        *heat.findings(program, profile, own_comments.has_material(text, profile)),
    ]
    return moving, of_program


def _refuse_far_places(program: ParsedProgram) -> None:
    """Raise GcodeError for a damaged coordinate: checks sample along a move, which would take days."""
    if len(program.line) and np.abs(program.bounds[:, :3]).max() > MOST_MM:
        far = np.abs(program.end[:, :3])
        row = int(np.flatnonzero((far > MOST_MM).any(axis=1))[0])
        axis = int(far[row].argmax())
        place = f"{'XYZ'[axis]} comes to {program.end[row, axis]:g} mm"
        raise GcodeError(f"line {program.line[row]}: {place}: no printer reaches beyond {MOST_MM:g}")


class Timeline:
    """Axis positions and filament after any line of a program, the remaining time, and the number of layers of each part."""

    def __init__(self, run: DryRun) -> None:
        program, self._letters, self._waits = run.program, run.letters, run.waits
        self._line, self._ends, self._filament_mm = program.line, program.end, program.filament_mm
        self._done_s = np.concatenate([[0.0], np.cumsum(run.times_s)])
        laying = program.kind == MoveKind.EXTRUDE  # the travel to a part still belongs to the layer before it
        self._layers = {part: len(np.unique(program.layer[laying & (program.part == part)])) for part in program.parts}

    def at(self, file_line: int) -> dict[str, float]:
        """Axis positions after a line of the program, by letter, mm and deg; {} before the first move."""
        row = self._rows(file_line) - 1
        return {} if row < 0 else dict(zip(self._letters, self._ends[row].tolist(), strict=False))

    def filament_mm(self, file_line: int) -> float:
        """Filament pushed up to a line of the program, mm."""
        return float(np.max(self._filament_mm[: self._rows(file_line)], initial=0.0))

    def remaining_s(self, file_line: int) -> float:
        """Seconds of moves and waits after a line of the program, without heating before the print and homing."""
        waits_s = sum(wait_s for line, wait_s in self._waits if line > file_line)
        return float(self._done_s[-1] - self._done_s[self._rows(file_line)]) + waits_s

    def layers(self, part: int | None) -> int | None:
        """Number of layers of a part."""
        return None if part is None else self._layers.get(part)

    def _rows(self, file_line: int) -> int:
        """Number of moves up to a line."""
        return int(np.searchsorted(self._line, file_line, side="right"))


def retractions(program: ParsedProgram) -> int:
    """Number of retractions; several consecutive moves count as one."""
    pulled = program.e_mm[np.abs(program.e_mm) > 1e-9] < 0
    return int((pulled & ~np.concatenate([[False], pulled[:-1]])).sum()) if len(pulled) else 0


def _box(deposited: Beads, counted: NDArray[np.bool_]) -> list[list[float]]:
    """Least and greatest X Y Z of the counted beads; [] without any."""
    if not counted.any():
        return []
    least, most = np.full(3, np.inf), np.full(3, -np.inf)
    for some, box in deposited.boxes():
        if counted[some].any() and not counted[some].all():
            points = deposited.segments(some)[counted[some]].reshape(-1, 3)
            box = np.stack([points.min(axis=0), points.max(axis=0)])
        if counted[some].any():
            least, most = np.minimum(least, box[0]), np.maximum(most, box[1])
    return [least.tolist(), most.tolist()]


def reached(run: DryRun) -> dict[str, list[float]]:
    """The least and the greatest value of each axis, mm or deg, by its letter; [] where nothing moves."""
    program = run.program
    return {letter: program.bounds[:, k].tolist() if len(program.end) else [] for k, letter in enumerate(run.letters)}


def summary(run: DryRun) -> dict[str, Any]:
    """The figures of `simulate --json` and `export --json`."""
    program = run.program
    travels = (program.kind == MoveKind.TRAVEL) & (program.e_mm >= 0)  # a wipe retracts and does not count
    box = _box(run.deposited, ~program.rows_of_types(Kind.PURGE.value)[run.segment_row])
    return {
        "time_s": run.time_s,
        "filament_mm": float(np.max(program.filament_mm, initial=0.0)),
        "extruded_mm3": float(run.segment_mm3.sum()),
        "travel_mm": float(program.ways_mm()[travels].sum()),
        "layers": program.layers,
        "parts": len(program.parts),
        "reorientations": int((program.kind == MoveKind.ROTATE).sum()),
        "retractions": retractions(program),
        "bounds_mm": box,
        "axes": reached(run),
        "interfaces": [
            {
                "part": face.part,
                "area_mm2": face.area_mm2,
                "contact_share": face.contact,
                "plastic_over_room": face.over_room,
            }
            for face in run.interfaces
        ],
        "findings": [asdict(finding) | {"message": terminal_words(finding.message)} for finding in run.findings],
    }
