"""Travel: how the tip gets from one stroke to the next: pulling back with a wipe, lifting, crossing, priming."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import dist

import numpy as np

from machine.planning import limits
from machine.planning.lift import clear_height_mm
from machine.planning.moves import Move, Retract, Travel, Wipe
from mdp.clearance import Standing
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.errors import MoveError
from profiles.profile import Profile
from slicer.geometry.polyline import length_mm
from slicer.paths import Layer, Path
from slicer.strokes.speed import travel_mm_s2
from slicer.strokes.wiping import STANDING_MM, first_length, runs_round, wipe_trail

TO_AND_FRO = 4  # times at most that a wipe turns round on a lone stroke shorter than it


@dataclass
class Tip:
    """Where the tip is (machine X Y Z), how the table stands, how far the filament is pulled back.

    trail: (n, 3) a way that a wipe may go over; printed: strokes (n, 3) after it, each with its layer, its row there and the
    shift from the part frame, none from before a retraction. run_in_mm: filament that the next strokes inside are to push beyond
    their own. limb: while a limb is printed, its part number and what stands beside it.
    """

    at_mm: Floats
    pose: Pose
    retracted_mm: float = 0.0
    prime_extra_mm: float = 0.0
    run_in_mm: float = 0.0
    trail: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    printed: list[tuple[Floats, Layer, int, Floats]] = field(default_factory=list)
    limb: tuple[int, Standing] | None = None

    def forget(self) -> None:
        """Nothing of what was printed is to be wiped over any more."""
        self.trail = self.trail[:0]
        self.printed.clear()

    def way_back(self, wipe_mm: float) -> Floats:
        """The way (n, 3) that a wipe may go from here, that long where there is as much."""
        trail, since = self.trail, list[tuple[Floats, Path, Floats]]()
        for points, layer, k, shift in reversed(self.printed):
            since.append((points, layer.path(k), shift))
            if _suffices(*since[-1][:2], wipe_mm):
                break
        for points, path, shift in reversed(since):
            trail = trail_after(points, path, trail, shift, wipe_mm)
        return trail


def to_path(tip: Tip, start: Floats, approach: Floats, retracts: bool, shift: Floats, profile: Profile) -> Iterator[Move]:
    """To a stroke's start: up to the layer first, then along the approach (k, 2); or pulled back and lifted, straight.

    Within a limb the filament is pulled back and the tip lifted wherever the head would meet what stands beside the limb.
    """
    if dist(start.tolist(), tip.at_mm.tolist()) <= STANDING_MM:
        return
    if retracts:
        yield from retract(tip, profile)
    lift = profile.process.lift_mm if retracts else 0.0
    over = max(float(start[2]), min(float(start[2]) + lift, profile.machine.z.limits_mm[1]))
    if tip.limb is not None:
        clear = _over_standing(tip, approach, start, shift, over, profile)
        if clear > over and not retracts:
            yield from retract(tip, profile)  # a wipe moves the tip
            clear = _over_standing(tip, approach, start, shift, over, profile)
        over = clear
    if abs(over - float(tip.at_mm[2])) > STANDING_MM:
        yield from go(tip, [*tip.at_mm[:2], over], profile)
    points = _way(tip, approach, start, over)
    if len(points) > 1:
        tip.at_mm = points[-1]
        yield Travel(points, travel_speed(profile), travel_mm_s2(profile))
    yield from go(tip, list(start), profile)
    tip.at_mm = start


def _way(tip: Tip, approach: Floats, start: Floats, over: float) -> Floats:
    """(n, 3) from the tip along the approach to above a path's start; a single point where the tip is there already."""
    if len(approach):
        between = np.column_stack([approach, np.full(len(approach), over)])
        points = np.array([tip.at_mm, *between, [*start[:2], over]])
        moving: Floats = points[np.concatenate([[True], np.linalg.norm(np.diff(points, axis=0), axis=1) > STANDING_MM])]
        return moving
    points = np.array([tip.at_mm.tolist(), [*start[:2].tolist(), over]])
    return points if dist(*points.tolist()) > STANDING_MM else points[:1]


def _over_standing(tip: Tip, approach: Floats, start: Floats, shift: Floats, over: float, profile: Profile) -> float:
    """Z at which the head clears what stands beside a limb on the way to a path's start: `over` where that is enough, else the
    least height that is, with the clearance beneath the nozzle, too."""
    assert tip.limb is not None
    (part, standing), way = tip.limb, _way(tip, approach, start, over)
    z_mm = clear_height_mm(standing, way[:, :2] - shift[:2], over - float(shift[2])) + float(shift[2])
    if z_mm <= over + STANDING_MM:
        return over
    z_mm, machine = z_mm + profile.machine.clearance_mm, profile.machine
    if z_mm > machine.z.limits_mm[1]:
        raise MoveError(
            f"part {part}: a way within it needs the tip at Z {z_mm:.1f} mm for the head to pass what stands beside the part, "
            f"{machine.name} allows at most {machine.z.limits_mm[1]:g} mm"
        )
    return z_mm


def go(tip: Tip, target: list[float], profile: Profile) -> Iterator[Move]:
    """A straight travel; straight up and down at the lift speed."""
    if dist(tip.at_mm.tolist(), target) > STANDING_MM:
        points = np.array([tip.at_mm, target], dtype=np.float64)
        upright = bool(np.all(np.abs(points[1, :2] - points[0, :2]) <= STANDING_MM))
        speed = lift_speed(profile) if upright else travel_speed(profile)
        speed = limits.travel_speed(points, speed, profile.machine)
        yield Travel(points, speed, travel_mm_s2(profile))
        tip.at_mm = points[1]


def travel_speed(profile: Profile) -> float:
    """mm/s that a travel across may have."""
    return min(profile.process.travel_speed_mm_s, profile.machine.x.speed_mm_s, profile.machine.y.speed_mm_s)


def lift_speed(profile: Profile) -> float:
    """mm/s that a travel straight up or down may have."""
    return min(profile.process.lift_speed_mm_s, profile.machine.z.speed_mm_s)


def retract(tip: Tip, profile: Profile) -> Iterator[Move]:
    """Pull back what is not yet pulled back, moving over what was just printed where there is any."""
    amount = profile.material.retract_mm - tip.retracted_mm
    if amount <= 0:
        return
    tip.retracted_mm += amount
    tip.prime_extra_mm = max(tip.prime_extra_mm, profile.material.retract_prime_extra_mm)
    way = first_length(tip.way_back(profile.material.wipe_mm), profile.material.wipe_mm)
    tip.forget()
    length = np.linalg.norm(np.diff(way, axis=0), axis=1)
    if len(way) < 2 or float(np.linalg.norm(way[0] - tip.at_mm)) > STANDING_MM:
        yield Retract(amount, filament_speed(profile))
        return
    speed = min(travel_speed(profile), float(length.sum()) * filament_speed(profile) / amount)
    yield Wipe(way, length * (amount / length.sum()), limits.travel_speed(way, speed, profile.machine))
    tip.at_mm = way[-1]


def prime(tip: Tip, profile: Profile) -> Iterator[Move]:
    """Push forward what was pulled back, and what is to be pushed beyond it."""
    amount = tip.retracted_mm + tip.prime_extra_mm
    if amount > 0:
        tip.retracted_mm = tip.prime_extra_mm = 0.0
        yield Retract(-amount, filament_speed(profile))


def filament_speed(profile: Profile) -> float:
    """mm/s at which filament is pulled back and pushed forward."""
    return min(profile.material.retract_speed_mm_s, profile.machine.extruder_speed_mm_s)


def _suffices(points: Floats, path: Path, wipe_mm: float) -> bool:
    """Whether what was printed before a stroke does not matter for a wipe after it."""
    return length_mm(points) >= wipe_mm if path.wiped else not runs_round(points, path.width_mm)


def trail_after(points: Floats, path: Path, before: Floats, shift: Floats, wipe_mm: float) -> Floats:
    """The way of a wipe of wipe_mm after a stroke (n, 3).

    Where the stroke is shorter it goes on, back over the way to its beginning, to the strokes before it in the layer; where
    there are none, to and fro. before: the way over those, from where the last of them ended; none after a retraction. Where
    it must not go over the stroke itself, it goes on over those at once.
    """
    if not path.wiped and not (len(before) and runs_round(points, path.width_mm)):
        return points[:0]
    trail = wipe_trail(points, path.width_mm) if path.wiped else points[[-1, 0]]
    if float(np.linalg.norm(points[-1] - points[0])) >= wipe_mm or length_mm(trail) >= wipe_mm:
        return trail
    if len(before) and abs(float(before[0, 2] - points[0, 2])) <= STANDING_MM:
        z = np.full(len(path.approach), points[0, 2])
        between = np.column_stack([path.approach.reshape(-1, 2) + shift[:2], z])[::-1]
        trail = np.vstack([trail, between, first_length(before, wipe_mm)])
    once = trail
    for _ in range(TO_AND_FRO):
        if length_mm(trail) >= wipe_mm:
            break
        once = once[::-1]
        trail = np.vstack([trail, once[1:]])
    return trail
