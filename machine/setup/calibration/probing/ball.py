"""Ball: its centre from heights at which a tip that comes from above has met it, by least squares with the known radius;
and what the head would meet while its tip, or a probe beside it, touches the ball.
"""

from dataclasses import dataclass

import numpy as np

from machine.kinematics.table import machine_points, workpiece_points
from machine.setup.calibration.program import clipped_head
from mdp.clearance import find_obstacle
from mdp.head import Ring, bodies, directions
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.errors import PrinterError
from profiles.machine import Machine

ROUNDS = 30
SETTLED_MM = 1e-9
UNSURE_MM = 2.0  # by which a place may be lower than is expected
BESIDE_MM = 0.3  # between the ball and what of the head is not to touch it


@dataclass(frozen=True)
class Ball:
    """A ball on a post: radius, centre in the workpiece frame, radius of the post; mm."""

    radius_mm: float
    centre_mm: tuple[float, float, float]
    post_mm: float = 4.0


def contact_heights(centre_mm: Floats, radius_mm: float, flat_mm: float, places_mm: Floats) -> Floats:
    """(n,) Z at which a flat tip of radius flat_mm, its middle over (n, 2) places, meets the ball; nan where it misses it.

    The edge of the flat that is nearest to the middle touches first: there the ball is as high as at the place less the flat.
    """
    aside = np.maximum(np.hypot(*(places_mm - centre_mm[:2]).T) - flat_mm, 0.0)
    with np.errstate(invalid="ignore"):
        heights: Floats = centre_mm[2] + np.sqrt(radius_mm**2 - aside**2)
    return heights


def ball_centre(contacts_mm: Floats, radius_mm: float, flat_mm: float = 0.0, seek_flat: bool = False) -> Floats:
    """(3,) centre of the ball that (n, 3) contacts from above belong to, n at least 3; flat_mm as in contact_heights.

    seek_flat: the flat's radius is found, too, from flat_mm on; n at least 4, one of them near to the middle. Raises PrinterError
    where the contacts are those of no such ball.
    """
    numbers = np.array([*contacts_mm[:, :2].mean(axis=0), contacts_mm[:, 2].max() - radius_mm, flat_mm])
    count = 4 if seek_flat else 3
    for _ in range(ROUNDS):
        off = contacts_mm[:, 2] - contact_heights(numbers[:3], radius_mm, numbers[3], contacts_mm[:, :2])
        if not np.isfinite(off).all():
            break
        step = np.linalg.lstsq(_slope(numbers, radius_mm, contacts_mm[:, :2])[:, :count], off, rcond=None)[0]
        numbers[:count] += np.clip(step, -0.3 * radius_mm, 0.3 * radius_mm)
        if np.abs(step).max() < SETTLED_MM:
            return numbers[:3]
    raise PrinterError(
        f"the contacts are not those of a ball {2.0 * radius_mm:g} mm in diameter: is it --ball-mm, firm and clean?"
    )


def _slope(numbers: Floats, radius_mm: float, places_mm: Floats) -> Floats:
    """(n, 4) derivatives of the contact heights by x, y, z of the centre and by the flat."""
    away = places_mm - numbers[:2]
    distance = np.hypot(*away.T)
    aside = np.maximum(distance - numbers[3], 0.0)
    steep = aside / np.sqrt(radius_mm**2 - aside**2)
    across = steep[:, None] * away / np.maximum(distance, 1e-12)[:, None]
    slope: Floats = np.column_stack([across, np.ones(len(away)), steep])
    return slope


def find_in_the_way(machine: Machine, pose: Pose, ball: Ball, tips_mm: Floats, touches_by_nozzle: bool) -> str | None:
    """Why the tip cannot be at (n, 3) X Y Z, or between them, with the table at a pose; None: it can.

    touches_by_nozzle: the nozzle's own end is what meets the ball.
    """
    low = tips_mm - [0.0, 0.0, UNSURE_MM]
    clipped = clipped_head(machine, ball.centre_mm)
    obstacle = find_obstacle(clipped, pose, workpiece_points(machine, pose, np.vstack([low, tips_mm])))
    return obstacle or _find_ball(clipped, pose, ball, tips_mm, touches_by_nozzle)


def _find_ball(machine: Machine, pose: Pose, ball: Ball, tips_mm: Floats, touches_by_nozzle: bool) -> str | None:
    """The body of the head that the ball or its post would meet, the tip at each of the places."""
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
