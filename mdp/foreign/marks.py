"""Marks: the modifiers, support enforcers and support blockers of a slicer file, as modifiers and marks of a plan."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mdp.foreign.printed import solid_of_volume
from mdp.formats.slicer_file import (
    MODIFIER,
    NO_SUPPORT,
    PAINT_NO_SEAM,
    PAINT_NO_SUPPORT,
    PAINT_SUPPORT,
    PART,
    SUPPORT,
    Build,
    BuildObject,
    Role,
)
from mdp.formats.surface import Surface, concatenate
from mdp.head import corners
from mdp.mesh import Floats, Mesh
from mdp.repair.colours import NONE, triangle_of
from mdp.zone import AnyZone, MeshVolume, Modifier, Triangles, Volume, Zone, Zones
from profiles.errors import MeshError, ProfileError, counted
from profiles.frozen import Vector

if TYPE_CHECKING:
    from profiles.foreign.read import SlicerSettings

MARKED = {SUPPORT: "support", NO_SUPPORT: "no_support"}
PAINTED = {PAINT_SUPPORT: "support", PAINT_NO_SUPPORT: "no_support", PAINT_NO_SEAM: "no_seam"}
SAME = 1e-6  # cosine of a right angle, and share of a box's volume that a solid inside may lack
PLURAL = {"is": "are", "changes": "change"}
MOST_NAMED = 8  # settings named in a sentence
THINNEST_MM = 0.001  # least size of a height range: a smaller difference is rounding of its file
BESIDE_MM = 1.0  # margin around an object, more than its outlines can reach beyond its mesh


class Marks:
    """The marks of a slicer file, moved with its model.

    mesh: the solid of what the file prints; moved: scale, turn and shift_mm so that a point p of the file becomes turn @ scale p
    + shift_mm. A volume that is not a solid is left out, with a note.
    """

    def __init__(self, build: Build, path: Path, mesh: Mesh, moved: tuple[float, Floats, Floats]) -> None:
        self._objects, self._several = build.objects, sum(bool(item.surfaces(PART)) for item in build.objects) > 1
        self._corners_mm = mesh.vertices[mesh.faces]
        self._path, (self._scale, self._turn, self._shift_mm), self._on_plate = path, moved, build.on_plate
        self._notes: list[str] = []
        self._subjects: dict[tuple[str, str], list[str]] = {}  # subjects of notes, by predicate

    @cached_property
    def _settings(self) -> "SlicerSettings | None":
        """The settings of the whole print, read once and only for models that need them; None, with a note, if they are
        damaged.
        """
        from profiles.foreign.read import read_slicer_settings

        try:
            return read_slicer_settings(self._path)
        except ProfileError as error:
            said = f"{error}".removeprefix(f"profile {self._path}: ")
            self._notes.append(f"{said}: those of its objects, modifiers and height ranges are left out")
            return None

    def zones(self) -> tuple[Zones, list[str]]:
        """All marks, and a sentence about each."""
        modifiers, kinds = list[Modifier](), {kind: list[AnyZone]() for kind in ("no_seam", "no_support", "support")}
        painted = dict[str, list[Floats]]()
        for item in self._objects:
            modifiers += self._of_object(item) if item.surfaces(PART) else ()
            for surface, role in item.volumes:
                if role.kind == MODIFIER or (role.kind == PART and role.settings):
                    process = self._process(_named(role), role.settings)
                    place = self._place(surface, role, item) if process else None
                    modifiers += [] if place is None else [Modifier(place, process)]
                elif role.kind in MARKED and (place := self._place(surface, role, item)) is not None:
                    kinds[MARKED[role.kind]].append(place)
                    self._tell(_named(role), "is", f"taken as [[{MARKED[role.kind]}]]")
                elif role.kind in PAINTED:
                    painted.setdefault(role.kind, []).append(self._moved(surface.vertices[surface.faces]))
        for kind, corners_mm in painted.items():
            kinds[PAINTED[kind]] += self._painted(kind, np.concatenate(corners_mm))
        notes = [_note_text(subjects, *predicate) for predicate, subjects in self._subjects.items()]
        return Zones(**{kind: tuple(zones) for kind, zones in kinds.items()}, modifiers=tuple(modifiers)), [*notes, *self._notes]

    def _tell(self, subject: str, verb: str, rest: str) -> None:
        self._subjects.setdefault((verb, rest), []).append(subject)

    def _of_object(self, item: BuildObject) -> Iterator[Modifier]:
        """The modifiers for an object's settings and for its height ranges."""
        lowest, highest = _bounds(item)
        low, high = lowest - BESIDE_MM, highest + BESIDE_MM
        if item.settings and (process := self._process(f"object {item.name!r}" if item.name else "the object", item.settings)):
            yield Modifier(self._box(low, high), process)
        base = max(lowest[2], 0.0) if self._on_plate else lowest[2]
        tall_mm = highest[2] - base
        for least, most, settings in item.heights:
            what, first, last = f"the height range {least:g} to {most:g} mm", max(least, 0.0), min(most, tall_mm + BESIDE_MM)
            box = self._box([*low[:2], base + first], [*high[:2], base + last])
            if not (first < min(last, tall_mm) and np.subtract(box.max_mm, box.min_mm).min() >= THINNEST_MM):
                self._notes.append(f"{what} is left out: it holds nothing of its object, which is {tall_mm:.4g} mm tall")
            elif process := self._process(what, settings):
                yield Modifier(box, process)

    def _process(self, what: str, settings: Mapping[str, str]) -> dict[str, Any]:
        """The process keys to which settings convert, with a note about them."""
        if self._settings is None:
            return {}
        from profiles.foreign.read import settings_of_volume

        process, left = settings_of_volume(self._settings, settings)
        taken = ", ".join(f"{key} = {value}" for key, value in process.items())
        values = [f"{name} = {settings[name]}" for name in left[:MOST_NAMED]] + ["..."] * (len(left) > MOST_NAMED)
        rest = f"; not taken: {', '.join(values)}" if left else ""
        self._tell(what, *(("is", f"taken as [[modifier]]: {taken}{rest}") if taken else ("changes", f"nothing here{rest}")))
        return process

    def _painted(self, kind: str, corners_mm: Floats) -> list[Triangles]:
        """The faces of the solid that lie on (k, 3, 3) painted triangles, with a note on how many triangles have such faces."""
        row = triangle_of(corners_mm, self._corners_mm)
        held, lost = len(np.unique(row[row != NONE])), "not on the surface of what is printed"
        rest = len(corners_mm) - held
        if not held:
            self._notes.append(f"{kind} is left out: its {counted(rest, 'triangle')} {'is' if rest == 1 else 'are'} {lost}")
            return []
        others = f"; {counted(rest, 'other')} {'is' if rest == 1 else 'are'} {lost}" if rest else ""
        self._notes.append(f"{kind} on {held} of its triangles is taken as [[{PAINTED[kind]}]]{others}")
        return [Triangles(self._corners_mm[row != NONE])]

    def _place(self, surface: Surface, role: Role, item: BuildObject) -> Volume | None:
        """The region of a volume, clipped to its object's box if there are several objects; None, with a note, if it is not a
        solid.

        Where an object is nothing but marks, as in Cura, they hold for all.
        """
        try:
            solid = solid_of_volume(surface, role)
        except MeshError as error:
            self._notes.append(f"{error}: it is left out")
            return None
        mesh = Mesh(self._moved(solid.vertices), solid.faces.astype(np.int32))
        room = self._box(*_bounds(item)) if self._several and item.surfaces(PART) else None
        box = _box_around(mesh.vertices)
        if box is None or not isclose(float(np.prod(np.subtract(box.max_mm, box.min_mm))), mesh.volume_mm3, rel_tol=SAME):
            return MeshVolume(self._path, mesh, room)
        return _within(box, room)

    @cached_property
    def _axes(self) -> tuple[Vector, Vector, Vector] | None:
        """The file's axes in the model's present placement; None if they are still those of the frame."""
        cube = _box_around(corners((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)) @ self._turn.T)
        assert cube is not None  # a rotation keeps it a cube
        return cube.axes

    def _box(self, low: Sequence[float] | Floats, high: Sequence[float] | Floats) -> Zone:
        """A box of the file, in the model's present placement."""
        points = np.array([[*low], [*high]])
        return _box_along(self._axes, self._moved(corners(*map(tuple, points.tolist()))))

    def _moved(self, places: Floats) -> Floats:
        moved: Floats = (places * self._scale) @ self._turn.T + self._shift_mm  # rounded as the solid is
        return moved


def _note_text(subjects: Sequence[str], verb: str, rest: str) -> str:
    """A sentence about one subject, or about the first and the number of the others."""
    if len(subjects) == 1:
        return f"{subjects[0]} {verb} {rest}"
    return f"{subjects[0]} and {len(subjects) - 1} more {PLURAL[verb]} {rest}"


def _named(role: Role) -> str:
    return f"{role.kind} {role.name!r}" if role.name else f"a {role.kind}"


def _bounds(item: BuildObject) -> Floats:
    """(2, 3) least and greatest coordinates of an object's printed volumes."""
    surface = concatenate(item.surfaces(PART))
    used = surface.vertices[surface.faces.ravel()]
    return np.stack([used.min(axis=0), used.max(axis=0)])


def _within(box: Zone, room: Zone | None) -> Zone:
    """The part of a box within its room; a plain box if both are aligned with the frame."""
    if room is None or box.axes is not None or room.axes is not None:
        return replace(box, room=room)
    low, high = np.maximum(box.min_mm, room.min_mm), np.minimum(box.max_mm, room.max_mm)
    if not (low < high).all():
        return replace(box, room=room)
    (x0, y0, z0), (x1, y1, z1) = low.tolist(), high.tolist()
    return Zone((x0, y0, z0), (x1, y1, z1))


def _box_around(points: Floats) -> Zone | None:
    """The box that may have these (8, 3) points as corners: its edges run along the shortest three lines from the first point
    that are at right angles. None if there are no such lines or not eight points. Only the volume between the points shows
    whether it is a box.
    """
    if len(points) != 8:
        return None
    sides = points[1:] - points[0]
    sides = sides[np.argsort(np.linalg.norm(sides, axis=1), kind="stable")]
    lengths = np.linalg.norm(sides, axis=1)
    if lengths[0] == 0.0:
        return None
    directions, edges = sides / lengths[:, None], [0]
    for k in range(1, 7):  # the shortest is an edge, and so is the next one square to the edges before it
        if len(edges) < 3 and np.abs(directions[edges] @ directions[k]).max() < SAME:
            edges.append(k)
    if len(edges) < 3:
        return None
    axes = directions[edges]
    axes = axes[np.argsort([int(np.argmax(np.abs(axis))) for axis in axes], kind="stable")]
    axes *= np.sign(axes[np.arange(3), np.argmax(np.abs(axes), axis=1)])[:, None]
    axes[2] *= np.sign(np.linalg.det(axes))
    rows = [(x, y, z) for x, y, z in axes.tolist()]
    level = np.allclose(axes, np.eye(3), rtol=0.0, atol=SAME)
    return _box_along(None if level else (rows[0], rows[1], rows[2]), points)


def _box_along(axes: tuple[Vector, Vector, Vector] | None, points: Floats) -> Zone:
    """The smallest box with these axes around some points; None: axes of the frame."""
    places = points if axes is None else points @ np.array(axes).T
    (x0, y0, z0), (x1, y1, z1) = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    return Zone((x0, y0, z0), (x1, y1, z1), axes)
