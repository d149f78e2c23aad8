"""Switching: findings about a firmware that is told to follow the table, or to leave it, while the table is turned."""

import numpy as np

from machine.dialects import DIALECTS
from machine.dryrun.findings import Finding, at_line
from machine.parsed import ParsedProgram
from profiles.machine import Machine

TURNED_DEG = 1e-3


def findings(program: ParsedProgram, machine: Machine) -> list[Finding]:
    """Marlin's G43.4 and G49 take another place for the present one and move nothing: beyond A0 C0 it is a wrong one."""
    dialect = DIALECTS[machine.dialect]
    if dialect.firmware != "Marlin":
        return []
    level = np.array([machine.tilt.zero_deg, machine.turn.zero_deg])
    found = []
    for event in program.events:
        if event.code not in (dialect.follow_on, dialect.follow_off) or event.row == 0:
            continue
        stands = program.end[event.row - 1, 3:5]
        if np.abs(stands - level).max() > TURNED_DEG:
            told = f"{machine.tilt.letter}{stands[0]:g} {machine.turn.letter}{stands[1]:g}"
            home = f"{machine.tilt.letter}{level[0]:g} {machine.turn.letter}{level[1]:g}"
            message = f"{event.code} while the table stands at {told}: Marlin loses the position; turn it to {home} first"
            found.append(at_line(program, event.row, event.line, "error", "following-switched", message))
    return found
