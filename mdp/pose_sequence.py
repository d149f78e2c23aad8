"""Pose sequence: the branch and the turn equivalent of every part's pose, chosen for the whole print."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import ceil, floor, hypot

from mdp.pose import SINGULAR, Pose, axis_rotation, unit
from profiles.machine import Machine

Fits = Callable[[int, Pose], bool]


def least_rotation(machine: Machine, options: Sequence[Sequence[Pose]], fits: Fits | None = None) -> list[Pose]:
    """One pose for every part so that tilt and turn together move least over the whole print, inside limits and cables.

    options: for every part the poses that reach its direction, at least one each; turn equivalents (whole turns) are
    added here, but not to the first part's, where the print begins. A part printed on the level table may keep the turn
    of the part before it, whatever that is, where fits(position in options, pose) is true (None: anywhere).
    Shortest path through the parts, so the result is the best of all combinations; where the cables are wound up, the
    turn back is part of the path.
    """
    states = [list(options[0])]
    for position, poses in enumerate(options[1:], start=1):
        here = _equivalents(machine, poses, len(options))
        here += [pose for pose in _keep_turn(machine, poses, states[-1], here) if fits is None or fits(position, pose)]
        states.append(here)
    cost = [0.0] * len(states[0])
    came_from: list[list[int]] = []
    for before, here in pairwise(states):
        steps = [min((cost[k] + rotation_deg(p, q), k) for k, p in enumerate(before)) for q in here]
        cost = [total for total, _ in steps]
        came_from.append([k for _, k in steps])
    state = min(range(len(cost)), key=cost.__getitem__)
    chosen = [states[-1][state]]
    for back, before in zip(reversed(came_from), reversed(states[:-1]), strict=True):
        state = back[state]
        chosen.append(before[state])
    return chosen[::-1]


def rotation_deg(a: Pose, b: Pose) -> float:
    """How far tilt and turn together move from one pose to the other."""
    return abs(a.tilt_deg - b.tilt_deg) + abs(a.turn_deg - b.turn_deg)


def _equivalents(machine: Machine, poses: Sequence[Pose], reach: int) -> list[Pose]:
    """The poses with whole turns added, inside the turn's limits and cables, at most `reach` turns from where they are."""
    least, most = machine.turn.reach_deg
    equivalents = []
    for pose in poses:
        low = max(ceil((least - pose.turn_deg) / 360.0 - 1e-9), -reach)
        high = min(floor((most - pose.turn_deg) / 360.0 + 1e-9), reach)
        equivalents += [Pose(pose.tilt_deg, pose.turn_deg + 360.0 * turns) for turns in range(low, high + 1)]
    return equivalents


def _keep_turn(machine: Machine, poses: Sequence[Pose], before: Sequence[Pose], known: Sequence[Pose]) -> list[Pose]:
    """The poses in which any turn serves, at each turn the part before may be printed at."""
    free = dict.fromkeys(pose.tilt_deg for pose in poses if _any_turn_serves(machine, pose))
    unturned = dict.fromkeys(Pose(tilt, pose.turn_deg) for tilt in free for pose in before)
    return [pose for pose in unturned if pose not in known]


def _any_turn_serves(machine: Machine, pose: Pose) -> bool:
    """True when the turn axis stands upright: turning does not change which direction of the workpiece is up."""
    x, y, _ = axis_rotation(machine.tilt, pose.tilt_deg) @ unit(machine.turn.axis)
    return hypot(x, y) < SINGULAR
