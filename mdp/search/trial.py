"""Trial: a person's planes tried one after the other, quickly enough to be moved by hand: figures of every cut, or why not.

What planes have in common with those tried before is not cut again: of a plane that is dragged only it and the parts printed
before it are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, degrees

import numpy as np

from mdp.mesh import Mesh, dot
from mdp.plane import Plane
from mdp.search.by_hand import Refusal, cut_or_refuse
from mdp.search.front import front_row
from mdp.search.neck import find_neck
from mdp.search.node import Node
from mdp.search.obstacle import Obstacle, find_refused
from mdp.search.problem import Problem

Key = tuple[float, float, float, float]


@dataclass(frozen=True)
class TriedPart:
    """A part cut off: its volume, the length of its rim where it is seen, the smallest angle of an edge that the cut makes
    (of the part or of what it is cut off), and what its cut leaves to support for ever and scars, mm2."""

    volume_mm3: float
    rim_mm: float
    edge_deg: float
    cost_mm2: float


@dataclass(frozen=True)
class Trial:
    """parts: those that could be cut off, from the second in print order on, None for the others. refused: why the part of this
    number cannot be, "" where all can, and obstacle: where; support_area_mm2, seam_mm: of all parts, where all can."""

    parts: tuple[TriedPart | None, ...]
    refused_part: int = 0
    refused: str = ""
    support_area_mm2: float | None = None
    seam_mm: float | None = None
    obstacle: Obstacle | None = None


class Trials:
    """The trials of one problem."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._cut: list[tuple[Key, Node]] = []  # of the last trial, in the order of its cuts

    def attempt(self, planes: Sequence[Plane]) -> Trial:
        """Cut by the base planes of the parts from the second on, in print order."""
        keys = [_key(plane) for plane in reversed(planes)]
        alike = 0
        while alike < min(len(keys), len(self._cut)) and self._cut[alike][0] == keys[alike]:
            alike += 1
        del self._cut[alike:]
        for done in range(alike, len(keys)):
            node = self._cut[-1][1] if self._cut else self._problem.root
            plane = planes[len(planes) - 1 - done]
            following = cut_or_refuse(self._problem, node, plane)
            if isinstance(following, Refusal):
                obstacle = find_refused(self._problem, node, plane, following)
                return Trial(self._parts(len(planes)), len(planes) + 1 - done, following.text, obstacle=obstacle)
            self._cut.append((keys[done], following))
        last = self._cut[-1][1] if self._cut else self._problem.root
        row = front_row(last, self._problem.terms)
        return Trial(self._parts(len(planes)), 0, "", row.support_area_mm2, row.seam_mm)

    def neck(self, planes: Sequence[Plane], number: int, reach_mm: float) -> Plane | None:
        """The neck near the plane of the part of a number, of what the parts printed after it leave; None: there is none, or
        those cannot be cut off. planes as in attempt."""
        later = planes[number - 1 :]
        if self.attempt(later).refused:
            return None
        node = self._cut[-1][1] if self._cut else self._problem.root
        return find_neck(node.remainder.mesh, node.seam_weights, planes[number - 2], reach_mm)

    def _parts(self, count: int) -> tuple[TriedPart | None, ...]:
        tried = [_measure(node) for _, node in self._cut]
        return (*[None] * (count - len(tried)), *reversed(tried))


def _measure(node: Node) -> TriedPart:
    before = node.parent
    assert before is not None
    plane = node.cuts[-1].base
    volume_mm3 = float(before.solid.volume() - node.solid.volume())
    edge_deg = smallest_edge_deg(before.remainder.mesh, plane)
    return TriedPart(volume_mm3, node.seams[-1].length_mm, edge_deg, node.cuts[-1].residual_mm2)


def smallest_edge_deg(mesh: Mesh, plane: Plane) -> float:
    """The smallest angle between a plane and the faces that it passes through, on either side of it; 90 where it meets none."""
    heights = plane.heights_mm(mesh.vertices)[mesh.faces]
    crossed = (heights.min(axis=1) < 0.0) & (heights.max(axis=1) > 0.0)
    cosines = np.abs(dot(mesh.normals[crossed], plane.normal))
    return degrees(acos(min(float(cosines.max(initial=0.0)), 1.0)))


def _key(plane: Plane) -> Key:
    x, y, z = (float(value) for value in plane.normal)
    return x, y, z, plane.offset_mm
