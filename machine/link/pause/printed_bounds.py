"""Printed bounds: boxes around what was printed at each pose, for moves over a print on the table."""

from dataclasses import dataclass, field
from itertools import product

import numpy as np

from machine.gcode.arcs import arc_box, arc_centre
from machine.gcode.modes import Coordinates, ModalState
from machine.gcode.words import read_words, split_command
from machine.kinematics.collision import Printed
from machine.kinematics.table import origin_mm, workpiece_points
from mdp.pose import Pose
from profiles.machine import Machine

BEAD_MM = 1.0  # more than half a bead's width


@dataclass
class PrintedBounds:
    """A box of axis positions X Y Z for each pose, updated at almost no cost while a program is sent."""

    machine: Machine
    _boxes: dict[tuple[float, float], list[float]] = field(default_factory=dict)
    _reached: Coordinates = ()  # end of the newest stroke, already in its box

    def track(self, modal: ModalState, command: str) -> tuple[bool, bool]:
        """Pass a command to `modal` and update the boxes; returns whether it moves an axis, and whether it extrudes."""
        before, pulled = modal.coordinates(), modal.pulled_mm
        if not modal.take(command):
            return False, False
        extrudes = modal.pushed_mm > 0.0 and not pulled
        if extrudes:
            after = modal.coordinates()
            if before != self._reached:
                self.extrude_to(before)
            for corner in _far_corners(modal, command, before, after):
                self.extrude_to(corner)
            self.extrude_to(after)
            self._reached = after
        return True, extrudes

    def extrude_to(self, coordinates: Coordinates) -> None:
        """Add the end of a stroke, X Y Z tilt turn."""
        x, y, z, tilt, turn = coordinates[:5]
        if x is None or y is None or z is None:
            return
        tilt = self.machine.tilt.zero_deg if tilt is None else tilt
        turn = self.machine.turn.zero_deg if turn is None else turn
        box = self._boxes.get((tilt, turn))
        if box is None:
            self._boxes[tilt, turn] = [x, y, z, x, y, z]
            return
        least_x, least_y, least_z, most_x, most_y, most_z = box
        if not (least_x <= x <= most_x and least_y <= y <= most_y and least_z <= z <= most_z):
            box[:3] = min(x, least_x), min(y, least_y), min(z, least_z)
            box[3:] = max(x, most_x), max(y, most_y), max(z, most_z)

    def corners(self, followed_table: bool = False) -> Printed:
        """Corners of all boxes in the workpiece frame; followed_table: the positions were already relative to the table."""
        corners = [np.zeros((0, 3))]
        for (tilt, turn), box in self._boxes.items():
            places = np.array(list(product(*zip(box[:3], box[3:], strict=True))))
            if followed_table:
                corners.append(places - origin_mm(self.machine))
            else:
                corners.append(workpiece_points(self.machine, Pose(tilt, turn), places))
        return Printed(np.vstack(corners), BEAD_MM)


def _far_corners(modal: ModalState, command: str, before: Coordinates, after: Coordinates) -> list[Coordinates]:
    """Corners of the box around an arc just taken, at the pose and height of its end; none for other moves."""
    if command[:3] == "G1 ":  # nearly every stroke
        return []
    name, rest = split_command(command.upper())
    words = modal.axes.words
    if name not in ("G2", "G3") or before[0] is None or before[1] is None or after[0] is None or after[1] is None:
        return []
    shape = {letter: value * modal.modes.unit_mm for letter, value in read_words(rest) if letter in "IJR" and letter not in words}
    start, end = (before[0], before[1]), (after[0], after[1])
    centre = arc_centre(start, end, shape, name == "G2")
    if centre is None:
        return []
    return [(*corner, *after[2:]) for corner in arc_box(start, end, centre, name == "G2")]
