"""Starvation: findings about moves that a serial line cannot bring to the printer as fast as they are made.

When the line is too slow the printer first slows short moves down, then stops in mid-motion, and a blob is left there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import STANDSTILLS, DryRun
from machine.dryrun.feeding import played
from machine.dryrun.findings import Finding
from machine.dryrun.motion import deltas
from machine.dryrun.timeline import TINY, axis_accelerations, axis_speeds, lengths
from machine.parsed import ParsedProgram
from mdp.mesh import Floats
from profiles.errors import PrinterError
from profiles.machine import Machine

BITS = 10.0  # of a byte on the line: start, eight, stop
FRAME_BYTES = 6  # N, blank, *, two digits of the checksum, newline; the line's number comes on top
GREETING, DIGITS = 3, 5  # lines sent before the program; digits after which the numbers begin anew
BAUDS = (1200, 4_000_000)
FREE_BAUD = 1e12  # a line that takes no time


@dataclass(frozen=True, eq=False)
class Feeding:
    """What a line does to a program's n rows. slowed, stopped: (n,) whether the printer slowed the move down since too few were
    planned, and whether it had run dry before it although it need not have stood still; time_s: until the last one is over.
    """

    slowed: NDArray[np.bool_]
    stopped: NDArray[np.bool_]
    time_s: float


def check_baud(baud: int) -> None:
    """Raises PrinterError for a rate that no line has."""
    if not BAUDS[0] <= baud <= BAUDS[1]:
        raise PrinterError(f"--baud is {baud}: {BAUDS[0]} to {BAUDS[1]} is allowed, printers use 115200 or 250000")


def starved(run: DryRun, lines: Sequence[str], machine: Machine, baud: int) -> DryRun:
    """The dry run with a finding for every part that a line of so many bits a second starves."""
    slow, free = (feeding(run.program, lines, machine, rate) for rate in (baud, FREE_BAUD))
    rows = (slow.slowed & ~free.slowed) | (slow.stopped & ~free.stopped)
    found = _findings(run.program, rows, slow.stopped, run.times_s, baud)
    return replace(run, findings=tuple(sorted((*run.findings, *found), key=lambda finding: (finding.severity, finding.line))))


def _findings(
    program: ParsedProgram, rows: NDArray[np.bool_], stopped: NDArray[np.bool_], times_s: Floats, baud: int
) -> list[Finding]:
    found, marked = [], np.flatnonzero(rows)
    for part in np.unique(program.part[marked]):
        mine = marked[program.part[marked] == part]
        needed = 1.0 / max(float(np.median(times_s[mine])), TINY)
        stops = int(stopped[mine].sum())
        message = (
            f"{baud} baud bring {len(mine)} moves too late, {needed:.0f} lines/s are needed there: the printer slows down"
            f"{f' and stops {stops} times' if stops else ''}; a faster line or longer segments help"
        )
        row = int(mine[0])
        found.append(Finding("warning", "starvation", int(program.line[row]), int(part), int(program.layer[row]), message))
    return found


def feeding(program: ParsedProgram, lines: Sequence[str], machine: Machine, baud: float) -> Feeding:
    """Play a program's lines over a line and its blocks in the printer's planner."""
    moved = deltas(program)
    length, measure = lengths(moved)
    blocks = np.flatnonzero(measure < 3)
    moved, length, measure = moved[blocks], length[blocks], measure[blocks]
    share = np.abs(moved) / length[:, None]
    with np.errstate(divide="ignore"):
        speed = np.minimum(program.feed[blocks] / 60.0, (axis_speeds(machine) / share).min(axis=1))
        acceleration = (axis_accelerations(machine) / share).min(axis=1)
    acceleration = np.where(measure == 0, np.minimum(acceleration, program.acceleration[blocks]), acceleration)
    stop = np.zeros(len(program.line), dtype=np.bool_)
    stop[[event.row for event in program.events if event.code in STANDSTILLS and event.row < len(stop)]] = True
    halts = np.diff(np.cumsum(stop)[blocks], prepend=0) > 0
    own, ahead = _bytes(lines, program.line[blocks])
    flags = np.zeros((2, len(blocks)), dtype=np.bool_)
    time_s = played(
        moved / length[:, None], length, speed, acceleration, measure, halts, own, ahead,
        machine.receive_bytes - 1.0, BITS / baud, machine.junction_speed_mm_s, flags[0], flags[1],
    )  # fmt: skip
    whole = np.zeros((2, len(program.line)), dtype=np.bool_)
    whole[:, blocks] = flags
    return Feeding(whole[0], whole[1], float(time_s))


def _bytes(lines: Sequence[str], at: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """(m,) bytes on the wire of the line of each block, which stands in text line `at`, and of the lines since the block before.

    A further block of the same line (an arc's) has no bytes.
    """
    texts = (line.partition(";")[0].strip() for line in lines)
    letters = np.array([0, *(len(text) for text in texts)], dtype=np.float64)
    digits = np.minimum(np.floor(np.log10(np.cumsum(letters > 0) + GREETING)) + 1, DIGITS)
    sizes = np.where(letters > 0, letters + FRAME_BYTES + digits, 0.0)
    sums = np.cumsum(sizes)
    before = np.concatenate([[0], at[:-1]])
    first = at != before
    return np.where(first, sizes[at], 0.0), np.where(first, sums[at] - sizes[at] - sums[before], 0.0)
