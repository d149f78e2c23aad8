"""Duration: how long strokes and travels take with acceleration, on a machine like classic Marlin: no axis changes its speed at
once by more than the junction speed, and none accelerates faster than it may.
"""

from math import sqrt

from mdp.kernels.arrays import floats
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats

TINY = 1e-9  # mm, mm/s or a cosine, instead of a division by 0


@no_nrt
def trapezoid_s(length_mm: float, speed_mm_s: float, acceleration_mm_s2: float, v0: float, v1: float) -> float:
    """Seconds of a straight move from one speed to another: a trapezoid of speeds, or a triangle where it gets no faster."""
    peak = min(speed_mm_s, sqrt(0.5 * (v0 * v0 + v1 * v1) + acceleration_mm_s2 * length_mm))
    ramps_mm = (2.0 * peak * peak - v0 * v0 - v1 * v1) / (2.0 * acceleration_mm_s2)
    return float((2.0 * peak - v0 - v1) / acceleration_mm_s2 + max(0.0, length_mm - ramps_mm) / max(peak, TINY))


@kernel
def line_s(length_mm: float, speed_mm_s: float, acceleration_mm_s2: float, ends_mm_s: float) -> float:
    """Seconds of a straight line that is begun and ended at one speed."""
    ends = min(ends_mm_s, speed_mm_s)
    return trapezoid_s(length_mm, speed_mm_s, acceleration_mm_s2, ends, ends)


@kernel
def loop_s(loop: Floats, speed_mm_s: float, acceleration_mm_s2: float, junction_mm_s: float) -> float:
    """Seconds of a closed stroke round a loop (n, 2), from a stand at its first point to a stand there.

    acceleration_mm_s2: of each axis, so a slanting side may have up to the square root of two times as much.
    """
    n = len(loop)
    corner, ramp, length = floats(n + 1, 0.0), floats(n, 0.0), floats(n, 0.0)
    x, y = 0.0, 0.0
    for i in range(n):
        after = (i + 1) % n
        dx, dy = loop[after, 0] - loop[i, 0], loop[after, 1] - loop[i, 1]
        length[i] = max(sqrt(dx * dx + dy * dy), TINY)
        dx, dy = dx / length[i], dy / length[i]
        ramp[i] = acceleration_mm_s2 / max(abs(dx), abs(dy), TINY)
        if i > 0:
            corner[i] = min(speed_mm_s, junction_mm_s / max(abs(dx - x), abs(dy - y), TINY))
        x, y = dx, dy
    for i in range(n - 1, -1, -1):
        corner[i] = min(corner[i], sqrt(corner[i + 1] ** 2 + 2.0 * ramp[i] * length[i]))
    seconds = 0.0
    for i in range(n):
        corner[i + 1] = min(corner[i + 1], sqrt(corner[i] ** 2 + 2.0 * ramp[i] * length[i]))
        seconds += trapezoid_s(length[i], speed_mm_s, ramp[i], corner[i], corner[i + 1])
    return float(seconds)
