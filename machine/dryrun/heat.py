"""Heat: findings about temperatures and flow, and about numbers nobody has measured."""

from math import pi

import numpy as np

from machine.dryrun.findings import Finding, at_line, per_part, unless_own
from machine.reader.parsed import MoveKind, ParsedProgram
from profiles.profile import Profile

MELTING_C = 150.0
SLACK = 1.005
ROUNDING_MM = 3e-3  # both ends are written to a thousandth, and a point dropped for that gives its filament to the next


def findings(program: ParsedProgram, profile: Profile) -> list[Finding]:
    """All findings about heat, flow and the profile."""
    return [
        *_cold(program),
        *_left_on(program),
        *_flow(program, profile),
        *_profile(program, profile),
        *_unknown_commands(program),
    ]


def _cold(program: ParsedProgram) -> list[Finding]:
    """Filament pushed while the nozzle has not been waited for, or its heater is off."""
    hot = np.zeros(len(program.line), dtype=np.bool_)
    heating = [e for e in program.events if e.code in ("M104", "M109")]
    warm = False
    for event in heating:
        warm = event.value >= MELTING_C and (warm or event.code == "M109")
        hot[event.row :] = warm
    rows = (program.e_mm > 1e-9) & ~hot
    if not rows.any():
        return []
    first = int(np.argmax(rows))
    waited_row = max((event.row for event in heating if event.row <= first), default=0)
    severity, unless = unless_own(program, waited_row, first)
    message = f"{{count}} moves push filament through a nozzle that is not hot: M109 S must come first and stay on{unless}"
    return per_part(program, rows, program.e_mm, severity, "cold-extrusion", message)


def _left_on(program: ParsedProgram) -> list[Finding]:
    problems = []
    extruding = np.flatnonzero(program.e_mm > 1e-9)
    last = int(extruding[-1]) if len(extruding) else -1  # a macro in the midst of the print ends nothing
    for codes, name, off in ((("M104", "M109"), "nozzle", "M104 S0"), (("M140", "M190"), "bed", "M140 S0")):
        events = [e for e in program.events if e.code in codes]
        if events and events[-1].value > 0:
            severity, unless = unless_own(program, max(events[-1].row, last + 1), len(program.line))
            message = f"the {name} heater stays at {events[-1].value:g} deg C after the end: {off} is missing{unless}"
            problems.append(at_line(program, events[-1].row, events[-1].line, severity, "heater-on", message))
    return problems


def _flow(program: ParsedProgram, profile: Profile) -> list[Finding]:
    """Plastic per second at the asked speed, against what the hot end melts."""
    material = profile.material
    rows = program.kind == MoveKind.EXTRUDE
    length = np.linalg.norm(program.end[:, :3] - program.start[:, :3], axis=1) + ROUNDING_MM
    area = pi * material.diameter_mm**2 / 4.0
    flow = program.e_mm * area / length * program.feed / 60.0
    most = material.volumetric_limit_mm3_s
    message = f"{{value}} mm3/s are asked for, {material.name} allows {most:g} mm3/s (moves: {{count}})"
    return per_part(program, rows & (flow > most * SLACK), flow, "warning", "flow", message)


def _profile(program: ParsedProgram, profile: Profile) -> list[Finding]:
    problems = []
    machine = profile.machine
    if machine.uncalibrated:
        count = len(machine.uncalibrated)
        which = f"{count} numbers of {machine.name} are" if count > 1 else f"one number of {machine.name} is"
        message = f"{which} in no source, measure them (docs/calibration.md): {', '.join(machine.uncalibrated)}"
        problems.append(Finding("warning", "uncalibrated", 0, 0, 0, message))
    for place in program.unsupported:
        where = f", most of them in layer {place.layer}" if place.layer else ""
        why = f": {place.reason}" if place.reason else ""
        message = f"{place.mm2:g} mm2 of risky faces of part {place.part} could be given no support{where}{why}"
        problems.append(Finding("warning", "unsupported", place.line, place.part, place.layer, message))
    return problems


def _unknown_commands(program: ParsedProgram) -> list[Finding]:
    return [
        Finding("warning", "ignored", line, 0, 0, f"{code} is not known to the dry run and was ignored{_times(count)}")
        for code, (line, count) in program.ignored.items()
    ]


def _times(count: int) -> str:
    return f", {count} times" if count > 1 else ""
