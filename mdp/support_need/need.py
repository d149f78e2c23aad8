"""Support need: the faces of a surface that require support along a direction, for the search and for the slicer."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mdp.directions.orientation import azimuth_rad
from mdp.directions.unit_vectors import AXES, framed, spread
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import BASE_TOLERANCE_MM, PLATE_TOLERANCE_MM, UP, Mask, threshold
from mdp.pose import about
from mdp.support_need.over_air import find_over_air
from mdp.support_need.patches import CARRIES_ITSELF, NEEDS_SUPPORT, Classes, Limits, classify
from mdp.topology.edges import LinkedFaces, flat_places, link
from mdp.zone import NOWHERE, UNMARKED, Marked, ZonesOnModel
from profiles.process import Process

MADE_BY_A_CUT = -1  # source of a face created by a cut
NO_SUPPORT_WEIGHT = 100.0  # weight of area that needs support where the user wants none
MOST_CACHED = 256  # single directions whose classes are cached; polishing returns to the same few planes again and again
LEVEL_LAYERS = 2.0  # a patch no higher than this is printed as one bridge
NO_BASE_MM = -np.inf
COARSE = spread(37, 0.0)  # directions over the half sphere, some 24 degrees apart
LEANS = 3  # number of coarse directions nearest to a direction; slanted support can reach the solid below along any of them
FEW = 16  # directions that are cached one by one


def limits_of(process: Process, base_mm: float) -> Limits:
    """Limits of self-supporting overhangs for a process. base_mm: height along the direction up to which a surface rests on
    something.
    """
    return Limits(
        risky_below=threshold(process.self_supporting_angle_deg),
        base_mm=base_mm,
        level_mm=LEVEL_LAYERS * process.layer_height_mm,
        bridge_mm=process.bridge_mm,
        arch_mm=process.arch_longest_mm,
        width_mm=process.line_width_mm,
        least_mm2=process.support_least_mm2,
    )


def needs_support(mesh: Mesh, process: Process, on_plate: bool) -> Mask:
    """(m,) False for faces of a part, in its part frame, that overhang but support themselves."""
    limits = limits_of(process, PLATE_TOLERANCE_MM if on_plate else BASE_TOLERANCE_MM)
    return _needing_upright(link(mesh), limits)


@dataclass(frozen=True, eq=False)
class SupportNeed:
    """The faces of a whole model that need support, for any direction of a search.

    weight: weight of area over air, which only slanted support or support on other parts can reach; enforced: (m,) faces that the
    user wants supported wherever they overhang, even if they support themselves; no_support: zones in which area that needs
    support weighs NO_SUPPORT_WEIGHT, since it would sag.
    """

    surface: LinkedFaces
    process: Process
    weight: float
    axes: Floats
    enforced: Mask
    no_support: Marked = UNMARKED
    _rows: dict[bytes, Classes] = field(default_factory=dict)
    _tables: dict[bytes, Classes] = field(default_factory=dict)

    @classmethod
    def of(cls, mesh: Mesh, process: Process, weight: float, zones: ZonesOnModel = NOWHERE) -> "SupportNeed":
        """The support need of a model that stands on the build plate."""
        axes = about(UP, azimuth_rad(mesh)).T
        return cls(link(mesh), process, weight, axes, zones.support.touched(mesh), zones.no_support)

    def pieces(self, mesh: Mesh, sources: Ints) -> "ModelPieces":
        """The faces of a piece cut from the model, and the source face of each. manifold3d may number a few more faces than the
        model has: they count as created by a cut.
        """
        sources = np.where(sources < len(self.surface.faces), sources, np.int32(MADE_BY_A_CUT))
        if not self.no_support.anywhere:
            return ModelPieces(self, sources)
        barred = self.no_support.among(sources).touched(mesh)
        return ModelPieces(self, sources, np.where(barred, NO_SUPPORT_WEIGHT, 1.0))

    @cached_property
    def upright(self) -> Mask:
        """(m,) False for faces that overhang when printed straight up, but support themselves. Support stands on the plate."""
        limits = limits_of(self.process, PLATE_TOLERANCE_MM)
        return _needing_upright(self.surface, limits, self.axes) | self.enforced

    def along(self, directions: Floats) -> Classes:
        """(k, m) class for each of (k, 3) unit directions: CARRIES_ITSELF, NEEDS_SUPPORT or UNSUPPORTABLE, valid for faces that
        are risky along the direction. A class depends only on face and direction, not on later cuts.
        """
        if len(directions) > FEW:
            return self._looked_up(self._tables, directions)
        rows = [self._looked_up(self._rows, direction[None]) for direction in directions]
        return np.concatenate(rows) if rows else np.zeros((0, len(self.surface.faces)), np.uint8)

    def _looked_up(self, known: dict[bytes, Classes], directions: Floats) -> Classes:
        key = directions.tobytes()
        classes = known.get(key)
        if classes is None:
            classes = self._classes(directions)
            if len(known) >= MOST_CACHED:
                known.clear()
            known[key] = classes
        return classes

    def _classes(self, directions: Floats) -> Classes:
        nearest = np.argsort(-(directions @ (COARSE @ self.axes).T), axis=1, kind="stable")[:, :LEANS].T
        over_air = self._over_air[nearest[0]]
        for lean in nearest[1:]:
            over_air &= self._over_air[lean]
        limits = limits_of(self.process, NO_BASE_MM)
        classes: Classes = NEEDS_SUPPORT + over_air
        in_threads(classify, len(directions), self.surface, framed(directions, self.axes), limits, classes)
        classes[:, self.enforced] = np.maximum(classes[:, self.enforced], np.uint8(NEEDS_SUPPORT))
        return classes

    @cached_property
    def _over_air(self) -> Classes:
        """(37, m) whether each face lies over air along each coarse direction, turned with the model. Flat regions are decided as
        a whole, since one face represents them in pieces cut from the model.
        """
        over_air = np.zeros((len(COARSE), len(self.surface.faces)), np.uint8)
        surface = self.surface, flat_places(self.surface)
        in_threads(find_over_air, len(COARSE), surface, framed(COARSE @ self.axes, self.axes), over_air)
        return over_air


def _needing_upright(surface: LinkedFaces, limits: Limits, axes: Floats = AXES) -> Mask:
    """(m,) False for faces that overhang straight up, but support themselves."""
    classes = np.full((1, len(surface.faces)), NEEDS_SUPPORT, np.uint8)
    in_threads(classify, 1, surface, framed(UP[None], axes), limits, classes)
    needing: Mask = np.not_equal(classes[0], CARRIES_ITSELF)
    return needing


@dataclass(frozen=True, eq=False)
class ModelPieces:
    """A model's support need, and (m,) the source face in the model of each face of a piece cut from it; negative if created by a
    cut. counts: (m,) weight of each face's area that needs support; None: 1.
    """

    need: SupportNeed
    sources: Ints
    counts: Floats | None = None

    @property
    def upright(self) -> Mask:
        """(m,) False for faces that support themselves when printed straight up."""
        return (self.sources < 0) | self.need.upright[self.sources]

    def along(self, direction: Floats) -> Classes:
        """(m,) class of each face along a unit direction."""
        row = self.need.along(direction[None])[0]
        return np.where(self.sources < 0, np.uint8(NEEDS_SUPPORT), row[self.sources])
