"""A simulated hand that moves the tip of a machine onto a mark by keys."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from machine.cli.commands.measuring import calibrate_by_keys
from machine.cli.commands.measuring.calibrate_by_keys import ENTER
from machine.kinematics.table import machine_points
from machine.printing.command_session import CommandSession
from machine.setup.calibration.program import STEPS_MM, WAYS
from mdp.pose import Pose
from profiles.machine import Machine

MOST_KEYS = 3000


class Mover:
    """Goes wherever it is sent, and records its moves."""

    def __init__(self) -> None:
        self.at_mm, self.pose, self.turned_at_mm = [0.0, 0.0, 150.0], Pose(0.0, 0.0), list[float]()

    def rise(self, z_mm: float) -> None:
        self.at_mm[2] = z_mm

    def cross(self, x_mm: float, y_mm: float) -> None:
        self.at_mm[:2] = x_mm, y_mm

    def turn(self, pose: Pose) -> None:
        self.pose = pose
        self.turned_at_mm.append(self.at_mm[2])

    def arrive(self) -> None:
        """Every move has already ended."""


def steady_hand(mover: Mover, real: Machine, mark_mm: tuple[float, float, float]) -> Iterator[str]:
    """Keys that move the tip onto the mark of a real machine, as near as the smallest step allows, again and again."""
    for _ in range(MOST_KEYS):
        away = machine_points(real, mover.pose, np.array([mark_mm]))[0] - np.array(mover.at_mm)
        axis = int(np.abs(away).argmax())
        if abs(away[axis]) <= 0.5 * STEPS_MM["4"]:
            yield "\n"
            continue
        yield next((key for key, step in STEPS_MM.items() if step <= abs(away[axis])), "4")
        yield next(key for key, way in WAYS.items() if way == (axis, int(np.sign(away[axis]))))
    raise AssertionError(f"{away} mm from the mark at {mover.pose}, and no step leads nearer")


def put_hand_on(monkeypatch: pytest.MonkeyPatch, real: Machine, mark_mm: tuple[float, float, float]) -> None:
    """Let `tiltprint calibrate --port` take its keys from a hand that touches the mark of a real machine."""
    mover = Mover()

    class Followed(calibrate_by_keys.PrinterMover):
        """A mover at a real port that also reports its position to the simulated hand."""

        def rise(self, z_mm: float) -> None:
            super().rise(z_mm)
            mover.rise(z_mm)

        def cross(self, x_mm: float, y_mm: float) -> None:
            super().cross(x_mm, y_mm)
            mover.cross(x_mm, y_mm)

        def turn(self, pose: Pose) -> None:
            super().turn(pose)
            mover.turn(pose)

    @contextmanager
    def keys(session: CommandSession) -> Iterator[Iterator[str]]:
        hand = steady_hand(mover, real, mark_mm)
        yield iter(lambda: ENTER[0] if mover.turned_at_mm == [] else next(hand), None)  # type: ignore[arg-type]

    monkeypatch.setattr(calibrate_by_keys, "PrinterMover", Followed)
    monkeypatch.setattr(calibrate_by_keys, "keys_of_a_person", keys)
    monkeypatch.setattr(calibrate_by_keys, "can_type", lambda: True)
