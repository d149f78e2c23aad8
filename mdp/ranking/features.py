"""Features: a ranker's inputs for each candidate, defined once for search and training.

M1..M6 are the metrics of the 2020 paper: M1 reduced risky area, M2 the same accumulated over the cuts so far, M3 volume of the
part, M4 distance of the plane from the build plate, M5 distance to fragile regions (slivers that the plane would leave, thin
walls and rods, on either side of it), M6 accumulated residual risky area. Areas are shares of the model's risky area, volumes of
the model's, distances of the radius of its bounding sphere, clipped to 0..1. If seams and stair-stepping have a cost, M1, M2 and
M6 include it, M6 only the stair-stepping that a cut adds.

The others come from the sweep as well. Three shares of the residual keep the names of older records and rankers: `wasted`
needs support although another cut could have saved it, `hopeless` is unavoidable overhang in the part, and `hopeless_left` in the
remainder, which is part of every later cost. risky_left, the area at risk that remains; seam; tilt and turn, the cosines
between the direction and upright or the previous cut's direction; section and contact, areas as shares of the sphere's great
circle; extent of the part along its direction; volume_left; cuts made before, in tens; round of the classic ranking's relaxation;
risky, the model's risky area in great circles; scale, the radius in decimetres.
"""

from collections.abc import Callable

import numpy as np

from mdp.mesh import Floats, Ints
from mdp.ranking.ranking import CandidateTable

TENS, DECIMETRE_MM = 10.0, 100.0


Column = Callable[[CandidateTable, Ints], Floats]


def _radii(table: CandidateTable, distance_mm: Floats) -> Floats:
    radii: Floats = np.clip(distance_mm / table.model.radius_mm, 0.0, 1.0)
    return radii


FEATURES: dict[str, Column] = {
    "M1": lambda table, rows: table.scored.gain_mm2[rows] / table.model.risky_mm2,
    "M2": lambda table, rows: (table.saved_mm2 + table.scored.gain_mm2[rows]) / table.model.risky_mm2,
    "M3": lambda table, rows: table.volume_mm3[rows] / table.model.volume_mm3,
    "M4": lambda table, rows: _radii(
        table, table.scored.offset_mm[rows] - table.limits.least_offset_mm[table.scored.direction[rows]]
    ),
    "M5": lambda table, rows: _radii(table, np.array([table.fragile_mm(int(row)) for row in rows], dtype=np.float64)),
    "M6": lambda table, rows: (table.lost_mm2 + table.scored.lost_mm2[rows]) / table.model.risky_mm2,
    "wasted": lambda table, rows: (
        (table.scored.lost_mm2 - table.scored.seam_mm2 - table.scored.unavoidable_mm2)[rows] / table.model.risky_mm2
    ),
    "hopeless": lambda table, rows: table.scored.unavoidable_mm2[rows] / table.model.risky_mm2,
    "hopeless_left": lambda table, rows: (
        (table.scored.unavoidable_here_mm2 - table.scored.unavoidable_mm2[rows]) / table.model.risky_mm2
    ),
    "risky_left": lambda table, rows: (table.node.risky_mm2 - table.scored.above_mm2[rows]) / table.model.risky_mm2,
    "seam": lambda table, rows: table.scored.seam_mm2[rows] / table.model.risky_mm2,
    "tilt": lambda table, rows: table.normals(rows)[:, 2],
    "turn": lambda table, rows: table.normals(rows) @ table.node.base.normal,
    "section": lambda table, rows: table.section_mm2[rows] / table.model.circle_mm2,
    "contact": lambda table, rows: table.contact_area_mm2[rows] / table.model.circle_mm2,
    "extent": lambda table, rows: (table.scored.end_mm - table.scored.offset_mm)[rows] / table.model.radius_mm,
    "volume_left": lambda table, rows: (float(table.node.solid.volume()) - table.volume_mm3[rows]) / table.model.volume_mm3,
    "cuts": lambda table, rows: np.full(len(rows), len(table.node.cuts) / TENS),
    "round": lambda table, rows: table.rounds(rows) / TENS,
    "risky": lambda table, rows: np.full(len(rows), table.model.risky_mm2 / table.model.circle_mm2),
    "scale": lambda table, rows: np.full(len(rows), table.model.radius_mm / DECIMETRE_MM),
}
COLUMNS = tuple(FEATURES)
PAPER_COLUMNS = COLUMNS[:6]
CHECKED = frozenset({"M3", "M5", "section", "contact", "volume_left"})  # known only for candidates that have been checked


def features(table: CandidateTable, rows: Ints, columns: tuple[str, ...] = COLUMNS) -> Floats:
    """(n, len(columns)) features of a table's rows; rows must have been checked for columns in CHECKED."""
    return np.stack([FEATURES[name](table, rows) for name in columns], axis=1)
