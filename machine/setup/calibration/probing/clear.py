"""Clear: what the head would meet while its tip, or a probe beside it, touches a ball on the table at a pose."""

import numpy as np

from machine.kinematics.table import machine_points, workpiece_points
from machine.setup.calibration.probing.ball import Ball
from machine.setup.calibration.program import clipped_head
from mdp.clearance import find_obstacle
from mdp.head import Ring, bodies, directions
from mdp.mesh import Floats
from mdp.pose import UP, Pose, rotation
from profiles.machine import Machine

UNSURE_MM = 2.0  # by which a place may be lower than is expected
BESIDE_MM = 0.3  # between the ball and what of the head is not to touch it


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
