"""Sequence: the branch and the turn equivalent of every part's pose, chosen for the whole print."""

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, floor

from mdp.pose import Pose
from profiles.machine import Machine


def least_rotation(machine: Machine, options: Sequence[Sequence[Pose]]) -> list[Pose]:
    """One pose for every part so that tilt and turn together move least over the whole print, limits kept.

    options: for every part the poses that reach its direction, at least one each; turn equivalents (whole turns) are
    added here, but not to the first part's, where the print begins. Shortest path through the parts, so the result is the
    best of all combinations.
    """
    states = [list(options[0]), *(_equivalents(machine, poses, len(options)) for poses in options[1:])]
    cost = [0.0] * len(states[0])
    came_from: list[list[int]] = []
    for before, here in pairwise(states):
        steps = [min((cost[k] + _rotation(p, q), k) for k, p in enumerate(before)) for q in here]
        cost = [total for total, _ in steps]
        came_from.append([k for _, k in steps])
    place = min(range(len(cost)), key=cost.__getitem__)
    chosen = [states[-1][place]]
    for back, before in zip(reversed(came_from), reversed(states[:-1]), strict=True):
        place = back[place]
        chosen.append(before[place])
    return chosen[::-1]


def _equivalents(machine: Machine, poses: Sequence[Pose], reach: int) -> list[Pose]:
    """The poses with whole turns added, inside the turn's limits and at most `reach` turns from its zero."""
    least, most = machine.turn.limits_deg
    found = []
    for pose in poses:
        low = max(ceil((least - pose.turn_deg) / 360.0 - 1e-9), -reach)
        high = min(floor((most - pose.turn_deg) / 360.0 + 1e-9), reach)
        found += [Pose(pose.tilt_deg, pose.turn_deg + 360.0 * turns) for turns in range(low, high + 1)]
    return found


def _rotation(a: Pose, b: Pose) -> float:
    return abs(a.tilt_deg - b.tilt_deg) + abs(a.turn_deg - b.turn_deg)
