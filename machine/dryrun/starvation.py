"""Starvation: findings about moves that a serial line cannot deliver as fast as they are printed.

When the line is too slow the printer first slows short moves down, then stops in mid-motion and leaves a blob. The planner is
Marlin's: at most 15 blocks, each as fast as those behind it let the machine stop; a block takes at least 20 ms while fewer than
half of the places are taken, so that the sender catches up; the first block of an idle machine waits for two.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import DryRun
from machine.dryrun.findings import Finding, at_row, by_part
from machine.dryrun.motion import standstills
from machine.firmware.firmware import BYTE_BITS, FRAME_BYTES, NUMBER_DIGITS
from machine.firmware.marlin import BUFSIZE, FIRST_MOVE_BLOCKS, FIRST_MOVE_DELAY_S, MIN_SEGMENT_S, PLANNED_BLOCKS
from machine.gcode.line_text import is_plain_move, read_line
from machine.gcode.reader.parsed import Indices32, ParsedProgram
from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices
from profiles.machine import Machine
from slicer.estimate.timing import TINY, Blocks, block_time, blocks_of, corner_speed

USUAL_FRAME_BYTES = FRAME_BYTES - 1  # most ASCII checksums, 0 to 127, have two digits; the line's number is added
GREETING = 3  # lines sent before the program
FREE_BAUD = 1e12  # a line that takes no time
OK_BYTES = float(len("ok N12345 P15 B3\n"))  # during which the printer reads nothing
NONE = -1


def find_starvation(run: DryRun, lines: Sequence[str], machine: Machine, baud: int) -> DryRun:
    """The dry run with a finding for every part that a serial line at a baud rate starves."""
    (slow, _), (free, _) = (feeding(run.program, lines, machine, rate) for rate in (baud, FREE_BAUD))
    rows = np.flatnonzero((slow & ~free).any(axis=0))
    problems = _findings(run.program, rows, slow[1], run.times_s, baud)
    return replace(run, findings=tuple(sorted((*run.findings, *problems), key=lambda finding: (finding.severity, finding.line))))


def _findings(program: ParsedProgram, rows: Indices, stopped: NDArray[np.bool_], times_s: Floats, baud: int) -> Iterator[Finding]:
    for mine in by_part(program, rows):
        needed = 1.0 / max(float(np.median(times_s[mine])), TINY)
        stops = int(stopped[mine].sum())
        message = (
            f"at {baud} baud {len(mine)} moves arrive late, {needed:.0f} lines/s are needed there: the printer slows down"
            f"{f' and stops {stops} times' if stops else ''}; a faster line or longer segments help"
        )
        yield at_row(program, int(mine[0]), "warning", "starvation", message)


def feeding(program: ParsedProgram, lines: Sequence[str], machine: Machine, baud: float) -> tuple[NDArray[np.bool_], float]:
    """Play a program's lines over a serial line and its blocks in the printer's planner.

    Returns (2, n) masks of rows that the printer slowed for lack of planned moves, and before which it ran dry without need; and
    the seconds until the last move is over.
    """
    accelerations = program.remarks.acceleration[program.remark]
    blocks, moving = blocks_of(program.changes(), program.feed / 60.0, standstills(program), machine, accelerations)
    own, ahead = _bytes(lines, program.line[moving])
    flags = np.zeros((2, len(own)), dtype=np.bool_)
    line = own, ahead, machine.receive_bytes - 1.0, BYTE_BITS / baud
    time_s = _play(blocks, line, machine.junction_speed_mm_s, flags[0], flags[1])
    whole = np.zeros((2, len(program.line)), dtype=np.bool_)
    whole[:, moving] = flags
    return whole, float(time_s)


def _bytes(lines: Sequence[str], at: Indices32) -> tuple[Floats, Floats]:
    """(m,) bytes on the wire of the line of each block, at text line `at`, and of the lines since the previous block.

    Further blocks of the same line (of an arc) have no bytes.
    """
    texts = (line if is_plain_move(line) else read_line(line).command for line in lines)
    letters = np.array([0, *(len(text) for text in texts)], dtype=np.float64)
    digits = np.minimum(np.floor(np.log10(np.cumsum(letters > 0) + GREETING)) + 1, NUMBER_DIGITS)
    sizes = np.where(letters > 0, letters + USUAL_FRAME_BYTES + digits, 0.0)
    sums = np.cumsum(sizes)
    before = np.concatenate([[0], at[:-1]])
    first = at != before
    return np.where(first, sizes[at], 0.0), np.where(first, sums[at] - sizes[at] - sums[before], 0.0)


@no_nrt
def _run(now: float, state: Floats, span: Indices, entry2: Floats, blocks: Blocks) -> None:
    """Begin and end the planner's blocks until now. state: [begin, duration, end speed, gate]; span: [current, last, first, end]
    block, NONE: none; entry2: (m + 1,) squares of the speeds at which blocks begin."""
    while True:
        if span[0] != NONE:
            end = state[0] + state[1]
            if end > now:
                return
            span[1], span[0] = span[0], NONE
            begin, v0 = end, state[2]
        else:
            begin, v0 = state[3], 0.0
        if span[2] == span[3] or begin > now:
            return
        i = span[2]
        span[2] += 1
        fastest2 = v0 * v0 + 2.0 * blocks.acceleration[i] * blocks.length[i]
        v1 = np.sqrt(min(entry2[span[2]] if span[2] < span[3] else 0.0, fastest2))
        state[0], state[1], state[2] = begin, block_time(blocks, i, v0, v1), v1
        span[0] = i


@no_nrt
def _wait_for_room(now: float, places: int, state: Floats, span: Indices, entry2: Floats, blocks: Blocks) -> float:
    """The time at which fewer than `places` blocks are planned."""
    _run(now, state, span, entry2, blocks)
    while span[3] - span[2] + (1 if span[0] != NONE else 0) >= places:
        now = max(now, state[0] + state[1] if span[0] != NONE else state[3])
        _run(now, state, span, entry2, blocks)
    return now


@kernel
def _play(
    blocks: Blocks, line: tuple[Floats, Floats, float, float], jerk: float, slowed: NDArray[np.bool_], stopped: NDArray[np.bool_]
) -> float:
    """Seconds until the last block is over; fills in the masks slowed and stopped (m,), and lowers some cruise speeds. line: (m,)
    bytes of the line of each block, (m,) of other lines before it, greatest bytes in flight, seconds per byte."""
    n, (own, ahead, ring, byte_s) = len(blocks.length), line
    corner2, taken, cruise, length = floats(n, 0.0), floats(n, 0.0), blocks.cruise, blocks.length
    state, span, entry2 = floats(4, 0.0), np.empty(4, np.int64), floats(n + 1, 0.0)
    span[0], span[1], span[2], span[3] = NONE, NONE, 0, 0
    sent, flight, oldest, now = 0.0, 0.0, 0, 0.0
    for i in range(n):
        flight += own[i]
        while oldest < i and (flight > ring or i - oldest >= BUFSIZE):
            flight -= own[oldest]
            oldest += 1
        begin = max(sent, taken[oldest - 1] + OK_BYTES * byte_s) if oldest > 0 else sent
        sent = begin + (ahead[i] + own[i]) * byte_s
        now = max(sent, now + OK_BYTES * byte_s) if own[i] > 0 else now
        if blocks.halts[i]:
            now = _wait_for_room(now, 1, state, span, entry2, blocks)
            span[1] = NONE
        now = _wait_for_room(now, PLANNED_BLOCKS, state, span, entry2, blocks)
        taken[i] = now
        queued = span[3] - span[2] + (1 if span[0] != NONE else 0)
        if 2 <= queued < PLANNED_BLOCKS // 2 + 1 and length[i] / cruise[i] < MIN_SEGMENT_S:
            seconds = length[i] / cruise[i]
            cruise[i] = length[i] / (seconds + 2.0 * (MIN_SEGMENT_S - seconds) / queued)
            slowed[i] = True
        if span[3] > span[2]:
            corner2[i] = corner_speed(blocks, i - 1, i, jerk) ** 2
        elif span[0] == NONE:
            stopped[i] = span[1] != NONE and corner_speed(blocks, span[1], i, jerk) > 0.0
            state[3] = now + FIRST_MOVE_DELAY_S
        span[3] = i + 1
        if span[3] - span[2] >= FIRST_MOVE_BLOCKS:
            state[3] = min(state[3], now)
        after2 = 0.0
        for k in range(i, span[2] - 1, -1):
            square = min(corner2[k], after2 + 2.0 * blocks.acceleration[k] * length[k])
            if square == entry2[k] and k < i:
                break
            entry2[k] = after2 = square
    return _wait_for_room(now, 1, state, span, entry2, blocks)
