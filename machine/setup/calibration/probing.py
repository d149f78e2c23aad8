"""Probing: calibrates a machine that senses contact, from the centre of one ball on the plate at many poses.

A least-squares fit with the known radius gives the centre from the heights at which the tip meets the ball from above. Each pose
is planned with the current estimate, so that the head meets nothing else.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import asin, degrees
from typing import Protocol

import numpy as np

from machine.kinematics.table import machine_points, workpiece_points
from machine.setup.calibration.fit import Touch, estimate, slope_of
from machine.setup.calibration.program import TILTS_DEG, clipped_head, safe_z_mm, steepest_tilts, turns_deg
from mdp.clearance import find_obstacle
from mdp.head import Ring, bodies, directions
from mdp.mesh import Floats
from mdp.pose import UP, Pose, level, rotation
from profiles.errors import MoveError, PrinterError
from profiles.frozen import Vector
from profiles.machine import Machine
from profiles.messages import option

ROUNDS = 30
SETTLED_MM = 1e-9
UNSURE_MM = 2.0  # possible depth of a place below its expected height
BESIDE_MM = 0.3  # between the ball and parts of the head that must not touch it
FAR_MM = 6.0  # a contact this far from its expected height is with something else
LIFT_MM = 2.0  # above the last contact, to seek the next one
AT_ONCE_MM = 0.05  # a contact this near to the start is false
AGREE_MM, MOST_TIMES = 0.03, 4  # agreement of two contacts at one place, and the most contacts
NEAR, WIDE = 0.2, 0.5  # shares of the ball's radius: distance from the expected centre for seeking and for measuring
DROP = 1.0 - (1.0 - WIDE**2) ** 0.5  # depth below the ball's top at that distance, of the radius
CENTRED = 0.1  # share of the radius: a centre this near to its expected place is measured well
STEP = 0.3  # share of the radius: greatest movement of the ball while a sign is unknown
SMALL = 0.2  # sine of the greatest such tilt
ROUGHLY = 3  # touches, with which positions are not yet predicted well
TELLING_MM = 0.5  # by which the better sign must be nearer
AROUND = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


@dataclass(frozen=True)
class Ball:
    """A ball on a post: radius, centre in the workpiece frame, radius of the post; mm."""

    radius_mm: float
    centre_mm: tuple[float, float, float]
    post_mm: float = 4.0


def contact_heights(centre_mm: Floats, radius_mm: float, flat_mm: float, places_mm: Floats) -> Floats:
    """(n,) Z at which a flat tip of radius flat_mm, centred at (n, 2) places, meets the ball; nan where it misses it.

    The edge of the flat nearest to the ball's centre touches first.
    """
    aside = np.maximum(np.hypot(*(places_mm - centre_mm[:2]).T) - flat_mm, 0.0)
    with np.errstate(invalid="ignore"):
        heights: Floats = centre_mm[2] + np.sqrt(radius_mm**2 - aside**2)
    return heights


def ball_centre(contacts_mm: Floats, radius_mm: float, flat_mm: float = 0.0, seek_flat: bool = False) -> Floats:
    """(3,) centre of the ball with (n, 3) contacts from above, n at least 3; flat_mm as in contact_heights.

    seek_flat: also fit the flat's radius, starting from flat_mm; n at least 4, one near the ball's centre. Raises PrinterError
    when no such ball fits.
    """
    numbers = np.array([*contacts_mm[:, :2].mean(axis=0), contacts_mm[:, 2].max() - radius_mm, flat_mm])
    count = 4 if seek_flat else 3

    def heights(numbers: Floats) -> Floats:
        return contact_heights(numbers[:3], radius_mm, numbers[3], contacts_mm[:, :2])

    for _ in range(ROUNDS):
        off, slope = contacts_mm[:, 2] - heights(numbers), slope_of(heights, numbers)[:, :count]
        if not (np.isfinite(off).all() and np.isfinite(slope).all()):
            break
        step = np.linalg.lstsq(slope, off, rcond=None)[0]
        numbers[:count] += np.clip(step, -0.3 * radius_mm, 0.3 * radius_mm)
        if np.abs(step).max() < SETTLED_MM:
            return numbers[:3]
    raise PrinterError(
        f"the contacts are not those of a ball {2.0 * radius_mm:g} mm in diameter: is it {option('ball-mm')}, firm and clean?"
    )


def find_in_the_way(machine: Machine, pose: Pose, ball: Ball, tips_mm: Floats, touches_by_nozzle: bool) -> str | None:
    """Why the tip cannot be at (n, 3) X Y Z, or between them, with the table at a pose; None if it can.

    touches_by_nozzle: the nozzle itself touches the ball.
    """
    low = tips_mm - [0.0, 0.0, UNSURE_MM]
    clipped = clipped_head(machine, ball.centre_mm)
    obstacle = find_obstacle(clipped, pose, workpiece_points(machine, pose, np.vstack([low, tips_mm])))
    return obstacle or _find_ball(clipped, pose, ball, tips_mm, touches_by_nozzle)


def _find_ball(machine: Machine, pose: Pose, ball: Ball, tips_mm: Floats, touches_by_nozzle: bool) -> str | None:
    """Sentence naming the body of the head that would meet the ball or its post at one of the places, or None."""
    tried = directions(rotation(machine, pose) @ UP)
    x, y, z = ball.centre_mm
    foot, centre = machine_points(machine, pose, np.array([[x, y, 0.0], [x, y, z]]))
    reaches = {"ball": tried @ centre + ball.radius_mm, "ball's post": np.maximum(tried @ foot, tried @ centre) + ball.post_mm}
    least = tried @ tips_mm.T
    for index, body in enumerate(bodies(machine)):
        if touches_by_nozzle and index == 0 and isinstance(body, Ring):
            continue
        for name, reach in reaches.items():
            if float((least + (body.least(tried) - reach)[:, None]).max(axis=0).min()) < BESIDE_MM:
                return f"the head's {body.name} would meet the {name}"
    return None


class Prober(Protocol):
    """A machine that moves and senses contact of its tip, or of a probe beside it, from above. Raises PrinterError."""

    def turn(self, pose: Pose) -> None:
        """Turn the table while the head stands still."""

    def rise(self, z_mm: float) -> None:
        """Move the tip to a height, also downward through free space."""

    def cross(self, x_mm: float, y_mm: float) -> None:
        """Move the tip over a place at constant height."""

    def seek(self, low_mm: float) -> float | None:
        """Lower the tip slowly until contact; returns its Z, None without contact down to low_mm."""


@dataclass(frozen=True)
class Probe:
    """A probe. offset_mm: from the nozzle's tip to the contact, 0 for the nozzle itself; flat_mm: radius of its flat end."""

    offset_mm: Vector = (0.0, 0.0, 0.0)
    flat_mm: float = 0.0

    @property
    def is_nozzle(self) -> bool:
        """Whether the nozzle itself touches."""
        return self.offset_mm[:2] == (0.0, 0.0)


@dataclass
class Measuring:
    """A measurement. machine: current estimate; touches: of the ball's centre so far; tell: receives a line for each step."""

    machine: Machine
    ball: Ball
    prober: Prober
    probe: Probe = Probe()
    tell: Callable[[str], None] = lambda text: None
    touches: list[Touch] = field(default_factory=list)
    contacts: int = 0
    _start: Machine = field(init=False)  # the profile's, with the signs known so far
    _mark: Vector = field(init=False)
    _above: float = field(init=False, default=0.0)  # height from which contact is sought

    def __post_init__(self) -> None:
        self._start, self._mark = self.machine, self.ball.centre_mm

    def run(self) -> list[Touch]:
        """Make all touches. Raises MoveError when no pose can be measured, PrinterError when probing fails."""
        home, turns = level(self.machine), turns_deg(self.machine)
        self._check(home, (self.machine,))
        self._add(home, self._visit(home, self._expected(home), NEAR))  # the ball's actual place
        self._tell_sign("turn", self._small_turn(home), np.array(self.touches[0].at_mm))
        across = Pose(home.tilt_deg, self._across_tilt(home))
        before = next((touch for touch in self.touches if touch.pose == across), None) or self._touch(across)
        self._tell_sign("tilt", self._small_tilt(before), np.array(before.at_mm))
        met = [touch.pose for touch in self.touches]
        for pose in (Pose(home.tilt_deg, turn_deg) for turn_deg in turns):
            if pose not in met:
                self._touch(pose)
        for tilt_deg in self._tilts():
            for pose in (Pose(tilt_deg, turn_deg) for turn_deg in turns):
                if obstacle := self._find_in_the_way(self.machine, pose):  # the estimate is better than when the tilt was chosen
                    self.tell(f"{self._name(pose)} is left out: {obstacle}")
                else:
                    self._touch(pose)
        self._rise(home)
        self.prober.turn(home)
        return self.touches

    def _tell_sign(self, axis: str, pose: Pose, before: Floats) -> None:
        """Find the sign of an axis by a small step from a measured pose."""
        given: Machine = self._start
        letter = getattr(given, axis).letter
        turned = [given.model_copy(update={axis: getattr(given, axis).model_copy(update={"sign": sign})}) for sign in (1, -1)]
        machines = [estimate(machine, self.touches, self._mark) for machine in turned]
        self._check(pose, [machine for machine, _ in machines])
        seen = self._visit(pose, before, NEAR)
        places = [machine_points(machine, pose, np.array([mark]))[0] for machine, mark in machines]
        off = [float(np.linalg.norm(place - seen)) for place in places]
        if abs(off[0] - off[1]) < TELLING_MM:
            raise PrinterError(
                f"a small step of {letter} does not show its sign, the ball has moved by {np.linalg.norm(seen - before):.2f} mm: "
                "does the axis turn, and does the ball stand away from it?"
            )
        self._start = turned[int(off[1] < off[0])]
        self._add(pose, seen)

    def _small_turn(self, home: Pose) -> Pose:
        """A turn so small that the ball is still met at its old place, in either direction."""
        step = degrees(STEP * self.ball.radius_mm / float(np.hypot(*self.ball.centre_mm[:2])))
        return Pose(home.tilt_deg, home.turn_deg + (step if home.turn_deg + step <= self.machine.turn.reach_deg[1] else -step))

    def _small_tilt(self, before: Touch) -> Pose:
        home, arm = before.pose, np.array(before.at_mm) - np.array(self.machine.tilt.point_mm)
        step = degrees(asin(min(SMALL, STEP * self.ball.radius_mm / float(np.linalg.norm(arm)))))
        above = home.tilt_deg + step <= self.machine.tilt.reach_deg[1]
        return Pose(home.tilt_deg + (step if above else -step), home.turn_deg)

    def _across_tilt(self, home: Pose) -> float:
        """The turn at which the ball is farthest from the tilt axis, so that a tilt raises or lowers it."""
        along, point = np.array(self.machine.tilt.axis), np.array(self.machine.tilt.point_mm)
        arms = {turn: self._expected(Pose(home.tilt_deg, turn)) - point for turn in turns_deg(self.machine)}
        return max(arms, key=lambda turn: abs(float(np.cross(along, arms[turn])[2])))

    def _tilts(self) -> list[float]:
        """The steepest tilts that can be measured, one to each side if possible, with gentler ones before them."""
        zero, turns = self.machine.tilt.zero_deg, turns_deg(self.machine)
        able = steepest_tilts(
            self.machine, lambda tilt: not any(self._find_in_the_way(self.machine, Pose(tilt, turn)) for turn in turns)
        )
        if not able:
            raise MoveError(
                f"no tilt of {TILTS_DEG[-1]:g} deg or more can be measured on {self.machine.name} with a ball whose centre is "
                f"{self.ball.centre_mm[2]:g} mm high: {self._obstacle(TILTS_DEG[-1])}; a higher post, nearer to the middle, helps"
            )
        shares = (0.5, 1.0) if len(able) == 2 else (1.0 / 3.0, 2.0 / 3.0, 1.0)
        return [zero + share * (tilt - zero) for share in shares for tilt in able]

    def _obstacle(self, tilt_deg: float) -> str:
        """Why the tilt nearest to level cannot be measured."""
        zero, turns = self.machine.tilt.zero_deg, turns_deg(self.machine)
        found = [self._find_in_the_way(self.machine, Pose(zero + s * tilt_deg, turn)) for s in (1.0, -1.0) for turn in turns]
        return next(obstacle for obstacle in found if obstacle)

    def _find_in_the_way(self, machine: Machine, pose: Pose) -> str | None:
        """The obstacle that keeps a machine from measuring the ball at a pose, or None."""
        least, most = machine.tilt.reach_deg
        if not least <= pose.tilt_deg <= most:
            return f"{machine.tilt.letter} goes from {least:g} to {most:g}"
        centre = machine_points(machine, pose, np.array([self.ball.centre_mm]))[0]
        places = centre[:2] + WIDE * self.ball.radius_mm * AROUND
        heights = contact_heights(centre, self.ball.radius_mm, self.probe.flat_mm, places)
        tips = np.column_stack([places, heights]) - self.probe.offset_mm
        above = np.column_stack([tips[:, :2], np.full(len(tips), self._safe_z(machine, pose))])
        return find_in_the_way(machine, pose, self.ball, np.vstack([tips, above]), self.probe.is_nozzle)

    def _check(self, pose: Pose, machines: Sequence[Machine]) -> None:
        """Raise MoveError for a pose at which one of the possible machines would meet something."""
        for machine in machines:
            if obstacle := self._find_in_the_way(machine, pose):
                raise MoveError(f"the ball cannot be measured at {self._name(pose)}: {obstacle}")

    def _touch(self, pose: Pose) -> Touch:
        """Measure the ball's centre at a pose where its place is predicted well enough."""
        self._check(pose, (self.machine,))
        return self._add(pose, self._visit(pose, self._expected(pose), WIDE if len(self.touches) > ROUGHLY else NEAR))

    def _add(self, pose: Pose, centre: Floats) -> Touch:
        x, y, z = centre.tolist()
        self.touches.append(Touch(pose, (x, y, z)))
        self.machine, mark = estimate(self._start, self.touches, self._mark)
        self.ball = replace(self.ball, centre_mm=mark)
        self.tell(f"{len(self.touches)}: {self._name(pose)}, the ball's centre at X{x:.3f} Y{y:.3f} Z{z:.3f}")
        return self.touches[-1]

    def _name(self, pose: Pose) -> str:
        return f"{self.machine.tilt.letter}{pose.tilt_deg:.4g} {self.machine.turn.letter}{pose.turn_deg:.4g}"

    def _expected(self, pose: Pose) -> Floats:
        """(3,) predicted X Y Z of the ball's centre."""
        place: Floats = machine_points(self.machine, pose, np.array([self.ball.centre_mm]))[0]
        return place

    def _visit(self, pose: Pose, expected: Floats, share: float) -> Floats:
        """(3,) measured centre of the ball at a pose, approached above everything that turns."""
        self._rise(pose)
        self.prober.turn(pose)
        self.prober.cross(*(expected[:2] - self.probe.offset_mm[:2]))
        return self._centre(pose, expected, share)

    def _rise(self, pose: Pose) -> None:
        self.prober.rise(self._safe_z(self._start, pose))

    def _safe_z(self, machine: Machine, pose: Pose) -> float:
        """Z of the tip above everything that turns on the way to a pose, whatever the directions of the axes."""
        x, y, z = self.ball.centre_mm
        mark = (float(np.hypot(x, y)) + self.ball.radius_mm, 0.0, z + self.ball.radius_mm)
        tilts = [pose.tilt_deg, *(touch.pose.tilt_deg for touch in self.touches[-1:])]
        tilt_deg = max(abs(value - machine.tilt.zero_deg) for value in tilts)
        return safe_z_mm(machine, mark, tilt_deg) + max(0.0, -self.probe.offset_mm[2])

    def _centre(self, pose: Pose, expected: Floats, share: float) -> Floats:
        """The ball's centre, sought around its expected place, then measured around the result."""
        radius, flat = self.ball.radius_mm, self.probe.flat_mm
        centre, top = expected, expected[2] + radius + FAR_MM - LIFT_MM
        for _ in range(MOST_TIMES):
            exact = share == WIDE
            contacts = []
            places = centre[:2] + share * radius * AROUND
            for place, height in zip(places, contact_heights(centre, radius, flat, places).tolist(), strict=True):
                contacts.append(self._contact(pose, place, height, float(top) + LIFT_MM, exact))
                if exact:  # the ball's top is at most this far above a contact
                    top = max(centre[2] + radius, max(z for _, _, z in contacts) + DROP * radius)
            before, centre = centre, ball_centre(np.array(contacts), radius, flat, seek_flat=exact)
            near = float(np.hypot(*(centre - before)[:2])) <= CENTRED * radius
            if near and exact:
                return centre
            share = WIDE if near else share
        raise PrinterError(f"at {self._name(pose)} the ball's centre is not found: it differs each time")

    def _contact(self, pose: Pose, place: Floats, expected: float, above_mm: float, exact: bool) -> Floats:
        """(3,) contact at a place, expected at a height and approached from another; exact: two contacts must agree."""
        self._above = above_mm
        self.prober.rise(self._tip_z(self._above))
        self.prober.cross(*(place - self.probe.offset_mm[:2]))
        heights: list[float] = []
        while len(heights) < MOST_TIMES:
            heights.append(self._seek(pose, expected))
            self._above = min(max(heights[-1], expected) + LIFT_MM, above_mm)
            self.prober.rise(self._tip_z(self._above))
            if not exact:
                return np.array([*place, heights[-1]])
            for low, high in pairwise(sorted(heights)):
                if high - low <= AGREE_MM:
                    return np.array([*place, 0.5 * (low + high)])
        apart = min(high - low for low, high in pairwise(sorted(heights)))
        raise PrinterError(
            f"at {self._name(pose)} {MOST_TIMES} contacts at one place lie {apart:.3f} mm apart and more, {AGREE_MM:g} mm is "
            "allowed: is the ball firm, the nozzle clean and the probe reliable?"
        )

    def _seek(self, pose: Pose, expected: float) -> float:
        """Height of one contact. Raises PrinterError for one that cannot be the ball."""
        name, low = self._name(pose), self._tip_z(expected - FAR_MM)
        self.contacts += 1
        met = self.prober.seek(low)
        near = f"contact is expected near Z{self._tip_z(expected):.1f}"
        if met is None:
            raise PrinterError(f"at {name} the probe met nothing down to Z{low:.1f}, {near}: does it sense, is the ball there?")
        height = met + self.probe.offset_mm[2]
        if height > self._above - AT_ONCE_MM:
            raise PrinterError(
                f"at {name} the probe triggered at once, at Z{met:.1f}, {near}: is it deployed and its signal right?"
            )
        if abs(height - expected) > FAR_MM:
            raise PrinterError(f"at {name} the probe met something at Z{met:.1f}, {near}: is the ball where it should be?")
        return height

    def _tip_z(self, height: float) -> float:
        return float(height) - self.probe.offset_mm[2]
