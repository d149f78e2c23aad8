"""Corner: how sharply a loop turns at one of its points, and to which side."""

import numpy as np

from mdp.kernels.kernel import part
from mdp.mesh import Floats

ARM_MM = 1.0  # a corner's angle is measured between points this far before and after it, so that noise is none
SMOOTH_DEG, SHARP_DEG = 20.0, 90.0  # from where on a turn hides a seam at all, and from where on it does so fully
SMOOTH_COSINE = float(np.cos(np.radians(SMOOTH_DEG)))


@part
def corner_strength(loop: Floats, i: int) -> float:
    """How much a corner the vertex of a loop (n, 2), solid on its left, is: 0 up to SMOOTH_DEG of turn, from SHARP_DEG on 1 where
    it is an inner one and -1 where it is an outer one."""
    px, py = _arm(loop, i, -1)
    qx, qy = _arm(loop, i, 1)
    bx, by, cx, cy = loop[i, 0] - px, loop[i, 1] - py, qx - loop[i, 0], qy - loop[i, 1]
    cross, dot = bx * cy - by * cx, bx * cx + by * cy
    if dot > SMOOTH_COSINE * np.hypot(bx, by) * np.hypot(cx, cy):
        return 0.0
    turn = np.degrees(np.arctan2(abs(cross), dot))
    strength = min((turn - SMOOTH_DEG) / (SHARP_DEG - SMOOTH_DEG), 1.0)
    return float(strength if cross < 0.0 else -strength)


@part
def _arm(loop: Floats, i: int, sense: int) -> tuple[float, float]:
    """The point ARM_MM along the loop from a vertex, forward or backward."""
    n, left, at = len(loop), ARM_MM, i
    for _ in range(n):
        ax, ay = loop[at % n, 0], loop[at % n, 1]
        dx, dy = loop[(at + sense) % n, 0] - ax, loop[(at + sense) % n, 1] - ay
        step = np.hypot(dx, dy)
        if step >= left:
            return ax + left / step * dx, ay + left / step * dy
        left -= step
        at += sense
    return loop[at % n, 0], loop[at % n, 1]
