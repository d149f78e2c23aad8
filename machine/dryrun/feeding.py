"""Feeding: a program's blocks brought to the printer's planner by a serial line, one after the other.

The planner is Marlin's: at most 15 blocks, each as fast as those behind it let the machine stop; a block lasts at least 20 ms
while fewer than half of the places are taken, so that the sender catches up; the first block of an idle machine waits for two.
"""

import numpy as np

from mdp.kernel import floats, kernel, part

LINES = 4  # Marlin's BUFSIZE: more lines are never in flight
OK_BYTES = 17.0  # of `ok N12345 P15 B3`, during which the printer reads nothing
BLOCKS = 15  # of Marlin's BLOCK_BUFFER_SIZE 16 one place stays empty
SEGMENT_S = 0.02  # DEFAULT_MINSEGMENTTIME
DELIVER_S, DELIVER_BLOCKS = 0.1, 3  # BLOCK_DELAY_FOR_1ST_MOVE
NONE = -1


@part
def _corner2(direction, cruise, measure, before, after, jerk):  # type: ignore[no-untyped-def]
    """Square of the greatest speed at a corner: no axis changes its speed by more than `jerk`."""
    if measure[before] != measure[after]:
        return 0.0
    v = min(cruise[before], cruise[after])
    for k in range(6):
        change = abs(direction[after, k] - direction[before, k])
        if change * v > jerk:
            v = jerk / change
    return v * v


@part
def _run(now, state, span, entry2, cruise, acceleration, length):  # type: ignore[no-untyped-def]
    """Begin and end what begins and ends until now. state: [begin, duration, v1, gate]; span: [current, last, first, end]."""
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
        a, way = acceleration[i], length[i]
        v1 = np.sqrt(min(entry2[span[2]] if span[2] < span[3] else 0.0, v0 * v0 + 2.0 * a * way))
        peak = min(cruise[i], np.sqrt(0.5 * (v0 * v0 + v1 * v1) + a * way))
        ramps = (2.0 * peak * peak - v0 * v0 - v1 * v1) / (2.0 * a)
        state[0], state[1], state[2] = begin, (2.0 * peak - v0 - v1) / a + max(0.0, way - ramps) / peak, v1
        span[0] = i


@part
def _waited(now, places, state, span, entry2, cruise, acceleration, length):  # type: ignore[no-untyped-def]
    """The time from which on fewer than `places` blocks are planned."""
    _run(now, state, span, entry2, cruise, acceleration, length)
    while span[3] - span[2] + (1 if span[0] != NONE else 0) >= places:
        now = max(now, state[0] + state[1] if span[0] != NONE else state[3])
        _run(now, state, span, entry2, cruise, acceleration, length)
    return now


@kernel
def played(direction, length, speed, acceleration, measure, halts, own, ahead, ring, byte_s, jerk, slowed, stopped):  # type: ignore[no-untyped-def]
    """Seconds until the last block is over; slowed and stopped (n,) are filled in.

    direction (n, 6), length (n,), speed (n,), acceleration (n,) and measure (n,) of the blocks; halts (n,): all before it must
    be over; own (n,): bytes of its line, ahead (n,): bytes of other lines before that; ring: bytes in flight at most; byte_s:
    seconds of a byte.
    """
    n = len(length)
    cruise, entry2, corner2, taken = floats(n, 0.0), floats(n + 1, 0.0), floats(n, 0.0), floats(n, 0.0)
    state = floats(4, 0.0)
    span = np.empty(4, np.int64)
    span[0], span[1], span[2], span[3] = NONE, NONE, 0, 0
    sent, flight, oldest, now = 0.0, 0.0, 0, 0.0
    for i in range(n):
        cruise[i] = speed[i]
        flight += own[i]
        while oldest < i and (flight > ring or i - oldest >= LINES):
            flight -= own[oldest]
            oldest += 1
        begin = max(sent, taken[oldest - 1] + OK_BYTES * byte_s) if oldest > 0 else sent
        sent = begin + (ahead[i] + own[i]) * byte_s
        now = max(sent, now + OK_BYTES * byte_s) if own[i] > 0 else now
        if halts[i]:
            now = _waited(now, 1, state, span, entry2, cruise, acceleration, length)
            span[1] = NONE
        now = _waited(now, BLOCKS, state, span, entry2, cruise, acceleration, length)
        taken[i] = now
        queued = span[3] - span[2] + (1 if span[0] != NONE else 0)
        if 2 <= queued < BLOCKS // 2 + 1 and length[i] / cruise[i] < SEGMENT_S:
            seconds = length[i] / cruise[i]
            cruise[i] = length[i] / (seconds + 2.0 * (SEGMENT_S - seconds) / queued)
            slowed[i] = True
        if span[3] > span[2]:
            corner2[i] = _corner2(direction, cruise, measure, i - 1, i, jerk)
        elif span[0] == NONE:
            stopped[i] = span[1] != NONE and _corner2(direction, cruise, measure, span[1], i, jerk) > 0.0
            state[3] = now + DELIVER_S
        span[3] = i + 1
        if span[3] - span[2] >= DELIVER_BLOCKS:
            state[3] = min(state[3], now)
        after2 = 0.0
        for k in range(i, span[2] - 1, -1):
            square = min(corner2[k], after2 + 2.0 * acceleration[k] * length[k])
            if square == entry2[k] and k < i:
                break
            entry2[k] = after2 = square
    return _waited(now, 1, state, span, entry2, cruise, acceleration, length)
